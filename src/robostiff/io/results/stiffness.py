"""Stiffness and deflection, also of cable robots, as text, as data for JSON, and for MATLAB."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis import Stiffness
from robostiff.analysis.free_motion import FreeMotion
from robostiff.analysis.result_tables import shown_loads, shown_twist
from robostiff.elastostatics import Status
from robostiff.elastostatics.tolerance import scaling
from robostiff.errors import InputError
from robostiff.io.whole_file import whole_file
from robostiff.markup import (
    COMPLIANCE_UNITS,
    STIFFNESS_UNITS,
    number,
    row,
    shown_matrix,
    text_of,
)
from robostiff.spatial import Space
from robostiff.version import __version__

if TYPE_CHECKING:
    from robostiff.analysis import CableResponse, CableStiffness, Deflection, PartShare


def stiffness_data(result: Stiffness) -> dict[str, Any]:
    """The result of `stiffness` at a single pose, as plain data.

    Parameters
    ----------
    result : Stiffness
        Of a single pose.

    Returns
    -------
    dict
        JSON-ready. ``stiffness`` and ``compliance`` are null where there is none; ``status`` joins
        what happened with ``+``, and is ``ok`` for a plain answer.
    """
    reached = Status.UNREACHABLE not in result.status
    compliance = result.compliance
    answered = bool(np.all(result.answered))
    return {
        **head(result.name, result),
        **_posture(result),
        "units": {
            "length": "m",
            "angle": "rad",
            "stiffness": asdict(STIFFNESS_UNITS),
            "compliance": asdict(COMPLIANCE_UNITS),
        },
        "stiffness": result.K.tolist() if answered else None,
        "compliance": plain(compliance),
        "rank": int(result.rank) if reached else None,
        "free_motions": plain(tuple(result.free_motions)),
        "rigid_directions": result.rigid_directions.tolist() if reached else [],
        "redundant_joints": list(result.redundant_joints) if reached else [],
        "method": result.method.name,
        "equation": result.method.equation,
        "decided_by": str(result.decision) if reached else None,
    }


def deflection_data(result: Deflection) -> dict[str, Any]:
    """The result of `deflection`, as plain data.

    Returns
    -------
    dict
        JSON-ready; ``deflection`` is null where there is none.
    """
    answer = result.stiffness
    reached = Status.UNREACHABLE not in answer.status
    return {
        **head(answer.name, result),
        **_posture(answer),
        "units": {"length": "m", "angle": "rad", "force": "N", "moment": "N m", "energy": "J"},
        "wrench": result.wrench.tolist(),
        "deflection": result.twist.tolist() if result.has_answer else None,
        "energy": result.energy if result.has_answer else None,
        "parts": picked(result.parts, "leg part energy share"),
        "actuators": picked(result.actuators, "leg joint load travel unit"),
        "reactions": picked(result.reactions, "leg joint wrench point"),
        "free_motions": [str(motion) for motion in answer.free_motions] if reached else [],
    }


def _posture(answer: Stiffness) -> dict[str, Any]:
    """Where a robot is, and the order of what follows."""
    return {
        "pose": plain(answer.pose),
        "joint_coordinates": {leg: q.tolist() for leg, q in answer.joint_coordinates.items()},
        "joint_names": {leg: list(names) for leg, names in answer.details().joint_names.items()},
        "reference_point": answer.reference_point.tolist(),
        "order": order(answer.space),
    }


def head(name: str, result: Any) -> dict[str, Any]:
    """How a result begins: the version, the robot, what happened, and advice."""
    status, advice = str(result.status), list(result.advice)
    return {"robostiff": __version__, "robot": name, "status": status, "advice": advice}


def picked(parts: Iterable[Any], names: str) -> list[dict[str, Any]]:
    """Attributes of some parts, by their names with blanks between them."""
    return [{name: plain(getattr(own, name)) for name in names.split()} for own in parts]


def plain(value: Any) -> Any:
    """A result or a part of it as data for JSON: arrays and tuples as lists, statuses in words."""
    if isinstance(value, FreeMotion):
        return {"description": str(value), "twist": value.twist.tolist()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Status):
        return str(value)
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if is_dataclass(value):
        data = {field.name: plain(getattr(value, field.name)) for field in fields(value)}
        for fact in ("about", "unit", "units"):  # class attributes
            if hasattr(type(value), fact):
                data[fact] = plain(getattr(value, fact))
        return data
    return value


def order(space: Space) -> dict[str, list[str]]:
    """Names of the coordinates of twists and wrenches, in order."""
    return {"twist": list(space.twist_order), "wrench": list(space.wrench_order)}


_LONGEST = 63  # letters of a name of MATLAB
_LEFT_OUT = ("equation", "decided_by")


def write_matlab(path: Path, result: Stiffness) -> None:
    """Write the stiffness of a robot at a single pose as a .mat file.

    Its variables are those of ``robostiff stiffness --json`` (`stiffness`, `compliance`, `pose`,
    `rank`, ...), and ``transform``, the platform as a 4 x 4 matrix. Twists have translations first.
    What there is none of is an empty array; names of legs become names of MATLAB.

    Parameters
    ----------
    path : Path
        Replaced if it is there.
    result : Stiffness

    Raises
    ------
    InputError
        When the name does not end in .mat.
    """
    from scipy.io import savemat

    if path.suffix.lower() != ".mat":
        raise InputError("file for MATLAB", got=str(path), expected="a name that ends in .mat")
    data = {key: value for key, value in stiffness_data(result).items() if key not in _LEFT_OUT}
    transform = result.transform
    if transform is not None:
        data["transform"] = transform.as_matrix()
    with whole_file(path) as begun:
        savemat(begun, _for_matlab(data), long_field_names=True, oned_as="row")


def _for_matlab(value: Any) -> Any:
    if value is None:
        return np.zeros((0, 0))
    if isinstance(value, dict):
        names: dict[str, Any] = {}
        for key, own in value.items():
            names[_name(key, names)] = _for_matlab(own)
        return names
    if isinstance(value, list) and any(isinstance(own, str | dict) for own in value):
        cells = np.empty(len(value), dtype=object)
        cells[:] = [_for_matlab(own) for own in value]
        return cells
    return value if isinstance(value, str) else np.asarray(value, dtype=float)


def _name(key: str, taken: dict[str, Any]) -> str:
    """A name of MATLAB: letters, digits and underscores, and none twice."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", key)
    plain = (plain if plain[:1].isalpha() else f"x{plain}")[:_LONGEST]
    name, number = plain, 2
    while name in taken:
        name = f"{plain[: _LONGEST - 4]}_{number}"
        number += 1
    return name


_NAMED = 5e-5  # of the energy: a smaller part would read 0.00 %


def stiffness_text(result: Stiffness) -> str:
    """The result of `stiffness` at a single pose, as lines of text.

    Parameters
    ----------
    result : Stiffness
        Of a single pose.
    """
    lines = [f"{result.name}, {about(result)}", *posture_lines(result), f"status: {result.status}"]
    if np.all(result.answered):
        lines += ["", f"K_C [{STIFFNESS_UNITS}]:"]
        lines += matrix_lines(result.K, result.space.wrench_order, result.space.twist_order)
    if Status.UNREACHABLE not in result.status:
        lines += ["", f"rank {int(result.rank)} of {result.space.size}"]
        lines += [f"free: {motion}" for motion in result.free_motions]
        lines += [f"redundant passive joint: {name}" for name in result.redundant_joints]
        lines += [f"rigid direction: {_unit_load(w, result)}" for w in result.rigid_directions]
        lines.append(f"decided by: {result.decision}")
    lines.append(f"method: {result.method.name}, {result.method.equation}")
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def _unit_load(wrench: np.ndarray, result: Stiffness) -> str:
    """A wrench (n,) with a unit force, or a unit moment where it has no force."""
    force, moment = np.split(wrench, [result.space.translations])
    size = np.linalg.norm(force)
    pulls = size * float(result.length) > 1e-9 * np.linalg.norm(moment)
    unit = wrench / (size if pulls else np.linalg.norm(moment))
    unit = unit * np.sign(unit[np.argmax(np.abs(unit))])
    return named(result.space.wrench_order, np.round(unit, 9) + 0.0, "N", "N m")


def deflection_text(result: Deflection, most: int = 10) -> str:
    """The result of `deflection`, as lines of text.

    Parameters
    ----------
    result : Deflection
    most : int
        How many parts to list, those with the largest energy first.
    """
    answer = result.stiffness
    lines = [f"{answer.name}, {about(answer)}", *posture_lines(answer), f"status: {result.status}"]
    load = named(answer.space.wrench_order, result.wrench, "N", "N m")
    if result.work_of_loads is not None:
        load = f"{'' if load == 'none' else f'{load}; '}forces or weights at bodies"
    lines.append(f"load:       {load}")
    if result.has_answer:
        shown = 1e6 * shown_twist(result)
        lines.append(f"deflection: {named(answer.space.twist_order, shown, 'um', 'urad')}")
        lines += [f"free:       {motion}" for motion in answer.free_motions]
        if result.energy > 0:
            lines += share_lines(result.energy, result.parts, most)
        if result.actuators:
            lines += ["", "load on the actuators:"]
            loads = zip(shown_loads(result), result.actuators, strict=True)
            lines += [load_line(load, a.unit, a.name) for load, a in loads]
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def about(result: Stiffness) -> str:
    """Pose, reference point and axes as text."""
    point = f"about ({row(result.reference_point)}) m, world axes"
    if result.pose is None:
        return f"snapshot {point}"
    return f"pose [{row(result.pose)}] (m, rad) {point}"


def posture_lines(result: Stiffness) -> list[str]:
    """Joint coordinates of a robot with one leg, which a pose may not determine.

    With passive joints those of the drives, by name.
    """
    if len(result.joint_coordinates) != 1 or Status.UNREACHABLE in result.status:
        return []
    ((leg, q),) = result.joint_coordinates.items()
    names = result.details().joint_names.get(leg, [leg] * len(q))
    drives = [
        f"{name}={value:.5g}"
        for name, value in zip(names, q, strict=True)
        if f"{leg}/{name}" not in result.details().passive_joint_names
    ]
    if len(drives) == len(q):
        return [f"joints [{row(q)}] (m, rad)"]
    return [f"drives at {', '.join(drives)} (m, rad)"] if drives else []


def share_lines(energy: float, parts: Sequence[PartShare], most: int) -> list[str]:
    """The elastic energy, and how much of it each part has."""
    named_ones = [part for part in parts[:most] if part.share >= _NAMED]
    if len(named_ones) == len(parts) - 1:  # a single one has a name rather than a count
        named_ones = list(parts)
    rest = parts[len(named_ones) :]
    lines = ["", f"elastic energy {energy:.4g} J, by part:"]
    lines += [f"{100 * p.share:7.2f} %  {p.name}" for p in named_ones]
    if rest:
        share = 100 * sum(p.share for p in rest)
        lines.append(f"{share:7.2f} %  {len(rest)} more parts")
    return lines


def load_line(load: float, unit: str, name: str) -> str:
    """A load with its unit and the drive that it is on."""
    return f"{load:12.5g} {unit:<4} {name}"


def matrix_lines(K: np.ndarray, rows: Sequence[str], columns: Sequence[str]) -> list[str]:
    """A labelled matrix, one line a row."""
    lines = ["    " + "".join(f"{name:>12}" for name in columns)]
    for name, values in zip(rows, shown_matrix(K), strict=True):
        lines.append(f"{name:>4}" + "".join(f"{number(value):>12}" for value in values))
    return lines


def named(names: Sequence[str], values: np.ndarray, unit: str, angular: str) -> str:
    """Values with their names and units, zeros left out."""
    parts = [
        f"{name} {value:.5g} {angular if name[0] in 'Mr' else unit}"
        for name, value in zip(names, values, strict=True)
        if value != 0
    ]
    return ", ".join(parts) or "none"


def cable_stiffness_data(result: CableStiffness) -> dict[str, Any]:
    """The result of `cable_stiffness` at a single pose, JSON-ready; what there is not is null."""
    answered = bool(np.all(result.answered))
    return {
        **head(result.name, result),
        "pose": result.pose.tolist(),
        "reference_point": result.reference_point.tolist(),
        "order": order(result.space),
        "units": {
            "length": "m",
            "angle": "rad",
            "tension": "N",
            "stiffness": asdict(STIFFNESS_UNITS),
        },
        "wrench": result.wrench.tolist(),
        "cables": [
            {
                "name": name,
                "length": float(result.placed.lengths[i]),
                "tension": float(result.tensions[i]) if answered else None,
                "stiffness": float(result.axial[i]) if answered else None,
            }
            for i, name in enumerate(result.cable_names)
        ],
        "tensions_by": result.rule,
        "stiffness": result.K.tolist() if answered else None,
        **{
            name: getattr(result, name).tolist() if answered else None
            for name in ("elastic", "geometric", "of_forces")
        },
        "rank": int(result.rank) if answered else None,
        "rank_of_structure_matrix": int(result.held_rank) if answered else None,
        "free_motions": [str(motion) for motion in result.free_motions],
        "unstable_motions": [str(motion) for motion in result.unstable_motions],
        "missing_wrench": result.missing_wrench.tolist() if answered else None,
    }


def cable_response_data(result: CableResponse) -> dict[str, Any]:
    """The result of `cable_response`, as plain data."""
    event = result.first_slack
    moved = result.displacement
    return {
        **head(result.before.name, result),
        "order": order(result.before.space),
        "units": {"length": "m", "angle": "rad", "force": "N", "moment": "N m"},
        "load": result.load.tolist(),
        "carried": result.carried,
        "displacement": plain(moved),
        "slack": list(result.slack) if result.has_answer else None,
        "first_slack": None if event is None else {"cable": event.cable, "factor": event.factor},
        "before": cable_stiffness_data(result.before),
        "after": None if result.after is None else cable_stiffness_data(result.after),
    }


def cable_stiffness_text(result: CableStiffness) -> str:
    """The result of `cable_stiffness` at a single pose, as lines of text."""
    lines = [*_head(result, str(result.status)), *_tension_lines(result)]
    if np.all(result.answered):
        lines += ["", f"K [{STIFFNESS_UNITS}]:"]
        lines += matrix_lines(result.K, result.space.wrench_order, result.space.twist_order)
        lines += ["", *_rank_and_motions(result)]
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def cable_response_text(result: CableResponse) -> str:
    """The result of `cable_response`, as lines of text."""
    before = result.before
    space = before.space
    lines = _head(before, str(result.status))
    lines.append(f"load:       {named(space.wrench_order, result.load, 'N', 'N m')}")
    if result.after is not None and result.displacement is not None:
        lengths = result.displacement * scaling(before.placed.characteristic_length, before.space)
        kept = np.abs(lengths) > 1e-9 * np.abs(lengths).max()  # less is rounding
        shown = 1e6 * np.where(kept, result.displacement, 0.0)
        lines.append(f"moved by:   {named(space.twist_order, shown, 'um', 'urad')}")
        lines += _tension_lines(before, result.after)
        lines += ["", f"slack: {', '.join(result.slack) or 'none'}"]
    elif np.all(before.answered):
        lines += _tension_lines(before)
        lines += ["", f"carried: {number(result.carried)} of the load"]
    if result.first_slack is not None:
        event = result.first_slack
        lines.append(f"first slack: {event.cable}, at {number(event.factor)} times the load")
    if result.after is not None:
        lines += ["", f"K under the load, of the taut cables [{STIFFNESS_UNITS}]:"]
        lines += matrix_lines(result.after.K, space.wrench_order, space.twist_order)
        lines += ["", *_rank_and_motions(result.after)]
    lines += [f"advice: {advice}" for advice in result.advice]
    return text_of(lines)


def _head(result: CableStiffness, status: str) -> list[str]:
    where = f"about ({row(result.reference_point)}) m, world axes"
    lines = [f"{result.name}, pose [{row(result.pose)}] (m, rad) {where}", f"status: {status}"]
    if np.any(result.wrench):
        lines.append(f"balanced:   {named(result.space.wrench_order, result.wrench, 'N', 'N m')}")
    return lines


def _tension_lines(before: CableStiffness, after: CableStiffness | None = None) -> list[str]:
    if not np.all(before.answered):
        return []
    columns = ["length [m]", "stiffness [N/m]", "tension [N]"]
    values = [before.placed.lengths, before.axial, before.tensions]
    if after is not None:
        columns.append("under load [N]")
        values.append(after.tensions)
    width = max(5, *(len(name) for name in before.cable_names))
    lines = ["", f"{'cable':<{width}}" + "".join(f"{column:>17}" for column in columns)]
    for i, name in enumerate(before.cable_names):
        cells = "".join(f"{number(float(column[i])):>17}" for column in values)
        lines.append(f"{name:<{width}}{cells}")
    lines.append(f"tensions: {before.rule}")
    return lines


def _rank_and_motions(result: CableStiffness) -> list[str]:
    rank = f"rank {int(result.rank)} of {result.space.size}"
    return [
        f"{rank}, {int(result.held_rank)} by stretching of cables",
        *(f"free: {motion}" for motion in result.free_motions),
        *(f"unstable: {motion}" for motion in result.unstable_motions),
    ]

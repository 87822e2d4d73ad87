"""Robots as the data of a model file, so that what fails can be saved, shrunk and read again."""

from __future__ import annotations

from typing import Any

import numpy as np

import robostiff as rs
from robostiff.elasticity import EulerBernoulli
from robostiff.model import Joint, JointKind, ParallelBlock, Role
from robostiff.spatial import Frame, Space


def model_data(robot: rs.Robot) -> dict[str, Any]:
    """What `robostiff.load` reads back as the same robot, written as JSON or YAML."""
    data: dict[str, Any] = {"robostiff": 1, "name": robot.name, "source": "random"}
    if robot.space is Space.PLANAR:
        data["planar"] = True
    if robot.home is not None:
        data["home"] = frame_data(robot.home)
        data["coordinates"] = [c.value for c in robot.coordinates]
    if np.any(robot.reference_point):
        data["reference_point"] = robot.reference_point.tolist()
    data["legs"] = [leg_data(leg) for leg in robot.legs]
    return data


def frame_data(frame: Frame) -> dict[str, Any]:
    """Origin and axes, those that say something."""
    data: dict[str, Any] = {}
    if np.any(frame.p):
        data["at"] = np.asarray(frame.p, dtype=float).tolist()
    if not np.array_equal(frame.R, np.eye(3)):
        data["matrix"] = np.asarray(frame.R, dtype=float).tolist()
    return data


def leg_data(leg: rs.Leg) -> dict[str, Any]:
    """A leg."""
    data: dict[str, Any] = {"name": leg.name, "chain": chain_data(leg.chain)}
    for key, frame in (("base", leg.base), ("platform", leg.attachment)):
        if written := frame_data(frame):
            data[key] = written
    if leg.elbow is not rs.Elbow.HOME:
        data["elbow"] = leg.elbow.value
    return data


def chain_data(chain: rs.Chain) -> list[dict[str, Any]]:
    """The elements of a chain, each with a name of its own."""
    return [
        {**_element(element), "name": f"{_word(element)} {i + 1}"}
        for i, element in enumerate(chain.elements)
    ]


def _word(element: Any) -> str:
    if isinstance(element, Joint):
        return element.kind.value
    return {rs.Telescope: "telescope", rs.Link: "link", rs.Rigid: "part", ParallelBlock: "block"}[
        type(element)
    ]


def _element(element: Any) -> dict[str, Any]:
    match element:
        case Joint():
            return _joint(element)
        case rs.Telescope():
            return {
                "type": "telescope",
                "direction": _list(element.direction),
                "y_axis": _list(element.axes[:, 1]),
                "home": float(element.home),
                "beams": [_beam(beam) for beam in element.beams],
                **_role(element.role),
            }
        case rs.Rigid():
            written = frame_data(element.transform)
            return {"type": "rigid", "to": written.pop("at", [0, 0, 0]), **written}
        case rs.Link():
            data: dict[str, Any] = {"type": "link", "to": _list(element.to)}
            if not np.any(element.to):
                data = {"type": "spring"}
            if not np.array_equal(element.axes, np.eye(3)):
                data["matrix"] = element.axes.tolist()
            return {**data, "compliance": element.elasticity.compliance.tolist()}
        case ParallelBlock():
            branches = [
                {
                    "name": branch.name,
                    "start": frame_data(branch.start),
                    "chain": chain_data(branch.chain),
                    "end": frame_data(branch.end),
                }
                for branch in element.branches
            ]
            return {"type": "parallel", "branches": branches}
    raise TypeError(type(element))


def _joint(joint: Joint) -> dict[str, Any]:
    data: dict[str, Any] = {"type": joint.kind.value, **_role(joint.role)}
    axes = [_list(freedom.axis) for freedom in joint.freedoms]
    home = [float(q) for q in joint.home]
    slides_and_turns = joint.kind in (JointKind.CYLINDRICAL, JointKind.PLANAR)
    if slides_and_turns and ("stiffness" in data or "limits" in data):
        raise TypeError("a file has no one number for N/m and N m/rad")
    match joint.kind:
        case JointKind.REVOLUTE | JointKind.PRISMATIC:
            return {**data, "axis": axes[0], "home": home[0]}
        case JointKind.HELICAL:
            pitch = float(joint.freedoms[0].pitch_per_turn)
            return {**data, "axis": axes[0], "pitch": pitch, "home": home[0]}
        case JointKind.UNIVERSAL:
            return {**data, "axes": axes, "home": home}
        case JointKind.SPHERICAL:
            return {**data, "home": home}
        case JointKind.CYLINDRICAL:
            return {**data, "axis": axes[0], "home": home}
        case JointKind.PLANAR:
            return {**data, "normal": axes[2], "home": home}
    raise TypeError(joint.kind)


def _role(role: Role) -> dict[str, Any]:
    if not isinstance(role, rs.Actuated | rs.Locked):
        return {"role": "passive"}
    data: dict[str, Any] = {"role": "actuated" if isinstance(role, rs.Actuated) else "locked"}
    if role.stiffness is not None:
        data["stiffness"] = float(role.stiffness)
    if isinstance(role, rs.Actuated) and role.limits is not None:
        data["limits"] = [float(x) for x in role.limits]
    return data


def _beam(beam: rs.TelescopicBeam) -> dict[str, Any]:
    s = beam.section
    section = {"A": s.A, "Iy": s.Iy, "Iz": s.Iz, "J": s.J}
    data = {
        "share": beam.share,
        "fixed": beam.fixed,
        "material": {"E": beam.material.E, "G": beam.material.G},
        "section": {"properties": {key: float(value) for key, value in section.items()}},
    }
    if not isinstance(beam.theory, EulerBernoulli):
        raise TypeError("beams of Timoshenko are not written")
    return data


def _list(vector: np.ndarray) -> list[float]:
    return np.asarray(vector, dtype=float).tolist()

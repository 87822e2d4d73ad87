"""Snapshot files of legs: a robot at a pose in world coordinates, read and written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from robostiff.elastostatics import Status, Tolerance
from robostiff.elastostatics.tolerance import coupling_out_of_plane
from robostiff.errors import FileError, InputError, Words, warn_of_slip
from robostiff.io.document import Document, DocumentPlace, read_document
from robostiff.io.snapshot.elements import (
    BeamPart,
    Chained,
    CouplingPart,
    FileHead,
    FilePart,
    Informative,
    LegMass,
    MassData,
    Name,
    PassivePart,
    Point,
    Spring6Part,
    SpringPart,
    drive_data,
    head_data,
    mass_data,
    one_pose,
    refuse_twins,
    screw_data,
    spring6_data,
)
from robostiff.io.suggest import distinct, free_names
from robostiff.io.validation import validate
from robostiff.kinematics import spring_compliance
from robostiff.kinematics.frames import with_couplings
from robostiff.model import (
    CoupledFreedom,
    Coupling,
    Locked,
    PlacedBlock,
    PlacedElement,
    PlacedFreedom,
    PlacedLeg,
    PlacedMass,
    PlacedSpring,
    Role,
    Snapshot,
)
from robostiff.model.checks import check_in_plane
from robostiff.model.coupled_joints import transmission
from robostiff.model.joint import joint_of


class BranchPart(FilePart):
    """A chain from the body before a parallel block to the body after it."""

    name: Name = Field(description="the name of the branch, unique in the block")
    end: Point = Field(description="where the branch meets the body after the block [m]")
    chain: list[ElementPart] = Field(
        description="the elements from body to body, none for a rigid branch; all else is rigid"
    )
    couplings: list[CouplingPart] = Field(default=[], description="of joints in the chain")
    masses: list[LegMass] = Field(default=[], description="of its parts, beside their densities")
    note: Informative = None


class ParallelPart(Chained):
    """Branches side by side, such as the bars of a parallelogram."""

    type: Literal["parallel"]
    branches: list[BranchPart] = Field(
        min_length=2, description="two or more chains between the same two bodies"
    )


ElementPart = Annotated[
    PassivePart | SpringPart | BeamPart | Spring6Part | ParallelPart, Field(discriminator="type")
]


class LegPart(BranchPart):
    """A chain from the base to the platform."""

    name: Name = Field(description="the name of the leg, unique in the file")
    end: Point = Field(description="where the leg meets the platform [m]")
    chain: list[ElementPart] = Field(
        min_length=1, description="the elements from base to platform; all else is rigid"
    )


class SnapshotFile(FileHead):
    """A robot frozen at a pose: world axes, metres, newtons and radians."""

    legs: list[LegPart] = Field(min_length=1, description="the chains that hold the platform")
    masses: list[MassData] = Field(default=[], description="on the platform")


# Part of its size by which coordinates from CAD programs, rounded to three digits or more, are off.
_ROUNDED = 1e-3


def _check_leg(leg: PlacedLeg, reference_point: np.ndarray, chain: DocumentPlace) -> None:
    """Raise a FileError unless a leg or branch, whose elements are written at a place, is planar.

    Its joints turn about z or slide across it, and loads in the plane bend no part out of it.
    """
    for i, element in enumerate(leg.elements):
        if isinstance(element, PlacedFreedom):
            with chain.at(i, "axis").complaints():
                check_in_plane("a joint of a planar robot", element)
        elif isinstance(element, PlacedBlock):
            for j, branch in enumerate(element.branches):
                _check_leg(branch, reference_point, chain.at(i, "branches", j, "chain"))
    parts = [
        spring_compliance(element, reference_point)
        if isinstance(element, PlacedSpring)
        else np.zeros((6, 6))
        for element in leg.elements
    ]
    coupling, allowed = coupling_out_of_plane(np.sum([np.zeros((6, 6)), *parts], axis=0))
    if np.any(coupling > allowed):  # at the element that bends most
        excess = [np.max(coupling_out_of_plane(part)[0] - allowed) for part in parts]
        raise chain.at(int(np.argmax(excess))).error(
            "part of a planar robot that a load in the plane bends out of it",
            expected="parts at the height of the reference point, a principal axis along z",
            hint="without planar: true the robot is spatial",
        )


def read_snapshot(source: Path | str) -> Snapshot:
    """Read a snapshot file, JSON or YAML; ``-`` for standard input.

    Raises a FileError, with line, column and path, when the file cannot be used.
    """
    return snapshot_from_document(read_document(source))


def snapshot_from_document(document: Document) -> Snapshot:
    """A robot at a pose, from a document.

    Raises a FileError at the place in the document that is to blame.
    """
    from robostiff.analysis.posed_stiffness import stiffness

    if is_graph(document):
        place = document.key_location(["graph"])
        raise FileError(place, "a graph, and not legs", hint="read it with load")
    file = validate(SnapshotFile, document)
    place = DocumentPlace(document)
    refuse_twins([leg.name for leg in file.legs], place.at("legs"), "leg")
    legs = []
    for i, leg in enumerate(file.legs):
        here = place.at("legs", i)
        legs.append(_placed_leg(leg, here, leg.name))
        if not _is_elastic(legs[-1]):
            raise here.at("chain").error(
                f"leg {leg.name} without compliance",
                expected="at least one beam, spring or spring6",
                hint="a leg of rigid parts and passive joints alone has no stiffness matrix",
            )
    shared = file.shared
    reference = shared["reference_point"]
    masses = [
        mass
        for i, entry in enumerate(file.masses)
        for mass in entry.placed(place.at("masses", i), "platform", reference)
    ]
    snapshot = Snapshot(legs=tuple(legs), masses=tuple(masses), **shared)
    if file.planar:
        for i, leg in enumerate(legs):
            _check_leg(leg, reference, place.at("legs", i, "chain"))
    # Rounding of the coordinates may decide a rank, or whether a joint is redundant.
    result = stiffness(snapshot, tolerance=Tolerance(near_independence=_ROUNDED))
    doubtful = Status.ILL_CONDITIONED
    if doubtful in result.status and doubtful not in stiffness(snapshot).status:
        pairs = zip(snapshot.legs, result.details().legs, strict=True)
        names = [f"leg {leg.name!r}" for leg, K in pairs if doubtful in K.status]
        who = ", ".join(names) or "the platform"
        warn_of_slip(
            f"{document.location(['legs'])}: rank {result.rank} is decided by differences of "
            f"coordinates below {_ROUNDED:g} of the size, in {who}; if coordinates are rounded, "
            "write ten digits, and the same numbers where points coincide or axes are parallel"
        )
    return snapshot


def is_snapshot(document: Document) -> bool:
    """Whether a document is a snapshot, rather than a model of a robot at any pose."""
    data = document.data
    if not isinstance(data, dict) or "robostiff" in data:
        return False
    legs = data.get("legs")
    is_placed = isinstance(legs, list) and any(
        isinstance(leg, dict) and {"chain", "end"} <= leg.keys() for leg in legs
    )
    has_model_keys = any(key in data for key in ("parameters", "home", "coordinates", "sections"))
    return is_placed or "graph" in data or ("reference_point" in data and not has_model_keys)


def is_graph(document: Document) -> bool:
    """Whether a snapshot is described as a graph of nodes, rather than by legs."""
    data = document.data
    return isinstance(data, dict) and "graph" in data and "legs" not in data


def _is_elastic(leg: PlacedLeg) -> bool:
    return any(isinstance(e, PlacedSpring) or e.stiffness is not None for e in leg.parts)


def _placed_leg(
    part: LegPart | BranchPart, place: DocumentPlace, name: str, prefix: str = ""
) -> PlacedLeg:
    """A leg or a branch; inside blocks names begin with ``block/branch/``."""
    end = np.array(part.end, dtype=float)
    chain = place.at("chain")
    written_names = [element.name for element in part.chain]
    refuse_twins(written_names, chain, "element")
    elements: list[PlacedElement] = []
    masses: list[PlacedMass] = []
    names = free_names(written_names, [element.type for element in part.chain])
    for i, (element, label) in enumerate(zip(part.chain, names, strict=True)):
        if isinstance(element, ParallelPart):
            branches, legs = chain.at(i, "branches"), []
            refuse_twins([branch.name for branch in element.branches], branches, "branch")
            for j, branch in enumerate(element.branches):
                branch_name = f"{prefix}{label}/{branch.name}"
                legs.append(_placed_leg(branch, branches.at(j), branch_name, f"{branch_name}/"))
            elements.append(PlacedBlock(prefix + label, tuple(legs)))
            continue
        elements.append(element.placed(prefix + label, chain.at(i)))
        if isinstance(element, BeamPart):
            masses += element.placed_masses(prefix + label, i + 1)
    _question_joints(part.chain, chain)
    for i, mass in enumerate(part.masses):
        masses += _masses(mass, place.at("masses", i), names, elements)
    couplings: list[Coupling] = []
    for i, row in enumerate(part.couplings):
        with place.at("couplings", i).complaints():
            couplings.append(Coupling(tuple(row.sum.items()), Locked(row.k), None, row.name or ""))
    if couplings:
        freedoms = [e for e in elements if isinstance(e, PlacedFreedom)]
        joints = {
            freedom.name.removeprefix(prefix): (i, joint_of(freedom, freedom.role))
            for i, freedom in enumerate(freedoms)
        }
        try:
            with np.errstate(all="ignore"):
                moved = transmission(joints, len(joints), couplings)
        except InputError:
            for i in range(len(couplings)):  # one after the other, so that an error is at its place
                with place.at("couplings", i).complaints():
                    transmission(joints, len(joints), couplings[: i + 1])
            raise
        elements = with_couplings(elements, moved, prefix=prefix)
    return PlacedLeg(name, tuple(elements), end, tuple(masses))


def _masses(
    data: LegMass, place: DocumentPlace, names: Sequence[str], elements: Sequence[PlacedElement]
) -> Iterator[PlacedMass]:
    if data.after is None:
        if data.at is None or data.start is not None:
            raise place.error(
                "mass before the first element", expected="a place of it: at, and no start"
            )
        yield from data.placed(place, "base", np.zeros(3))
        return
    if data.after not in names:
        raise place.at("after").unknown("element before a mass", data.after, names)
    count = names.index(data.after) + 1
    carrier = elements[count - 1]
    if data.start is not None and not isinstance(carrier, PlacedSpring):
        raise place.at("after").error(
            "elastic part along which a mass is", got=data.after, expected="a beam or a spring6"
        )
    usual = carrier.branches[0].end if isinstance(carrier, PlacedBlock) else carrier.point
    yield from data.placed(place, carrier.name, usual, count)


# Part of a beam's length by which the axis of a joint may miss it, with a rigid part between.
_FAR = 0.5


def _question_joints(chain: Sequence[ElementPart], place: DocumentPlace) -> None:
    """Warn of joints in a chain whose axis passes far from the beam beside them."""
    for i, (one, other) in enumerate(pairwise(chain)):
        for beam, joint, j in ((one, other, i + 1), (other, one, i)):
            if not isinstance(beam, BeamPart) or not isinstance(joint, PassivePart | SpringPart):
                continue
            if joint.kind == "P":
                continue
            ends, axis = np.array([beam.start, beam.end]), np.array(joint.axis)
            axis = axis / np.linalg.norm(axis)
            gap = float(np.min(np.linalg.norm(np.cross(ends - joint.point, axis), axis=1)))
            length = float(np.linalg.norm(ends[1] - ends[0]))
            if gap > _FAR * length:
                where = place.document.location(place.at(j, "point").path)
                warn_of_slip(
                    f"{where}: the axis of this joint passes {gap:g} m from the beam beside it, "
                    f"which is {length:g} m long; are both in metres?"
                )


def snapshot_to_data(snapshot: Snapshot) -> dict[str, Any]:
    """Plain data that `read_snapshot` reads back, once written as JSON.

    Every elastic part becomes a ``spring6`` with its stiffness, or with its compliance if that is
    singular; rigid joints are left out, for whatever lies between elements is rigid.

    Parameters
    ----------
    snapshot : Snapshot
        At one pose.

    Returns
    -------
    dict

    Raises
    ------
    InputError
        When it holds several poses, or parts that the format cannot describe.
    """
    if snapshot.platform is not None:
        raise InputError(
            f"snapshot {snapshot.name!r} as a file of legs",
            got=Words("a flexible platform"),
            expected="a rigid one",
            hint="write it as a graph: network_to_data(network_of_snapshot(snapshot))",
        )
    snapshot.check_has_no_springs("file of legs")
    data = head_data(snapshot, "robot")
    if snapshot.masses:
        data["masses"] = [mass_data(mass) for mass in snapshot.masses]
    names = distinct(leg.name for leg in snapshot.legs)
    for leg, name in zip(snapshot.legs, names, strict=True):
        if not _is_elastic(leg):
            expected = "at least one elastic part or joint"
            hint = "give a link or an actuator of the leg its elasticity"
            raise InputError(f"leg {name} without compliance", expected=expected, hint=hint)
    data["legs"] = [_chain(*pair, "") for pair in zip(snapshot.legs, names, strict=True)]
    return data


def _chain(leg: PlacedLeg, name: str, prefix: str) -> dict[str, Any]:
    """A leg or a branch; names lose the ``block/branch/`` that the reader puts before them."""
    alone = [e.alone if isinstance(e, CoupledFreedom) else e for e in leg.elements]
    roles = _locked_by_couplings(leg, {e.name for e in alone if _is_rigid(e)})
    elements = [
        replace(e, role=roles[e.name]) if isinstance(e, PlacedFreedom) and e.name in roles else e
        for e in alone
    ]
    not_rigid = [k for k, e in enumerate(elements) if not _is_rigid(e)]
    elements = [elements[k] for k in not_rigid]
    names = distinct(e.name.removeprefix(prefix) for e in elements)
    chain: list[dict[str, Any]] = []
    for element, label in zip(elements, names, strict=True):
        if isinstance(element, PlacedBlock):
            branches = distinct(b.name.removeprefix(f"{element.name}/") for b in element.branches)
            pairs = zip(element.branches, branches, strict=True)
            inside = [_chain(branch, called, f"{branch.name}/") for branch, called in pairs]
            chain.append({"type": "parallel", "name": label, "branches": inside})
        elif isinstance(element, PlacedSpring):
            at = element.point, element.rotation, element.elasticity
            chain.append({"type": "spring6", "name": label, **spring6_data(label, *at)})
        else:
            kind = "passive" if element.is_passive else "spring"
            drive = {} if element.is_passive else drive_data(element)
            chain.append({"type": kind, "name": label, **screw_data(element), **drive})
    written = dict(zip((e.name for e in elements), names, strict=True))
    data: dict[str, Any] = {"name": name, "end": one_pose(leg.end, 1), "chain": chain}
    joints = [e for e in leg.elements if isinstance(e, PlacedFreedom)]
    turns = {e.joint if isinstance(e, CoupledFreedom) else e.name: e.turns for e in joints}
    for gear in (e for e in joints if isinstance(e, CoupledFreedom) and len(e.sum) > 1):
        # The first joint says whether the sum is an angle or a length.
        first = [term for term in gear.sum if turns[term[0]] is gear.turns]
        factors = dict(first) | dict(gear.sum)
        terms = {written[joint]: float(a) for joint, a in factors.items() if joint in written}
        if len(terms) > 1:
            coupling = {"name": gear.name.removeprefix(prefix), "sum": terms, "k": gear.stiffness}
            data.setdefault("couplings", []).append(coupling)
    if leg.masses:
        data["masses"] = [
            mass_data(mass) | {"after": names[before[-1]]} if before else mass_data(mass)
            for mass in leg.masses
            for before in ([i for i, k in enumerate(not_rigid) if k < mass.after],)
        ]
    return data


def _locked_by_couplings(leg: PlacedLeg, rigid: set[str]) -> dict[str, Role]:
    """Joints that a coupling holds by themselves, as all others of its sum are held rigidly."""
    roles: dict[str, Role] = {}
    sums = [e for e in leg.elements if isinstance(e, CoupledFreedom) and len(e.sum) > 1]
    while sums:
        rest = []
        for element in sums:
            moving = [(joint, a) for joint, a in element.sum if joint not in rigid]
            if len(moving) > 1:
                rest.append(element)
                continue
            for joint, a in moving:
                k = element.stiffness
                roles[joint] = Locked(None if k is None else k * float(a) ** 2)
                rigid = rigid | ({joint} if k is None else set())
        if len(rest) == len(sums):
            break
        sums = rest
    return roles


def _is_rigid(part: PlacedElement) -> bool:
    return isinstance(part, PlacedFreedom) and not part.is_passive and part.stiffness is None

"""Writing snapshots of robots and graphs of networks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity, elasticity_from_stiffness
from robostiff.elastostatics import chain_stiffness
from robostiff.errors import InputError, NoAnswerError
from robostiff.io.snapshot.elements import ScrewData
from robostiff.model import (
    CoupledFreedom,
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
from robostiff.network import BeamElement, JointElement, Network, SpringElement
from robostiff.network.elements import CouplingElement, Element
from robostiff.spatial import Screw, Space

# Part of its size by which a compliance may change when it is written as a stiffness.
_READS_BACK = 1e-12


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

    Examples
    --------
    >>> from robostiff.model import Actuated
    >>> drive = PlacedFreedom(np.eye(3)[2], np.zeros(3), None, "drive", Actuated(2e6))
    >>> jack = Snapshot("jack", (PlacedLeg("leg", (drive,), np.zeros(3)),), np.zeros(3))
    >>> data = snapshot_to_data(jack)
    >>> data["legs"][0]["chain"][0]["k"]
    2000000.0
    """
    if snapshot.platform is not None:
        raise InputError(
            f"snapshot {snapshot.name!r} as a file of legs",
            got="a flexible platform",
            expected="a rigid one",
            hint="write it as a graph: network_to_data(network_of_snapshot(snapshot))",
        )
    snapshot.check_has_no_springs("file of legs")
    data = _head(snapshot, "robot")
    if snapshot.masses:
        data["masses"] = [_mass(mass) for mass in snapshot.masses]
    names = distinct(leg.name for leg in snapshot.legs)
    data["legs"] = [_leg(leg, name) for leg, name in zip(snapshot.legs, names, strict=True)]
    return data


def _leg(leg: PlacedLeg, name: str) -> dict[str, Any]:
    if not any(isinstance(e, PlacedSpring) or e.stiffness is not None for e in leg.parts):
        raise InputError(
            f"leg {name} without compliance",
            expected="at least one elastic part or joint",
            hint="give a link or an actuator of the leg its elasticity",
        )
    return _chain(leg, name, "")


def _chain(leg: PlacedLeg, name: str, prefix: str) -> dict[str, Any]:
    """A leg or a branch; names lose the ``block/branch/`` that the reader puts before them."""
    alone = [e.alone if isinstance(e, CoupledFreedom) else e for e in leg.elements]
    held = _held_alone(leg, {e.name for e in alone if _is_rigid(e)})
    elements = [
        replace(e, role=held[e.name]) if isinstance(e, PlacedFreedom) and e.name in held else e
        for e in alone
    ]
    kept = [k for k, e in enumerate(elements) if not _is_rigid(e)]
    elements = [elements[k] for k in kept]
    names = distinct(e.name.removeprefix(prefix) for e in elements)
    chain = [
        _block(e, n) if isinstance(e, PlacedBlock) else _element(e, n)
        for e, n in zip(elements, names, strict=True)
    ]
    written = dict(zip((e.name for e in elements), names, strict=True))
    couplings = list(_couplings(leg, written, held, prefix))
    data = {"name": name, "end": _one_pose(leg.end, 1), "chain": chain}
    if couplings:
        data["couplings"] = couplings
    if leg.masses:
        data["masses"] = [
            _mass(mass) | {"after": names[before[-1]]} if before else _mass(mass)
            for mass in leg.masses
            for before in ([i for i, k in enumerate(kept) if k < mass.after],)
        ]
    return data


def _mass(mass: PlacedMass) -> dict[str, Any]:
    """What `placed_masses` reads back."""
    data = {"name": mass.name, "mass": float(mass.value)}
    if mass.span is None:
        data["at"] = _one_pose(mass.centre, 1)
    else:
        data["span"] = [float(part) for part in mass.span]
    return data if mass.start is None else {**data, "start": _one_pose(mass.start, 1)}


def _head(robot: Snapshot | Network, name: str) -> dict[str, Any]:
    data: dict[str, Any] = {"name": robot.name or name}
    if robot.description:
        data["description"] = robot.description
    data["units"] = "SI: m, N, rad"
    if robot.space is Space.PLANAR:
        data["planar"] = True
    data["reference_point"] = _one_pose(robot.reference_point, 1)
    return data if robot.gravity is None else {**data, "gravity": _one_pose(robot.gravity, 1)}


def _held_alone(leg: PlacedLeg, rigid: set[str]) -> dict[str, Role]:
    """Joints that a coupling holds by themselves, as all others of its sum are held rigidly."""
    held: dict[str, Role] = {}
    left = [e for e in leg.elements if isinstance(e, CoupledFreedom) and len(e.sum) > 1]
    while left:
        rest = []
        for element in left:
            moving = [(joint, a) for joint, a in element.sum if joint not in rigid]
            if len(moving) > 1:
                rest.append(element)
                continue
            for joint, a in moving:
                k = element.stiffness
                held[joint] = Locked(None if k is None else k * float(a) ** 2)
                rigid = rigid | ({joint} if k is None else set())
        if len(rest) == len(left):
            break
        left = rest
    return held


def _couplings(
    leg: PlacedLeg, written: dict[str, str], held: dict[str, Role], prefix: str
) -> Iterator[dict[str, Any]]:
    joints = [e for e in leg.elements if isinstance(e, PlacedFreedom)]
    turns = {e.joint if isinstance(e, CoupledFreedom) else e.name: e.turns for e in joints}
    for element in leg.elements:
        if isinstance(element, CoupledFreedom) and len(element.sum) > 1:
            # The first joint says whether the sum is an angle or a length.
            kind = element.turns
            factors = sorted(element.sum, key=lambda term, kind=kind: turns[term[0]] is not kind)
            terms = {written[joint]: float(a) for joint, a in factors if joint in written}
            if len(terms) > 1:
                name = element.name.removeprefix(prefix)
                yield {"name": name, "sum": terms, "k": element.stiffness}


def _block(block: PlacedBlock, name: str) -> dict[str, Any]:
    own = f"{block.name}/"
    names = distinct(branch.name.removeprefix(own) for branch in block.branches)
    branches = [
        _chain(branch, n, f"{branch.name}/")
        for branch, n in zip(block.branches, names, strict=True)
    ]
    return {"type": "parallel", "name": name, "branches": branches}


def _is_rigid(own: PlacedElement) -> bool:
    return isinstance(own, PlacedFreedom) and not own.is_passive and own.stiffness is None


def _element(element: PlacedFreedom | PlacedSpring, name: str) -> dict[str, Any]:
    if isinstance(element, PlacedSpring):
        own = element.point, element.rotation, element.elasticity
        return {"type": "spring6", "name": name, **_spring6(name, *own)}
    kind = "passive" if element.is_passive else "spring"
    data = {"type": kind, "name": name, **_screw(element)}
    return data if element.is_passive else {**data, **_drive(element)}


def _drive(element: PlacedFreedom) -> dict[str, Any]:
    """Stiffness of a freedom, None of a passive one, and the inertia of its drive."""
    inertia = getattr(element.role, "inertia", None)
    return {"k": element.stiffness, **({} if inertia is None else {"inertia": inertia})}


def _spring6(
    name: str, point: np.ndarray, rotation: np.ndarray, elasticity: Elasticity
) -> dict[str, Any]:
    """A spring by its stiffness if this says all there is to say, else by its compliance."""
    place = {"point": _one_pose(point, 1), "rotation": _one_pose(rotation, 2)}
    compliance = _one_pose(elasticity.compliance, 2)
    K = _stiffness(np.array(compliance), elasticity.freedoms)
    if K is not None:
        return {**place, "K": K.tolist()}
    if elasticity.freedoms.size:
        raise InputError(
            f"spring {name} with directions both free and rigid",
            expected="a spring that is given by one matrix",
            hint="write its free directions as passive joints beside it",
        )
    return {**place, "compliance": compliance}


def _stiffness(C: np.ndarray, freedoms: np.ndarray) -> np.ndarray | None:
    """Stiffness from which the compliance and the freedoms are found again; None without one."""
    try:
        K = chain_stiffness(C, freedoms).K
        back = elasticity_from_stiffness(K)
    except (NoAnswerError, InputError):
        return None
    if freedoms.size:
        return K if back.freedoms.shape == freedoms.shape else None
    size = np.sqrt(np.diagonal(C))
    same = np.all(np.abs(back.compliance - C) <= _READS_BACK * np.outer(size, size))
    return K if same else None


def _one_pose(array: np.ndarray, axes: int) -> list[Any]:
    """The array as lists, without batch axes."""
    value = np.asarray(array, dtype=float)
    shape = value.shape[value.ndim - axes :]
    if value.size != np.prod(shape):
        raise InputError(
            "shape of the batch of poses",
            got=value.shape[: value.ndim - axes],
            expected="one pose",
            hint="a snapshot file holds one pose: write a file for each",
        )
    return value.reshape(shape).tolist()


def _screw(screw: Screw) -> dict[str, Any]:
    """About or along which axis a joint moves."""
    data = {"point": _one_pose(screw.point, 1), "axis": _one_pose(screw.axis, 1)}
    return {**ScrewData.of(screw), **data}


def distinct(names: Iterable[str]) -> list[str]:
    """The names, with a number behind those that are taken already."""
    unique: list[str] = []
    for name in names:
        candidate, number = name or "part", 2
        while candidate in unique:
            candidate, number = f"{name or 'part'} ({number})", number + 1
        unique.append(candidate)
    return unique


def network_to_data(network: Network) -> dict[str, Any]:
    """Plain data that `robostiff.load` reads back, once written as JSON.

    Every beam and spring becomes a spring with its stiffness, or with its compliance if that is
    singular.

    Parameters
    ----------
    network : Network

    Raises
    ------
    InputError
        When a spring has directions both free and rigid, or nothing is elastic.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02), name="rod")
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> network_to_data(network)["graph"]["springs"][0]["name"]
    'rod'
    """
    if not any(_is_elastic(own) for own in (*network.elements, *network.couplings)):
        raise InputError(
            f"network {network.name} without compliance",
            expected="at least one beam, spring or joint with a stiffness",
        )
    joints = _named(
        [
            {
                **{"name": joint.name, "a": joint.a, "b": joint.b},
                "dofs": [{**_screw(own), **_drive(own)} for own in joint.moving],
            }
            for joint in network.joints
        ]
    )
    data = _head(network, "network")
    springs = []
    for own in (*network.beams, *network.springs):
        spring = {"name": own.name, "a": own.a, "b": own.b, **_spring6(own.name, *_elastic(own))}
        masses = [_mass(mass) for mass in own.masses]
        springs.append({**spring, "masses": masses} if masses else spring)
    data["graph"] = {
        "nodes": {node.name: _one_pose(node.point, 1) for node in network.nodes},
        "fixed": list(network.fixed),
        "platform": network.platform,
        "springs": _named(springs),
        "joints": joints,
    }
    names = {id(own): data["name"] for own, data in zip(network.joints, joints, strict=True)}
    if couplings := [_coupling(own, names) for own in network.couplings if own.terms]:
        data["graph"]["couplings"] = couplings
    masses = [{"on": node.name, **_mass(mass)} for node in network.nodes for mass in node.masses]
    if masses:
        data["graph"]["masses"] = masses
    return data


def _elastic(element: BeamElement | SpringElement) -> tuple[np.ndarray, np.ndarray, Elasticity]:
    if isinstance(element, BeamElement):
        return element.end, element.rotation, Elasticity(element.tip_compliance)
    return element.point, element.rotation, element.elasticity


def _coupling(own: CouplingElement, names: dict[int, str]) -> dict[str, Any]:
    terms = {
        f"{names[id(joint)]}/dof{place + 1}": float(factor)
        for joint, number, factor in own.terms
        if (place := joint.place(number)) is not None
    }
    return {"name": own.name, "sum": terms, "k": own.stiffness}


def _named(parts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    names = distinct(part["name"] for part in parts)
    return [{**part, "name": name} for part, name in zip(parts, names, strict=True)]


def _is_elastic(element: Element | CouplingElement) -> bool:
    if isinstance(element, CouplingElement):
        return element.stiffness is not None
    if isinstance(element, JointElement):
        return any(f.stiffness is not None for f in element.freedoms)
    return bool(np.any(_elastic(element)[2].compliance))

"""A robot of legs as a network: one more body after every element of every leg."""

from __future__ import annotations

import numpy as np

from robostiff.errors import InputError
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.network.elements import JointElement, Node, SpringElement
from robostiff.network.network import Network

_GROUND, _PLATFORM = "ground", "platform"


def network_of_snapshot(snapshot: Snapshot) -> Network:
    """A robot at one pose as a network of rigid bodies, springs and joints.

    Nothing is condensed and no leg treated apart: each element connects two bodies, and
    `condense` finds the stiffness of the platform without the forms of K_C.

    Parameters
    ----------
    snapshot : Snapshot
        At one pose.

    Raises
    ------
    InputError
        When it holds several poses, or springs of formulas.

    Examples
    --------
    >>> import robostiff as rs
    >>> posture = rs.find_posture(rs.load("hexapod"))
    >>> network = network_of_snapshot(posture.snapshot.one(0))
    >>> len(network.nodes), len(network.joints), len(network.springs)
    (56, 36, 24)
    """
    if snapshot.reference_point.ndim != 1:
        raise InputError(
            f"poses of snapshot {snapshot.name!r}",
            got=snapshot.reference_point.shape[:-1],
            expected="one pose",
            hint="take one of them: snapshot.one(0)",
        )
    nodes = [Node(_GROUND, snapshot.centre), Node(_PLATFORM, snapshot.reference_point)]
    springs: list[SpringElement] = []
    joints: list[JointElement] = []
    for number, leg in enumerate(snapshot.legs):
        _add_leg(leg, f"{number + 1} {leg.name}", nodes, springs, joints)
    return Network(
        snapshot.name,
        tuple(nodes),
        (_GROUND,),
        _PLATFORM,
        snapshot.reference_point,
        springs=tuple(springs),
        joints=tuple(joints),
        space=snapshot.space,
        description=snapshot.description,
    )


def _add_leg(
    leg: PlacedLeg,
    prefix: str,
    nodes: list[Node],
    springs: list[SpringElement],
    joints: list[JointElement],
) -> None:
    before = _GROUND
    elements = [e for e in leg.elements if not _is_rigid(e)]
    for i, element in enumerate(elements):
        if i == len(elements) - 1:
            after = _PLATFORM
        else:
            after = f"{prefix}, after {i + 1} {element.name}"
            nodes.append(Node(after, np.asarray(element.point, dtype=float)))
        if isinstance(element, PlacedSpring):
            name = f"{leg.name}/{element.name}"
            springs.append(
                SpringElement(
                    name, before, after, element.point, element.rotation, element.elasticity
                )
            )
        else:
            joints.append(JointElement(leg.name, before, after, (element,)))
        before = after
    if not elements:
        joints.append(JointElement(leg.name, _GROUND, _PLATFORM))


def _is_rigid(element: PlacedFreedom | PlacedSpring) -> bool:
    return (
        isinstance(element, PlacedFreedom) and not element.is_passive and element.stiffness is None
    )

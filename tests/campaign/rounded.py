"""The same robot with its dimensions rounded anew: nothing that decides may flip."""
# pyright: reportArgumentType=false

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.model import Chain, Element, Leg, Link, PlacedFreedom, PlacedSpring, Rigid, Snapshot
from tests.campaign.answers import Answer
from tests.campaign.placed import with_parts
from tests.campaign.posed import Posed, nominal
from tests.campaign.reference import Reference, redundant_joints, reference

_PART = 1e-15  # of each number
_NEIGHBOURS, _SEED = 6, 7  # of a robot, by one unit in the last place


def neighbours(snapshot: Snapshot) -> list[Reference]:
    """Exact answers of robots whose coordinates differ by one unit in the last place.

    Where passive joints are redundant, each of them may be the one that is left out: joints that
    count as meeting in a point miss it by rounding, and any three of four meet elsewhere.
    """
    idle = redundant_joints(snapshot)
    rng = np.random.default_rng(_SEED)

    def moved(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        def anew(x: np.ndarray) -> np.ndarray:
            return x + np.spacing(np.abs(x)) * rng.choice([-1.0, 1.0], np.shape(x))

        if isinstance(part, PlacedSpring):
            return replace(part, point=anew(part.point), rotation=anew(part.rotation))
        return replace(part, point=anew(part.point), axis=anew(part.axis))

    robots = [with_parts(snapshot, moved) for _ in range(_NEIGHBOURS)]
    fewer = [_without(robot, *place) for robot in (snapshot, *robots) for place in idle]
    found = [reference(robot) for robot in (*robots, *fewer)]
    return [one for one in found if one is not None]


def _without(snapshot: Snapshot, leg: int, element: int) -> Snapshot:
    """The robot without one of its joints."""
    legs = list(snapshot.legs)
    elements = legs[leg].elements
    legs[leg] = replace(legs[leg], elements=(*elements[:element], *elements[element + 1 :]))
    return replace(snapshot, legs=tuple(legs))


def anew(x: Any, rng: np.random.Generator) -> Any:
    """Numbers that differ by their last digits; what is zero stays so."""
    return np.asarray(x, dtype=float) * (1 + _PART * rng.choice([-1.0, 1.0], np.shape(x)))


def rounded_snapshot(snapshot: Snapshot, rng: np.random.Generator) -> Snapshot:
    """All coordinates of joints and springs, and all compliances as a whole."""

    def one(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        if isinstance(part, PlacedFreedom):
            return replace(part, point=anew(part.point, rng), axis=anew(part.axis, rng))
        own = part.elasticity
        # An entry alone would make a singular compliance indefinite.
        elasticity = rs.Elasticity(own.compliance * anew(1.0, rng), own.freedoms)
        rotation = anew(part.rotation, rng)
        return replace(part, point=anew(part.point, rng), rotation=rotation, elasticity=elasticity)

    return with_parts(snapshot, one)


def rounded(snapshot: Snapshot, rng: np.random.Generator, known: Any) -> Answer:
    """Status and rank as before; K and C against the reference of the rounded robot."""
    if snapshot.platform is not None:
        return Answer("rounded", None, rs.Status.FORM_DOES_NOT_HOLD)
    moved = rounded_snapshot(snapshot, rng)
    result = rs.stiffness(moved)
    K = result.K if bool(result.answered) else None
    answer = Answer("rounded", K, result.status, int(result.rank), truth=reference(moved))
    return replace(answer, neighbours=lambda: neighbours(moved))


def rounded_posed(posed: Posed, rng: np.random.Generator) -> Posed:
    """The parameters of a shipped robot, lengths and places of others; and all poses."""
    rows = anew(posed.rows, rng)
    if posed.shipped:
        own = nominal(posed.shipped, posed.parameters)
        values = {name: float(anew(value, rng)) for name, value in own.items()}
        return replace(posed, robot=rs.load(posed.shipped, values), rows=rows)

    def frame(own: rs.Frame) -> rs.Frame:
        return rs.Frame(own.R, anew(own.p, rng))

    def element(own: Element) -> Element:
        if isinstance(own, Link):
            return replace(own, to=anew(own.to, rng))
        return replace(own, transform=frame(own.transform)) if isinstance(own, Rigid) else own

    def leg(own: Leg) -> Leg:
        elements = tuple(element(part) for part in own.chain.elements)
        chain = Chain(elements, own.chain.couplings)
        return replace(own, base=frame(own.base), chain=chain, attachment=frame(own.attachment))

    legs = tuple(leg(own) for own in posed.robot.legs)
    return replace(posed, robot=replace(posed.robot, legs=legs), rows=rows)


def rounded_poses(case: Any) -> None:
    """A robot with poses: status, rank and K as in the batch."""
    posed = rounded_posed(case.posed, case.rng)
    found = rs.stiffness(posed.robot, posed.pose())
    for row in range(len(posed.rows)):
        one = found[row]
        K = one.K if bool(one.answered) else None
        case.same("rounded", row, K, int(one.status), int(one.rank))

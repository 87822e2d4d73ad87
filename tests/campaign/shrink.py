"""Smaller robots that fail in the same way: fewer legs, fewer elements, rounder numbers."""
# pyright: reportAttributeAccessIssue=false
# pyright: reportArgumentType=false

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import TypeVar

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.model import Chain, PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from tests.campaign import posed_ways, ways
from tests.campaign.answers import Complaint, keys_of
from tests.campaign.placed import with_parts
from tests.campaign.posed import Posed

T = TypeVar("T")
_SECONDS = 3.0  # of processor time for one failure


def shrunk_snapshot(
    snapshot: Snapshot, seed: list[int], complaints: list[Complaint]
) -> tuple[Snapshot, list[Complaint]]:
    """The smallest found that has one of the complaints."""
    wanted = _telling(complaints)
    only = frozenset(way for way, _ in wanted)

    def still(smaller: Snapshot) -> list[Complaint]:
        found = ways.judged(smaller, seed, only)[0].complaints
        return found if keys_of(found) & wanted else []

    return _smallest(snapshot, complaints, _smaller_snapshots, still)


def shrunk_posed(
    posed: Posed, seed: list[int], complaints: list[Complaint]
) -> tuple[Posed, list[Complaint]]:
    """The same for a robot with poses; legs and poses are left out."""
    wanted = _telling(complaints)
    known = {way.name for way in posed_ways.WAYS}
    only = frozenset(n for n in known if any(way.startswith(n) for way, _ in wanted))

    def still(smaller: Posed) -> list[Complaint]:
        found, _ = posed_ways.judged_posed(smaller, seed, only)
        return found if keys_of(found) & wanted else []

    if posed.shipped:
        return posed, complaints
    return _smallest(posed, complaints, _smaller_posed, still)


def _telling(complaints: list[Complaint]) -> set[tuple[str, str]]:
    """What must stay: what is said of ways in particular, where anything is."""
    keys = keys_of(complaints)
    return {key for key in keys if key[0] != "default"} or keys


def _smallest(robot: T, complaints: list[Complaint], smaller, still) -> tuple[T, list[Complaint]]:
    end = time.process_time() + _SECONDS
    progress = True
    while progress and time.process_time() < end:
        progress = False
        for candidate in smaller(robot):
            if time.process_time() > end:
                break
            try:
                found = still(candidate)
            except Exception:  # noqa: S112 - a smaller robot that is none
                continue
            if found:
                robot, complaints, progress = candidate, found, True
                break
    return robot, complaints


def _smaller_snapshots(snapshot: Snapshot) -> Iterator[Snapshot]:
    if snapshot.platform is None:
        for i in range(len(snapshot.legs)):
            if len(snapshot.legs) > 1:
                yield replace(snapshot, legs=snapshot.legs[:i] + snapshot.legs[i + 1 :])
    for i, leg in enumerate(snapshot.legs):
        for less in _smaller_legs(leg):
            legs = (*snapshot.legs[:i], less, *snapshot.legs[i + 1 :])
            yield replace(snapshot, legs=legs)
    for digits in (1, 2, 3):
        rounded = _rounded(snapshot, digits)
        if repr(rounded) != repr(snapshot):
            yield rounded


def _smaller_legs(leg: PlacedLeg) -> Iterator[PlacedLeg]:
    for k, element in enumerate(leg.elements):
        before, after = leg.elements[:k], leg.elements[k + 1 :]
        if len(leg.elements) > 1:
            yield replace(leg, elements=(*before, *after))
        if isinstance(element, PlacedBlock):
            for i, branch in enumerate(element.branches):
                yield replace(leg, elements=(*before, *branch.elements, *after))
                if len(element.branches) > 2:
                    fewer = element.branches[:i] + element.branches[i + 1 :]
                    yield replace(leg, elements=(*before, PlacedBlock(element.name, fewer), *after))
                for less in _smaller_legs(branch):
                    own = (*element.branches[:i], less, *element.branches[i + 1 :])
                    yield replace(leg, elements=(*before, PlacedBlock(element.name, own), *after))


def _rounded(snapshot: Snapshot, digits: int) -> Snapshot:
    """Coordinates of so many decimals, springs along the axes of the world, round stiffnesses."""

    def one(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        point = np.round(part.point, digits)
        if isinstance(part, PlacedSpring):
            C = part.elasticity.compliance
            size = 10.0 ** np.floor(np.log10(np.abs(C) + 1e-300) - digits)
            C = np.where(C == 0, 0.0, np.round(C / size) * size)
            return replace(part, point=point, elasticity=Elasticity(C, part.elasticity.freedoms))
        axis = np.round(part.axis, digits)
        size = np.linalg.norm(axis)
        return replace(part, point=point, axis=axis / size if size else part.axis)

    rounded = with_parts(snapshot, one)
    return replace(rounded, reference_point=np.round(snapshot.reference_point, digits))


def _smaller_posed(posed: Posed) -> Iterator[Posed]:
    robot = posed.robot
    if len(posed.rows) > 2:
        for i in range(1, len(posed.rows)):
            rows = np.delete(posed.rows, i, axis=0)
            q = None if posed.q is None else np.delete(posed.q, i, axis=0)
            yield replace(posed, rows=rows, q=q)
    if len(robot.legs) > 1:
        for i in range(len(robot.legs)):
            legs = robot.legs[:i] + robot.legs[i + 1 :]
            yield replace(posed, robot=replace(robot, legs=legs))
    if posed.by_joints:
        return
    for i, leg in enumerate(robot.legs):
        for k, element in enumerate(leg.chain.elements):
            if type(element).__name__ == "Link" and len(leg.chain.elements) > 2:
                from robostiff.model import Rigid
                from robostiff.spatial import Frame

                rigid = Rigid(Frame(np.eye(3), element.to))
                elements = (*leg.chain.elements[:k], rigid, *leg.chain.elements[k + 1 :])
                less = replace(leg, chain=Chain(elements))
                legs = (*robot.legs[:i], less, *robot.legs[i + 1 :])
                yield replace(posed, robot=replace(robot, legs=legs))

"""Recorded legs, evaluated at the samples of their record, beside legs computed in floats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.kinematics import PostureFinder, leg_compliance, passive_jacobian
from robostiff.kinematics.formula import FormulaPose, PlacedFormula, place_leg
from robostiff.model import ALL_COORDINATES, Element, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record
from tests.generators.elements import random_transform
from tests.generators.legs import LegCase, platform_at, six

SIX = tuple(coordinate.value for coordinate in ALL_COORDINATES)


def built_leg(elements: Sequence[Element], seed: int = 0) -> LegCase:
    """A leg of some elements, somewhere and at any angle."""
    rng = np.random.default_rng(seed)
    chain = rs.Chain(tuple(elements))
    base, attachment = (random_transform(rng, shift) for shift in (0.5, 0.2))
    leg = rs.Leg("leg", base, chain, attachment)
    return LegCase(leg, six(platform_at(leg, chain.home)))


def recorded_pose(poses: np.ndarray) -> tuple[Record, FormulaPose]:
    """A pose whose coordinates are inputs, the samples the poses (N, 6)."""
    record = Record({name: own.tolist() for name, own in zip(SIX, poses.T, strict=True)})
    coordinates = [record.input(name) for name in SIX]
    return record, FormulaPose.of_coordinates(np.array(coordinates, dtype=object))


@dataclass(frozen=True)
class Pair:
    """A leg recorded and in floats, at the same poses.

    Attributes
    ----------
    record : Record
    formula : PlacedFormula
    recorded, computed : list of PlacedLeg
        One a pose.
    reached : (N,) array
        Where the leg in floats meets the platform.
    q : (N, size) array
        Its coordinates.
    """

    record: Record
    formula: PlacedFormula
    recorded: list[PlacedLeg]
    computed: list[PlacedLeg]
    reached: np.ndarray
    q: np.ndarray

    @property
    def largest_gap(self) -> np.ndarray:
        """Of the recorded leg (N,)."""
        gaps = [_sample(x, len(self.q)) for x in self.formula.gap]
        return np.max([np.zeros(len(self.q)), *gaps], axis=0)

    @property
    def long_enough(self) -> np.ndarray:
        """Where all beams of the recorded leg have a length (N,)."""
        lengths = [_sample(x, len(self.q)) for x in self.formula.lengths]
        return np.min([np.ones(len(self.q)), *lengths], axis=0) > 0


def pair_of(case: LegCase, poses: np.ndarray) -> Pair:
    """A leg of its own at poses (N, 6)."""
    record, pose = recorded_pose(poses)
    finder = PostureFinder(case.robot)
    posture = finder.find(poses)
    formula = place_leg(case.leg, pose, finder.solvers[0])
    snapshots = [posture.snapshot.one(k).legs[0] for k in range(len(poses))]
    shift, turn = posture.shift_gaps[:, 0], posture.turn_gaps[:, 0]
    reached = (shift <= 1e-7 * posture.length) & (turn <= 1e-7)
    recorded = at_samples(formula.leg, len(poses))
    return Pair(record, formula, recorded, snapshots, reached, posture.coordinates[0])


def at_samples(leg: PlacedLeg, count: int) -> list[PlacedLeg]:
    """A recorded leg in floats, at each sample of its record."""
    values = [_values_of(element, count) for element in leg.own_parts]
    end = _samples(leg.end, count)
    return [
        PlacedLeg(leg.name, tuple(element[k] for element in values), end[k]) for k in range(count)
    ]


def difference(a: PlacedLeg, b: PlacedLeg) -> float:
    """How far two legs differ, in compliance of all of it, and in the span of J_q."""
    at = b.end
    C, C_other = leg_compliance(a, at), leg_compliance(b, at)
    span, span_other = (_projector(passive_jacobian(leg, at)[0]) for leg in (a, b))
    apart = np.abs(C - C_other).max() / np.abs(C_other).max()
    return float(max(apart, np.abs(span - span_other).max()))


def _values_of(element: PlacedFreedom | PlacedSpring, count: int) -> list[Any]:
    point = _samples(element.point, count)
    if isinstance(element, PlacedFreedom):
        axis, role = _samples(element.axis, count), element.role
        roles = [role] * count
        if not isinstance(role, rs.Passive) and isinstance(role.stiffness, Entry):
            roles = [replace(role, stiffness=float(k)) for k in role.stiffness.sample]
        return [
            replace(element, point=p, axis=e, role=own)
            for p, e, own in zip(point, axis, roles, strict=True)
        ]
    rotation = _samples(element.rotation, count)
    C, freedoms = _samples(element.elasticity.compliance, count), element.elasticity.freedoms
    return [
        replace(element, point=p, rotation=R, elasticity=Elasticity(own, freedoms))
        for p, R, own in zip(point, rotation, C, strict=True)
    ]


def _samples(a: np.ndarray, count: int) -> np.ndarray:
    out = np.empty((count, *a.shape))
    for place in np.ndindex(a.shape):
        out[(slice(None), *place)] = _sample(a[place], count)
    return out


def _sample(x: Any, count: int) -> np.ndarray:
    return x.sample if isinstance(x, Entry) else np.full(count, float(x))


def _projector(J: np.ndarray) -> np.ndarray:
    U, s, _ = np.linalg.svd(J, full_matrices=False)
    basis = U[:, s > 1e-9]
    return basis @ basis.T

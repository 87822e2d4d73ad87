"""The closure and the stiffness of a driven linkage as records.

Wrenches circulate in its loops. Bodies that more than two connections meet are joined by chains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from robostiff.elastostatics import scaling
from robostiff.kinematics.spanning_tree import independent_parts
from robostiff.linkage.driven import DrivenLinkage
from robostiff.linkage.essential import network_of, placed_branches
from robostiff.linkage.linkage import Configuration, Connection, moved_bodies
from robostiff.model import Joint, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record, usual_size
from robostiff.recorded.circulation import BodyChain, circulating
from robostiff.recorded.closure import RecordedClosure, steps_from_home
from robostiff.recorded.elimination import WorkingFrame
from robostiff.recorded.factor import factors_of
from robostiff.recorded.guess import with_nominal
from robostiff.recorded.leg import LegRecorder, at_samples, stiffness_entries
from robostiff.recorded.newton_step import openings, step_of_groups
from robostiff.recorded.parameters import parameter_samples, with_inputs
from robostiff.recorded.robot import RecordedRobot
from robostiff.spatial import Space


def record_linkage_closure(
    driven: DrivenLinkage, samples: Sequence[Configuration]
) -> tuple[RecordedClosure | None, tuple[str, ...]]:
    """Record the closure of a linkage from coordinates of its drives; as `record_linkage`.

    None where home is singular, or joints that resist are left undetermined. Passive joints that no
    loop determines, as of a rod that spins, stay where they are at home.
    """
    part, length = driven.part, driven.home.length
    following = driven.following(samples)
    closed = [*samples, driven.home]  # the last one is home: a pivot that vanishes there is none
    given = coordinates_in(driven.driving, closed) | with_nominal(part)
    state = coordinates_in(following, closed)
    record = Record({**given, **state})
    bodies = moved_bodies(part)
    q = coordinates(driven, record, (*driven.driving, *following))
    tree, moving = bodies.tree, {}
    for c in following:
        rates = ({name: 1} for name in c.coordinate_names)
        moving |= zip(bodies.places[c.name][0], rates, strict=True)
    found = [*openings(tree, tree.placed(bodies.row(q)), moving, length)]
    unknowns = [name for rates in moving.values() for name in rates]
    parts = independent_parts(unknowns, [opening.rates for opening in found])
    groups = [([found[k] for k in loops], names) for names, loops in parts]
    joints = [
        (c.element, c.coordinate_names, q[c.name] * bodies.places[c.name][1], c.freedoms)
        for c in following
        if isinstance(c.element, Joint)
    ]
    step = step_of_groups(groups, {}, joints, length)
    # A spherical joint that is passed backwards turns the other way.
    signs = {name: bodies.places[c.name][1] for c in following for name in c.coordinate_names}
    step = replace(step, steps={name: x * signs[name] for name, x in step.steps.items()})
    undetermined = tuple(step.undetermined)
    passive = {name for c in following if c.is_passive for name in c.coordinate_names}
    if not passive.issuperset(undetermined):
        return None, undetermined
    inputs = {name: record.input(name) for name in (*given, *state)}
    start = {name: float(values[-1]) for name, values in state.items()}
    return steps_from_home(record, tuple(given), start, step, inputs), undetermined


def coordinates(
    driven: DrivenLinkage, record: Record, moving: Sequence[Connection]
) -> dict[str, np.ndarray]:
    """Coordinates of all connections: inputs of a record, or as at home."""
    q: dict[str, np.ndarray] = dict(driven.home.coordinates)
    for c in moving:
        q[c.name] = np.array([record.input(name) for name in c.coordinate_names], dtype=object)
    return q


def coordinates_in(
    connections: Sequence[Connection], closed: Sequence[Configuration]
) -> dict[str, np.ndarray]:
    """Coordinates of connections in some configurations (samples,), by their own names."""
    return {
        name: np.array([float(one.coordinates[c.name][k]) for one in closed])
        for c in connections
        for k, name in enumerate(c.coordinate_names)
    }


# A smallest stiffness below this part of the largest is watched the more closely, so that a loss of
# 1e4 stays above the ratio of 1e-10 at which `Tolerance` doubts.
_SOFT = 1e-6
_ROUNDING = 1e-11  # of a wrench: what elimination leaves of zero


def record_linkage(
    driven: DrivenLinkage, samples: Sequence[Configuration]
) -> tuple[RecordedRobot | None, tuple[str, ...]]:
    """Record the stiffness of a linkage; inputs are the coordinates of its drives, then symbols.

    All ways to hold the platform are those of one leg. None where the closure has no record; the
    second result are coordinates that no loop determines. A transmitted wrench that meets no
    compliance is an `InputError`.
    """
    closure, undetermined = record_linkage_closure(driven, samples)
    if closure is None:
        return None, undetermined
    movers = [*driven.driving, *driven.following(samples)]
    record = Record(coordinates_in(movers, samples) | parameter_samples(driven.part))
    part = with_inputs(driven.part, record)
    moved = {c.name for c in movers}
    moving = [c for c in part.connections if c.name in moved]
    bodies, q = moved_bodies(part), coordinates(driven, record, moving)
    placed = bodies.tree.placed(bodies.row(q))
    R, p = placed.at(bodies.frames[part.platform])
    reference = p + R @ part.reference_point
    reference = np.array([record.simplify(x, driven.home.length) for x in reference])
    network = network_of(driven.part.numeric, driven.home)
    length = network.characteristic_length or driven.home.length
    recorder = LegRecorder(record, reference, Space.SPATIAL, length)

    def start_of(c: Connection) -> tuple[np.ndarray, np.ndarray]:
        return placed.at(bodies.frames[c.a].to(c.before.R, c.before.p))

    legs = []
    for a, b, path in placed_branches(part, q, start_of):
        elements = [e for _, chain in path for e in chain.parts]
        legs.append((a, b, PlacedLeg(path[0][0].name, _simple(elements, recorder), reference)))
    legs.sort(key=lambda leg: sum(f.is_passive for f in leg[2].freedoms))
    chains = [BodyChain(leg.name, a, b, leg) for a, b, leg in legs]
    world = WorkingFrame(np.eye(3, dtype=int).astype(object), reference)
    leg = circulating(part.name, chains, part.base, part.platform, recorder, world)
    K = stiffness_entries([leg], 6)
    recorded = RecordedRobot(
        name=part.name,
        record=record,
        space=Space.SPATIAL,
        length=length,
        legs=(leg,),
        K=K,
        reach=(),
        closure_losses=tuple(_near_softness(K, length, record.count)),
        limits=(),
        joints=closure.joints,
        closure=closure,
    )
    return recorded, undetermined


def _near_softness(K: dict[tuple[int, int], Any], length: float, count: int) -> list[Any]:
    """By how much K is nearer to a free motion than at the samples, where it is near there."""
    factors = factors_of(K, 6)
    places = list(combinations_with_replacement(range(6), 2))
    upper = at_samples([K[place] for place in places], count)
    unit = np.zeros((count, 6, 6))
    for number, (i, j) in enumerate(places):
        unit[:, i, j] = unit[:, j, i] = upper[:, number]
    scale = scaling(np.array(length), Space.SPATIAL)
    unit /= np.outer(scale, scale)
    size = np.sqrt(np.einsum("sii->si", unit))
    size = np.maximum(size, _ROUNDING * np.max(size, axis=1, keepdims=True))
    unit /= size[:, :, None] * size[:, None, :]
    # As the network decides: the smallest eigenvalue that is held, at a unit diagonal.
    ratio = float(np.min(np.linalg.eigvalsh(unit)[:, 6 - factors.rank])) if factors.rank else 1.0
    if not 0 < ratio < _SOFT:
        return []
    return [_SOFT / ratio * usual_size(d) / d for d in factors.d if isinstance(d, Entry)]


def _simple(
    elements: Sequence[PlacedFreedom | PlacedSpring], recorder: LegRecorder
) -> tuple[PlacedFreedom | PlacedSpring, ...]:
    """Elements in the world, their entries as simple as they are at the samples."""
    record, length = recorder.record, recorder.length

    def plain(x: np.ndarray, size: float = 1.0) -> np.ndarray:
        flat = [record.simplify(one, size) for one in x.ravel()]
        return np.array(flat, dtype=object).reshape(x.shape)

    return tuple(
        replace(e, axis=plain(e.axis), point=plain(e.point, length))
        if isinstance(e, PlacedFreedom)
        else replace(e, rotation=plain(e.rotation), point=plain(e.point, length))
        for e in elements
    )

"""The stiffness of a linkage as a record: wrenches that circulate in its loops, and their energy.

Bodies that more than two connections meet are joined by chains. The platform is loaded against the
base, which closes one more loop. Wrenches in equilibrium circulate: every chain outside of a
spanning tree has wrenches of its own, as the leg of a robot has, and chains of the tree carry sums
of these, which their passive joints restrict. K follows from the energy of what is left.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.elastostatics import scaling
from robostiff.linkage.bodies import Bodies, spanning_tree
from robostiff.linkage.closure import Configuration
from robostiff.linkage.driven import (
    DrivenLinkage,
    coordinates,
    record_linkage_closure,
    sampled_coordinates,
)
from robostiff.linkage.essential import network_of
from robostiff.linkage.linkage import Connection, Linkage
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record, most_size, usual_size
from robostiff.recorded.elimination import (
    Carried,
    Column,
    carried_by,
    dot,
    made_conjugate,
    times,
    transmitted_by,
    wrench_size,
)
from robostiff.recorded.factor import factors_of
from robostiff.recorded.leg import (
    LegRecorder,
    RecordedLeg,
    at_samples,
    lower_bound,
    stiffness_entries,
)
from robostiff.recorded.parameters import parameter_samples, with_inputs
from robostiff.recorded.robot import RecordedRobot
from robostiff.recorded.working_frame import (
    LocalLeg,
    WorkingFrame,
    energy_of,
    local_leg,
    to_world,
)
from robostiff.spatial import Frame, Space

_ROWS = Space.SPATIAL.rows
_LOAD = "the load of the platform"  # closes one more loop, as a connection of base and platform
# Part of its usual size that a compliance must never fall below for it not to be watched.
_ENOUGH = 1e-4
# A smallest stiffness below this part of the largest is watched the more closely, so that a loss of
# 1e4 stays above the ratio of 1e-10 at which `Tolerance` doubts.
_SOFT = 1e-6
_ROUNDING = 1e-11  # of a wrench: what elimination leaves of zero


@dataclass(frozen=True)
class _Flow:
    """A chain, its wrenches about the reference point in world axes, and their energy."""

    name: str
    wrenches: list[Column]
    carried: Carried


def record_linkage(
    driven: DrivenLinkage, samples: Sequence[Configuration]
) -> tuple[RecordedRobot | None, tuple[str, ...]]:
    """Record the stiffness of a linkage; inputs are the coordinates of its drives, then symbols.

    All ways to hold the platform are those of one leg. None where the closure has no record; the
    second result are coordinates that no loop determines. A transmitted wrench that meets no
    compliance is an `InputError`.

    Examples
    --------
    >>> from robostiff.robots.descriptions import load_linkage
    >>> driven = DrivenLinkage.of(load_linkage("double-pantograph"))
    >>> recorded, undetermined = record_linkage(driven, driven.samples())
    >>> recorded.closure.inputs, recorded.factors.rank, undetermined
    (('screw',), 6, ())
    """
    closure, undetermined = record_linkage_closure(driven, samples)
    if closure is None:
        return None, undetermined
    parameters = parameter_samples(driven.part)
    record = Record(sampled_coordinates(driven, samples) | parameters)
    part = with_inputs(driven.part, record)
    moved = {*driven.drives, *(c.name for c in driven.following(samples))}
    moving = [c for c in part.connections if c.name in moved]
    bodies = Bodies.of(spanning_tree(part), coordinates(driven, record, moving))
    reference = bodies.frames[part.platform].at(Frame(np.eye(3), part.reference_point)).p
    reference = np.array([record.simplified(x, driven.home.length) for x in reference])
    length = (
        network_of(driven.part.numeric, driven.home).characteristic_length or driven.home.length
    )
    recorder = LegRecorder(record, reference, Space.SPATIAL, length)
    leg = _Circulation(part, bodies, recorder).leg
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
    upper = at_samples([K[i, j] for i, j in _upper(6)], count)
    unit = np.zeros((count, 6, 6))
    for place, (i, j) in enumerate(_upper(6)):
        unit[:, i, j] = unit[:, j, i] = upper[:, place]
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


@dataclass(frozen=True)
class _Circulation:
    """Wrenches in the loops of a linkage."""

    part: Linkage
    bodies: Bodies
    recorder: LegRecorder

    @property
    def leg(self) -> RecordedLeg:
        """All ways to hold the platform, as those of one leg from base to platform."""
        placed = {name: self._placed(name, own) for name, (_, _, own) in self._chains.items()}
        tree = spanning_tree(self._graph(placed))
        # A load leads from the base to the platform, along the first edge of the tree.
        flows = [self._flow(placed[cut.name]) for cut in tree.cuts]
        signs = [{c.name: sign for c, sign in tree.around(cut)[1:]} for cut in tree.cuts]
        starts = np.cumsum([0, *(len(flow.wrenches) for flow in flows)]).tolist()
        scale = [1.0, 1.0, 1.0, *[self.recorder.length] * 3]
        columns: list[Column] = []
        for flow, sign in zip(flows, signs, strict=True):
            for w in flow.wrenches:
                # What the loop carries over the load's edge is the opposite of the load.
                load = [x * int(-sign[_LOAD]) for x in w] if _LOAD in sign else [0] * 6
                own = [int(len(columns) == i) for i in range(starts[-1])]
                columns.append([*load, *own])
        world = WorkingFrame(np.eye(3, dtype=int).astype(object), self.recorder.reference)
        inner = {
            name: local_leg(leg, world, self.recorder.record, self.recorder.length)
            for name, leg in placed.items()
            if any(name in sign for sign in signs)
        }
        all_wrenches = [w for flow in flows for w in flow.wrenches]
        over: dict[str, list[Column]] = {}
        for name in inner:
            over[name] = [
                [x * int(sign[name]) for x in w] if name in sign else [0] * 6
                for flow, sign in zip(flows, signs, strict=True)
                for w in flow.wrenches
            ]
        conditions = [
            [*[0] * 6, *(dot(twist, w) for w in over[name])]
            for name, local in inner.items()
            for twist in local.twists
        ]
        scale += [1.0 / wrench_size(w, scale) for w in all_wrenches]
        found = transmitted_by(conditions, columns, scale)
        energy = self._energy(flows, starts, inner, over, found.wrenches)
        ways = [_without_rounding(way, scale) for way in found.wrenches]
        conjugate = made_conjugate(ways, energy, self.part.name)
        return RecordedLeg(
            name=self.part.name,
            wrenches=conjugate.wrenches,
            mu=conjugate.mu,
            losses=[
                *(loss for flow in flows for loss in flow.carried.losses),
                *found.losses,
                *conjugate.losses,
                *self._near_rigid(conjugate.mu),
            ],
            redundant=(*(r for flow in flows for r in flow.carried.redundant), *found.redundant),
            frame=0,
            basis=ways,
            energy=energy,
        )

    @cached_property
    def _chains(self) -> dict[str, tuple[str, str, list[Connection]]]:
        """From and to bodies at which the linkage branches; by the name of the first connection."""
        at: dict[str, list[Connection]] = {}
        for c in self.part.connections:
            at.setdefault(c.a, []).append(c)
            at.setdefault(c.b, []).append(c)
        ends = {self.part.base, self.part.platform}
        branching = {body for body, own in at.items() if len(own) != 2} | ends
        found: dict[str, tuple[str, str, list[Connection]]] = {}
        seen: set[str] = set()
        for start in (body for body in at if body in branching):
            for first in at[start]:
                if first.name in seen:
                    continue
                chain, body, step = [first], start, first
                while True:
                    body = step.b if step.a == body else step.a
                    if body in branching:
                        break
                    (step,) = (c for c in at[body] if c is not step)
                    chain.append(step)
                seen |= {c.name for c in chain}
                found[first.name] = start, body, chain
        return found

    def _placed(self, name: str, chain: Sequence[Connection]) -> PlacedLeg:
        elements: list[PlacedFreedom | PlacedSpring] = []
        for c in chain:
            elements += self.bodies.placed(c).parts
        record = self.recorder.record

        def plain(x: np.ndarray, size: float = 1.0) -> np.ndarray:
            flat = [record.simplified(one, size) for one in x.ravel()]
            return np.array(flat, dtype=object).reshape(x.shape)

        length = self.recorder.length
        simple = [
            replace(e, axis=plain(e.axis), point=plain(e.point, length))
            if isinstance(e, PlacedFreedom)
            else replace(e, rotation=plain(e.rotation), point=plain(e.point, length))
            for e in elements
        ]
        return PlacedLeg(name, tuple(simple), self.recorder.reference)

    def _graph(self, placed: dict[str, PlacedLeg]) -> Linkage:
        """Chains as connections: that of the load, then those with few passive freedoms."""
        I = Frame.identity()
        order = sorted(placed, key=lambda name: sum(f.is_passive for f in placed[name].freedoms))
        edges = [Connection(_LOAD, self.part.base, self.part.platform, I, None, I)]
        for name in order:
            a, b, _ = self._chains[name]
            edges.append(Connection(name, a, b, I, None, I))
        return replace(self.part, connections=tuple(edges), held=frozenset())

    def _flow(self, leg: PlacedLeg) -> _Flow:
        """A chain of its own wrenches, in the frame in which these are shortest."""
        recorder, tried = self.recorder, []
        for frame, local in recorder.promising(leg):
            carried = carried_by(local, _ROWS, recorder.length)
            wrenches = [to_world(w, frame, recorder.reference, _ROWS) for w in carried.wrenches]
            entries = [x for row in (*wrenches, *carried.energy) for x in row]
            cost = recorder.record.cost(x.step for x in entries if isinstance(x, Entry))
            tried.append((cost, len(tried), _Flow(leg.name, wrenches, carried)))
        return min(tried)[2]

    def _energy(
        self,
        flows: Sequence[_Flow],
        starts: Sequence[int],
        inner: dict[str, LocalLeg],
        over: dict[str, list[Column]],
        ways: Sequence[Column],
    ) -> list[list[Any]]:
        """Of the ways: chains of their own in their own share, those of the tree in the sums."""
        m = len(ways)
        energy: list[list[Any]] = [[0] * m for _ in range(m)]
        for flow, start in zip(flows, starts, strict=False):
            shares = [way[6 + start : 6 + start + len(flow.wrenches)] for way in ways]
            given = [times(flow.carried.energy, share) for share in shares]
            for i, j in _upper(m):
                energy[i][j] = energy[i][j] + dot(given[i], shares[j])
        for name, local in inner.items():
            sums = [[dot(way[6:], row) for row in zip(*over[name], strict=True)] for way in ways]
            own = energy_of(local, sums, _ROWS)
            for i, j in _upper(m):
                energy[i][j] = energy[i][j] + own[i][j]
        for i, j in _upper(m):
            energy[j][i] = energy[i][j]
        return energy

    def _near_rigid(self, mu: Sequence[Any]) -> list[Any]:
        """By how much wrenches are nearer to rigid than at the samples."""
        record = self.recorder.record
        return [
            usual_size(x) / x
            for x in mu
            if isinstance(x, Entry) and lower_bound(record, x.step) < _ENOUGH * usual_size(x)
        ]


def _without_rounding(way: Column, scale: Sequence[float]) -> Column:
    """What a way holds the platform by; what vanishes at all samples is 0, as closed loops have it.

    Free motions are no stiffness then, and internal stress holds nothing.
    """
    size = wrench_size(way, scale)
    return [
        0 if most_size(x) <= _ROUNDING * size * s else x
        for x, s in zip(way[:6], scale[:6], strict=True)
    ]


def _upper(size: int) -> Iterator[tuple[int, int]]:
    return ((i, j) for i in range(size) for j in range(i, size))

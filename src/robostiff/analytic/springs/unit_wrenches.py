"""Unit wrenches that a leg transmits: forces along lines of its parts, couples about their axes.

What a person would write down: the force along a rod, the couple across two joints' axes. They are
found at the samples of the record, where each of them does no work on any passive joint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import combinations, islice, pairwise
from math import comb
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.frozen import frozen, replace
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, square_root
from robostiff.recorded.elimination import WorkingFrame, cross, turned_back
from robostiff.recorded.leg import LegRecorder, SampledLeg, at_samples
from robostiff.spatial import Space

_SAME = 1e-10  # of a unit vector, or of the length
IDLE = 1e-9  # work on a passive joint, and coupling of two wrenches
_INDEPENDENT = 1e-6
_MOST = 1000  # bases that are compared


def _alike(vectors: np.ndarray, close: float, *, up_to_sign: bool) -> list[list[int]]:
    """Numbers of vectors (m, count, n) that are the same at all samples, perhaps up to a sign."""
    found, rest = [], np.arange(len(vectors))
    while len(rest):
        first, others = vectors[rest[0]], vectors[rest]
        is_same = np.abs(others - first).max(axis=(1, 2)) < close
        if up_to_sign:
            is_same |= np.abs(others + first).max(axis=(1, 2)) < close
        found.append(rest[is_same].tolist())
        rest = rest[~is_same]
    return found


@frozen(eq=False)
class UnitWrench:
    """A unit force along a line, or a unit couple."""

    direction: np.ndarray  # (3,): unit vector, world axes
    point: np.ndarray | None  # (3,): a point of the line of a force [m]; None for a couple

    def seen_from(self, place: WorkingFrame | np.ndarray, search: WrenchSearch) -> list[Any]:
        """Its six entries in a frame, about its origin, or about a point in world axes."""
        R, p = (place.R, place.p) if isinstance(place, WorkingFrame) else (None, place)
        e, simplified = self.direction, search.record.simplify
        turned = e if R is None else [simplified(x) for x in turned_back(R, e)]
        if self.point is None:
            return [0, 0, 0, *turned]
        moment = cross(self.point - p, e)
        moment = moment if R is None else turned_back(R, moment)
        return [*turned, *(simplified(x, search.length) for x in moment)]

    def work_on(self, freedom: PlacedFreedom, search: WrenchSearch) -> Any:
        """Work on a unit motion of a joint."""
        at = freedom.point if self.point is None else self.point
        twist = freedom.twist(np.asarray(at, dtype=object))
        part = twist[3:] if self.point is None else twist[:3]
        total = part[0] * self.direction[0] + part[1] * self.direction[1]
        return search.record.simplify(total + part[2] * self.direction[2], search.length)


@frozen
class Basis:
    """Unit wrenches of a leg and how they share energy."""

    wrenches: tuple[UnitWrench, ...]  # couples before forces, the least coupled first
    compliance: np.ndarray  # (count, m, m): W^T C W at the samples

    @property
    def coupled(self) -> np.ndarray:
        """Which of its wrenches share energy (m, m)."""
        A = np.abs(self.compliance)
        sizes = np.sqrt(np.einsum("naa,nbb->nab", A, A))
        return np.max(A / np.where(sizes > 0, sizes, 1), axis=0) > IDLE

    @property
    def couplings(self) -> int:
        """How many pairs of its wrenches share energy."""
        return int(np.sum(np.triu(self.coupled, 1)))


@frozen
class WrenchSearch(LegRecorder):
    """Finds a basis of unit wrenches of which few or none share energy."""

    @classmethod
    def of(cls, placed: PlacedRobot) -> WrenchSearch:
        """For the legs of a robot."""
        return cls(placed.record, placed.reference, placed.entries.space, placed.length)

    def basis(self, leg: PlacedLeg) -> Basis | None:
        """The simplest basis of what the passive joints transmit; None where none is found."""
        if any(s.elasticity.freedoms.shape[1] for s in leg.springs):
            return None
        sample = self.sampled(leg)
        if sample.transmitted is None:
            return None
        if sample.transmitted == 0:
            return Basis((), sample.C[:, :0, :0])
        places = self._transmitted(leg, sample)
        if len(places) < sample.transmitted:
            return None
        m = sample.transmitted
        found = list[_PlacedWrench]()
        for alike in places:
            each = []
            for one in alike:
                entries = one.wrench.seen_from(self.reference, self)
                for part in leg.parts:
                    if isinstance(part, PlacedSpring):
                        frame = WorkingFrame(part.rotation, part.point)
                        entries += one.wrench.seen_from(frame, self)
                    elif part.stiffness is not None:
                        entries.append(one.wrench.work_on(part, self))
                used = [x for x in entries if isinstance(x, Entry)]
                numbers = sum(not isinstance(x, Entry) and x != 0 for x in entries)
                steps = self.record.cost(x.step for x in used)
                each.append(replace(one, cost=10 * steps + 10 * len(used) + numbers))
            found.append(min(each, key=lambda one: one.cost))
        count = m
        while count < len(found) and comb(count + 1, m) <= _MOST:
            count += 1
        return _fewest_couplings(sorted(found, key=lambda one: one.cost)[:count], sample)

    def of_wrenches(self, leg: PlacedLeg, wrenches: tuple[UnitWrench, ...]) -> Basis | None:
        """A basis of given wrenches; None where they are none of what a leg transmits."""
        sample, count = self.sampled(leg), self.record.count
        if sample.transmitted != len(wrenches):
            return None
        each = [w.seen_from(self.reference, self) for w in wrenches]
        W = np.stack([at_samples(w, count) / self.scale for w in each], axis=1)
        W = W[:, :, self.space.rows]
        does_work = sample.J.size and np.max(np.abs(W @ sample.J)) > IDLE * np.max(np.abs(W))
        if does_work or np.min(np.linalg.svd(W, compute_uv=False)) < _INDEPENDENT:
            return None
        return Basis(wrenches, W @ sample.C @ np.swapaxes(W, 1, 2))

    def _transmitted(self, leg: PlacedLeg, sample: SampledLeg) -> list[list[_PlacedWrench]]:
        """Unit wrenches that do no work on passive joints, alike ones together."""
        directions = self._different(_directions(leg, self.record.count), 1.0, up_to_sign=True)
        points = self._different(_points(leg, self.record.count), self.length, up_to_sign=False)
        reference = at_samples(self.reference, self.record.count)
        d = np.array([at for _, at in directions])  # (directions, samples, 3)
        p = np.array([at for _, at in points]) - reference
        # A couple about each direction, and forces along it through all points.
        w = np.zeros((len(d), 1 + len(p), self.record.count, 6))
        w[:, 0, :, 3:] = d
        w[:, 1:, :, :3] = d[:, None]
        w[:, 1:, :, 3:] = np.cross(p[None], d[:, None])
        fits = np.ones(w.shape[:2], dtype=bool)
        if self.space is Space.PLANAR:
            fits[:, 0] = np.max(np.abs(d[:, :, :2]), axis=(1, 2)) <= _SAME
            fits[:, 1:] = (np.max(np.abs(d[:, :, 2:]), axis=(1, 2)) <= _SAME)[:, None]
        scaled = (w / self.scale)[..., self.space.rows]
        sizes = np.linalg.norm(scaled, axis=-1)
        scaled = scaled / np.where(sizes > 0, sizes, 1)[..., None]
        if sample.J.shape[2]:
            work = np.abs(np.einsum("dpni,nij->dpnj", scaled, sample.J))
            fits &= np.max(work, axis=(2, 3)) <= IDLE
        places = np.argwhere(fits)
        each = [
            _PlacedWrench(
                UnitWrench(directions[i][0], points[j - 1][0] if j else None),
                scaled[i, j],
                sizes[i, j],
            )
            for i, j in places
        ]
        alike = _alike(scaled[fits], _SAME, up_to_sign=True)
        return [[each[k] for k in group] for group in alike]

    def _different(
        self, vectors: Iterator[_Vector], scale: float, *, up_to_sign: bool
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Vectors with their samples, each once; only these are written."""
        each = [*vectors]
        found: list[tuple[np.ndarray, np.ndarray]] = []
        for group in _alike(np.array([at for at, _ in each]), _SAME * scale, up_to_sign=up_to_sign):
            written = ((vector, each[i][0]) for i in group if (vector := each[i][1]()) is not None)
            for vector, at in islice(written, 1):
                simpler = [self.record.simplify(x, scale) for x in vector]
                found.append((np.array(simpler, dtype=object), at))
        return found


@frozen
class _PlacedWrench:
    """A unit wrench, its direction among scaled wrenches, its length there, and what it costs."""

    wrench: UnitWrench
    scaled: np.ndarray
    size: np.ndarray
    cost: int = 0


def _fewest_couplings(pool: Sequence[_PlacedWrench], sample: SampledLeg) -> Basis | None:
    """Independent wrenches with the fewest couplings, cheap ones first."""
    m = sample.transmitted or 0
    best: tuple[tuple[int, int], Basis] | None = None
    for chosen in combinations(pool, m):
        W = np.stack([one.scaled for one in chosen], axis=1)
        if np.min(np.linalg.svd(W, compute_uv=False)) < _INDEPENDENT:
            continue
        A = W @ sample.C @ np.swapaxes(W, 1, 2)
        sizes = np.sqrt(np.maximum(np.einsum("naa->na", A), 0))
        if np.min(sizes) <= 0:
            return None
        shared = np.max(np.abs(A) / (sizes[:, :, None] * sizes[:, None, :]), axis=0) > IDLE
        rank = int(np.sum(shared)) - m, sum(one.cost for one in chosen)
        if best is not None and rank >= best[0]:
            continue
        wrenches = [one.wrench for one in chosen]
        of_units = np.stack([one.size for one in chosen], axis=1)
        A = A * of_units[:, :, None] * of_units[:, None, :]
        order = sorted(range(m), key=lambda i: (wrenches[i].point is not None, np.sum(shared[i])))
        best = rank, Basis(tuple(wrenches[i] for i in order), A[:, order][:, :, order])
        if rank[0] == 0:
            break
    return None if best is None else best[1]


#: A vector at the samples (count, 3), and a function that writes its entries, None for none.
_Vector = tuple[np.ndarray, Callable[[], Any]]


def _known(vector: Any, count: int) -> _Vector:
    entries = np.asarray(vector, dtype=object)
    return at_samples(entries, count), lambda: entries


def _across(a: _Vector, b: _Vector) -> _Vector:
    """The cross product, several times as fast as np.cross for few samples."""

    def write() -> np.ndarray | None:
        both = a[1](), b[1]()
        return None if both[0] is None or both[1] is None else np.array(cross(*both), dtype=object)

    (x, y, z), (u, v, w) = a[0].T, b[0].T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1), write


def _unit(a: _Vector) -> _Vector | None:
    """The unit vector along another; None where that is zero."""
    size = np.linalg.norm(a[0], axis=1)
    if np.min(size) <= _SAME:
        return None

    @cache
    def write() -> np.ndarray | None:
        between = a[1]()
        if between is None:
            return None
        square = between @ between
        if not isinstance(square, Entry):
            return between / square_root(square) if float(square) > 0 else None
        record = square.record
        at = at_samples(between, record.count)
        least = np.min(np.abs(at), axis=0)
        first = int(np.argmax(least))
        if least[first] > 0 and np.max(np.ptp(at / at[:, [first]], axis=0)) < _SAME:
            ratios = [record.simplify(x / between[first]) for x in between]
            ratios = np.array(ratios, dtype=object)
            if not any(isinstance(x, Entry) for x in ratios):
                return ratios * int(np.sign(at[0, first])) / sp.sqrt(sp.sympify(ratios @ ratios))
        length = record.simplify(square_root(square))
        if not isinstance(length, Entry):
            return between if length == 1 else None
        if np.min(length.sample) <= _SAME:
            return None
        return np.array([x / length for x in between], dtype=object)

    return a[0] / size[:, None], write


def _are_square(a: _Vector, b: _Vector) -> bool:
    return bool(np.abs((a[0] * b[0]).sum(axis=1)).max() < _SAME)


def _between(a: _Vector, b: _Vector) -> _Vector:
    return b[0] - a[0], lambda: b[1]() - a[1]()


def _directions(leg: PlacedLeg, count: int) -> Iterator[_Vector]:
    """Axes of springs and joints, lines between joints, and what is square to two axes."""
    for spring in leg.springs:
        for axis in np.asarray(spring.rotation, dtype=object).T:
            yield _known(axis, count)
    axes = [_known(freedom.axis, count) for freedom in leg.freedoms]
    yield from axes
    for a, b in combinations(axes, 2):
        if _are_square(a, b):
            yield _across(a, b)
    yield from _lines(leg, count)


def _lines(leg: PlacedLeg, count: int) -> Iterator[_Vector]:
    """Lines between parts, and of parallel branches the axes about which they hold together."""
    points = [_known(part.point, count) for part in leg.own_parts]
    for block in leg.blocks:
        for branch in block.branches:
            yield from _lines(branch, count)
    yield from _levers(leg, count)
    axes = [_known(f.axis, count) for f in leg.own_parts if isinstance(f, PlacedFreedom)]
    # Cosines, the simplest formulas of what parts feel, are written: first those between axes.
    for a, b in combinations(axes, 2):
        _ = a[1]() @ b[1]()
    each = (_unit(_between(a, b)) for a, b in combinations(points, 2))
    units = [unit for unit in each if unit is not None]
    for first, *_ in _alike(np.array([at for at, _ in units]), _SAME, up_to_sign=True):
        if (direction := units[first][1]()) is not None:
            _ = [direction @ axis[1]() for axis in axes]
    for unit in units:
        yield unit
        yield from (_across(unit, axis) for axis in axes if _are_square(unit, axis))


def _levers(leg: PlacedLeg, count: int) -> Iterator[_Vector]:
    """Axes of couples of parallel branches, and those in the plane of two across a joint."""
    for block in leg.blocks:
        inner = [lever for branch in block.branches for lever in _levers(branch, count)]
        starts = [next(_points(branch, count), None) for branch in block.branches]
        for a, b in combinations([p for p in starts if p is not None], 2):
            for spring in block.branches[0].springs:
                lever = _across(_between(a, b), _known(spring.rotation[:, 0], count))
                if (unit := _unit(lever)) is not None:
                    yield unit
        joints = [f for f in leg.own_parts if isinstance(f, PlacedFreedom) and f.is_passive]
        for a, b in combinations(inner, 2):
            for joint in joints:
                spared = _across(_across(a, b), _known(joint.axis, count))
                if (unit := _unit(spared)) is not None:
                    yield unit


def _points(leg: PlacedLeg, count: int) -> Iterator[_Vector]:
    """Places of parts, the middles between neighbours, and those between parallel branches."""
    own = [_known(part.point, count) for part in leg.own_parts]
    yield from own
    yield from (_middle(pair) for pair in pairwise(own))
    for block in leg.blocks:
        branches = [list(_points(branch, count)) for branch in block.branches]
        for points in branches:
            yield from points
        for places in zip(*branches, strict=False):
            yield _middle(places)


def _middle(points: Sequence[_Vector]) -> _Vector:
    at = np.mean([p for p, _ in points], axis=0)
    return at, lambda: np.sum([write() for _, write in points], axis=0) / sp.Integer(len(points))

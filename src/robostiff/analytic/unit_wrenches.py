"""Unit wrenches that a leg transmits: forces along lines of its parts, couples about their axes.

What a person would write down: the force along a rod, the couple across two joints' axes. They are
found at the samples of the record, where each of them does no work on any passive joint.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from robostiff.kinematics.jacobians import freedom_twist
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record, square_root
from robostiff.recorded.working_frame import cross, turned_back
from robostiff.spatial import Space

_SAME = 1e-10  # of a unit vector, or of the length
_IDLE = 1e-9  # work on a passive joint, and coupling of two wrenches
_INDEPENDENT = 1e-6
_RANK = 1e-7
_MOST = 12  # wrenches that are combined to a basis


def sampled(values: Any, count: int) -> np.ndarray:
    """Entries and numbers at the samples of their record, (count, ...)."""
    array = np.asarray(values, dtype=object)
    flat = [x.sample if isinstance(x, Entry) else np.full(count, float(x)) for x in array.flat]
    return np.array(flat).T.reshape(count, *array.shape)


@dataclass(frozen=True, eq=False)
class UnitWrench:
    """A unit force along a line, or a unit couple.

    Attributes
    ----------
    direction : (3,) array
        Unit vector, world axes.
    point : (3,) array or None
        A point of the line of a force [m]; None for a couple.
    """

    direction: np.ndarray
    point: np.ndarray | None

    def about(self, reference: np.ndarray, record: Record, length: float) -> list[Any]:
        """Its six entries about a point, world axes."""
        if self.point is None:
            return [0, 0, 0, *self.direction]
        moment = cross(self.point - reference, self.direction)
        return [*self.direction, *(record.simplified(x, length) for x in moment)]

    def felt_by(self, spring: PlacedSpring, record: Record, length: float) -> list[Any]:
        """Force and moment at an elastic part, in its own axes."""
        R = spring.rotation
        turned = [record.simplified(x) for x in turned_back(R, self.direction)]
        if self.point is None:
            return [0, 0, 0, *turned]
        moment = turned_back(R, cross(self.point - spring.point, self.direction))
        return [*turned, *(record.simplified(x, length) for x in moment)]

    def work_on(self, freedom: PlacedFreedom, record: Record, length: float) -> Any:
        """Work on a unit motion of a joint."""
        at = freedom.point if self.point is None else self.point
        twist = freedom_twist(freedom, np.asarray(at, dtype=object))
        part = twist[3:] if self.point is None else twist[:3]
        total = part[0] * self.direction[0] + part[1] * self.direction[1]
        return record.simplified(total + part[2] * self.direction[2], length)


@dataclass(frozen=True)
class WrenchSearch:
    """Finds a basis of unit wrenches that share no energy.

    Attributes
    ----------
    record : Record
    reference : (3,) array
        Reference point, entries or numbers.
    space : Space
    length : float
        Characteristic length [m].
    """

    record: Record
    reference: np.ndarray
    space: Space
    length: float

    def basis(self, leg: PlacedLeg) -> tuple[UnitWrench, ...] | None:
        """The simplest basis of what the passive joints transmit; None where none is found."""
        if leg.blocks or any(s.elasticity.freedoms.shape[1] for s in leg.springs):
            return None
        own = _SampledLeg.of(leg, self)
        if own.transmitted is None:
            return None
        if own.transmitted == 0:
            return ()
        found = self._transmitted(leg, own)
        if len(found) < own.transmitted:
            return None
        cheapest = sorted(found, key=lambda pair: self._cost(leg, pair[0]))[:_MOST]
        return self._combined(cheapest, own)

    def redundant(self, leg: PlacedLeg) -> tuple[bool, ...]:
        """Which passive joints of a leg add no freedom to those before."""
        J = _SampledLeg.of(leg, self).J
        ranks = [0] + [
            int(np.max(np.linalg.matrix_rank(J[:, :, : k + 1], tol=_RANK)))
            for k in range(J.shape[2])
        ]
        return tuple(after == before for before, after in pairwise(ranks))

    def _transmitted(self, leg: PlacedLeg, own: _SampledLeg) -> list[tuple[UnitWrench, np.ndarray]]:
        """Different unit wrenches that do no work on passive joints, and their samples."""
        directions = self._different(_directions(leg), 1.0, up_to_sign=True)
        points = self._different(_points(leg), self.length, up_to_sign=False)
        found: list[tuple[UnitWrench, np.ndarray]] = []
        seen: list[np.ndarray] = []
        planar = self.space is Space.PLANAR
        for (d, d_at), place in [(d, p) for d in directions for p in (None, *points)]:
            out_of_plane = np.max(np.abs(d_at[:, :2] if place is None else d_at[:, 2:]))
            if planar and out_of_plane > _SAME:
                continue
            if place is None:
                w = np.hstack([np.zeros_like(d_at), d_at * self.length])
            else:
                w = np.hstack([d_at, np.cross(place[1] - own.reference, d_at)])
            scaled = (w / own.scale)[:, self.space.rows]
            scaled = scaled / np.linalg.norm(scaled, axis=1)[:, None]
            if own.J.shape[2] and np.max(np.abs(np.einsum("ni,nij->nj", scaled, own.J))) > _IDLE:
                continue
            alike = [k for k, s in enumerate(seen) if _alike(s, scaled)]
            wrench = UnitWrench(d, None if place is None else place[0])
            if not alike:
                seen.append(scaled)
                found.append((wrench, scaled))
            elif self._cost(leg, wrench) < self._cost(leg, found[alike[0]][0]):
                found[alike[0]] = (wrench, scaled)
        return found

    def _combined(
        self, pool: Sequence[tuple[UnitWrench, np.ndarray]], own: _SampledLeg
    ) -> tuple[UnitWrench, ...] | None:
        """The first independent ones without coupling, cheap ones first."""
        m = own.transmitted or 0
        for chosen in combinations(pool, m):
            W = np.stack([w for _, w in chosen], axis=1)
            if np.min(np.linalg.svd(W, compute_uv=False)) < _INDEPENDENT:
                continue
            A = np.einsum("nai,nij,nbj->nab", W, own.C, W)
            sizes = np.sqrt(np.einsum("naa->na", A))
            if np.min(sizes) <= 0:
                return None
            shared = A / (sizes[:, :, None] * sizes[:, None, :]) - np.eye(m)
            if np.max(np.abs(shared)) < _IDLE:
                # Forces before couples.
                return tuple(sorted((w for w, _ in chosen), key=lambda w: w.point is None))
        return None

    def _cost(self, leg: PlacedLeg, wrench: UnitWrench) -> int:
        record, length = self.record, self.length
        entries = wrench.about(self.reference, record, length)
        for part in leg.parts:
            if isinstance(part, PlacedSpring):
                entries += wrench.felt_by(part, record, length)
            elif part.stiffness is not None:
                entries.append(wrench.work_on(part, record, length))
        used = [x for x in entries if isinstance(x, Entry)]
        plain = sum(not isinstance(x, Entry) and x != 0 for x in entries)
        return 10 * record.cost(x.step for x in used) + 10 * len(used) + plain

    def _different(
        self, vectors: Iterator[np.ndarray], scale: float, *, up_to_sign: bool
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Vectors with their samples, each once."""
        found: list[tuple[np.ndarray, np.ndarray]] = []
        for vector in vectors:
            simpler = np.array([self.record.simplified(x, scale) for x in vector], dtype=object)
            at = sampled(simpler, self.record.count)
            signs = (1, -1) if up_to_sign else (1,)
            if not any(
                np.max(np.abs(at - sign * other)) < _SAME * scale
                for _, other in found
                for sign in signs
            ):
                found.append((simpler, at))
        return found


@dataclass(frozen=True)
class _SampledLeg:
    """A leg at the samples: passive twists and compliance about the reference, scaled.

    Rotations count by the length, and so do moments, so that all entries compare.
    """

    reference: np.ndarray
    scale: np.ndarray
    J: np.ndarray
    C: np.ndarray
    transmitted: int | None

    @classmethod
    def of(cls, leg: PlacedLeg, search: WrenchSearch) -> _SampledLeg:
        count, rows = search.record.count, list(search.space.rows)
        reference = sampled(search.reference, count)
        scale = np.array([1.0] * 3 + [search.length] * 3)
        at = np.asarray(search.reference, dtype=object)
        C = np.zeros((count, 6, 6))
        columns = []
        for part in leg.parts:
            if isinstance(part, PlacedSpring):
                R, p = sampled(part.rotation, count), sampled(part.point, count)
                C += _moved(sampled(part.elasticity.compliance, count), R, p - reference)
            else:
                twist = sampled(freedom_twist(part, at), count)
                if part.is_passive:
                    columns.append(twist * np.where(np.arange(6) < 3, 1 / search.length, 1.0))
                elif part.stiffness is not None:
                    k = sampled([part.stiffness], count)
                    C += twist[:, :, None] * twist[:, None, :] / k[:, :, None]
        # Twists by shifts over the length, wrenches by moments over the length: their work stays.
        J = np.zeros((count, len(rows), 0))
        if columns:
            J = np.stack(columns, axis=2)[:, rows]
            J = J / np.linalg.norm(J, axis=1)[:, None, :]
        C = (C * scale[None, :, None] * scale[None, None, :])[:, rows][:, :, rows]
        ranks = {int(r) for r in np.linalg.matrix_rank(J, tol=_RANK)} if columns else {0}
        transmitted = len(rows) - ranks.pop() if len(ranks) == 1 else None
        return cls(reference, scale, J, C, transmitted)


def _moved(C: np.ndarray, R: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Compliances of parts in their own axes about a point that is -v from them, world axes."""
    count = len(C)
    felt = np.zeros((count, 6, 6))  # of a wrench about the reference, at the part
    felt[:, :3, :3] = felt[:, 3:, 3:] = np.swapaxes(R, 1, 2)
    lever = np.zeros((count, 3, 3))
    lever[:, 0, 1], lever[:, 0, 2], lever[:, 1, 2] = v[:, 2], -v[:, 1], v[:, 0]
    lever[:, 1, 0], lever[:, 2, 0], lever[:, 2, 1] = -v[:, 2], v[:, 1], -v[:, 0]
    felt[:, 3:, :3] = np.swapaxes(R, 1, 2) @ lever
    return np.swapaxes(felt, 1, 2) @ C @ felt


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    return any(bool(np.max(np.abs(a - sign * b)) < _SAME) for sign in (1, -1))


def _directions(leg: PlacedLeg) -> Iterator[np.ndarray]:
    """Axes of springs and joints, lines between joints, and what is square to two axes."""
    for spring in leg.springs:
        yield from np.asarray(spring.rotation, dtype=object).T
    axes = [np.asarray(freedom.axis, dtype=object) for freedom in leg.freedoms]
    yield from axes
    points = list(_points(leg))
    for a, b in combinations(points, 2):
        unit = _unit(b - a)
        if unit is not None:
            yield unit
    for a, b in combinations(axes, 2):
        if _is_square(a @ b):
            yield np.array(cross(a, b), dtype=object)


def _points(leg: PlacedLeg) -> Iterator[np.ndarray]:
    for part in leg.parts:
        yield np.asarray(part.point, dtype=object)


def _unit(between: np.ndarray) -> np.ndarray | None:
    """Unit vector between two points; None where they meet."""
    square = between @ between
    if not isinstance(square, Entry):
        return between / square_root(square) if float(square) > 0 else None
    length = square.record.simplified(square_root(square))
    if not isinstance(length, Entry):
        return between if length == 1 else None
    if np.min(length.sample) <= _SAME:
        return None
    return np.array([x / length for x in between], dtype=object)


def _is_square(cosine: Any) -> bool:
    size = np.max(np.abs(cosine.sample)) if isinstance(cosine, Entry) else abs(float(cosine))
    return bool(size < _SAME)

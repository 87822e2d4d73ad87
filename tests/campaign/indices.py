"""Stiffness indices by their definitions, in 60 digits, of bodies on springs between given points.

A body hangs on springs along lines through points with small whole coordinates, so that their
arrangement is exact: in general, through one point, parallel, in one plane, in two planes, fewer
than six. Stiffnesses differ by up to 10^`spread`. K is the sum of k (u, p x u)(u, p x u)^T, its
null space and its inverse on what is left are found by eigenvectors in `mpmath`. Eigenscrews and
centres have laws, in tests/analysis/indices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mpmath as mp
import numpy as np

import robostiff as rs
from robostiff.model import Actuated, Passive, PlacedFreedom, PlacedLeg, Snapshot
from robostiff.spatial import Space

KINDS = ("general", "few", "apex", "parallel", "plane", "two planes", "planar", "planar few")
_DIGITS = 60
_ZERO = mp.mpf(10) ** -35


@dataclass(frozen=True)
class Body:
    """A body on springs: places and directions in whole numbers, stiffnesses, a point."""

    kind: str
    lines: tuple[tuple[tuple[int, ...], tuple[int, ...], float], ...]
    point: tuple[int, ...]

    @property
    def is_planar(self) -> bool:
        return self.kind.startswith("planar")

    def snapshot(self) -> Snapshot:
        legs = []
        for number, (p, d, k) in enumerate(self.lines):
            u = np.array(d, dtype=float) / np.linalg.norm(d)
            tip, foot = np.array(p, dtype=float), np.array(p, dtype=float) - 3 * u
            axes = np.eye(3)[2:] if self.is_planar else np.eye(3)
            balls = [
                PlacedFreedom(axis, at, 0.0, f"{where}{j}", Passive())
                for where, at in (("foot", foot), ("tip", tip))
                for j, axis in enumerate(axes)
            ]
            drive = PlacedFreedom(u, foot, None, "drive", Actuated(k))
            legs.append(PlacedLeg(f"leg{number}", (drive, *balls), tip))
        space = Space.PLANAR if self.is_planar else Space.SPATIAL
        return Snapshot(self.kind, tuple(legs), np.array(self.point, dtype=float), space)

    def stiffness(self) -> Any:
        """K about the point, in 60 digits."""
        rows = (0, 1, 5) if self.is_planar else range(6)
        K = mp.zeros(len(rows))
        for p, d, k in self.lines:
            arm = [a - b for a, b in zip(p, self.point, strict=True)]
            size = mp.sqrt(sum(x * x for x in d))
            w = [*d, *np.cross(arm, d).tolist()]
            w = mp.matrix([mp.mpf(int(w[i])) / size for i in rows])
            K += mp.mpf(k) * w * w.T
        return K


def body(seed: int, spread: float = 6.0) -> Body:
    """A random body; its kind follows from the seed."""
    rng = np.random.default_rng([20261123, seed])
    kind = KINDS[seed % len(KINDS)]
    is_planar = kind.startswith("planar")
    count = int(rng.integers(1, 6)) if "few" in kind else int(rng.integers(6, 9))
    if is_planar:
        count = int(rng.integers(1, 3)) if "few" in kind else int(rng.integers(3, 5))

    def place() -> np.ndarray:
        return rng.integers(-4, 5, 3) * (1, 1, 0 if is_planar else 1)

    apex, along = place(), place()
    while not np.any(along):
        along = place()
    lines = []
    while len(lines) < count:
        p, d = place(), place()
        if kind == "apex":
            d = apex - p
        if kind == "parallel":
            d = along
        if kind == "plane":
            p[2], d[2] = 1, 0
        if kind == "two planes":
            p[2], d[2] = (1, 0) if len(lines) % 2 else (-2, 0)
        if np.any(d):
            k = float(10 ** rng.uniform(3, 3 + spread))
            lines.append((tuple(map(int, p)), tuple(map(int, d)), k))
    point = apex if rng.uniform() < 0.3 else place()
    return Body(kind, tuple(lines), tuple(map(int, point)))


def eigen(M: Any) -> tuple[list[Any], list[Any]]:
    """Ascending eigenvalues, rounding as zero, and eigenvectors of a symmetric matrix.

    Stiffnesses are above 100 N/m and points some metres apart: what is below is rounding.
    """
    values, vectors = mp.eigsy(M)
    own = [v if abs(v) > _ZERO else mp.mpf(0) for v in values]
    return own, [vectors[:, i] for i in range(M.rows)]


def pseudo_inverse(M: Any) -> Any:
    found = mp.zeros(M.rows)
    for value, e in zip(*eigen(M), strict=True):
        if value:
            found += e * e.T / value
    return found


class ByDefinition:
    """Indices of a matrix K about its point."""

    def __init__(self, K: Any, length: float) -> None:
        n = K.rows
        self.d = d = 3 if n == 6 else 2
        self.K = K
        S = mp.diag([1] * d + [mp.mpf(length)] * (n - d))
        self.S = S
        tt, tr, rr = K[:d, :d], K[:d, d:], K[d:, d:]
        self.held = tt, rr
        self.free = (tt - tr * pseudo_inverse(rr) * tr.T, rr - tr.T * pseudo_inverse(tt) * tr)
        inverse = S**-1
        self.scaled = eigen(inverse * K * inverse)[0]
        self.rank = sum(1 for v in self.scaled if v)

    def along(self, u: Any) -> tuple[Any, Any]:
        """Stiffness along u with all else free, and with all else held."""
        A, held = self.free[0], (u.T * self.held[0] * u)[0]
        compliance = mp.mpf(0)
        for value, e in zip(*eigen(A), strict=True):
            part = (e.T * u)[0]
            if not value:
                if abs(part) > _ZERO:
                    return mp.mpf(0), held
                continue
            compliance += part**2 / value
        return 1 / compliance, held


def compare(own: Body, *, length: float | None = None, limit: float = 1e-8) -> list[str]:
    """What is wrong with the indices of a body; of none that robostiff says is ill-conditioned."""
    with mp.workdps(_DIGITS):
        return _Comparison(own, length, limit).complaints


class _Comparison:
    def __init__(self, own: Body, length: float | None, limit: float) -> None:
        self.complaints: list[str] = []
        self.limit = limit
        found = rs.indices(own.snapshot(), length=length)
        if rs.Status.ILL_CONDITIONED in found.status:
            return
        K = own.stiffness()
        by = ByDefinition(K, found.length)
        if int(found.result.rank) != by.rank:
            self.complaints.append(f"rank {found.result.rank}, {by.rank}")
            return
        self.largest = mp.norm(K)
        self._blocks(found, by)
        self._whole(found, by)

    def near(self, words: str, given: Any, expected: Any, size: Any = None) -> None:
        """An entry is right to the limit of its size."""
        if given is None or expected is None:
            if given is not expected:
                self.complaints.append(f"{words}: {given} for {expected}")
            return
        size = abs(expected) if size is None else size
        rounding = mp.mpf(10) ** -15 * self.largest if expected == 0 else 0
        if not abs(mp.mpf(float(given)) - expected) <= self.limit * size + rounding:
            self.complaints.append(f"{words}: {given} for {mp.nstr(expected, 12)}")

    def _blocks(self, found: Any, by: ByDefinition) -> None:
        kinds = (("principal", found.principal, by.held), ("collinear", found.collinear, by.free))
        for name, given, blocks in kinds:
            parts = (
                (given.translational, given.translational_directions),
                (given.rotational, given.rotational_directions),
            )
            for (values, directions), M in zip(parts, blocks, strict=True):
                all_expected = eigen(M)[0]
                for value, expected in zip(values, all_expected, strict=True):
                    # The entries of K hold 16 digits of the largest.
                    size = max(expected, all_expected[-1] * 1e-6) if expected else None
                    self.near(f"{name} {M.rows}", value, expected, size)
                for value, e in zip(values, directions, strict=True):
                    self._direction(f"{name} direction", M, float(value), e)
        worst, ratio = found.worst_deflection, found.anisotropy
        for which, M in zip(("translational", "rotational"), by.free, strict=True):
            values = eigen(M)[0]
            is_free = not values[0]
            self.near(f"worst {which}", getattr(worst, which), None if is_free else 1 / values[0])
            expected = None if is_free else values[-1] / values[0]
            self.near(f"anisotropy {which}", getattr(ratio, which), expected)
            own = getattr(worst, f"{which}_direction")
            self._direction(f"worst direction {which}", M, float(values[0]), own)
        for own in found.along_axes:
            free, held = by.along(mp.matrix(own.direction.tolist()))
            self.near("along, free", own.free, free)
            self.near("along, held", own.held, held)

    def _direction(self, words: str, M: Any, value: float, e: Any) -> None:
        """M e = value e; of a soft direction by its energy, which a slight turn raises."""
        v = mp.matrix(np.asarray(e).tolist())
        largest = eigen(M)[0][-1]
        if abs(mp.norm(v) - 1) > 1e-12:
            self.complaints.append(f"{words}: no unit vector {e}")
        left = mp.norm(M * v - value * v)
        energy = abs((v.T * M * v)[0] - value)
        rounding = mp.mpf(10) ** -13 * self.largest
        if left > self.limit * largest + rounding or energy > 1e-6 * value + rounding:
            self.complaints.append(f"{words} {e}: off by {mp.nstr(left, 5)}, {mp.nstr(energy, 5)}")

    def _whole(self, found: Any, by: ByDefinition) -> None:
        values, n = by.scaled, len(by.scaled)
        for given, expected in zip(found.eigenstiffness.values, values, strict=True):
            self.near("eigenstiffness", given, expected, max(abs(expected), values[-1] * 1e-7))
        for value, x in zip(found.eigenstiffness.values, found.eigenstiffness.twists, strict=True):
            self._direction(
                "eigenstiffness twist",
                by.S**-1 * by.K * by.S**-1,
                float(value),
                np.array([float(s) for s in by.S * mp.matrix(x.tolist())]),
            )
        condition, work = found.condition, found.virtual_work
        if not values[0]:
            for given in (condition.two_norm, condition.frobenius, work.worst, work.mean):
                self.near("of a singular matrix", given, None)
            return
        self.near("condition", condition.two_norm, values[-1] / values[0])
        both = sum(v**2 for v in values) * sum(v**-2 for v in values)
        self.near("Frobenius", condition.frobenius, mp.sqrt(both) / n)
        self.near("worst work", work.worst, 1 / values[0] / 2)
        self.near("mean work", work.mean, sum(1 / v for v in values) / n / 2)
        F = mp.matrix(work.worst_wrench.tolist())
        self.near("size of the worst wrench", float(mp.norm(by.S**-1 * F)), mp.mpf(1))
        self.near("its work", work.worst, (F.T * by.K**-1 * F)[0] / 2)

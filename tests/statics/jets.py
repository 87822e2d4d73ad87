"""Robots under load without the library: poses and energies with their derivatives by numbers that
carry gradient and Hessian along, and Newton's method on the energy with closures as constraints."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Jet:
    """Values (...) with gradients (..., n) and Hessians (..., n, n)."""

    v: np.ndarray
    g: np.ndarray
    h: np.ndarray
    __array_ufunc__ = None

    @staticmethod
    def of(value: object, n: int) -> Jet:
        v = np.asarray(value, dtype=float)
        return Jet(v, np.zeros((*v.shape, n)), np.zeros((*v.shape, n, n)))

    @staticmethod
    def unknowns(values: np.ndarray) -> Jet:
        n = len(values)
        return Jet(np.asarray(values, dtype=float), np.eye(n), np.zeros((n, n, n)))

    def __add__(self, other: object) -> Jet:
        o = other if isinstance(other, Jet) else Jet.of(other, self.g.shape[-1])
        return Jet(self.v + o.v, self.g + o.g, self.h + o.h)

    def __mul__(self, other: object) -> Jet:
        o = other if isinstance(other, Jet) else Jet.of(other, self.g.shape[-1])
        both = self.g[..., :, None] * o.g[..., None, :]
        return Jet(
            self.v * o.v,
            self.g * o.v[..., None] + o.g * self.v[..., None],
            self.h * o.v[..., None, None]
            + o.h * self.v[..., None, None]
            + both
            + np.swapaxes(both, -1, -2),
        )

    def __matmul__(self, o: Jet) -> Jet:
        both = np.einsum("ijn,jkm->iknm", self.g, o.g)
        return Jet(
            self.v @ o.v,
            np.einsum("ijn,jk->ikn", self.g, o.v) + np.einsum("ij,jkn->ikn", self.v, o.g),
            np.einsum("ijnm,jk->iknm", self.h, o.v)
            + np.einsum("ij,jknm->iknm", self.v, o.h)
            + both
            + np.swapaxes(both, -1, -2),
        )

    def __sub__(self, other: object) -> Jet:
        return self + (other if isinstance(other, Jet) else Jet.of(other, self.g.shape[-1])) * -1.0

    def __getitem__(self, i: object) -> Jet:
        return Jet(self.v[i], self.g[i], self.h[i])  # type: ignore[index]

    @property
    def T(self) -> Jet:
        return Jet(*(np.swapaxes(own, 0, 1) for own in (self.v, self.g, self.h)))

    def sum(self) -> Jet:
        n = self.g.shape[-1]
        return Jet(self.v.sum(), self.g.reshape(-1, n).sum(0), self.h.reshape(-1, n, n).sum(0))

    def through(self, f: Sequence[float]) -> Jet:
        """A function of one number: value, derivative and second derivative there."""
        outer = self.g[..., :, None] * self.g[..., None, :]
        return Jet(np.asarray(f[0]), f[1] * self.g, f[1] * self.h + f[2] * outer)

    def among(self, places: np.ndarray, n: int) -> Jet:
        """The same among n unknowns, its own at some places."""
        g = np.zeros((*self.v.shape, n))
        h = np.zeros((*self.v.shape, n, n))
        g[..., places] = self.g
        h[..., places[:, None], places] = self.h
        return Jet(self.v, g, h)


def series(u: float, first: int) -> list[float]:
    """``sum (-u)^k / (2 k + first)!`` with two derivatives: sin(a)/a, (1 - cos a)/a^2, u = a^2."""
    found = []
    for d in range(3):
        terms = [
            (-1.0) ** k * math.perm(k, d) * u ** (k - d) / math.factorial(2 * k + first)
            for k in range(d, 26)
        ]
        found.append(math.fsum(terms))
    return found


_SKEW = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _SKEW[_j, _k, _i], _SKEW[_k, _j, _i] = -1.0, 1.0


def turned(r: Jet) -> Jet:
    """Rotation matrix of a rotation vector."""
    S = Jet(
        _SKEW @ r.v, np.einsum("ijk,kn->ijn", _SKEW, r.g), np.einsum("ijk,knm->ijnm", _SKEW, r.h)
    )
    u = (r * r).sum()
    return (
        S * u.through(series(float(u.v), 1))
        + (S @ S) * u.through(series(float(u.v), 2))
        + np.eye(3)
    )


Energy = Callable[[float], Sequence[float]]


@dataclass
class Turn:
    """A joint: energy of its coordinate, by value and two derivatives; helical with a pitch."""

    point: np.ndarray
    axis: np.ndarray
    turns: bool
    slide: float
    energy: Energy
    preload: float = 0.0
    size = 1

    def motion(self, x: Jet) -> tuple[Jet, Jet]:
        along = Jet(x.v * self.axis, np.outer(self.axis, x.g), np.multiply.outer(self.axis, x.h[0]))
        n = x.g.shape[-1]
        R = turned(along) if self.turns else Jet.of(np.eye(3), n)
        return R, along * self.slide + self.point - (R @ Jet.of(self.point[:, None], n))[:, 0]

    def stored(self, x: Jet) -> Jet:
        return x[0].through(self.energy(float(x.v[0])))


@dataclass
class Part:
    """An elastic part with stiffness K; a beam also has EA/L and its shortening G."""

    point: np.ndarray
    axes: np.ndarray
    K: np.ndarray
    axial: float = 0.0
    G: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    preload: float = 0.0
    size = 6

    def motion(self, x: Jet) -> tuple[Jet, Jet]:
        n = x.g.shape[-1]
        own = Jet.of(self.axes, n)
        R = own @ turned(x[3:]) @ own.T
        shift = (own @ x[:3][:, None])[:, 0]
        return R, shift + self.point - (R @ Jet.of(self.point[:, None], n))[:, 0]

    def stored(self, x: Jet) -> Jet:
        n = x.g.shape[-1]
        th = x[:, None]
        half = (th * (Jet.of(self.G, n) @ th)).sum() * 0.5
        u = x[0] + half
        linear = (th * (Jet.of(self.K, n) @ th)).sum() * 0.5
        return linear + (u * u - x[0] * x[0]) * (0.5 * self.axial)


@dataclass
class JetLeg:
    """Elements from base to platform, and dead forces: after so many elements, point, force."""

    elements: list[Turn | Part]
    loads: list[tuple[int, np.ndarray, np.ndarray]] = field(default_factory=list)

    @property
    def size(self) -> int:
        return sum(element.size for element in self.elements)


@dataclass
class JetRobot:
    """Legs on a platform with its point, and springs: ends (leg or None, after, point), k, tension.

    An end with leg None is on the base after 0 elements, on the platform after 1.
    """

    legs: list[JetLeg]
    point: np.ndarray
    springs: list[tuple[tuple, tuple, float, float]] = field(default_factory=list)
    #: Leg, factors of the sum by places among its coordinates, stiffness or None: a closure.
    couplings: list[tuple[int, dict[int, float], float | None]] = field(default_factory=list)

    @property
    def closures(self) -> int:
        """How many there are."""
        return 6 * len(self.legs) + sum(k is None for *_, k in self.couplings)

    @property
    def size(self) -> int:
        """Coordinates of all legs."""
        return sum(leg.size for leg in self.legs)

    def terms(
        self, x: np.ndarray, R0: np.ndarray, p0: np.ndarray, factor: float
    ) -> tuple[Jet, Jet, list[Jet]]:
        """Energy, potential of loads and preloads, closures: of all legs, then of the platform."""
        n = self.size + 6
        step = Jet.unknowns(np.zeros(6)).among(np.arange(n - 6, n), n)
        R, p = turned(step[3:]) @ Jet.of(R0, n), step[:3] + p0
        energy, work, closure, bodies, at = Jet.of(0.0, n), Jet.of(0.0, n), [], {}, 0
        for number, leg in enumerate(self.legs):
            places = np.arange(at, at + leg.size)
            own, first, m = Jet.unknowns(x[places]), 0, leg.size
            at += m
            R_leg, t = Jet.of(np.eye(3), m), Jet.of(np.zeros(3), m)
            stored, done = Jet.of(0.0, m), Jet.of(0.0, m)
            for k, element in enumerate(leg.elements):
                q = own[first : first + element.size]
                first += element.size
                turn, shift = element.motion(q)
                R_leg, t = R_leg @ turn, (R_leg @ shift[:, None])[:, 0] + t
                stored = stored + element.stored(q)
                done = done + q[0] * element.preload
                for after, point, force in leg.loads:
                    if after == k + 1:
                        moved = (R_leg @ Jet.of(point[:, None], m))[:, 0] + t - point
                        done = done + (moved * force).sum()
                bodies[number, k + 1] = R_leg.among(places, n), t.among(places, n)
            energy, work = energy + stored.among(places, n), work + done.among(places, n)
            R_end, t_end = bodies[number, len(leg.elements)]
            gap = (R_end @ Jet.of(self.point[:, None], n))[:, 0] + t_end - p
            D = R_end @ R.T
            closure += [gap[0], gap[1], gap[2]]
            closure += [(D[i, j] - D[j, i]) * 0.5 for i, j in ((2, 1), (0, 2), (1, 0))]
        starts = np.cumsum([0, *(leg.size for leg in self.legs)])
        for number, row, k in self.couplings:
            total = Jet.of(0.0, n)
            for place, factor_of_sum in row.items():
                at_place = np.array([starts[number] + place])
                own = Jet.unknowns(x[at_place])[0].among(at_place, n)
                total = total + own * factor_of_sum
            if k is None:
                closure.append(total)
            else:
                energy = energy + total * total * (0.5 * k)
        potential = work * -factor
        bodies[None, 0] = Jet.of(np.eye(3), n), Jet.of(np.zeros(3), n)
        bodies[None, 1] = R, p - (R @ Jet.of(self.point[:, None], n))[:, 0]
        for (leg_a, after_a, a), (leg_b, after_b, b), k, tension in self.springs:
            ends = [
                (bodies[own][0] @ Jet.of(at_rest[:, None], n))[:, 0] + bodies[own][1]
                for own, at_rest in (((leg_a, after_a), a), ((leg_b, after_b), b))
            ]
            d = ends[1] - ends[0]
            square = (d * d).sum()
            root = math.sqrt(square.v)
            longer = square.through([root, 0.5 / root, -0.25 / root**3]) - np.linalg.norm(b - a)
            # stored from the free length; the tension grows with the loads
            energy = energy + longer * longer * (0.5 * k) + longer * (factor * tension)
            energy = energy + (factor * tension) ** 2 / (2 * k)
        return energy, potential, closure


@dataclass
class JetAnswer:
    """Where a robot comes to rest."""

    R: np.ndarray
    p: np.ndarray
    K: np.ndarray
    energy: float
    potential: float
    least: float


def skew(a: np.ndarray) -> np.ndarray:
    return _SKEW @ a


def at_rest(robot: JetRobot, wrench: np.ndarray, steps: int = 3, to: float = 1.0) -> JetAnswer:
    """The equilibrium under a part of all loads and a wrench, followed from rest in equal steps."""
    n = robot.size
    x, force = np.zeros(n), np.zeros(robot.closures)
    R, p = np.eye(3), robot.point.astype(float)
    for factor in to * np.arange(1, steps + 1) / steps:
        for _ in range(12):
            energy, potential, closure = robot.terms(x, R, p, factor)
            G = np.array([own.g for own in closure])
            H = energy.h + potential.h + np.einsum("c,cij->ij", force, [own.h for own in closure])
            rest = energy.g + potential.g + G.T @ force
            rest[n:] -= factor * wrench
            A = H.copy()
            # a moment M acts on the turn r by W(r)^T M, of which the rate is skew(M) / 2
            A[n + 3 :, n + 3 :] -= 0.5 * skew(factor * wrench[3:])
            whole = np.block([[A, G.T], [G, np.zeros((len(G), len(G)))]])
            gaps = np.array([own.v for own in closure])
            step = _solved(whole, -np.concatenate([rest, gaps]))
            x, force = x + step[:n], force + step[n + 6 :]
            R = turned(Jet.of(step[n + 3 : n + 6], 1)).v @ R
            p = p + step[n : n + 3]
            if np.abs(step[: n + 6]).max() < 1e-11:
                break
        else:
            raise AssertionError("no equilibrium: take other numbers")
    energy, potential, closure = robot.terms(x, R, p, to)
    G = np.array([own.g for own in closure])
    H = energy.h + potential.h + np.einsum("c,cij->ij", force, [own.h for own in closure])
    inner = np.block([[H[:n, :n], G[:, :n].T], [G[:, :n], np.zeros((len(G), len(G)))]])
    across = np.concatenate([H[:n, n:], G[:, n:]])
    K = H[n:, n:] - across.T @ _solved(inner, across)
    K[3:, 3:] -= 0.5 * skew(to * wrench[3:])
    H[n + 3 :, n + 3 :] -= 0.5 * skew(to * wrench[3:])
    _, values, Vt = np.linalg.svd(G)
    N = Vt[np.sum(values > 1e-10 * values[0]) :]
    least = np.linalg.eigvalsh(N @ (0.5 * (H + H.T)) @ N.T)[0]
    return JetAnswer(R, p, K, float(energy.v), float(energy.v + potential.v), float(least))


def _solved(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    rows = 1.0 / np.abs(A).max(1)
    columns = 1.0 / np.abs(A * rows[:, None]).max(0)
    scaled = A * rows[:, None] * columns
    x = np.zeros_like(b)
    for _ in range(3):
        rest = (b - A @ x).T * rows
        x = x + (np.linalg.solve(scaled, rest.T).T * columns).T
    return x

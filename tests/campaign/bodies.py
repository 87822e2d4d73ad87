"""Rigid bodies in the world and the energy of what connects them, at its minimum.

Every body has a matrix and a shift of its own; joints are constraints between two of them. No
chain, no coordinate of a joint and no derivative by hand: first derivatives come from complex
steps, second ones from differences of these, and Newton's method finds where the energy is
stationary under the constraints. The energies are those of docs/under-load.md; a beam may be cut
into many parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import LinAlgWarning, eigh, lu_factor, lu_solve, null_space
from scipy.spatial.transform import Rotation

_TINY = 1e-30  # imaginary step
_H = 1e-3  # real step of differences of fourth order, in units of the machine's length and of rad
_WEAK = 1e-11  # of what motions without stiffness and redundant constraints are given
_OPEN = 1e-9  # what constraints may miss: more contradict one another
_POWERS = 9  # of the motion of a joint, in its energy
_LONGEST = 0.2  # step of Newton's method [rad]
_SHIFTS = np.vstack([np.zeros((1, 12)), *(s * _H * np.eye(12) for s in (1, -1, 2, -2))])
_EYE = np.eye(3)


class NoMinimumError(Exception):
    """Newton's method did not arrive, or there is nothing that it could find."""


@dataclass(frozen=True)
class ElasticPart:
    """Body b against body a about a point, in axes that a carries: ``th^T K th / 2`` [J].

    Of a beam, `stretch` is EA/L and ``th^T G th / 2`` the shortening by bending. Rows (k, 6) of
    `rigid` times th are zero.
    """

    a: int
    b: int
    point: np.ndarray
    axes: np.ndarray
    K: np.ndarray
    stretch: float = 0.0
    G: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    rigid: np.ndarray = field(default_factory=lambda: np.zeros((0, 6)))


@dataclass(frozen=True)
class SingleJoint:
    """Body b turns about an axis fixed to a, or slides along it (pitch None).

    Its energy by its motion q is ``sum c_n q^n``; `number` is its place in sums of joints.
    """

    a: int
    b: int
    axis: np.ndarray
    point: np.ndarray
    pitch: float | None
    energy: tuple[float, ...] = ()
    number: int | None = None


@dataclass(frozen=True)
class PointSpring:
    """Between points of two bodies: tension ``k l + c`` at the distance l, of a cable 0 or more."""

    a: int
    b: int
    ends: tuple[np.ndarray, np.ndarray]
    k: float
    c: float
    is_cable: bool = False


@dataclass(frozen=True)
class DeadPull:
    """A force that keeps its direction, at a point of a body."""

    body: int
    point: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class Sum:
    """``s = sum a_j q_j`` of numbered joints, held rigidly or by a spring."""

    factors: tuple[tuple[int, float], ...]
    stiffness: float | None


@dataclass
class Bodies:
    """A machine at rest: body 0 does not move, body 1 is the platform, about whose centre all is.

    Attributes
    ----------
    centres : list of (3,) arrays
        At rest [m].
    length : float
        Of the machine [m].
    rows : sequence of int
        Which of the six motions bodies have: three in a plane.
    masses : list of (int, float, (3,) array, (3, 3) array)
        Body, mass [kg], centre [m], and inertia about it in world axes [kg m^2].
    """

    centres: list[np.ndarray]
    length: float
    rows: Sequence[int] = range(6)
    elastic: list[ElasticPart] = field(default_factory=list)
    joints: list[SingleJoint] = field(default_factory=list)
    springs: list[PointSpring] = field(default_factory=list)
    pulls: list[DeadPull] = field(default_factory=list)
    sums: list[Sum] = field(default_factory=list)
    masses: list[tuple[int, float, np.ndarray, np.ndarray]] = field(default_factory=list)

    def body(self, centre: np.ndarray) -> int:
        """A new body."""
        self.centres.append(np.array(centre, dtype=float))
        return len(self.centres) - 1

    def merge(self, one: int, other: int) -> None:
        """Two bodies are one, that of the lower number."""
        low, high = sorted((one, other))

        def renamed(i: int) -> int:
            return low if i == high else i - (i > high)

        connections: tuple[Any, ...] = (self.elastic, self.joints, self.springs)
        for own in connections:
            for i, part in enumerate(own):
                own[i] = type(part)(**{**part.__dict__, "a": renamed(part.a), "b": renamed(part.b)})
        self.pulls = [DeadPull(renamed(p.body), p.point, p.force) for p in self.pulls]
        self.masses = [(renamed(m[0]), *m[1:]) for m in self.masses]
        del self.centres[high]

    def at_rest(self) -> State:
        """Nothing moved."""
        n = len(self.centres)
        return State(np.tile(_EYE, (n, 1, 1)), np.zeros((n, 3)), np.zeros(self.numbers), None)

    @property
    def numbers(self) -> int:
        """How many joints stand in sums."""
        return 1 + max((j.number for j in self.joints if j.number is not None), default=-1)


@dataclass(frozen=True)
class State:
    """Where all bodies are, motions of joints in sums, and multipliers of constraints."""

    R: np.ndarray
    u: np.ndarray
    y: np.ndarray
    multipliers: np.ndarray | None


@dataclass(frozen=True)
class System:
    """Energy to second order at a state, in units of the machine: shifts by its length."""

    gradient: np.ndarray
    hessian: np.ndarray
    constraints: np.ndarray
    jacobian: np.ndarray


def system(
    bodies: Bodies,
    state: State,
    pulled: float = 1.0,
    platform: bool = True,
    known: np.ndarray | None = None,
) -> System:
    """Gradient, Hessian of energy less multipliers times constraints, and constraints.

    `pulled` is the part of dead forces and of preloads that acts; without `platform`, those on the
    platform are left out. A `known` Hessian is not computed again.
    """
    shifts = _SHIFTS if known is None else _SHIFTS[:1]
    count, ny = len(bodies.centres), bodies.numbers
    n = 6 * count + ny
    g, H = np.zeros(n), np.zeros((n, n))
    c_all: list[np.ndarray] = []
    J_all: list[np.ndarray] = []
    used = 0
    units = np.tile(np.repeat([bodies.length, 1.0], 3), 2)
    for group in _groups(bodies, pulled, platform):
        a, b = group.a, group.b
        places = np.concatenate([6 * a[:, None] + np.arange(6), 6 * b[:, None] + np.arange(6)], 1)
        shape = len(a), len(shifts), 12
        d = np.broadcast_to((shifts[:, None, :] + 1j * _TINY * np.eye(12)) * units, (*shape, 12))
        Ra, ua = _moved(state.R[a], state.u[a], d[..., :6])
        Rb, ub = _moved(state.R[b], state.u[b], d[..., 6:])
        energy, gaps, q = group.values(bodies, Ra, ua, Rb, ub)
        rates = energy.imag / _TINY  # (M, S, 12)
        lagrangian = rates.copy()
        k = gaps.shape[-1]
        if k:
            wanted = state.multipliers
            own = np.zeros((len(a), k)) if wanted is None else wanted[used : used + len(a) * k]
            own = own.reshape(len(a), k)
            lagrangian -= np.einsum("msjk,mk->msj", gaps.imag / _TINY, own)
            J = np.zeros((len(a), k, n))
            rows = np.arange(len(a))[:, None]
            for i in range(12):
                J[rows, np.arange(k)[None], places[:, i, None]] += gaps[:, 0, i].imag / _TINY
            c = gaps[:, 0, 0].real.copy()
            if group.numbers is not None and q is not None:
                J[np.arange(len(a)), k - 1, 6 * count + group.numbers] = -1.0
                c[:, k - 1] -= state.y[group.numbers]
            c_all.append(c.reshape(-1))
            J_all.append(J.reshape(-1, n))
            used += len(a) * k
        np.add.at(g, places, rates[:, 0])
        if known is not None:
            continue
        one, back, two, far = lagrangian[:, 1:].reshape(len(a), 4, 12, 12).swapaxes(0, 1)
        local = (8 * (one - back) - (two - far)) / (12 * _H)
        np.add.at(H, (places[:, :, None], places[:, None, :]), 0.5 * (local + local.swapaxes(1, 2)))
    for own in bodies.sums:
        factors = np.zeros(n)
        for j, factor in own.factors:
            factors[6 * count + j] = factor
        if own.stiffness is None:
            c_all.append(np.array([factors[6 * count :] @ state.y]))
            J_all.append(factors[None])
        else:
            g += own.stiffness * factors * (factors[6 * count :] @ state.y)
            H += own.stiffness * np.outer(factors, factors)
    moves = [6 * i + r for i in range(1, count) for r in bodies.rows]
    moves += list(range(6 * count, n))
    c = np.concatenate(c_all) if c_all else np.zeros(0)
    J = np.vstack(J_all)[:, moves] if J_all else np.zeros((0, len(moves)))
    return System(g[moves], H[np.ix_(moves, moves)] if known is None else known, c, J)


@dataclass(frozen=True)
class _Group:
    """Connections of one kind side by side."""

    kind: str
    parts: list

    @property
    def a(self) -> np.ndarray:
        return np.array([0 if self.kind == "pull" else p.a for p in self.parts])

    @property
    def b(self) -> np.ndarray:
        return np.array([p.body if self.kind == "pull" else p.b for p in self.parts])

    @property
    def numbers(self) -> np.ndarray | None:
        numbered = self.kind.startswith("joint") and self.parts[0].number is not None
        return np.array([p.number for p in self.parts]) if numbered else None

    def _of(self, name: str) -> np.ndarray:
        values = np.array([getattr(p, name) for p in self.parts], dtype=float)
        return values.reshape(len(values), 1, 1, *values.shape[1:])

    def values(self, bodies: Bodies, Ra: Any, ua: Any, Rb: Any, ub: Any) -> tuple[Any, Any, Any]:
        """Energy (M, S, 12), gaps (M, S, 12, k), and motion of joints."""
        centres = np.array(bodies.centres)
        ca, cb = centres[self.a][:, None, None], centres[self.b][:, None, None]

        def at(points, c, u, R):
            return c + u + np.einsum("...ij,...j->...i", R, points - c)

        none = np.zeros((*ua.shape[:-1], 0), dtype=complex)
        if self.kind == "pull":
            moved = at(self._of("point"), cb, ub, Rb) - self._of("point")
            return -np.sum(self._of("force") * moved, axis=-1), none, None
        if self.kind == "spring":
            ends = self._of("ends")
            v = at(ends[..., 1, :], cb, ub, Rb) - at(ends[..., 0, :], ca, ua, Ra)
            length = np.sqrt(np.sum(v * v, axis=-1))
            k, c = self._of("k"), self._of("c")
            tension = k * length + c
            # Decided where nothing is shifted: differences must not cross the corner.
            slack = self._of("is_cable") * (tension[:, :1, :1].real < 0)
            return 0.5 / k * np.where(slack, 0.0, tension) ** 2, none, None
        points = self._of("point")
        away = at(points, cb, ub, Rb) - at(points, ca, ua, Ra)
        d = np.einsum("...ji,...j->...i", Ra, away)
        turn = np.einsum("...ji,...jk->...ik", Ra, Rb)
        r = _log(turn)
        if self.kind.startswith("elastic"):
            axes = self._of("axes")
            theta = np.concatenate([np.einsum("...ji,...j->...i", axes, x) for x in (d, r)], -1)
            energy = 0.5 * np.einsum("...i,...ij,...j->...", theta, self._of("K"), theta)
            short = 0.5 * np.einsum("...i,...ij,...j->...", theta, self._of("G"), theta)
            stretched = theta[..., 0]
            gaps = np.einsum("...ki,...i->...k", self._of("rigid"), theta)
            return energy + self._of("stretch") * short * (stretched + 0.5 * short), gaps, None
        e = self._of("axis")
        n1, n2 = (np.array([_across(p.axis)[i] for p in self.parts])[:, None, None] for i in (0, 1))
        L = bodies.length
        if self.kind.startswith("joint turning"):
            q = np.sum(e * r, axis=-1)
            f = np.einsum("...ij,...j->...i", turn, np.broadcast_to(e, r.shape))
            pitch = self._of("pitch")
            gaps = [np.sum(n * f, -1) for n in (n1, n2)] + [np.sum(n * d, -1) / L for n in (n1, n2)]
            gaps.append((np.sum(e * d, axis=-1) - pitch * q) / L)
        else:
            q = np.sum(e * d, axis=-1)
            gaps = [np.sum(n * d, -1) / L for n in (n1, n2)] + [r[..., i] for i in range(3)]
        if self.parts[0].number is not None:
            gaps.append(q)
        energy = np.zeros_like(q)
        coefficients = np.array(
            [[*p.energy, *[0.0] * (_POWERS - len(p.energy))] for p in self.parts]
        )
        for c in coefficients.T[::-1]:
            energy = energy * q + c[:, None, None]
        return energy * q, np.stack(gaps, axis=-1), q


def _groups(bodies: Bodies, pulled: float, platform: bool) -> list[_Group]:
    found: dict[str, list] = {}
    for part in bodies.elastic:
        found.setdefault(f"elastic {len(part.rigid)}", []).append(part)
    for joint in bodies.joints:
        kind = "joint sliding" if joint.pitch is None else "joint turning"
        first, *rest = joint.energy or (0.0,)
        own = SingleJoint(**{**joint.__dict__, "energy": (pulled * first, *rest)})
        found.setdefault(f"{kind}{'' if joint.number is None else ' in sums'}", []).append(own)
    for spring in bodies.springs:
        found.setdefault("spring", []).append(spring)
    for pull in bodies.pulls:
        if pulled and pull.body and (platform or pull.body != 1):
            own = DeadPull(pull.body, pull.point, pulled * np.asarray(pull.force))
            found.setdefault("pull", []).append(own)
    return [_Group(kind, parts) for kind, parts in found.items()]


def _across(axis: np.ndarray) -> np.ndarray:
    return null_space(np.asarray(axis, dtype=float)[None]).T


def _moved(R: np.ndarray, u: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bodies (M,) after small motions (M, S, 12, 6): ``exp(dphi) R`` and ``u + du``."""
    v = d[..., 3:]
    S = np.zeros((*v.shape, 3), dtype=complex)
    S[..., 2, 1], S[..., 0, 2], S[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    S = S - S.swapaxes(-1, -2)
    a = np.sum(v * v, axis=-1)[..., None, None]
    sine = 1 - a / 6 * (1 - a / 20 * (1 - a / 42))
    cosine = 0.5 - a / 24 * (1 - a / 30 * (1 - a / 56))
    E = _EYE + sine * S + cosine * (S @ S)
    return E @ R[:, None, None], u[:, None, None] + d[..., :3]


def _log(R: np.ndarray) -> np.ndarray:
    """Rotation vector of matrices, analytic below half a turn."""
    v = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1
    )
    one = 0.5 * (1.0 + R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2])  # 1 + cosine
    t = np.sum(v * v, axis=-1) / (one * one)  # square of the tangent of half the angle
    near = np.abs(t) < 0.02
    series = sum((-1) ** k * np.where(near, t, 0) ** k / (2 * k + 1) for k in range(10))
    root = np.sqrt(np.where(near, 1.0, t))
    return v * (2 / one * np.where(near, series, np.arctan(root) / root))[..., None]


@dataclass(frozen=True)
class Minimum:
    """Where the energy is least.

    Attributes
    ----------
    displacement : (r,) array
        Of the platform's centre [m] and its rotation vector [rad].
    compliance : (r, r) array
        Twist of the platform by a further wrench, forces staying [m/N ...].
    held : (r,) array
        What all but the forces on the platform hold of it [N, N m].
    """

    bodies: Bodies
    state: State
    displacement: np.ndarray
    compliance: np.ndarray
    held: np.ndarray

    @property
    def K_total(self) -> np.ndarray:
        """Stiffness against a further wrench."""
        d = np.sqrt(np.abs(np.diag(self.compliance)))
        return np.linalg.inv(self.compliance / np.outer(d, d)) / np.outer(d, d)


def minimum(
    bodies: Bodies, wrench: np.ndarray, pulled: float = 1.0, start: State | None = None
) -> Minimum:
    """Where the energy is stationary under a wrench (r,) on the platform about its centre.

    Raises
    ------
    NoMinimumError
        When Newton's method does not arrive.
    """
    state = start or bodies.at_rest()
    r, units = len(bodies.rows), np.repeat([bodies.length, 1.0], 3)[list(bodies.rows)]
    before, own, known = np.inf, None, None
    for _ in range(60):
        own = system(bodies, state, pulled, known=known)
        wanted = np.zeros(len(own.gradient))
        wanted[:r] = wrench * units
        if state.multipliers is None:
            state = State(state.R, state.u, state.y, np.zeros(len(own.constraints)))
        step, more = _solved(bodies, own, wanted - own.gradient, -own.constraints, wrench)
        size = float(np.max(np.abs(step), initial=0.0))
        if not np.isfinite(size):
            break
        part = min(1.0, _LONGEST / max(size, 1e-300))
        multipliers = (1 - part) * np.asarray(state.multipliers) + part * more
        state = _stepped(bodies, state, part * step, multipliers)
        if size < 1e-12 or (known is None and size < 1e-9 and size > 0.5 * before):
            if np.max(np.abs(own.constraints), initial=0.0) > _OPEN:
                break
            return _minimum(bodies, state, wrench, pulled)
        known = own.hessian if size < min(1e-4, 0.1 * before) else None
        before = size
    raise NoMinimumError


def _solved(bodies: Bodies, own: System, g: Any, c: Any, wrench: Any, columns: Any = None) -> Any:
    """Steps and new multipliers: ``H x - J^T m = g``, ``J x = c``, a moment turning along."""
    n, m, r = len(own.gradient), len(own.constraints), len(bodies.rows)
    S = np.zeros((n + m, n + m))
    S[:n, :n] = own.hessian
    if r == 6:
        x, y, z = 0.5 * np.asarray(wrench)[3:]
        S[3:6, 3:6] -= [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    size = float(np.mean(np.abs(np.diag(own.hessian)))) or 1.0
    J = own.jacobian * size
    S[:n, n:], S[n:, :n] = -J.T, -J
    weak = S.copy()
    weak[np.arange(n), np.arange(n)] += _WEAK * size
    weak[np.arange(n, n + m), np.arange(n, n + m)] -= _WEAK * size
    b = np.concatenate([g, -c * size]) if columns is None else columns
    try:
        with np.errstate(all="raise"):
            factors = lu_factor(weak, check_finite=True)
    except (ValueError, FloatingPointError, LinAlgWarning):
        raise NoMinimumError from None
    x = lu_solve(factors, b)
    for _ in range(4):
        x = x + lu_solve(factors, b - S @ x)
    return (x[:n], x[n:] * size) if columns is None else x[:n]


def _stepped(bodies: Bodies, state: State, step: np.ndarray, multipliers: np.ndarray) -> State:
    count = len(bodies.centres)
    moves = np.zeros((count, 6))
    k = (count - 1) * len(bodies.rows)
    moves[1:, list(bodies.rows)] = step[:k].reshape(count - 1, len(bodies.rows))
    R = Rotation.from_rotvec(moves[:, 3:]).as_matrix() @ state.R
    y = state.y + step[k:]
    return State(R, state.u + bodies.length * moves[:, :3], y, multipliers)


def _minimum(bodies: Bodies, state: State, wrench: np.ndarray, pulled: float) -> Minimum:
    rows, own = list(bodies.rows), system(bodies, state, pulled)
    r = len(rows)
    units = np.repeat([bodies.length, 1.0], 3)[rows]
    n = len(own.gradient)
    loads = np.zeros((n + len(own.constraints), r))
    loads[:r] = np.diag(units)
    found = _solved(bodies, own, None, None, wrench, loads)
    moved = np.concatenate([state.u[1], Rotation.from_matrix(state.R[1]).as_rotvec()])[rows]
    alone = system(bodies, state, pulled, platform=False, known=own.hessian)
    held = (alone.gradient - own.jacobian.T @ state.multipliers)[:r] / units
    return Minimum(bodies, state, moved, found[:r] * units[:, None], held)


def elastic_energy(bodies: Bodies, state: State) -> float:
    """Of all elastic parts, joints and springs, without forces and preloads [J]."""
    total = 0.0
    for group in _groups(bodies, 0.0, False):
        d = np.zeros((len(group.parts), 1, 1, 6))
        at = [_moved(state.R[i], state.u[i], d) for i in (group.a, group.b)]
        total += float(np.sum(group.values(bodies, *at[0], *at[1])[0].real))
    for own in bodies.sums:
        s = sum(factor * state.y[j] for j, factor in own.factors)
        total += 0.5 * (own.stiffness or 0.0) * s * s
    return total


def curvatures(bodies: Bodies, state: State, pulled: float = 1.0) -> np.ndarray:
    """Eigenvalues of the energy at a state among motions that the constraints leave."""
    own = system(bodies, state, pulled)
    Z = _left(own)
    return eigh(Z.T @ own.hessian @ Z, eigvals_only=True)


def _left(own: System) -> np.ndarray:
    return (
        null_space(own.jacobian, rcond=1e-9) if len(own.constraints) else np.eye(len(own.gradient))
    )


def frequencies(bodies: Bodies, state: State, pulled: float = 1.0) -> np.ndarray:
    """Natural frequencies [Hz] from the inertia of each body by itself, ascending.

    ``M x'' + H x = 0`` among the motions that constraints leave; H must have no zero.
    """
    own = system(bodies, state, pulled)
    Z = _left(own)
    count, rows = len(bodies.centres), list(bodies.rows)
    M = np.zeros((6 * count, 6 * count))
    for body, value, centre, inertia in bodies.masses:
        R = state.R[body]
        x, y, z = R @ (centre - bodies.centres[body])
        arm = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turned = R @ inertia @ R.T
        L = bodies.length
        block = np.block(
            [
                [L * L * value * _EYE, -L * value * arm],
                [L * value * arm, turned - value * arm @ arm],
            ]
        )
        M[6 * body : 6 * body + 6, 6 * body : 6 * body + 6] += block
    moves = [6 * i + row for i in range(1, count) for row in rows]
    whole = np.zeros_like(own.hessian)
    whole[: len(moves), : len(moves)] = M[np.ix_(moves, moves)]
    H, M = Z.T @ own.hessian @ Z, Z.T @ whole @ Z
    squares = eigh(M, H, eigvals_only=True)  # inverse squares: bodies without mass follow
    squares = squares[squares > 1e-14 * squares[-1]]
    return np.sort(1 / np.sqrt(squares)) / (2 * np.pi)

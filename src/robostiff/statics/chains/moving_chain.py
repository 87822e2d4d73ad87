"""Chains in finite motion: where their bodies are, velocities, energy, and second derivatives.

All elements of all chains alike are computed at once: a leading axis N counts the chains, K the
elements. All elastic parts have the same number c of coordinates here, those that they lack being
empty columns: six, or more where some beam has inner modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robostiff.spatial import skew
from robostiff.statics.chains.beam_bowing import bowing_energy
from robostiff.statics.chains.chain import (
    BodyLoad,
    BodyPlace,
    ChainTerms,
    Element,
    FiniteChain,
    FiniteJoint,
    Law,
)

# Below this angle series answer: differences of cosines lose their digits there.
_SMALL = 0.05
_IDENTITY = np.eye(3)
_SKEWS = skew(np.eye(3)).reshape(3, 9)
# Sin a/a, b, c, and the derivatives of b and c by a, divided by a: by powers of a^2.
_SERIES = np.array(
    [
        [1, 1 / 2, 1 / 6, -1 / 12, -1 / 60],
        [-1 / 6, -1 / 24, -1 / 120, 1 / 180, 1 / 1260],
        [1 / 120, 1 / 720, 1 / 5040, -1 / 6720, -1 / 60480],
        [-1 / 5040, -1 / 40320, 0, 0, 0],
    ]
)
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
_Steps = tuple[np.ndarray, np.ndarray, "FiniteTurn"]


@dataclass(frozen=True)
class FiniteTurn:
    """Rotation exp(r x) and its angular velocity W dr: the left Jacobian of SO(3).

    ``W = I + b S + c S^2`` with ``S = (r x)``, ``a = |r|``, ``b = (1 - cos a)/a^2`` and
    ``c = (a - sin a)/a^3``.

    Attributes
    ----------
    r : (..., 3) array
        Rotation vectors [rad].
    R, W : (..., 3, 3) arrays
        ``d exp(r x) = ((W dr) x) exp(r x)``.
    factors : tuple of four (..., 1) arrays
        b, c, and their derivatives by a, divided by a.
    """

    r: np.ndarray
    R: np.ndarray
    W: np.ndarray
    factors: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

    def rate_felt(self, m: np.ndarray) -> np.ndarray:
        """Derivative of ``m . W[:, k]`` by ``r[b]`` (..., 3, 3), rows k.

        With ``dS^2/dr_b = E_b S + S E_b`` and ``u = m x r`` it is
        ``(b' u + c' u x r) r^T + b (m x) + c ((m . r) I - m r^T + (u x))``; m is (..., 3).

        Examples
        --------
        >>> turn_and_rates(np.zeros((1, 3))).rate_felt(np.array([[0.0, 0, 1]]))[0, 1, 0]
        np.float64(0.5)
        """
        b, c, b_rate, c_rate = self.factors
        r = self.r
        u = crossed(m, r)
        along = np.sum(m * r, axis=-1, keepdims=True)
        rows = b_rate * u + c_rate * crossed(u, r) - c * m
        return (
            rows[..., None] * r[..., None, :]
            + skews(b * m + c * u)
            + (c * along)[..., None] * _IDENTITY
        )


def turn_and_rates(r: np.ndarray) -> FiniteTurn:
    """Turn by rotation vectors (..., 3) [rad].

    Examples
    --------
    >>> turn_and_rates(np.array([[0.0, 0, np.pi / 2]])).R.round(12)[0, 1, 0]
    np.float64(1.0)
    """
    S = skews(r)
    SS = S @ S
    first, b, c, b_rate, c_rate = _coefficients(np.sqrt(np.sum(r * r, axis=-1, keepdims=True)))
    B, C = b[..., None], c[..., None]
    R = _IDENTITY + first[..., None] * S + B * SS
    W = _IDENTITY + B * S + C * SS
    return FiniteTurn(r, R, W, (b, c, b_rate, c_rate))


def skews(v: np.ndarray) -> np.ndarray:
    """Matrices (v x) of vectors (..., 3), by one product."""
    return (v @ _SKEWS).reshape(*v.shape, 3)


def crossed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``a x b`` of vectors (..., 3), few calls for few vectors."""
    return a[..., _NEXT] * b[..., _LAST] - a[..., _LAST] * b[..., _NEXT]


def _coefficients(a: np.ndarray) -> tuple[np.ndarray, ...]:
    """Sin a/a, b, c, and the derivatives of b and c by a, divided by a."""
    u = a * a
    small = a < _SMALL
    if np.all(small):
        return _series(u)
    safe = np.where(small, 1.0, a)
    s, v = np.sin(safe), 2.0 * np.sin(0.5 * safe) ** 2
    far = (
        s / safe,
        v / safe**2,
        (safe - s) / safe**3,
        (s / safe**2 - 2 * v / safe**3) / safe,
        (v / safe**3 - 3 * (safe - s) / safe**4) / safe,
    )
    near = _series(np.where(small, u, 0.0))
    return tuple(np.where(small, n, f) for n, f in zip(near, far, strict=True))


def _series(u: np.ndarray) -> tuple[np.ndarray, ...]:
    found = np.concatenate([np.ones(u.shape), u, u * u, u * u * u], axis=-1) @ _SERIES
    return tuple(found[..., i : i + 1] for i in range(5))


class MovingChains:
    """Elements of chains as arrays: in each slot a chain has an element of its kind, or none.

    Where it has none, nothing moves: a joint without axis, or an elastic part without modes.

    Parameters
    ----------
    kinds : sequence of str
        Of the slots: ``turn``, ``slide`` or ``spring``.
    sizes : sequence of int
        Coordinates in each slot, of the chain that has most.
    chains : sequence of FiniteChain
    slots : sequence of arrays of int
        Of their elements.
    loads : sequence of BodyLoad
        Behind slots.
    rows : sequence of slice
        Of every chain.
    body_rows : sequence of int
        Coordinates of the bodies at the starts, where some of them move.
    moves : array of bool
        Rows whose body at the start moves.
    """

    def __init__(
        self,
        kinds: Sequence[str],
        sizes: Sequence[int] | np.ndarray,
        chains: Sequence[FiniteChain],
        slots: Sequence[np.ndarray],
        loads: Sequence[BodyLoad],
        rows: Sequence[slice],
        body_rows: Sequence[int],
        moves: np.ndarray,
    ) -> None:
        self.slots, self.count = len(kinds), len(moves)
        N = self.count
        self.point = np.zeros((N, self.slots, 3))
        starts = np.cumsum([0, *sizes])
        self.size = int(starts[-1])
        is_spring = np.array([kind == "spring" for kind in kinds], dtype=bool)
        self.joint_elements, self.spring_elements = (
            np.flatnonzero(own) for own in (~is_spring, is_spring)
        )
        at = np.where(is_spring, np.cumsum(is_spring), np.cumsum(~is_spring)) - 1
        J, S = len(self.joint_elements), len(self.spring_elements)
        self.joint_places = starts[self.joint_elements]
        self.axis, self.slide = np.zeros((N, J, 3)), np.zeros((N, J, 1))
        self.stiffness, self.preload = np.zeros((2, N, J))
        #: Row, joint, and law of what is no linear spring.
        self.laws: list[tuple[int, int, Law]] = []
        within = [np.arange(sizes[k]) for k in self.spring_elements.tolist()]
        width = max((len(own) for own in within), default=0)
        self.own_axes, self.modes = np.tile(_IDENTITY, (N, S, 1, 1)), np.zeros((N, S, 6, width))
        self.mode_stiffness = np.zeros((N, S, width))
        self.axial, self.bowing = np.zeros((N, S, 1)), np.zeros((N, S, width, width))
        for chain, own, here in zip(chains, slots, rows, strict=True):
            for e, k in zip(chain.elements, own, strict=True):
                self.point[here, k] = e.point
                self._put(e, here, int(at[k]))
        turns = [float(kinds[k] == "turn") for k in self.joint_elements.tolist()]
        self.turning = np.array(turns).reshape(J, 1)
        self.axis_skew = skews(self.axis)
        self.axis_skew_squared = self.axis_skew @ self.axis_skew
        none = np.zeros(0, dtype=int)
        #: Which of the c S coordinates there are, and their places in x.
        self.full = np.concatenate([none, *(width * i + own for i, own in enumerate(within))])
        places = zip(starts[self.spring_elements], within, strict=True)
        self.spring_places = np.concatenate([none, *(k + own for k, own in places)])
        self.has_bowing = bool(np.any(self.axial))
        self.load_point, self.load_force = np.zeros((2, N, len(loads), 3))
        for i, load in enumerate(loads):
            self.load_point[:, i], self.load_force[:, i] = load.point, load.force
        self.load_after = np.array([load.after for load in loads], dtype=int)
        self.body_rows = list(body_rows)
        self.moves = moves.astype(float)[:, None, None]
        self._set_order(starts)
        #: Velocity and angular velocity (N, n, 2, 3) by its coordinates, as far as they stay.
        self.local = np.zeros((N, self.size, 2, 3))
        self.local[:, self.joint_places, 0] = self.axis * self.slide
        self.local[:, self.joint_places, 1] = self.axis * self.turning
        shifts = self.own_axes @ self.modes[:, :, :3]
        self.local[:, self.spring_places, 0] = self._columns_of_springs(shifts)

    def _put(self, e: Element, rows: slice, i: int) -> None:
        """An element of some rows as the i-th joint or elastic part."""
        if isinstance(e, FiniteJoint):
            self.axis[rows, i], self.slide[rows, i, 0] = e.axis, e.slide
            self.stiffness[rows, i], self.preload[rows, i] = e.stiffness, e.preload
            self.laws += [
                (rows.start + n, i, law) for n, law in enumerate(e.laws) if law is not None
            ]
            return
        self.own_axes[rows, i], self.modes[rows, i, :, : e.size] = e.rotation, e.modes
        self.mode_stiffness[rows, i, : e.size] = e.stiffness
        self.axial[rows, i, 0], self.bowing[rows, i, : e.size, : e.size] = e.axial, e.bowing

    def _set_order(self, starts: np.ndarray) -> None:
        body = len(self.body_rows)
        own = np.repeat(np.arange(self.slots), np.diff(starts))
        #: Element that moves by each unknown, counted from the body at the start.
        self.order = np.concatenate([np.zeros(body, dtype=int), own + bool(body)])
        self.nearer = self.order[:, None] < self.order[None, :]
        self.same = self.order[:, None] == self.order[None, :]
        self.joint_columns = self.joint_places + body
        self.spring_columns = self.spring_places + body
        n = len(self.order)
        # Blocks of the elastic parts, among all pairs of their coordinates.
        width = max(self.modes.shape[-1], 1)
        a, b = np.nonzero(self.full[:, None] // width == self.full // width)
        self.block_pairs = width * self.full[a] + self.full[b] % width
        self.block_places = self.spring_columns[a] * n + self.spring_columns[b]

    @property
    def is_loaded(self) -> bool:
        """Whether forces act on its bodies, or preloads in its joints."""
        return bool(self.load_after.size) or bool(np.any(self.preload))

    def moved(self, x: np.ndarray, start: BodyPlace | None) -> np.ndarray:
        """The chains at coordinates x (N, size), from where their start is; None for the base.

        Motions (N, K + 1, 4, 4) from the unloaded posture of the body at the start, and of that
        behind every element.
        """
        return self._moved(self._steps(x), start)

    def _steps(self, x: np.ndarray) -> _Steps:
        """Turns of all elements, in world axes of the unloaded posture, and of elastic parts.

        Between them where the far ends are taken, in these axes [m].
        """
        E, far = np.empty((*self.point.shape, 3)), self.point.copy()
        q = x[:, self.joint_places][..., None]
        angle = (q * self.turning)[..., None]
        versine = 2.0 * np.sin(0.5 * angle) ** 2
        E[:, self.joint_elements] = (
            _IDENTITY + np.sin(angle) * self.axis_skew + versine * self.axis_skew_squared
        )
        far[:, self.joint_elements] += self.axis * self.slide * q
        y = self._spring_coordinates(x)
        th = (self.modes @ y[..., None])[..., 0]
        turned = turn_and_rates(th[..., 3:])
        own = self.own_axes
        E[:, self.spring_elements] = own @ turned.R @ np.swapaxes(own, -1, -2)
        far[:, self.spring_elements] += (own @ th[..., :3, None])[..., 0]
        return E, far, turned

    def _moved(self, steps: _Steps, start: BodyPlace | None) -> np.ndarray:
        N, K = self.point.shape[:2]
        M = np.zeros((N, K, 4, 4))
        E, far, _ = steps
        M[..., :3, :3], M[..., 3, 3] = E, 1.0
        M[..., :3, 3] = far - (E @ self.point[..., None])[..., 0]
        T = np.empty((N, K + 1, 4, 4))
        T[:, 0] = np.eye(4)
        if start is not None:
            T[:, 0, :3, :3], T[:, 0, :3, 3] = start.R, start.t
        for k in range(K):
            np.matmul(T[:, k], M[:, k], out=T[:, k + 1])
        return T

    def _spring_coordinates(self, x: np.ndarray) -> np.ndarray:
        y = np.zeros((self.count, self.modes.shape[1] * self.modes.shape[3]))
        y[:, self.full] = x[:, self.spring_places]
        return y.reshape(self.mode_stiffness.shape)

    def terms(
        self,
        x: np.ndarray,
        start: BodyPlace | None,
        centre: np.ndarray | None,
        end_point: np.ndarray,
        W: np.ndarray,
        share: float,
        pulls: np.ndarray | None = None,
    ) -> ChainTerms:
        """What the chains contribute to the equations of their legs, at coordinates (N, size).

        With a nearer the base than b, ``d_b v_a = w_a x v_b`` and ``d_b w_a = 0``; with b nearer,
        ``d_b v_a = w_b x v_a`` and ``d_b w_a = w_b x w_a``, the Lie bracket. Within an element,
        ``d_b v_a = d_b w_a x s + w_a x (w_b x s)``, s from its point to the one that moves. A force
        f feels of that ``w_a . (J_b x f)``, with J_b the velocity of its own point by b, and within
        an element ``w_a . ((w_b x s) x f)``.

        Parameters
        ----------
        start, centre : BodyPlace and (N, 3) array, or None
            Of the body at the start, and its point, about which its twist is [m]; None for base.
        end_point : (N, 3) array
            Point of the body at the end, at the unloaded posture [m].
        W : (N, 6) array
            What that body exerts on the chain, about the point where the chain has it [N, N m].
        share, pulls : float, and (N, L, 3) array or None
            Share of loads and preloads; forces at the points of the loads beside these [N].
        """
        steps = self._steps(x)
        T = self._moved(steps, start)
        w, v, C = self._columns(steps, T, centre)
        end = BodyPlace(T[:, -1, :3, :3], T[:, -1, :3, 3])
        P, f, M = end.of(end_point)[:, None], W[:, None, :3], W[:, None, 3:]
        turning = crossed(w, P - C[:, self.order])
        moving = v + turning
        J = np.concatenate([moving, w], axis=-1)
        gradient = -np.sum(moving * f + w * M, axis=-1)
        across, within = crossed(moving, f), crossed(turning, f)
        by_share = np.zeros(w.shape[:2])
        by_share[:, self.joint_columns] = -self.preload
        moment = M + crossed(P - C, f)
        if len(self.load_after):
            at = self._loaded_points(T)
            moving, turning = self._at_loads(w, v, C, at)
            by_share -= np.sum(moving * self.load_force[:, :, None], axis=(1, 3))
            loads = share * self.load_force if pulls is None else share * self.load_force + pulls
            f = loads[:, :, None]
            gradient -= np.sum(moving * f, axis=(1, 3))
            across = across + np.sum(crossed(moving, f), axis=1)
            within = within + np.sum(crossed(turning, f), axis=1)
            arms = (at[:, :, None] - C[:, None]) * self._reach(C.shape[1]).T[..., None]
            moment = moment + np.sum(crossed(arms, f), axis=1)
        U = w @ np.swapaxes(across, -1, -2)
        bracket = crossed(w, M) @ np.swapaxes(w, -1, -2)
        H = np.where(self.nearer, U, np.swapaxes(U, -1, -2) + bracket)
        H = np.where(self.same, w @ np.swapaxes(within, -1, -2), H)
        tangent = -H
        q = x[:, self.joint_places]
        tangent[:, self.joint_columns, self.joint_columns] += self.stiffness
        gradient[:, self.joint_columns] += self.stiffness * q - share * self.preload
        for n, i, law in self.laws:
            column, own, k = self.joint_columns[i], float(q[n, i]), self.stiffness[n, i]
            gradient[n, column] += law.at(own) - k * own
            tangent[n, column, column] += law.tangent(own) - k
        if len(self.spring_elements):
            _, force, curvature = self._stored(x)
            gradient[:, self.spring_columns] += force.reshape(self.count, -1)[:, self.full]
            beyond = moment[:, self.spring_elements + (C.shape[1] - self.slots)]
            axes = T[:, self.spring_elements, :3, :3] @ self.own_axes
            about = (np.swapaxes(axes, -1, -2) @ beyond[..., None])[..., 0]
            V = self.modes[:, :, 3:]
            block = curvature - np.swapaxes(V, -1, -2) @ steps[2].rate_felt(about) @ V
            flat = tangent.reshape(self.count, -1)
            flat[:, self.block_places] += block.reshape(self.count, -1)[:, self.block_pairs]
        return ChainTerms(end, np.swapaxes(J, -1, -2), tangent, gradient, by_share)

    def _columns(
        self, steps: _Steps, T: np.ndarray, centre: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angular velocities and velocities (N, n, 3) about points of the elements (N, K, 3)."""
        _, far, turned = steps
        before, body = T[:, :-1], len(self.body_rows)
        C = (before[..., :3, :3] @ far[..., None])[..., 0] + before[..., :3, 3]
        local = self.local.copy()
        turning = self.own_axes @ turned.W @ self.modes[:, :, 3:]
        local[:, self.spring_places, 1] = self._columns_of_springs(turning)
        axes = before[:, self.order[body:] - bool(body), :3, :3]
        both = local @ np.swapaxes(axes, -1, -2)
        v, w = both[:, :, 0], both[:, :, 1]
        if body and centre is not None:
            unit = self.moves * np.eye(6)[self.body_rows]
            v = np.concatenate([unit[..., :3], v], axis=1)
            w = np.concatenate([unit[..., 3:], w], axis=1)
            C = np.concatenate([centre[:, None], C], axis=1)
        return w, v, C

    def _columns_of_springs(self, by: np.ndarray) -> np.ndarray:
        """Of matrices (N, S, 3, c) the columns that there are (N, m, 3)."""
        columns = np.swapaxes(by, -1, -2).reshape(self.count, by.shape[1] * by.shape[3], 3)
        return columns[:, self.full]

    def _stored(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Energy of the elastic parts (N, S), bowing of beams among it; gradient and curvature."""
        y = self._spring_coordinates(x)
        ky = self.mode_stiffness * y
        value, gradient = 0.5 * np.sum(ky * y, axis=-1), ky
        curvature = self._elastic
        if not self.has_bowing:
            return value, gradient, curvature
        more = bowing_energy(y, self.axial, self.modes[:, :, 0], self.bowing)
        return value + more[0], gradient + more[1], curvature + more[2]

    @cached_property
    def _elastic(self) -> np.ndarray:
        return self.mode_stiffness[..., None] * np.eye(self.modes.shape[-1])

    def loaded(
        self, x: np.ndarray, start: BodyPlace | None, centre: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Where loads act (N, L, 3) [m], and velocities there by the unknowns (N, L, 3, n)."""
        steps = self._steps(x)
        T = self._moved(steps, start)
        w, v, C = self._columns(steps, T, centre)
        at = self._loaded_points(T)
        return at, np.swapaxes(self._at_loads(w, v, C, at)[0], -1, -2)

    def twists(
        self, x: np.ndarray, start: BodyPlace | None, centre: np.ndarray | None, about: np.ndarray
    ) -> np.ndarray:
        """Twists (N, n, 6) about a point (3,) of what each unknown moves."""
        steps = self._steps(x)
        w, v, C = self._columns(steps, self._moved(steps, start), centre)
        return np.concatenate([v + crossed(w, about - C[:, self.order]), w], axis=-1)

    def moving(self, behind: np.ndarray) -> np.ndarray:
        """Which unknowns move the bodies behind so many slots (K, n)."""
        return self.order < behind[:, None] + bool(self.body_rows)

    def _at_loads(
        self, w: np.ndarray, v: np.ndarray, C: np.ndarray, at: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Velocities of points (N, L, 3) by unknowns (N, L, n, 3), and the part due to turning."""
        reach = self._reach(C.shape[1])[self.order].T[..., None]
        turning = crossed(w[:, None], at[:, :, None] - C[:, None, self.order]) * reach
        return v[:, None] * reach + turning, turning

    def _loaded_points(self, T: np.ndarray) -> np.ndarray:
        """Where loads act (N, L, 3) [m]."""
        behind = T[:, self.load_after]
        at = (behind[..., :3, :3] @ self.load_point[..., None])[..., 0]
        return at + behind[..., :3, 3]

    def _reach(self, elements: int) -> np.ndarray:
        """Which element, counted from the body at the start, feels which load (K, L)."""
        return np.arange(elements)[:, None] < self.load_after + (elements - self.slots)

    def energies(self, x: np.ndarray) -> np.ndarray:
        """Elastic energy in every slot (N, K) [J], preloads left out."""
        found = np.zeros((self.count, self.slots))
        found[:, self.joint_elements] = 0.5 * self.stiffness * x[:, self.joint_places] ** 2
        for n, i, law in self.laws:
            found[n, self.joint_elements[i]] = law.energy(float(x[n, self.joint_places[i]]))
        if len(self.spring_elements):
            found[:, self.spring_elements] = self._stored(x)[0]
        return found

    def load_potential(self, x: np.ndarray, start: BodyPlace | None) -> np.ndarray:
        """Potential of whole loads and preloads, 0 at the unloaded posture (N,) [J]."""
        found = -np.sum(self.preload * x[:, self.joint_places], axis=-1)
        if len(self.load_after):
            at = self._loaded_points(self.moved(x, start))
            found -= np.sum(self.load_force * (at - self.load_point), axis=(-1, -2))
        return found

"""Newton's method for the nearest closed posture, and for postures in the assembly mode of one.

An assembly mode are the postures reached on paths without singularity.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from itertools import pairwise

import numpy as np

from robostiff.elastostatics.tolerance import Tolerance
from robostiff.frozen import frozen
from robostiff.kinematics.closure.loops import ClosurePart, Loops
from robostiff.spatial.batch import transpose

CLOSED = 1e-10
CONVERGED = 1e-14
_STANDSTILL = 1e-11
_NEAREST_ITERATIONS = 60
# Part by which a step may lessen the squares of gaps that many such steps leave as they are.
_STATIONARY = 1e-12
_LARGEST_STEP = 0.5
_NEARLY_CLOSED = 1e-7
_NEWTON_STEPS = 6
# Beyond them, of what is closed to CLOSED: near a singular posture such a gap still costs digits.
_LAST_STEPS = 2
_CONTRACTION = 0.5
# Steps below this are as small as rounding makes them: they need not become smaller.
_SMALL_STEP = 1e-9
# A part of the way from home that is too long for one is cut into so many, down to the shortest:
# postures near a singularity may turn fast.
_CUT, SHORTEST = 4.0, 1.0 / 4096.0
#: Where a way ends in its last such part, modes may meet at its end.
LAST_PART = 1.0 / 64.0
# Smallest singular value, as a part of home's, below which assembly modes meet. At a limit of reach
# a gap leads as far beyond the singularity as its square root; rounding is a gap as well.
_MEETING, _BEYOND_MEETING, _ROUNDING = 1e-2, 3.0, 1e-13
# Below this part of home's a step of Newton's method may lead across the singularity.
_WATCHED = 0.1
# A first step beyond half a turn, from home near a singularity, says nothing about where it leads.
_LONG_STEP = np.pi
_INDEPENDENT = Tolerance().independence
# Coordinates this far from home, in radians and parts of the length, say what rank is usual there.
_ASIDE, _SEED = 1e-3, 5
# Starts around a singular home, as far from it.
_TRIES, _BESIDE = 4, 0.2


def nearest(loops: Loops, x: np.ndarray) -> np.ndarray:
    """Postures closed, or as nearly as possible, by Levenberg steps from guesses x (N, size).

    Steps are damped by the square of the gap. They may lead to another assembly mode. A posture is
    left where the sum of squares of its gaps is stationary: it remains as nearly closed as it is.
    """
    best, best_size = x.copy(), np.full(len(x), np.inf)
    going = np.arange(len(x))
    for _ in range(_NEAREST_ITERATIONS):
        e, J = loops.gaps_and_rates(x)
        size = np.max(np.abs(e), axis=-1, initial=0.0)
        better = size < best_size[going]
        best[going[better]], best_size[going[better]] = x[better], size[better]
        closed = (best_size[going] <= CONVERGED) | (~better & (best_size[going] < _STANDSTILL))
        step = np.zeros((len(e), J.shape[-1]))
        if J.shape[-1]:  # something can move
            J_T, wide = transpose(J), J.shape[-1] > J.shape[-2]
            A = J @ J_T if wide else J_T @ J
            trace = np.trace(A, axis1=-2, axis2=-1) / A.shape[-1]
            trace = np.where(trace > 0, trace, 1.0)  # else any damping keeps a gap at rest
            damping = np.maximum(np.minimum(size, 1.0) ** 2, 1e-15) * trace
            np.einsum("...ii->...i", A)[...] += damping[:, None]
            step = np.linalg.solve(A, e[..., None] if wide else J_T @ e[..., None])
            step = (J_T @ step if wide else step)[..., 0]
        J_step = np.einsum("...ij,...j->...i", J, step)
        falls = np.sum(e * J_step, axis=-1) > _STATIONARY * np.sum(e * e, axis=-1)
        on = ~closed & falls
        if not np.any(on):
            break
        going, x, step = going[on], x[on], step[on]
        longest = np.max(np.abs(step), axis=-1, keepdims=True)
        x = loops.after_step(x, step * np.minimum(1.0, _LARGEST_STEP / np.maximum(longest, 1e-300)))
    return best


@frozen
class _Directions:
    """Combinations of equations and of unknowns in which a part is square and regular.

    ``U`` (N, m, r) and ``V`` (N, n, r) are orthonormal, ``sign`` that of det U^T J V.
    """

    U: np.ndarray
    V: np.ndarray
    sign: np.ndarray
    ranks: tuple[int, int]  # of loops inside legs, and of all else

    def of_rows(self, rows: np.ndarray) -> _Directions:
        """Those of some postures; of home alone they are the same for all."""
        if len(self.U) == 1:
            return self
        return _Directions(self.U[rows], self.V[rows], self.sign[rows], self.ranks)

    def square(self, J: np.ndarray) -> np.ndarray:
        """U^T J V (N, r, r)."""
        return transpose(self.U) @ J @ self.V


@frozen
class Followed:
    """Postures at prescribed coordinates."""

    x: np.ndarray  # (N, size): the nearest that was found where there is none
    closed: np.ndarray  # (N,) of bool: where they close in the assembly mode of home
    # (N,) of bool: where they close, but no path without singularity was found that leads there
    # from home
    elsewhere: np.ndarray
    ends: tuple[int, ...] = ()  # of the coordinates of a pose, and of each leg after it

    @property
    def pose(self) -> np.ndarray:
        """Pose coordinates (N, 6): x, y, z, rotation vector."""
        return self.x[:, :6]

    @property
    def coordinates(self) -> list[np.ndarray]:
        """Views of the coordinates (N, size) of each leg."""
        return [self.x[:, a:b] for a, b in pairwise(self.ends)]


def follow(
    loops: Loops, home: np.ndarray, given: np.ndarray, near: np.ndarray | None = None
) -> Followed:
    """Postures at prescribed coordinates (N, g), in the assembly mode of a closed one (size,).

    At its own coordinates that is the posture. With another one that need not close, so that no
    path leads from it, those closed from there.
    """
    if near is not None:
        x = np.tile(near, (len(given), 1))
        x[:, loops.given] = given
        return closed_near(loops, x)
    mode = mode_of(loops, home)
    away = np.any(given != home[loops.given], axis=-1)
    if away.all() or not mode.is_closed:
        return mode.at(given)
    x, closed, elsewhere = np.tile(home, (len(given), 1)), ~away, np.zeros(len(given), dtype=bool)
    if away.any():
        found = mode.at(given[away])
        x[away], closed[away], elsewhere[away] = found.x, found.closed, found.elsewhere
    return Followed(x, closed, elsewhere, loops.ends)


def mode_of(loops: Loops, home: np.ndarray) -> AssemblyMode:
    """The assembly mode of a closed posture (size,), prepared once."""
    key = home.tobytes()
    if key not in loops.modes:
        loops.modes.clear()
        loops.modes[key] = AssemblyMode(loops, home)
    return loops.modes[key]


def straight_ways(
    count: int, goes: Callable[[np.ndarray, np.ndarray], np.ndarray], shortest: float
) -> np.ndarray:
    """How far straight ways lead (count,), 1 at their end, gone part by part.

    A part that fails is cut into smaller ones, which begin where the last one ended. By numbers of
    ways (m,), and the part of each that is to be gone, `goes` says where that succeeds.
    """
    gone, part = np.zeros(count), np.full(count, 1.0 / _CUT)
    going = np.arange(count)
    while going.size:
        kept = goes(going, gone[going] + part[going])
        part[going[~kept]] /= _CUT
        won = going[kept]
        gone[won] += part[won]
        longer = _CUT * part[won]
        whole = (longer < 1.0) & (np.mod(gone[won], longer) == 0.0)
        part[won[whole]] = longer[whole]
        going = going[(gone[going] < 1.0) & (part[going] >= shortest)]
    return gone


def closed_near(loops: Loops, x: np.ndarray) -> Followed:
    """Postures closed from guesses (N, size), in the assembly mode of each guess."""
    x = nearest(loops, x)
    closed = np.max(np.abs(loops.gaps(x)), axis=-1) <= CLOSED
    return Followed(x, closed, np.zeros(len(x), dtype=bool), loops.ends)


@frozen
class AssemblyMode:
    """The assembly mode of a closed posture: postures reached on paths without singularity.

    Along the way every part keeps the sign of its determinant det(U^T J V), and each Newton step is
    at most half of the one before, six at most, and the first one no longer than half a turn. At
    its end telescopes are longer than zero. The way is gone at once where that holds, otherwise in
    parts of 1/4, which are cut by four down to 1/4096 where they have to be. The answer at a pose
    is the same to the last bit whatever other poses come with it.
    """

    loops: Loops
    home: np.ndarray  # (size,): the closed posture

    @cached_property
    def is_closed(self) -> bool:
        """Whether home closes as well as any posture that is found; dimensions may lack digits."""
        return bool(_size(self.loops.gaps(self.home[None]))[0] <= _STANDSTILL)

    def at(self, given: np.ndarray) -> Followed:
        """Postures at prescribed coordinates (N, g), in the order of ``loops.given``."""
        x = np.tile(self.home, (len(given), 1))
        x[:, self.loops.given] = given
        x, kept, J = self._stepped(x, self._at_home)
        long = self._is_long(x)
        J, kept = J[long[kept]] if len(J) else J, kept & long
        if self._at_home is None:
            self._start_aside(x, kept, given)
        elsewhere = np.zeros(len(x), dtype=bool)
        rows = np.flatnonzero(~kept)
        at_once = rows.size == 0
        if not at_once:
            x[rows], gone, directions = self._along(given[rows])
            kept[rows], left = (gone >= 1.0) & self._is_long(x[rows]), gone < 1.0
            rows = rows[left]
            if rows.size:
                own = directions and [one.of_rows(left) for one in directions]
                guess = x[rows]
                guess[:, self.loops.given] = given[rows]
                x[rows] = nearest(self.loops, guess)
                gap = _size(self.loops.gaps(x[rows]))
                closed = (gap <= _NEARLY_CLOSED) & self._is_long(x[rows])
                arrived = gone[left] >= 1.0 - LAST_PART
                kept[rows] = closed & arrived & self._meets(x[rows], gap, own)
                elsewhere[rows] = closed & ~kept[rows]
        if self._at_home is None:  # modes meet there
            return Followed(x, kept, elsewhere, self.loops.ends)
        rows = np.flatnonzero(kept)
        if rows.size:
            J = J if at_once else self.loops.rates(x[rows])
            singular = np.zeros(len(rows), dtype=bool)
            for part, usual in zip(self.loops.parts, self._usual, strict=True):
                if usual.size:  # the smallest singular value has nearly vanished
                    values = np.linalg.svd(_of_part(part, J), compute_uv=False)[:, usual.size - 1]
                    singular |= values < _WATCHED * usual[-1]
            rows = rows[singular]
        if rows.size:
            beyond = rows[self._crosses(x[rows], given[rows], self._at_home[-1])]
            kept[beyond], elsewhere[beyond] = False, True
        return Followed(x, kept, elsewhere, self.loops.ends)

    def _start_aside(self, x: np.ndarray, kept: np.ndarray, given: np.ndarray) -> None:
        """Close postures x (N, size) from around a singular home where none is kept, in place.

        No step from there leads out of a plane in which all axes are: that of a head that stands
        upright turns the tool one way, and has to be turned itself before.
        """
        random = np.random.default_rng(_SEED)
        unknowns = len(self.loops.parts[-1].unknowns)
        for aside in random.uniform(-_BESIDE, _BESIDE, (_TRIES, unknowns)):
            rows = np.flatnonzero(~kept)
            if not rows.size:
                return
            guess = self.loops.after_step(np.tile(self.home, (rows.size, 1)), aside[None])
            guess[:, self.loops.given] = given[rows]
            found = nearest(self.loops, guess)
            closed = _size(self.loops.gaps(found)) <= _NEARLY_CLOSED
            closed &= self._is_long(found)
            x[rows[closed]], kept[rows[closed]] = found[closed], True

    def _crosses(self, x: np.ndarray, given: np.ndarray, at_home: _Directions) -> np.ndarray:
        """Where the way to nearly singular postures crosses the singularity just before them (N,).

        Modes meet there, and a step may lead to the other one, in which determinants keep their
        signs. Smallest singular values of two postures before, with the sign of the determinant,
        say by extrapolation where they vanish.
        """
        crosses = np.zeros(len(x), dtype=bool)
        places, before, known = self.loops.given, [x], np.ones(len(x), dtype=bool)
        for back in (1, 2):
            guess = before[-1].copy()
            guess[:, places] = given + back * LAST_PART * (self.home[places] - given)
            closed, found, *_ = self._newton(guess, at_home)
            before.append(closed)
            known &= found
        J_near, J_far = (self.loops.rates(one) for one in before[1:])
        for k in np.flatnonzero(known):
            for part in self.loops.parts:
                own = _directions(part, J_near[[k]])
                if own.V.shape[-1]:
                    (a,), (b,) = (own.square(_of_part(part, J[[k]])) for J in (J_near, J_far))
                    at_near, at_far = (np.linalg.svd(T, compute_uv=False)[-1] for T in (a, b))
                    crosses[k] |= 2 * at_near < at_far * np.linalg.slogdet(b)[0] * own.sign[0]
        return crosses

    def _meets(
        self, x: np.ndarray, gap: np.ndarray, directions: list[_Directions] | None
    ) -> np.ndarray:
        """Where postures are so singular that assembly modes meet, beyond by no more than gaps."""
        if directions is None or self._at_home is None:
            return np.zeros(len(x), dtype=bool)
        margin = np.full(len(x), np.inf)
        J = self.loops.rates(x)
        for part, own, usual in zip(self.loops.parts, directions, self._usual, strict=True):
            T = own.square(_of_part(part, J))
            if usual.size:
                smallest = np.linalg.svd(T, compute_uv=False)[:, -1] / usual[-1]
                margin = np.minimum(margin, smallest * np.linalg.slogdet(T)[0] * own.sign)
        beyond = _BEYOND_MEETING * np.sqrt(np.maximum(gap, _ROUNDING))
        return (margin > -beyond) & (margin < _MEETING)

    def _is_long(self, x: np.ndarray) -> np.ndarray:
        """Where telescopes that have a length at home keep one."""
        at_home = self.loops.lengths(self.home[None])[0] > 0
        return np.all(self.loops.lengths(x)[:, at_home] > 0, axis=-1)

    def way_ends(self, x: np.ndarray, given: np.ndarray) -> np.ndarray:
        """Where the straight way to prescribed coordinates (N, g) ends at postures on it (N,).

        They are closed, and not the shortest part of the way leads on in their assembly mode.
        """
        if self._at_home is None:
            return np.zeros(len(x), dtype=bool)
        e, J = self.loops.gaps_and_rates(x)
        pairs = zip(self.loops.parts, self._at_home, strict=True)
        own, ahead = [_directions(part, J, every.ranks) for part, every in pairs], x.copy()
        places = self.loops.given
        ahead[:, places] += SHORTEST * (given - self.home[places])
        return (_size(e) <= CLOSED) & ~self._stepped(ahead, own)[1]

    def _along(self, given: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[_Directions] | None]:
        """Last postures on the straight way from home, the part that is gone, and directions."""
        places, x = self.loops.given, np.tile(self.home, (len(given), 1))
        start, each = self.home[places], np.zeros(len(x), dtype=int)
        directions = self._at_home and [
            _Directions(one.U[each], one.V[each], one.sign[each], one.ranks)
            for one in self._at_home
        ]

        def goes(rows: np.ndarray, aim: np.ndarray) -> np.ndarray:
            there = x[rows]
            there[:, places] = start + aim[:, None] * (given[rows] - start)
            own = directions and [one.of_rows(rows) for one in directions]
            there, kept, J = self._stepped(there, own)
            won = rows[kept]
            x[won] = there[kept]
            if directions and won.size:
                for part, every in zip(self.loops.parts, directions, strict=True):
                    new = _directions(part, J, every.ranks)
                    every.U[won], every.V[won], every.sign[won] = new.U, new.V, new.sign
            return kept

        return x, straight_ways(len(x), goes, SHORTEST), directions

    def _stepped(
        self, x: np.ndarray, directions: list[_Directions] | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Closed from guesses, where that keeps the assembly mode, and rates there."""
        J = rates = np.zeros((0, 0, 0))
        if directions is None:
            x = nearest(self.loops, x)
            kept = _size(self.loops.gaps(x)) <= _NEARLY_CLOSED
        else:
            x, kept, rates = self._newton(x, directions[-1])
        if directions is not None and np.any(kept):
            J = rates[kept]
            same = np.ones(len(J), dtype=bool)
            for part, every in zip(self.loops.parts, directions, strict=True):
                one = every.of_rows(kept)
                same &= np.linalg.slogdet(one.square(_of_part(part, J)))[0] * one.sign > 0
            kept[kept], J = same, J[same]
        return x, kept, J

    def _newton(
        self, x: np.ndarray, directions: _Directions
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Closed from guesses by steps that contract from a short one on, where that succeeds."""
        x, rates = x.copy(), np.zeros((0, 0, 0))
        closed = np.zeros(len(x), dtype=bool)
        last = np.full(len(x), np.inf)
        going = np.arange(len(x))
        for taken in range(_NEWTON_STEPS + _LAST_STEPS + 1):
            e, J = self.loops.gaps_and_rates(x[going])
            if taken == 0:
                rates = np.empty((len(x), *J.shape[1:]))
            size = _size(e)
            still = last[going] <= _SMALL_STEP
            # Where nothing moves any more, dimensions with few digits may leave a little open.
            here = size <= np.where(still, _NEARLY_CLOSED, CLOSED)
            closed[going], rates[going[here]] = here, J[here]
            on = (size > CONVERGED) & ~still
            is_last = taken >= _NEWTON_STEPS
            if is_last:
                on &= size <= CLOSED
            if taken == _NEWTON_STEPS + _LAST_STEPS or not np.any(on):
                break
            going, e, J = going[on], e[on], J[on]
            own = directions.of_rows(going)
            whole = self.loops.parts[-1]
            T = own.square(_of_part(whole, J))
            right = transpose(own.U) @ np.take(e, whole.equations, axis=1)[..., None]
            try:
                found = np.linalg.solve(T, right)
            except np.linalg.LinAlgError:  # no number where T is singular
                singular = (np.linalg.slogdet(T)[0] == 0)[:, None, None]
                T = np.where(singular, np.eye(T.shape[-1]), T)
                found = np.where(singular, np.nan, np.linalg.solve(T, right))
            step = (own.V @ found)[..., 0]
            length = np.sqrt(np.sum(step * step, axis=-1))
            most = _LONG_STEP if taken == 0 else _CONTRACTION * last[going]
            contracts = (length <= most) | (length <= _SMALL_STEP)
            closed[going[~contracts]] = is_last
            going, step, length = going[contracts], step[contracts], length[contracts]
            if going.size == 0:
                break
            x[going], last[going] = self.loops.after_step(x[going], step), length
        return x, closed, rates

    @cached_property
    def _at_home(self) -> list[_Directions] | None:
        """Directions at home; None where home is singular, so that modes meet there."""
        J, home = self._rates_at_home, self.home[None]
        aside = np.random.default_rng(_SEED).uniform(-_ASIDE, _ASIDE, J.shape[::2])
        J_aside = self.loops.rates(self.loops.after_step(home, aside))
        here, there = ([_directions(part, x) for part in self.loops.parts] for x in (J, J_aside))
        falls = any(own.V.shape[-1] < one.V.shape[-1] for own, one in zip(here, there, strict=True))
        return None if falls else here

    @cached_property
    def _rates_at_home(self) -> np.ndarray:
        return self.loops.rates(self.home[None])

    @cached_property
    def _usual(self) -> list[np.ndarray]:
        """Singular values at home, part by part; of a singular home none."""
        return [
            np.linalg.svd(own.square(_of_part(part, self._rates_at_home)), compute_uv=False)[0]
            for part, own in zip(self.loops.parts, self._at_home or (), strict=False)
        ]


def _size(e: np.ndarray) -> np.ndarray:
    return np.max(np.abs(e), axis=-1, initial=0.0)


def _of_part(part: ClosurePart, J: np.ndarray) -> np.ndarray:
    """The rates of one part, those of loops first."""
    # Indices leave equal entries of all postures side by side, which products sum in another order.
    return np.ascontiguousarray(J[..., part.equations[:, None], part.unknowns])


def _directions(
    part: ClosurePart, J: np.ndarray, ranks: tuple[int, int] | None = None
) -> _Directions:
    """Directions at postures by singular values, of loops first; of some ranks, or of the first."""
    J, k = _of_part(part, J), len(part.loops)
    loops, ends = ranks or (None, None)
    U_loops, V_loops = _spans(J[:, :k], loops)
    rest = J[:, k:] - (J[:, k:] @ V_loops) @ transpose(V_loops)
    U_ends, V_ends = _spans(rest, ends)
    r = U_loops.shape[-1]
    U = np.zeros((*J.shape[:2], r + U_ends.shape[-1]))
    U[:, :k, :r], U[:, k:, r:] = U_loops, U_ends
    V = np.concatenate([V_loops, V_ends], axis=-1)
    sign = np.linalg.slogdet(transpose(U) @ J @ V)[0]
    return _Directions(U, V, sign, (r, U_ends.shape[-1]))


def _spans(A: np.ndarray, rank: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal bases of the range of matrices, and of the complement of their null space."""
    if 0 in A.shape[1:]:
        return np.zeros((*A.shape[:2], 0)), np.zeros((len(A), A.shape[2], 0))
    U, s, V_T = np.linalg.svd(A, full_matrices=False)
    rank = int(np.count_nonzero(s[0] > _INDEPENDENT)) if rank is None else rank
    return U[..., :rank], transpose(V_T[:, :rank])

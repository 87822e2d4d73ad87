"""Legs that carry a force along the line between two points alone, and how soon they buckle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from robostiff.record import Entry, reciprocal, square_root, usual_size
from robostiff.recorded.leg import RecordedLeg
from robostiff.spatial import cross
from robostiff.statics.chains.elements import (
    Element,
    FiniteJoint,
    FiniteSpring,
    Share,
)
from robostiff.statics.chains.legs import Legs
from robostiff.statics.equations.problem import EquilibriumProblem
from robostiff.statics.equations.stability import margins_of
from robostiff.statics.kernels.leg import MovingBody

_SAME = 1e-9  # of the length, or of a compliance: rounding at the samples
_DEGREE = 3
# Between the lengths of a fit: a part of it, and how many times what it misses at these.
_PART, _MISSED = 1.03, 2.0
# Of the rates of the other sign: rounding.
_NONE = 1e-6


@dataclass(frozen=True)
class RecordedStrut:
    """A spring between a point of the base and one of the platform."""

    # (3,) of entries and numbers: at the unloaded posture [m]
    A: np.ndarray
    B: np.ndarray
    reference: np.ndarray  # point of the platform
    stiffness: Any  # entry or number: along the line [N/m]
    unloaded: RecordedLeg  # the same as a leg without load

    def first_force(self, twist: np.ndarray) -> Any:
        """To first order, after a twist (6,) of the platform from the unloaded posture."""
        (w,), (mu,) = self.unloaded.wrenches, self.unloaded.mu
        size = square_root(_square_of_force(w))
        sign = np.sign(_values(np.array(w[:3], dtype=object) @ (self.B - self.A))[0])
        return (np.array([x / mu for x in w], dtype=object) @ twist) * size * float(sign)

    @property
    def length(self) -> Any:
        """Unloaded [m]."""
        d = self.B - self.A
        return square_root(d @ d)


@dataclass(frozen=True)
class StrutTerms:
    """What some struts carry together, and each of them.

    W (6,) is their wrench about the point of the platform, K the symmetric part of their stiffness,
    upper triangle, and `moment` is W[3:] of the forces that K is of; of each, `rates` are those of
    its force by the twist of the platform, t is this force [N], `lengths` are without load [m].
    """

    W: np.ndarray
    K: dict[tuple[int, int], Any]
    moment: np.ndarray
    rates: list[tuple[Any, np.ndarray]]
    t: list[Any]
    lengths: list[Any]

    def forces_after(self, twist: np.ndarray) -> list[Any]:
        """To first order, after a twist (6,) of the platform."""
        return [t + (g @ twist) * k for t, (k, g) in zip(self.t, self.rates, strict=True)]


def strut_terms(
    struts: Sequence[RecordedStrut], body: MovingBody, forces: Sequence[Any] | None = None
) -> StrutTerms:
    """Struts between the base and a body that has moved.

    With d along a strut of length l, unloaded l_0, c from the point of the body to its end, ``g =
    (d, c x d)`` and ``s = t/l = k - k l_0/l``, W is the sum of ``s g``, and K, symmetric part, that
    of ``(k - s) g g^T / l^2`` and of forces that turn.

    `forces` are those that turn with the struts, t where left out. A Newton step with the forces
    that a long step before it led to, as those of a wrench that is an unknown, comes closer: what
    stretches a strut to second order is no force that holds.
    """
    R, at = body
    rates, tensions, lengths, turning = [], [], [], []
    W: list[Any] = [0] * 6
    K: dict[tuple[int, int], Any] = {(i, j): 0 for i in range(6) for j in range(i, 6)}
    for number, own in enumerate(struts):
        c = R @ (own.B - own.reference)
        d = c + (at - own.A)
        square = d @ d
        by = reciprocal(square_root(square))
        unloaded = own.length
        soft = own.stiffness * unloaded * by
        s = own.stiffness - soft
        g = np.concatenate([d, cross(c, at - own.A)])
        turning.append(s if forces is None else forces[number] * by)
        scaled = g * ((soft if forces is None else own.stiffness - turning[-1]) * (by * by))
        for i in range(6):
            W[i] = W[i] + g[i] * s
            for j in range(i, 6):
                K[i, j] = K[i, j] + scaled[i] * g[j]
        rates.append((own.stiffness * by, g))
        tensions.append(s * (square * by))
        lengths.append(unloaded)
    of_forces, moment = turning_forces(struts, body, turning)
    for place, value in of_forces.items():
        K[place] = K[place] + value
    if forces is None:
        W[3:] = moment
    return StrutTerms(np.array(W, dtype=object), K, moment, rates, tensions, lengths)


def turning_forces(
    struts: Sequence[RecordedStrut], body: MovingBody, s: Sequence[Any]
) -> tuple[dict[tuple[int, int], Any], np.ndarray]:
    """Stiffness of forces ``s d`` that turn with struts, and their moment (3,).

    The symmetric part, upper triangle, is the sum of ``s [[I, -c~], [c~, G - trace(G) I]]`` with G
    the symmetric part of ``(d - c) c^T``; the other part of that is the moment. ``d - c`` is from A
    to the point of the body, which is the same for all, so that s is summed first.
    """
    R, at = body
    total, first = 0, struts[0].A
    turning, apart = (
        np.zeros(3, dtype=int).astype(object),
        np.zeros((3, 3), dtype=int).astype(object),
    )
    for own, part in zip(struts, s, strict=True):
        scaled = (R @ (own.B - own.reference)) * part
        total = total + part
        turning = turning + scaled
        apart = apart + scaled[:, None] * (own.A - first)[None, :]
    G = turning[:, None] * (at - first)[None, :] - apart
    K: dict[tuple[int, int], Any] = {}
    x, y, z = turning
    for i, j, k in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        K[i, i], K[3 + i, 3 + i] = total, -(G[j, j] + G[k, k])
        K[3 + j, 3 + k] = (G[j, k] + G[k, j]) * 0.5
    K |= {(0, 4): z, (1, 5): x, (2, 3): y, (0, 5): -y, (1, 3): -z, (2, 4): -x}
    return K, np.array([G[1, 2] - G[2, 1], G[2, 0] - G[0, 2], G[0, 1] - G[1, 0]], dtype=object)


def recorded_strut(
    legs: Legs, chains: Sequence[int], unloaded: RecordedLeg, length: float
) -> RecordedStrut | None:
    """A leg that carries a force along one line alone, as a spring; None for any other.

    It turns freely about two points, about one of them in all directions. What lies between is
    straight, and a force along it bends nothing; springs at the points are equally soft in all
    directions. Whether it stays straight is another question, of its buckling. Without load it
    transmits what `unloaded` does: a strut has its stiffness. `length` is that of the robot [m].
    """
    chain = legs.chains[chains[0]]
    elements = chain.elements
    held = [c for own in legs.couplings for c, _ in (own.place, *own.terms)]
    held += [own.chain for spring in legs.springs for own in spring.spots if own is not None]
    pushed = any(not _nothing(e.preload) for e in elements if isinstance(e, FiniteJoint))
    is_acted_on = chain.loads or pushed or chains[0] in held
    turns = [
        (k, e)
        for k, e in enumerate(elements)
        if isinstance(e, FiniteJoint) and e.turns and _nothing(e.stiffness)
    ]
    are_turns = len(turns) >= 5 and all(_nothing(e.slide) for _, e in turns)
    if (
        chains[1:]
        or is_acted_on
        or len(legs.rows) != 6
        or not are_turns
        or len(unloaded.wrenches) != 1
    ):
        return None
    places = _clusters([e.point for _, e in turns], [e.axis for _, e in turns], length)
    if places is None:
        return None
    first, A, B = places
    kinks = [k for k, _ in turns]
    groups = turns[:first], turns[first:]
    counts = sorted(_independent([e.axis for _, e in own]) for own in groups)
    d = B - A
    along = d * reciprocal(square_root(d @ d))
    compliances = []
    for k, own in enumerate(elements):
        if k in kinks:
            continue
        if k < kinks[0] or k > kinks[-1]:
            compliances.append(_at_end(own, A if k < kinks[0] else B, length))
        else:
            inside = kinks[first - 1] < k < kinks[first]
            compliances.append(_between(own, along, A, length) if inside else None)
    if counts not in ([2, 3], [3, 3]) or not compliances or None in compliances:
        return None
    (wrench,), (mu,) = unloaded.wrenches, unloaded.mu
    along_line = mu * reciprocal(_square_of_force(wrench))
    same = (reduce(add, compliances) - along_line) * (1 / usual_size(along_line))
    if not _zero(np.array([same])):
        return None
    return RecordedStrut(A, B, legs.platform_point, reciprocal(along_line), unloaded)


def _square_of_force(wrench: Sequence[Any]) -> Any:
    square = reduce(add, (f * f for f in wrench[:3]))
    return square.record.simplified(square) if isinstance(square, Entry) else square


def _at_end(own: Element, at: np.ndarray, length: float) -> Any:
    """Compliance of a spring at a point, alike in all directions; None of anything else."""
    if isinstance(own, FiniteJoint) or any(map(_nothing, own.stiffness)):
        return None
    C = _compliance(own)
    size = C[0, 0]
    if _nothing(size) or not _zero((own.point - at) * (1 / length)):
        return None
    rest = C.copy()
    for i in range(3):
        rest[i, i] = rest[i, i] - size
    return size if _zero(rest.reshape(-1) * (1 / usual_size(size))) else None


def _between(own: Element, along: np.ndarray, A: np.ndarray, length: float) -> Any:
    """Compliance along the line; None where a force along it does more than stretch."""
    if any(map(_nothing, np.ravel(own.stiffness))):
        return None
    if isinstance(own, FiniteJoint):
        is_slide = not own.turns and _zero(cross(own.axis, along))
        return reciprocal(own.stiffness) if is_slide else None
    if not _zero(cross(own.point - A, along) * (1 / length)):
        return None
    local = own.rotation.T @ along
    twist = _compliance(own)[:, :3] @ local
    size = local @ twist[:3]
    bends = np.concatenate([(twist[:3] - local * size), twist[3:] * length])
    return size if _zero(bends * (1 / usual_size(size))) else None


def _compliance(own: FiniteSpring) -> np.ndarray:
    found = np.zeros((6, 6), dtype=int).astype(object)
    for k, column in zip(own.stiffness, own.modes.T, strict=True):
        found = found + column[:, None] * column[None, :] * reciprocal(k)
    return found


def _clusters(
    points: Sequence[np.ndarray], axes: Sequence[np.ndarray], length: float
) -> tuple[int, np.ndarray, np.ndarray] | None:
    """How many joints turn about the first point, and the two points; None of other chains."""
    A, B = points[0], points[-1]
    on_A = [_zero(cross(p - A, a) * (1 / length)) for p, a in zip(points, axes, strict=True)]
    on_B = [_zero(cross(p - B, a) * (1 / length)) for p, a in zip(points, axes, strict=True)]
    for first in range(2, len(points) - 1):
        if all(on_A[:first]) and all(on_B[first:]):
            return first, A, B
    return None


def _independent(axes: Sequence[np.ndarray]) -> int:
    """Rank of some axes at the samples."""
    count = max((x.sample.size for a in axes for x in a if isinstance(x, Entry)), default=1)
    values = np.array([[np.broadcast_to(_values(x), count) for x in a] for a in axes])
    return min(
        int(np.linalg.matrix_rank(values[:, :, k], tol=1e-6)) for k in range(values.shape[2])
    )


def _zero(values: np.ndarray) -> bool:
    return all(np.all(np.abs(_values(x)) <= _SAME) for x in values)


def _nothing(value: Any) -> bool:
    return not isinstance(value, Entry) and float(value) == 0.0


def _values(value: Any) -> np.ndarray:
    return value.sample if isinstance(value, Entry) else np.array([float(value)])


@dataclass(frozen=True)
class Buckling:
    """Bounds of what a force t [N] along a strut does to its margin: ``1 - t g``, ``1 + t h``."""

    # lengths between which they hold [m]
    shortest: float
    longest: float
    # (4,): polynomials g and h of the length, the constant last [1/N]; zero where nothing happens
    pull: np.ndarray
    push: np.ndarray

    def checks(self, t: Any, length: Any, safe: float) -> list[Any]:
        """Entries that are positive where the margin is above `safe`."""
        found = []
        for sign, own in ((1.0, self.push), (-1.0, self.pull)):
            if np.any(own):
                g: Any = float(own[0])
                for c in own[1:]:
                    g = g * length + float(c)
                found.append(1.0 - safe + t * g * sign)
        if found:
            size = 1 / self.longest
            found += [(length - self.shortest) * size, (self.longest - length) * size]
        return found


def buckling_of(
    problems: Sequence[EquilibriumProblem], struts: Sequence[int], force: float
) -> dict[int, Buckling]:
    """Of some legs, from the same robot at several postures, by a trial force [N].

    The second order of the energy is proportional to the force, in beams through their strain, so
    that margins are linear in it.
    """
    seen: dict[int, list[tuple[float, float, float]]] = {k: [] for k in struts}
    for problem in problems if struts else ():
        legs = problem.legs
        chains = {c: own for c, own in enumerate(legs.chains) if own.owner.leg in seen}
        at, lengths = legs.numbers, {}
        step = np.zeros(at.total + len(legs.beams))  # under a force of one newton along the struts
        for c, chain in chains.items():
            # about which the struts turn
            free = (e for e in chain.elements if not np.any(e.stiffness))
            turning = [e.point for e in free if isinstance(e, FiniteJoint) and e.turns]
            d = turning[-1] - turning[0]
            lengths[c] = float(np.linalg.norm(d))
            shift = np.append(d / lengths[c], np.zeros(3))
            beams = [at.total + i for i, (own, *_) in enumerate(legs.beams) if own == c]
            rows = np.concatenate([at.x[legs.coordinates[c]], at.W[c], beams]).astype(int)
            by_shift = problem.at_rest.by_twist @ shift
            step[rows] = by_shift[rows] / (by_shift[at.W[c]] @ shift)
        rates: dict[int, list[float]] = {c: [] for c in chains}
        for sign in (1.0, -1.0):
            moved = legs.stepped(legs.unloaded, sign * force * step)
            eq = legs.equations(moved, np.eye(3), problem.point, Share(0.0, 0.0))
            for block, A in zip(problem.blocks, eq.A, strict=True):
                if chains.keys().isdisjoint(block.chains[:, 0].tolist()):
                    continue
                margins = margins_of(problem, block, A, moved)
                for (c, *_), own in zip(block.chains.tolist(), margins, strict=True):
                    # nothing is lost where the platform holds all, or something spins
                    lost = 1.0 - own.value if own and own.value else 0.0
                    rates.get(c, []).append(max(0.0, lost) / force)
        for c, (pull, push) in rates.items():
            seen[legs.chains[c].owner.leg].append((lengths[c], pull, push))
    return {index: _bounds(np.array(rows)) for index, rows in seen.items()}


def _bounds(rows: np.ndarray) -> Buckling:
    length = rows[:, 0]
    spread = np.ptp(length) > 1e-6 * length.max()
    found = []
    for rates in (rows[:, 1], rows[:, 2]):
        fit = np.zeros(_DEGREE + 1)
        if np.any(rates > _NONE * rows[:, 1:].max()):
            degree = min(_DEGREE, len(np.unique(length.round(9))) - 1) if spread else 0
            own = np.polyfit(length, rates, degree)
            off = float(np.max(np.abs(np.polyval(own, length) - rates)))
            fit[-len(own) :] = own * _PART
            fit[-1] += _MISSED * off
        found.append(fit)
    edge = 0.0 if spread else 1e-6 * float(length.max())
    return Buckling(float(length.min()) - edge, float(length.max()) + edge, *found)

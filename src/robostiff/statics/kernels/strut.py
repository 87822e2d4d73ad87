"""Legs that carry a force along the line between two points alone, and how soon they buckle."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from robostiff.frozen import frozen
from robostiff.record import Entry, is_zero, reciprocal, square_root
from robostiff.recorded.leg import RecordedLeg
from robostiff.spatial import cross
from robostiff.spatial.rotation import matrix_of_rotation
from robostiff.statics.chains.elements import FiniteChain, FiniteJoint
from robostiff.statics.chains.legs import Legs
from robostiff.statics.equations.newton import equilibrium_at
from robostiff.statics.equations.problem import EquilibriumProblem, LoadCase
from robostiff.statics.equations.stability import margins_of
from robostiff.statics.kernels.elimination import SymmetricElimination
from robostiff.statics.kernels.leg import MovingBody

# How far the platform is held from the unloaded posture, in radians and lengths of the robot; of
# the force that shortens a strut by that length: what it may miss.
_FAR, _SAME = 3e-3, 1e-11
# Postures at which legs have to be struts.
_POSTURES = 4
# Of a strut: free turns at least, three about one of its ends.
_TURNS = 5
_DEGREE = 3
# Between the lengths of a fit: a part of it, and how many times what it misses at these.
_PART, _MISSED = 1.03, 2.0
# Of the rates of the other sign: rounding.
_NONE = 1e-6


@frozen
class RecordedStrut:
    """A spring between a point of the base and one of the platform."""

    # (3,) of entries and numbers: at the unloaded posture [m]
    A: np.ndarray
    B: np.ndarray
    reference: np.ndarray  # point of the platform
    stiffness: Any  # entry or number: along the line [N/m]


def add_struts(
    elimination: SymmetricElimination,
    names: Sequence[int],
    struts: Sequence[RecordedStrut],
    body: MovingBody,
) -> tuple[np.ndarray, list[tuple[Any, Any]]]:
    """Add struts between the base and a body that has moved to the equations of its twist.

    With d along a strut of length l, unloaded l_0, c from the point of the body to its end, ``g =
    (d, c x d)`` and ``s = t/l = k - k l_0/l``, W is the sum of ``s g``. K, symmetric part, is that
    of ``(k - s) g g^T / l^2`` and of forces that turn, ``s [[I, -c~], [c~, G - trace(G) I]]``, with
    G the symmetric part of ``(d - c) c^T``; the other part of that is the moment. ``d - c`` is from
    A to the point of the body, which is the same for all, so that s is summed first.

    Returns the moment (3,), and of each strut its force t [N] and its length without load [m].
    """
    (R, at), first, total, carried = body, struts[0].A, 0, []
    turning = np.zeros(3, dtype=int).astype(object)
    apart = np.outer(turning, turning)
    W: list[Any] = [0] * 6
    K: dict[tuple[int, int], Any] = {(i, j): 0 for i in range(6) for j in range(i, 6)}
    for strut in struts:
        c, rest = R @ (strut.B - strut.reference), strut.B - strut.A
        d = c + (at - strut.A)
        square, length = d @ d, square_root(rest @ rest)
        by = reciprocal(square_root(square))
        soft = strut.stiffness * length * by
        s = strut.stiffness - soft
        g = np.concatenate([d, cross(c, at - strut.A)])
        scaled = g * (soft * (by * by))
        for i in range(6):
            W[i] = W[i] + g[i] * s
            for j in range(i, 6):
                K[i, j] = K[i, j] + scaled[i] * g[j]
        carried.append((s * (square * by), length))
        pull = c * s
        total, turning = total + s, turning + pull
        apart = apart + pull[:, None] * (strut.A - first)[None, :]
    G = turning[:, None] * (at - first)[None, :] - apart
    x, y, z = turning
    more = {(0, 4): z, (1, 5): x, (2, 3): y, (0, 5): -y, (1, 3): -z, (2, 4): -x}
    for i, j, k in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        more[i, i], more[3 + i, 3 + i] = total, -(G[j, j] + G[k, k])
        more[3 + j, 3 + k] = (G[j, k] + G[k, j]) * 0.5
    W[3:] = [G[1, 2] - G[2, 1], G[2, 0] - G[0, 2], G[0, 1] - G[1, 0]]
    for (i, j), value in K.items():
        elimination.add(names[i], names[j], value + more.get((i, j), 0))
    for name, force in zip(names, W, strict=True):
        elimination.add_right(name, -force)
    return np.array(W[3:], dtype=object), carried


def recorded_struts(
    legs: Legs, unloaded: Sequence[RecordedLeg], problems: Sequence[EquilibriumProblem]
) -> dict[int, RecordedStrut]:
    """Legs on which nothing acts and that are struts at several postures, by their chains.

    `unloaded` are all legs without load: a strut has the stiffness of its own, by one wrench; a leg
    of several branches is none. `problems` have the robot in numbers.
    """
    straight = set.intersection(*(struts_among(problem) for problem in problems[:_POSTURES]))
    taken = [c for one in legs.couplings for c, _ in (one.place, *one.terms)]
    taken += [spot.chain for spring in legs.springs for spot in spring.spots if spot is not None]
    found = {}
    for c, chain in enumerate(legs.chains):
        joints = (e for e in chain.elements if isinstance(e, FiniteJoint))
        pushed = chain.loads or not all(is_zero(e.preload) for e in joints)
        if chain.owner.leg not in straight or c in taken or pushed:
            continue
        A, *_, B = _turning_points(chain)
        leg = unloaded[chain.owner.leg]
        if len(leg.wrenches) > 1:
            continue
        (wrench,), (mu,) = leg.wrenches, leg.mu
        square = reduce(add, (f * f for f in wrench[:3]))
        square = square.record.simplify(square) if isinstance(square, Entry) else square
        stiffness = reciprocal(mu * reciprocal(square))
        found[c] = RecordedStrut(A, B, legs.platform_point, stiffness)
    return found


def struts_among(problem: EquilibriumProblem) -> set[int]:
    """Legs that are springs between two points, by their numbers.

    They behave so: while the platform is held elsewhere, they carry what such springs do between
    the points of their first and last free turns, no matter what they are made of. Whether they
    stay straight is another question, of their buckling.
    """
    legs, random = problem.legs, np.random.default_rng(11)
    single = [part.chains[0] for part in legs.numbers.components if len(part.chains) == 1]
    points = {c: _turning_points(legs.chains[c]) for c in single}
    points = {c: p for c, p in points.items() if len(p) >= _TURNS and np.any(p[0] != p[-1])}
    if not points or problem.size < 6 or problem.at_rest.rigid:
        return set()
    nothing, length = np.zeros(problem.size), problem.length
    turn, shift = _FAR * random.uniform(-1, 1, (2, 3))
    target = matrix_of_rotation(turn), problem.point + length * shift
    loading = LoadCase(nothing, share_rate=0.0)
    elsewhere = equilibrium_at(problem, loading, 0.0, problem.unloaded, target)
    found = set()
    for c, (A, *_, B) in points.items():
        unit = (B - A) / np.linalg.norm(B - A)
        k = unit @ problem.at_rest.by_twist[legs.numbers.W[c, :3], :3] @ unit
        arm = target[0] @ (B - problem.point)
        d = arm + target[1] - A
        force = k * (1 - np.linalg.norm(B - A) / np.linalg.norm(d)) * d
        off = elsewhere.state.W[c] - np.concatenate([force, np.cross(arm, force)])
        if elsewhere.converged and np.max(np.abs(off / problem.scale)) <= _SAME * k * length:
            found.add(legs.chains[c].owner.leg)
    return found


def _turning_points(chain: FiniteChain) -> list[np.ndarray]:
    """Points (3,) of the joints that turn freely, base first [m]."""
    joints = [e for e in chain.elements if isinstance(e, FiniteJoint) and e.turns]
    return [e.point for e in joints if is_zero(e.stiffness)]


@frozen
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
        for sign, polynomial in ((1.0, self.push), (-1.0, self.pull)):
            if np.any(polynomial):
                g: Any = float(polynomial[0])
                for c in polynomial[1:]:
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
        chains = {c: chain for c, chain in enumerate(legs.chains) if chain.owner.leg in seen}
        at, lengths = legs.numbers, {}
        step = np.zeros(at.total + len(legs.beams))  # under a force of one newton along the struts
        for c, chain in chains.items():
            A, *_, B = _turning_points(chain)
            d = B - A
            lengths[c] = float(np.linalg.norm(d))
            shift = np.append(d / lengths[c], np.zeros(3))
            beams = [at.total + i for i, (k, *_) in enumerate(legs.beams) if k == c]
            rows = np.concatenate([at.x[at.coordinates[c]], at.W[c], beams]).astype(int)
            by_shift = problem.at_rest.by_twist @ shift
            step[rows] = by_shift[rows] / (by_shift[at.W[c]] @ shift)
        rates: dict[int, list[float]] = {c: [] for c in chains}
        for sign in (1.0, -1.0):
            none = np.zeros(problem.size)
            eq = legs.equations(legs.after_step(legs.unloaded, none, sign * force * step), 0.0)
            for g, block in enumerate(problem.blocks):
                if chains.keys().isdisjoint(block.chains[:, 0].tolist()):
                    continue
                margins = margins_of(problem, eq, g)
                for (c, *_), margin in zip(block.chains.tolist(), margins, strict=True):
                    # nothing is lost where the platform holds all, or something spins
                    lost = 1.0 - margin.value if margin and margin.value else 0.0
                    rates.get(c, []).append(max(0.0, lost) / force)
        for c, (pull, push) in rates.items():
            seen[legs.chains[c].owner.leg].append((lengths[c], pull, push))
    bounds = {}
    for index, rows in seen.items():
        of_length = np.array(rows)
        length = of_length[:, 0]
        spread = np.ptp(length) > 1e-6 * length.max()
        found = np.zeros((2, _DEGREE + 1))
        for fit, values in zip(found, of_length.T[1:], strict=True):
            if np.any(values > _NONE * of_length[:, 1:].max()):
                degree = min(_DEGREE, len(np.unique(length.round(9))) - 1) if spread else 0
                line = np.polyfit(length, values, degree)
                fit[-len(line) :] = line * _PART
                fit[-1] += _MISSED * float(np.max(np.abs(np.polyval(line, length) - values)))
        edge = 0.0 if spread else 1e-6 * float(length.max())
        bounds[index] = Buckling(float(length.min()) - edge, float(length.max()) + edge, *found)
    return bounds

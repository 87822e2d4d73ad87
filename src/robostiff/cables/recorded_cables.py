"""A cable robot as a record: the nearest tensions within limits, and the stiffness they give."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from robostiff.errors import NoAnswerError
from robostiff.kinematics.closure.body import tidy_numbers
from robostiff.kinematics.formula import FormulaPose
from robostiff.model.cable import CableRobot
from robostiff.record import Flag, Record, greater, least, plain_root, reciprocal
from robostiff.recorded import RecordedRobot, factors_of
from robostiff.spatial import cross

_MET = 1e-11  # of the size of the forces: tensions that are the nearest ones, but for rounding
_APART = 1e-9  # of that size: a tension nearer to zero is looked at again
_PROVEN = 1e-6  # of that size: by what limits must be exceeded to prove that no tensions exist
_UNBALANCED = 1e-6  # of that size: given tensions nearer to balance are looked at again
_ENDLESS = 1e6  # that size times this stands for a tension without a limit
# Part of the tension of a cable that others leave free, squared and plain: above the first it is
# set to a limit, below the second it is decided by them.
_FREE, _DECIDED = 1e-9, 1e-10
_NO_LENGTH = 1e-6  # of the size of the robot: a shorter cable is looked at again
_ROUNDS = 3  # in which cables are set to their limits anew, at most


def record_cables(robot: CableRobot, poses: np.ndarray, home: np.ndarray) -> RecordedRobot:
    """Record the stiffness of a cable robot about its reference point, without a wrench.

    Tensions are those that the robot gives, or those of `NearestTensions`, whichever cables are at
    their limits: the record compares, and says where no tensions exist.

    Parameters
    ----------
    robot : CableRobot
    poses : (samples, n) array
        Free coordinates at some poses in general position [m, rad].
    home : (6,) array
        All coordinates of the home pose.

    Raises
    ------
    NoAnswerError
        When the cables leave a motion free at every pose.
    """
    names = [coordinate.value for coordinate in robot.coordinates]
    record = Record(dict(zip(names, poses.T, strict=True)))
    six = np.array(home, dtype=object)
    six[robot.coordinate_places] = [record.input(name) for name in names]
    pose = FormulaPose.of_coordinates(tidy_numbers(six))
    arms = [pose.R @ (cable.attachment - robot.reference_point) for cable in robot.cables]
    centre = pose.p + pose.R @ robot.reference_point
    spans = [centre + arm - cable.exit_point for arm, cable in zip(arms, robot.cables, strict=True)]
    lengths = [plain_root(span @ span) for span in spans]
    along = [span * reciprocal(length) for span, length in zip(spans, lengths, strict=True)]
    rows = list(robot.space.rows)
    columns = [np.array([*-e, *-cross(b, e)])[rows] for e, b in zip(along, arms, strict=True)]
    force, arm = np.zeros(3), np.zeros(3, dtype=object)
    if robot.weight is not None:
        force, arm = robot.weight.force, pose.R @ (robot.weight.point - robot.reference_point)
    load = np.array([*force, *cross(arm, force)])[rows]
    points = np.array([x for cable in robot.cables for x in (cable.exit_point, home[:3])])
    length = float(np.linalg.norm(points - points.mean(axis=0), axis=-1).mean()) or 1.0
    given = robot.given_tensions
    if given is None:
        chosen = _Nearest(robot, columns, load)
        tensions, flags, tests, losses = chosen.tensions, chosen.flags, chosen.tests, chosen.losses
    else:
        tensions, losses = given.tolist(), ()
        least_, greatest = robot.tension_limits
        outside = np.any((given < least_) | (given > greatest))
        scale = np.where(np.array(rows) < 3, 1.0, 1.0 / length)
        missing = [
            (sum((w[i] * t for w, t in zip(columns, tensions, strict=True)), load[i])) * s
            for i, s in enumerate(scale.tolist())
        ]
        far = greater(_sum_of_squares(missing), (_UNBALANCED * (1.0 + given.sum())) ** 2)
        flags: dict[Flag, Any] = {
            Flag.UNBALANCED: far,
            Flag.BEYOND_LIMITS: int(outside),
            Flag.UNTENSIONED: int(np.any(given <= 0)),
        }
        tests = (far,)
    unstrained = []
    for cable, x, t in zip(robot.cables, lengths, tensions, strict=True):
        stretch = 0.0 if cable.EA is None else 1.0 / cable.EA
        give = 0.0 if cable.winch_stiffness is None else 1.0 / cable.winch_stiffness
        own = (x + cable.guide_length - t * give) / (t * stretch + 1)  # see `axial_stiffness`
        unstrained.append((own * stretch + give, own))
    axial = [reciprocal(compliance) for compliance, _ in unstrained]
    K = _stiffness(
        columns, list(robot.space.rows), along, arms, lengths, tensions, axial, force, arm
    )
    pivots = factors_of(K, len(rows)).d
    # An attachment at its exit point is out of reach, which the direct form says.
    apart = reduce(lambda a, b: a * b, (greater(x, _NO_LENGTH * length) for x in lengths))
    if Flag.INFEASIBLE in flags:
        flags[Flag.INFEASIBLE] = flags[Flag.INFEASIBLE] * apart
    return RecordedRobot(
        name=robot.name,
        record=record,
        space=robot.space,
        length=length,
        legs=(),
        K=K,
        reach=(),
        closure_losses=tuple(losses),
        limits=(),
        tests=(*tests, apart, *(greater(x, 0) for x in (*pivots, *(x for _, x in unstrained)))),
        flags=flags,
        tensions=dict(zip(robot.cable_names, tensions, strict=True)),
    )


def _stiffness(
    columns: Sequence[np.ndarray],
    rows: list[int],
    along: Sequence[np.ndarray],
    arms: Sequence[np.ndarray],
    lengths: Sequence[Any],
    tensions: Sequence[Any],
    axial: Sequence[Any],
    force: np.ndarray,
    arm: np.ndarray,
) -> dict[tuple[int, int], Any]:
    """Upper triangle of K: elastic, geometric, and of the weight (see `geometric_stiffness`)."""
    per_length = [t * reciprocal(x) for t, x in zip(tensions, lengths, strict=True)]
    n = len(rows)
    turned = np.array(per_length, dtype=object) @ np.array(arms)
    # Of cables and weight, sum of f b^T with S(f, b) = (f b^T + b f^T)/2 - (f . b) I
    pulls = [e * t - b * p for e, t, b, p in zip(along, tensions, arms, per_length, strict=True)]
    outer = sum(np.outer(f, b) for f, b in zip(pulls, arms, strict=True)) - np.outer(force, arm)
    turning = (outer + outer.T) * 0.5 - np.eye(3, dtype=int) * np.trace(outer)
    whole = np.zeros((6, 6), dtype=object)
    whole[:3, :3] = np.eye(3, dtype=int) * sum(per_length)
    x, y, z = turned
    whole[:3, 3:] = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    whole[3:, 3:] = turning
    found = {(i, j): whole[rows[i], rows[j]] for i in range(n) for j in range(i, n)}
    for w, k, p in zip(columns, axial, per_length, strict=True):
        by = w * (k - p)
        found = {(i, j): x + by[i] * w[j] for (i, j), x in found.items()}
    return found


class _Nearest:
    """The tensions of `NearestTensions` on entries, and where they are right.

    Tensions that balance the load differ by ``P x``, P the projector onto the null space of A^T.
    From those nearest to the aim, the cable that is furthest beyond a limit is set to it, as many
    times as there are cables too many. Where some cable is then held at a limit from which it would
    go back, all are begun again with the cable that was set last. Tensions t are the nearest if and
    only if ``t = clip(t - a)`` with the pushes a of the limits: nothing else needs to be checked.

    (Goldfarb and Idnani 1983, a dual method for quadratic programs.)
    """

    def __init__(self, robot: CableRobot, columns: Sequence[np.ndarray], load: np.ndarray) -> None:
        m, n = len(columns), len(load)
        self._low, greatest = (limits.tolist() for limits in robot.tension_limits)
        bounded = [x for x in greatest if math.isfinite(x)]
        force = 0.0 if robot.weight is None else float(np.abs(robot.weight.force).sum())
        self._size = force + sum(self._low) + sum(bounded) or 1.0
        self._high = [x if math.isfinite(x) else _ENDLESS * self._size for x in greatest]
        level = robot.tension_level
        aim = [
            low + level * (high - low) if level else low
            for low, high in zip(self._low, self._high, strict=True)
        ]
        W = np.array(columns).T
        gram = factors_of({(i, j): W[i] @ W[j] for i in range(n) for j in range(i, n)}, n)
        if gram.rank < n:
            raise NoAnswerError(
                f"no record of {robot.name!r}: its cables leave a motion free at every pose"
            )
        self.losses = tuple(gram.losses)
        self._W, self._load, self._gram = W, load, gram
        by = [reciprocal(d) for d in gram.d]
        z = [self._eliminated(column) for column in columns]
        self._scaled = [[x * d for x, d in zip(own, by, strict=True)] for own in z]
        self._projector = np.empty((m, m), dtype=object)
        for i in range(m if m > n else 0):
            for j in range(i, m):
                entry = int(i == j) - _dot(self._scaled[i], z[j])
                self._projector[i, j] = self._projector[j, i] = entry
        low, high, size = self._low, self._high, self._size
        start, spare = [t + x for t, x in zip(aim, self._change(aim), strict=True)], m - n
        rounds = max(1, min(spare, _ROUNDS))
        raw, right, proven, first = list(start), 0, 0, None
        for _ in range(rounds):
            t, pushes, last, impossible = self._round(start, spare, first)
            own = [x - a for x, a in zip(t, pushes, strict=True)]
            within = [_clip(x, a, b) for x, a, b in zip(own, low, high, strict=True)]
            apart = _sum_of_squares([x - y for x, y in zip(within, t, strict=True)])
            holds = greater((_MET * size) ** 2, apart)
            raw = [x + (y - x) * (1 - right) for x, y in zip(raw, own, strict=True)]
            right, proven, first = (
                1 - (1 - right) * (1 - holds),
                1 - (1 - proven) * (1 - impossible),
                last,
            )
        self.tensions = [_clip(x, a, b) for x, a, b in zip(raw, low, high, strict=True)]
        may_vanish = [x for x, a in zip(raw, low, strict=True) if a == 0]
        loose: Any = 1
        for x in may_vanish:
            loose = loose * greater(x, 0)
        # What the pivots do not decide is no proof.
        for loss in self.losses:
            proven = proven * greater(_SAFE, loss * loss)
        self.flags: dict[Flag, Any] = {Flag.UNTENSIONED: 1 - loose, Flag.INFEASIBLE: proven}
        self.tests = (right, *(greater(x * x, (_APART * size) ** 2) for x in may_vanish))

    def _eliminated(self, column: Any) -> list[Any]:
        """L^-1 of a column, A^T A = L D L^T, in the order of the pivots."""
        rest, found = list(column), []
        for lower, pivot in zip(self._gram.columns, self._gram.pivots, strict=True):
            found.append(rest[pivot])
            rest = [x - own * found[-1] for x, own in zip(rest, lower, strict=True)]
        return found

    def _change(self, t: Sequence[Any]) -> list[Any]:
        """The smallest change of tensions that makes them balance the load."""
        missing = self._eliminated(self._load + self._W @ np.array(t, dtype=object))
        return [-_dot(own, missing) for own in self._scaled]

    def _round(
        self, start: list[Any], spare: int, first: Any
    ) -> tuple[list[Any], list[Any], Any, Any]:
        """Tensions with some cables set to limits, pushes there, the last one, whether none exist.

        A cable is chosen by weights, 1 for it and 0 for the others, with the limit it is set to.
        """
        low, high, P = self._low, self._high, self._projector
        m = len(start)
        t, pushes, last = list(start), [0] * m, first
        # Of each cable that is set: its weights, column and pushes, and the inverse pivot
        set_: list[tuple[list[Any], list[Any], list[Any], Any]] = []
        free = [P[i, i] for i in range(m)]

        def column_of(w: list[Any]) -> tuple[list[Any], list[Any]]:
            """What a push on the chosen cable does to all tensions; by which pushes."""
            column, pushed = list(P @ np.array(w, dtype=object)), list(w)
            for _, own, others, inverse in set_:
                part = _dot(own, w) * inverse
                column = [x - part * y for x, y in zip(column, own, strict=True)]
                pushed = [x - part * y for x, y in zip(pushed, others, strict=True)]
            return column, pushed

        for k in range(spare):
            if k or first is None:
                beyond = [_beyond(*own) for own in zip(t, low, high, strict=True)]
                parts = [
                    greater(f, _FREE) * x * x * reciprocal(1 - greater(f, _FREE) * (1 - f))
                    for x, f in zip(beyond, free, strict=True)
                ]
                w = _largest(parts)
                below = [greater(a, x) for x, a in zip(t, low, strict=True)]
                limit = sum(
                    y * (b + (a - b) * is_low)
                    for y, a, b, is_low in zip(w, low, high, below, strict=True)
                )
                last = w, limit
            else:
                w, limit = first
            column, pushed = column_of(w)
            inverse = reciprocal(_dot(column, w) + (1 - sum(w)))
            push = (limit - _dot(w, t)) * inverse
            t = [x + push * y for x, y in zip(t, column, strict=True)]
            pushes = [x + push * y for x, y in zip(pushes, pushed, strict=True)]
            free = [f - x * x * inverse for f, x in zip(free, column, strict=True)]
            set_.append((w, column, pushed, inverse))
        # Digits that were lost come back, and cables that are set stay where they are.
        change = self._change(t)
        for w, column, _, inverse in set_:
            part = _dot(w, change) * inverse
            change = [x - part * y for x, y in zip(change, column, strict=True)]
        t = [x + y for x, y in zip(t, change, strict=True)]
        # A cable beyond a limit that only those at limits can pull back, and do not far enough
        beyond = [_beyond(*own) for own in zip(t, low, high, strict=True)]
        w = _largest(beyond)
        column, pushed = column_of(w) if spare else ([0] * m, w)
        side = 2 * _dot(w, [greater(a, x) for x, a in zip(t, low, strict=True)]) - 1
        decided = greater(_DECIDED**2, _sum_of_squares(column))
        help_: Any = 0
        for x, a, b, u, own in zip(t, low, high, pushed, w, strict=True):
            g = side * (own - u)
            help_ = help_ + _most(g * (b - x), g * (a - x)) * (1 - own)
        proof = greater(_dot(w, beyond), help_ + _PROVEN * self._size) * decided
        return t, pushes, last, proof


_SAFE = 1e8  # square of a loss of a pivot


def _largest(parts: Sequence[Any]) -> list[Any]:
    """1 for the first that is the largest, if it is above zero, and 0 for all others."""
    largest, taken, found = reduce(_most, parts, 0), 0, []
    for x in parts:
        own = greater(x, 0) * (1 - greater(largest, x)) * (1 - taken)
        found.append(own)
        taken = taken + own
    return found


def _beyond(t: Any, low: float, high: float) -> Any:
    """By how much a tension is beyond its limits; 0 where it is not."""
    return _most(_most(low - t, t - high), 0)


def _clip(x: Any, low: float, high: float) -> Any:
    above = x - low
    return least(low + (above - least(above, 0)), high)  # never -0


def _most(a: Any, b: Any) -> Any:
    return -least(-a, -b)


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return sum((x * y for x, y in zip(a, b, strict=True)), 0)


def _sum_of_squares(values: Sequence[Any]) -> Any:
    return _dot(values, values)

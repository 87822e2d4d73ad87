"""Legs of a robot at a guess of its posture, on the entries of a new record."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from robostiff.frozen import frozen
from robostiff.kinematics import PostureFinder
from robostiff.kinematics.closure.body import tidy_numbers
from robostiff.kinematics.closure.loops import tree_of_leg
from robostiff.kinematics.formula import FormulaPose
from robostiff.model import ALL_COORDINATES, Joint, JointKind, Leg, Passive, Robot
from robostiff.model.entries import Symbolic
from robostiff.record import Entry, Operation, Record, angle_of
from robostiff.recorded.newton_step import LegAtGuess
from robostiff.recorded.parameters import coordinates_at_home, parameter_samples

#: Of the pose coordinates.
NAMES = [coordinate.value for coordinate in ALL_COORDINATES]
# Coordinates that differ by less at all closed postures are the same: legs close as exactly.
_SAME = 1e-12
#: A coordinate that is a factor times another one or a pose coordinate; or a number.
Same = tuple[str | None, float]


@frozen
class GuessedLeg:
    """A leg in numbers, and its coordinates at closed postures (samples, size), home the last."""

    names: list[str]
    free: np.ndarray
    q: np.ndarray
    angles: tuple[str, ...]
    closing: tuple[int, ...]
    same: dict[str, Same]

    @classmethod
    def of(
        cls, leg: Leg, names: list[str], q: np.ndarray, pose: dict[str, np.ndarray]
    ) -> GuessedLeg:
        """Coordinates are compared with moving pose coordinates, and with those before them."""
        chain = leg.chain
        if chain.is_coupled:
            return cls(names, chain.free, q, (), (), {})
        closing = tuple(i for ball in following_balls(leg) for i in range(ball, ball + 3))
        same: dict[str, Same] = {}
        # What turns is no multiple of what slides, and a ball joint turns as a whole.
        turns = {name: pose[name] for name in NAMES[3:] if name in pose}
        slides = {name: pose[name] for name in NAMES[:3] if name in pose}
        balls: list[dict[str, np.ndarray]] = []
        angles = []
        for element, place in chain.moving:
            samples = {names[i]: q[:, i] for i in range(place.start, place.stop) if chain.free[i]}
            if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
                if place.start not in closing:
                    found = _same_turn(samples, balls)
                    same |= found
                    balls += [] if found else [samples]
                continue
            for (name, x), screw in zip(samples.items(), element.freedoms, strict=False):
                known = turns if screw.turns else slides
                one = _same(x, known)
                if one is not None:
                    same[name] = one
                    continue
                known[name] = x
                if screw.is_rotation:
                    angles.append(name)
        return cls(names, chain.free, q, tuple(angles), closing, same)

    @property
    def state(self) -> dict[str, np.ndarray]:
        """Values of its unknowns at the samples."""
        found = {}
        for i in np.flatnonzero(self.free).tolist():
            name = self.names[i]
            if name in self.same:
                continue
            if name in self.angles:
                cosine, sine = turn_names(name)
                found |= {cosine: np.cos(self.q[:, i]), sine: np.sin(self.q[:, i])}
            elif i not in self.closing:
                found[name] = self.q[:, i]
        return found

    def on_entries(
        self, leg: Leg, record: Record, given: Collection[str], pose: FormulaPose
    ) -> LegAtGuess:
        """The leg at a guess, some pose coordinates given; what closes it stays at zero."""
        places = {name: i for i, name in enumerate(self.names)}

        def at(name: str) -> Any:
            if name in self.angles:
                cosine, sine = map(record.input, turn_names(name))
                return angle_of(sine, cosine, near=float(self.q[-1, places[name]]))
            return record.input(name)

        q: list[Any] = []
        for i, (name, home) in enumerate(zip(self.names, leg.chain.home, strict=True)):
            if name in self.same:
                other, factor = self.same[name]
                q.append(factor if other is None else at(other) * factor)
            elif i in self.closing:
                q.append(0)
            else:
                q.append(at(name) if self.free[i] else home)
        near = self.q[-1].astype(float)
        q_now = np.array(q, dtype=object)
        moving = {n: (None, x) if one in given else (one, x) for n, (one, x) in self.same.items()}
        R_end = tidy_numbers(leg.base.R).T @ pose.R @ tidy_numbers(leg.attachment.R)
        turned = axes_behind_balls(leg, q_now, self.closing[::3], np.eye(3, dtype=int), R_end)
        turned = {ball: _numbers(R, given) for ball, R in turned.items()}
        return LegAtGuess(leg, self.names, q_now, self.closing, near, moving, turned)


def _numbers(R: np.ndarray, given: Collection[str]) -> np.ndarray:
    """The same axes; entries of inputs that are given alone, and 0 or +-1 at all samples, as such.

    Others are so at closed postures, where the samples are, but not at every guess.
    """

    def number(x: Any) -> Any:
        short = x.record.simplify(x) if isinstance(x, Entry) else x
        if not isinstance(x, Entry) or isinstance(short, Entry):
            return x
        record = x.record
        steps = [record.operation(step) for step in record.steps_needed([x.step])]
        names = {name for operation, name, _ in steps if operation is Operation.INPUT}
        return short if names.issubset(given) else x

    return np.array([number(x) for x in R.flat], dtype=object).reshape(3, 3)


def is_still(x: np.ndarray) -> bool:
    """Whether a coordinate is the same at all closed postures."""
    return bool(np.max(np.abs(x - x[-1])) <= _SAME)


def _same(x: np.ndarray, known: Mapping[str, np.ndarray]) -> Same | None:
    """What a coordinate is at all samples, if that is known without it."""
    if is_still(x):
        return None, float(x[-1]) if abs(x[-1]) > _SAME else 0.0
    for name, other in known.items():
        for sign in (1.0, -1.0):
            if np.max(np.abs(x - sign * other)) <= _SAME:
                return name, sign
    return None


def _same_turn(
    samples: Mapping[str, np.ndarray], balls: Sequence[Mapping[str, np.ndarray]]
) -> dict[str, Same]:
    """The same of the coordinates of a ball joint, if one of others turns as it does; or {}."""
    if all(map(is_still, samples.values())):
        return {name: (None, float(x[-1])) for name, x in samples.items()}
    for ball in balls:
        pairs = list(zip(samples.items(), ball.items(), strict=True))
        if all(np.max(np.abs(x - y)) <= _SAME for (_, x), (_, y) in pairs):
            return {name: _same(x, {other: y}) or (other, 1.0) for (name, x), (other, y) in pairs}
    return {}


def turn_names(angle: str) -> tuple[str, str]:
    """Names of the cosine and the sine of an unknown angle."""
    return f"cos {angle}", f"sin {angle}"


def pose_on_entries(
    robot: Robot, finder: PostureFinder, record: Record, names: Sequence[str]
) -> np.ndarray:
    """Pose coordinates (6,) of a robot on entries: those named, inputs of a record, or home's."""
    six: list[Any] = coordinates_at_home(robot, finder)
    for k, name in enumerate(NAMES):
        if name in names:
            six[k] = record.input(name)
    return tidy_numbers(np.array(six, dtype=object))


def following_balls(leg: Leg) -> list[int]:
    """First places of the passive ball joints that turn as far as the bodies at both sides need.

    In each loop of a leg, the last one.
    """
    chain = leg.chain
    if chain.is_coupled:
        return []
    balls = [
        place.start
        for element, place in chain.moving
        if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL
        if isinstance(element.role, Passive) and chain.free[place].all()
    ]
    in_loops = ([b for b in balls if b in end.moving] for end in tree_of_leg(leg, np.eye(3)).ends)
    return [loop[-1] for loop in in_loops if loop]


def axes_behind_balls(
    leg: Leg, q: np.ndarray, balls: Sequence[int], R_base: np.ndarray, R_end: np.ndarray
) -> dict[int, np.ndarray]:
    """Axes (3, 3) behind ball joints that follow, from those (3, 3) in which the leg ends.

    Whatever stands before such a joint, and its own coordinates, do not matter.
    """
    if not balls:
        return {}
    tree = tree_of_leg(leg, R_base)
    placed = tree.placed(q, dict.fromkeys(balls, np.eye(3, dtype=int).astype(object)))
    placed.R_wanted[0] = R_end

    def behind(ball: int) -> np.ndarray:
        k, loop = next((k, end) for k, end in enumerate(tree.ends) if ball in end.moving)
        leading = [other for other in balls if other in loop.leading]
        R_wanted = placed.R_wanted[k]
        return (behind(leading[0]) @ R_wanted if leading else R_wanted) @ placed.R[k].T

    return {ball: behind(ball) for ball in balls}


def with_nominal(robot: Symbolic) -> dict[str, np.ndarray]:
    """Values of the parameters at the samples, the nominal ones last, as at home."""
    samples = parameter_samples(robot)
    return {name: np.append(x, float(robot.nominal[name])) for name, x in samples.items()}


def nominal(value: Any) -> float:
    """A number, or the value of an entry at home."""
    return float(value.sample[-1]) if isinstance(value, Entry) else float(value)

"""Legs in closed form with a rod: a strut of variable length, or a rod on a slide or a crank."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from robostiff.frozen import field, frozen, replace
from robostiff.kinematics.closure.body import (
    ClosedLeg,
    LegBody,
    Rest,
    Stretch,
    aim,
    body_after_turn,
    body_of_directions,
    constant_cosine,
    coordinate_axis_along,
    cross,
    direction_across,
    dot,
    frame,
    lack_of,
    positive_part,
    quotient,
    rest_of_directions,
    shortest_turn_of,
    spun,
    tidy_numbers,
    tidy_point,
)
from robostiff.kinematics.closure.leg_forms import Cluster, LegForm, Skeleton, Slide
from robostiff.kinematics.turn import turn_by_vector_of_entries
from robostiff.record import is_zero, square_root
from robostiff.spatial import cross as cross_of_entries

# Of the rod: nearer than this to the crank's axis, its far end leaves few digits of the angle.
_ON_AXIS = 1e-6
#: A direction, or a point, at zero coordinates and now.
Pair = tuple[np.ndarray, np.ndarray]


@frozen
class RodForm(LegForm):
    """A leg with a rod from joint A to joint B, at zero coordinates."""

    A: Cluster
    B: Cluster
    along: np.ndarray  # (3,): unit vector from A to B
    side: np.ndarray  # (3,): a direction across the rod; that of a beam's section keeps it short
    home: np.ndarray  # (size,): leg coordinates in the home configuration
    spin: int | None  # place of a turn about the rod itself
    # Whether the turn about itself matters of a rod between two spherical joints
    spin_matters: bool = field(default=True, kw_only=True)

    @property
    def turned_by_second(self) -> bool:
        """Whether the joint at the far end turns the rod about itself."""
        return not self.B.is_ball and (self.spin is not None or self.A.is_ball)


@frozen
class Strut(RodForm):
    """A slide along the line from joint A to joint B, perhaps with a turn about it.

    Its length, the fixed one and the slide's coordinate, has the sign that its mode says.
    """

    slide: Slide

    def leg_between(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""
        A, B, place = self.A, self.B, self.slide.place
        A_now, B_now = base.point(A.point), self.named(platform.point(B.point), "B")
        A_to_B = B_now - A_now
        length = self.named(square_root(dot(A_to_B, A_to_B)) * self.mode.root, "L")
        d = self.named(quotient(A_to_B, length), "d")
        rod = _RodNow(self, base, platform, d, A_now, B_now).closed
        (fixed,) = tidy_point(np.array([self.along @ (B.point - A.point)], dtype=object))
        carried = rod.bodies[A.places[-1] + 1].at(B.point, B_now)
        bodies = {0: base, place + 1: carried, **rod.bodies}
        return replace(rod, bodies=bodies, slides={place: Stretch(length, -fixed)})


def strut_of(
    skeleton: Skeleton, A: Cluster, slide: Slide, B: Cluster, turn: Cluster | None = None
) -> Strut | None:
    """The closed form of a slide between joints, and perhaps a turn about it, where it is one."""
    along = slide.axis
    A_to_B = B.point - A.point
    size = 1e-9 * (np.linalg.norm(A_to_B) + np.linalg.norm(skeleton.p_end) + 1e-300)
    if np.linalg.norm(np.cross(along, A_to_B)) > size or not _fit(A, B, along):
        return None
    side = direction_across(along).astype(float)
    spin, turns = (None, ()) if turn is None else (turn.places[0], (turn,))
    of_form = slide.place, _signs(A, B, spin), (A, *turns, B)
    return Strut(skeleton, *of_form, A, B, along, side, skeleton.home, spin, slide)


def _signs(A: Cluster, B: Cluster, spin: int | None) -> tuple[bool, bool, bool]:
    """Which signs of a mode a rod has: a joint of two axes does its part in two ways."""
    turned_by_second = not B.is_ball and (spin is not None or A.is_ball)
    return True, not A.is_ball and len(A.axes) == 2, turned_by_second and len(B.axes) == 2


def _fit(first: Cluster, second: Cluster, along: np.ndarray) -> bool:
    """Whether the two joints can be solved one after the other for a rod `along` a direction."""
    if first.is_ball:
        return True
    crossed = float(np.linalg.norm(np.cross(first.axes[-1], along))) > 1e-6
    return crossed and (second.is_ball or len(second.axes) <= 2)


@frozen
class Rod(RodForm):
    """A slide or crank that carries joint A, and a rod of length l from A to joint B.

    A slide along e has ``|B - A - s e| = l``, s = e.(B - A) +- sqrt(l^2 - |across|^2). A crank has
    ``|B - A(s)| = l``, from x cos s + y sin s = c, given by cosine and sine: x and y are the
    components of B along the arm at zero and across it, r the radius of A, and ``c = (|B|^2 + r^2 -
    l^2) / 2 r``, all seen from the centre of the circle of A.
    """

    drive: Slide | Cluster
    # A slide along the axis of the crank that carries all this; it decouples from the rest, which
    # moves in a plane
    across: Slide | None = None

    def leg_between(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""
        A, B, B_now = self.A, self.B, self.named(platform.point(self.B.point), "B")
        bodies, slides = {0: base}, {}
        if self.across is not None:
            e = base.direction(self.across.axis)
            s = dot(e, B_now - base.point(B.point))
            slides[self.across.place] = Stretch(s, 0)
            base = base.at(A.point, base.point(A.point) + e * s)
            bodies[self.across.place + 1] = base
        A_to_B = B.point - A.point
        square, sign, at_poses = A_to_B @ A_to_B, self.mode.root, base.is_at_poses
        # What lacks of the square of the length of the rod is given as a part of it, and the digits
        # that the coordinate of the drive loses: infinite for a crank that turns about the far end
        # of its rod, which leaves it undetermined.
        if isinstance(self.drive, Slide):
            e, start = base.direction(self.drive.axis), base.point(A.point)
            to_B = B_now - start
            along = dot(e, to_B)
            across = to_B - e * along
            left = square - dot(across, across)
            half = square_root(positive_part(left)) * sign
            s = along + half
            A_now = start + e * s
            carrier, rod = base.at(A.point, A_now), across - e * half
            lack, loss = lack_of(left) / square, 0
            slides[self.drive.place] = Stretch(self.named(s, "s"), 0)
        else:
            rest, radius = self.circle
            m, n, e = (base.direction(axis) for axis in rest.R.T)
            centre = base.point(rest.p)
            to_B = B_now - centre
            x, y, height = dot(to_B, m), dot(to_B, n), dot(to_B, e)
            if not at_poses:
                (height,) = tidy_point(np.array([height], dtype=object))
            size = x * x + y * y
            c = (size + (height * height + (radius * radius - square))) / (2 * radius)
            if at_poses:  # out of reach, as far as it goes
                c = np.clip(c, -np.sqrt(size), np.sqrt(size))
            left = size - c * c
            half = square_root(positive_part(left)) * sign
            cosine, sine = quotient(x * c - y * half, size), quotient(y * c + x * half, size)
            if at_poses:  # about the far end of its rod it may turn, and stays
                cosine = np.where(size == 0, 1.0, cosine)
            out = m * cosine + n * sine
            A_now = centre + out * radius
            carrier = LegBody(rest, frame(out, n * cosine - m * sine, e), centre)
            rod, lack, loss = B_now - A_now, lack_of(left) / square, quotient(square, size)
        bodies[self.leading + 1] = carrier
        length = square_root(square)
        if at_poses:  # out of reach, the rod does not end at B
            length = np.sqrt(dot(rod, rod))
        ends = self.named(quotient(rod, length), "d"), A_now, B_now
        found = _RodNow(self, carrier, platform, *ends).closed
        return replace(
            found,
            bodies={**bodies, **found.bodies},
            slides=slides,
            out_of_reach=[*found.out_of_reach, lack],
            loss=loss,
        )

    @cached_property
    def circle(self) -> tuple[Rest, Any]:
        """Circle of the near end about the axis of a crank, at zero coordinates: centre, radius.

        Axes at the centre are along the arm, across it, and along that of the crank [m].
        """
        crank: Any = self.drive
        (e0,) = crank.axes
        arm = self.A.point - crank.point
        level = e0 * (e0 @ arm)
        radius = square_root((arm - level) @ (arm - level))
        m0 = tidy_numbers((arm - level) / radius)
        R_zero = np.stack([m0, cross(e0, m0), e0], axis=-1)
        hub = tidy_point(crank.point + level)
        if e0.dtype != object:
            R_zero, hub = R_zero.astype(float), hub.astype(float)
        return Rest(R_zero, hub), radius

    def leaves_drive_open(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Where the far end of the rod is on the axis of the crank, which may then turn (N,).

        A drive that slides always follows from the pose.
        """
        if isinstance(self.drive, Slide):
            return np.zeros(len(p), dtype=bool)
        arm = self.platform_at(R, p).point(self.B.point) - self.drive.point[:, None]
        off_axis = cross(self.drive.axes[0][:, None], arm)
        size = np.linalg.norm(self.B.point - self.A.point)
        return np.sqrt(dot(off_axis, off_axis)) <= _ON_AXIS * size


def rod_of(skeleton: Skeleton, drive: Slide | Cluster, A: Cluster, B: Cluster) -> Rod | None:
    """The closed form of a rod between joints, and a slide or crank, where it is one."""
    if isinstance(drive, Cluster):
        arm = A.point - drive.point
        turning = not drive.is_ball and len(drive.axes) == 1
        if not turning or np.linalg.norm(np.cross(drive.axes[0], arm)) <= skeleton.rounding:
            return None
    rod = B.point - A.point
    size = np.linalg.norm(rod)
    if size <= skeleton.rounding or not _fit(A, B, rod / size):
        return None
    return rod_between(skeleton, drive, A, B)


def rod_between(skeleton: Skeleton, drive: Slide | Cluster, A: Cluster, B: Cluster) -> Rod:
    """A rod from joint A, which a drive carries, to joint B."""
    rod = B.point - A.point
    along = tidy_numbers(rod / np.linalg.norm(rod)).astype(float)
    side = direction_across(along).astype(float)
    driven = (drive,) if isinstance(drive, Cluster) else ()
    leading = drive.places[0] if isinstance(drive, Cluster) else drive.place
    of_form = leading, _signs(A, B, None), (*driven, A, B)
    return Rod(skeleton, *of_form, A, B, along, side, skeleton.home, None, drive)


@frozen
class _RodNow:
    """A rod whose ends are known."""

    form: RodForm
    # What carries the joints
    near: LegBody
    platform: LegBody
    d: np.ndarray  # (3,) or (3, N): unit vector from A to B now
    # (3,) or (3, N): places of the joints [m]
    A_now: np.ndarray
    B_now: np.ndarray

    @property
    def closed(self) -> ClosedLeg:
        """The rod turned so that it points from A to B and its joints meet the platform."""
        A, B, spin = self.form.A, self.form.B, self.form.spin
        bodies: dict[int, LegBody] = {}
        misses, lacks = [], []
        if A.is_ball:
            rod = self._shortest()
        else:
            a0, *others = A.axes
            axis, before = (a0, self.near.direction(a0)), self.near
            if others:  # what lies between the two axes
                (b0,) = others
                to_a, to_d = constant_cosine(a0, b0), constant_cosine(b0, self.form.along)
                found = aim(axis[1], self.d, to_a, to_d)
                lacks.append(found.gap)
                b = b0, found.way(self.form.mode.first)
                before = self._carried(self.near, axis, b, target_first=True)
                axis, bodies[A.places[0] + 1] = b, before
            else:
                misses += self._missed_angle(*axis)
            rod = self._carried(before, axis, (self.form.along, self.d), target_first=True)
        own = self
        if rod.is_at_poses:  # out of reach, the direction that it reaches
            own = replace(self, d=rod.direction(self.form.along))
        far, more_misses, more_lacks = own._at_second(rod)
        if A.is_ball:  # the ball takes the spin that the joint at B leaves
            rod = own._spun(far, -1) if not B.is_ball else far
        if B.is_ball:
            far = own._spun(rod, 1)
        bodies[A.places[-1] + 1] = rod
        if spin is not None:
            bodies[spin + 1] = far.at(B.point, self.B_now)
        bodies[B.places[0]] = far.at(B.point, self.B_now)
        behind, (*before, e), point = far, B.axes, (B.point, self.B_now)
        if len(before) == 2 and not B.is_ball:  # a wrist of three axes
            a, b = before
            axis, before = (a, far.direction(a)), [b]
            to_a, to_e = constant_cosine(a, b), constant_cosine(b, e)
            bent = aim(axis[1], self.platform.direction(e), to_a, to_e)
            target = b, bent.way(self.form.mode.second)
            behind = self._carried(far, axis, target, point, target_first=True)
            bodies[B.places[0] + 1] = behind
        if len(before) == 1:
            axis = before[0], behind.direction(before[0])
            last = e, self.platform.direction(e)
            carried = self._carried(behind, axis, last, point, target_first=True)
            bodies[B.places[-2] + 1] = carried
        bodies[B.places[-1] + 1] = self.platform
        ball_axes: dict[int, np.ndarray] = {}
        for cluster, body in ((A, rod), (B, far)):
            if cluster.is_ball:
                ball_axes |= {p: body.R[:, i] for i, p in enumerate(cluster.places)}
        return ClosedLeg(bodies, ball_axes, misses + more_misses, lacks + more_lacks)

    def _carried(
        self,
        before: LegBody,
        axis: Pair,
        target: Pair,
        point: Pair | None = None,
        *,
        target_first: bool,
    ) -> LegBody:
        """The body after an axis that brings a direction to its target; at joint A if not said.

        Over poses the axis stays where `before` has it, so that out of reach the direction comes as
        near as it can. A record takes one of the two as its first axis, which keeps it short.
        """
        x, p = point or (self.form.A.point, self.A_now)
        if before.is_at_poses:
            rest, _ = rest_of_directions(x, axis[0], target[0])
            rest = Rest(rest.R.astype(float), x)
            return body_after_turn(before, rest, p, axis[0], *target)
        (u0, u), (v0, v) = (target, axis) if target_first else (axis, target)
        return body_of_directions((x, u0, v0), (p, u, v))

    def _at_second(self, rod: LegBody) -> tuple[LegBody, list[Any], list[Any]]:
        """The rod at joint B, which may turn it about itself, misses and lacks."""
        B, turned = self.form.B, self.form.turned_by_second
        if B.is_ball or (rod.is_at_poses and not turned):
            return rod, [], []
        b0, e = B.axes[0], self.platform.direction(B.axes[-1])
        if not turned:
            on_rod = rod.direction(b0)
            off = [on_rod @ e - constant_cosine(*B.axes)] if len(B.axes) == 2 else on_rod - e
            return rod, [_square(x) for x in off], []
        if len(B.axes) == 1:
            return self._about_rod(rod, (b0, e)), self._missed_angle(b0, e), []
        to_d = constant_cosine(b0, self.form.along)
        found = aim(self.d, e, to_d, constant_cosine(*B.axes))
        target = b0, found.way(self.form.mode.second)
        return self._about_rod(rod, target), [], [found.gap]

    def _about_rod(self, rod: LegBody, target: Pair) -> LegBody:
        """The rod turned about itself, so that an axis at joint B meets its target."""
        along = self.form.along
        if rod.is_at_poses and abs(constant_cosine(along, target[0])) == 1:
            return rod  # it is on the rod and meets what it can
        return self._carried(rod, (along, self.d), target, target_first=False)

    def _missed_angle(self, axis: np.ndarray, now: np.ndarray) -> list[Any]:
        """How far an axis is from its angle to the rod."""
        if self.near.is_at_poses:
            return []
        return [_square(now @ self.d - constant_cosine(axis, self.form.along))]

    def _shortest(self) -> LegBody:
        """The rod after the shortest turn from home, or from a coordinate axis nearby."""
        form, d = self.form, self.d
        axes = form.along, form.side, cross_of_entries(form.along, form.side)
        if form.spin_matters or form.turned_by_second:
            R_home, ball = np.eye(3, dtype=int), np.stack(form.A.axes, axis=-1)
            home = np.array([form.home[place] for place in form.A.places], dtype=object)
            if not all(map(is_zero, home)):
                R_home = ball @ turn_by_vector_of_entries(home) @ ball.T
            if self.near.is_at_poses:
                R_home = R_home.astype(float)
            start, *sides = (self.near.direction(v @ R_home.T) for v in axes)
        else:
            start = coordinate_axis_along(d)
            k = int(np.flatnonzero(start)[0])
            m = np.eye(3, dtype=int)[(k + 1) % 3]
            sides = [m, np.cross(start, m)]
        turned = shortest_turn_of(start, tuple(sides), d)
        return LegBody(Rest(np.stack(axes, axis=-1), form.A.point), frame(d, *turned), self.A_now)

    def _spun(self, rod: LegBody, sign: int) -> LegBody:
        """The rod after a turn about itself by the home angle of its spin, or before that turn."""
        angle = 0 if self.form.spin is None else self.form.home[self.form.spin] * sign
        return rod if is_zero(angle) else replace(rod, R=spun(rod.R, self.d, angle))


def _square(x: Any) -> Any:
    x = tidy_numbers(np.array([x], dtype=object))[0]
    return x * x

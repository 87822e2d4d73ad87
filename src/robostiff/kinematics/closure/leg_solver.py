"""Closure of one leg: by its closed form if it has one, otherwise by Newton's method."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.errors import InputError, OpenAtHomeError
from robostiff.kept import kept
from robostiff.kinematics.closure.arm import Arm, recognise_arm
from robostiff.kinematics.closure.assembly import (
    RootSigns,
    all_modes,
    beyond_limits,
    in_one,
    nearest,
    on_turn_of_home,
    shortened,
)
from robostiff.kinematics.closure.leg_equations import (
    Followed,
    NewtonTask,
    attachment_frame,
    frame_in_base,
    gaps,
    pose_of_end,
)
from robostiff.kinematics.closure.leg_forms import (
    Post,
    Rod,
    Strut,
    recognise_post,
    recognise_rod,
    recognise_sliding_rod,
    recognise_strut,
)
from robostiff.kinematics.closure.skeleton import copied_places, skeleton_of
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Actuated, Chain, Elbow, Leg
from robostiff.spatial.batch import poses_side_by_side

#: Part of the length, or radians: a leg that closes.
CLOSED = 1e-7
_STARTS, _SEED = 32, 5  # of the search for other postures
#: Closed forms over recorded entries as well as over poses.
RecordedForm = Strut | Rod | Post
ClosedForm = RecordedForm | Arm
_MOVES = 1e-6  # radians and parts of the length: less is rounding
_SLIDES = 4  # of a posture along an open motion, which turns little
_STEP = 0.1  # of drives that are moved alone [rad, or parts of the length]
_OPEN = 1e-11  # of the length: more than rounding leaves between copies


@dataclass(frozen=True)
class LegSolver:
    """Closes one leg at platform poses."""

    leg: Leg
    closed_form: ClosedForm | None  # of the main path of its chain
    copies: np.ndarray  # (size,): places on the main path to whose coordinates its own are equal
    home_pose: np.ndarray  # (6,): pose coordinates of the home configuration
    home: np.ndarray  # (size,): leg coordinates that close it there
    length: float  # characteristic length [m]

    def solve(
        self, pose: np.ndarray, R_platform: np.ndarray, *, from_afar: bool = True
    ) -> tuple[np.ndarray, np.ndarray, PlacedChain | None]:
        """Leg coordinates (N, size) at platform poses, the nearest where out of reach.

        The second result is where the leg closes, but in another assembly mode than at home (N,);
        the third its chain at these coordinates, where that was needed to find them.
        Poses (N, 6) come with their rotation matrices, which the legs share. With `from_afar`,
        poses far from home are looked for in many small steps.
        """
        elsewhere = np.zeros(len(pose), dtype=bool)
        if self.closed_form is None:
            if from_afar:
                found = self._task.follow(self.home_pose, [self.home], pose)
                q, elsewhere = found.coordinates[0], found.elsewhere
            else:
                q = self._task.close(pose, [np.tile(self.home, (len(pose), 1))])[1][0]
            return on_turn_of_home(self.leg.chain, q, self.leg.chain.home), elsewhere, None
        if isinstance(self.closed_form, Arm):
            modes = self._modes_at_home
            q, _ = self._nearest_in(modes, self.closed_form, self.home, pose, R_platform)
            return q, elsewhere, None
        q = self._copies_at(self.closed_form, pose, R_platform)
        q = on_turn_of_home(self.leg.chain, q, self.leg.chain.home)
        if not (self.leg.chain.has_blocks and from_afar):
            return q, elsewhere, None
        leaves_open, placed = self._leaves_loops_open(q, pose, R_platform)
        rows = np.flatnonzero(leaves_open)
        if not rows.size:
            return q, elsewhere, placed
        found = self._task.follow(self.home_pose, [self.home], pose[rows])
        met = found.closed | found.elsewhere
        q[rows[met]] = found.coordinates[0][met]
        elsewhere[rows] = found.elsewhere
        return on_turn_of_home(self.leg.chain, q, self.leg.chain.home), elsewhere, None

    def solve_near(self, near: np.ndarray, pose: np.ndarray, R_platform: np.ndarray) -> np.ndarray:
        """Leg coordinates (N, size) at platform poses, in the posture nearest to given ones.

        In closed form that is the nearest of all assembly modes. Otherwise the leg is followed from
        the given coordinates, and from the pose to which they bring its end.
        """
        near = np.where(self.leg.chain.free, near, self.leg.chain.home)
        q, left = np.tile(near, (len(pose), 1)), np.arange(len(pose))
        if self.closed_form is not None:
            modes = all_modes(self.closed_form.signs)
            q, closed = self._nearest_in(modes, self.closed_form, near, pose, R_platform)
            left = np.flatnonzero(self.leg.chain.has_blocks & ~closed)
        if left.size:
            start = pose_of_end(self.leg, near)
            found = self._task.follow(start, [near], pose[left])
            kept = np.flatnonzero(found.closed | (self.closed_form is None))
            q[left[kept]] = found.coordinates[0][kept]
        return on_turn_of_home(self.leg.chain, q, near)

    def _nearest_in(
        self,
        modes: tuple[RootSigns, ...],
        form: ClosedForm,
        near: np.ndarray,
        pose: np.ndarray,
        R_platform: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Leg coordinates (N, size) nearest to given ones in some modes, and where they close."""
        every = self._in_modes(modes, form, pose, R_platform)
        closed = np.ones(every.shape[:-1], dtype=bool)
        if len(modes) > 1:
            closed = _open_by(self.leg, every, pose, R_platform, self.length) <= CLOSED
        given = np.ones(self.leg.chain.main_path.size, dtype=bool)
        chosen = self.nearest(form, every, closed, near, given)
        q = on_turn_of_home(self.leg.chain, every[chosen, np.arange(len(pose))], near)
        closed = closed[chosen, np.arange(len(pose))]
        if isinstance(form, Arm):
            rows = np.flatnonzero(form.meeting(q)[1])
            if rows.size:
                found = self._nearest_open(pose[rows], near)
                q[rows[found.closed]] = found.coordinates[0][found.closed]
        return q, closed

    def _nearest_open(self, pose: np.ndarray, near: np.ndarray) -> Followed:
        """Postures of an arm at poses that leave one motion of its drives open, the nearest.

        Each is closed, and moved along that motion until nothing of it leads nearer.
        """
        found = self._task.closed_near(pose, [np.tile(near, (len(pose), 1))])
        for _ in range(_SLIDES):
            q = found.coordinates[0].copy()
            J = self._task.rates(np.concatenate([pose, q], axis=-1))
            motion, free = np.linalg.svd(J)[2][:, -1], self.leg.chain.free
            ahead = np.sum(motion * (near - q)[:, free], axis=-1, keepdims=True)
            q[:, free] += ahead * motion
            found = self._task.closed_near(pose, [q])
        return found

    @cached_property
    def _modes_at_home(self) -> tuple[RootSigns, ...]:
        """The mode of home; of an arm all that meet there, as of one that is stretched out."""
        form = self.closed_form
        if not isinstance(form, Arm):
            return (form.mode,) if form else ()
        (meets,) = form.meeting(self.home[None])[0].T
        own = (form.mode.root, form.mode.first, form.mode.second)
        return tuple(
            mode
            for mode in all_modes(form.signs)
            if all(
                meet or x == y
                for meet, x, y in zip(meets, (mode.root, mode.first, mode.second), own, strict=True)
            )
        )

    @property
    def modes(self) -> tuple[RootSigns, ...]:
        """Assembly modes of the closed form that the elbow of the leg allows; none without one."""
        if self.closed_form is None:
            return ()
        wanted = {Elbow.PLUS: (1,), Elbow.MINUS: (-1,)}.get(self.leg.elbow, (1, -1))
        return tuple(mode for mode in all_modes(self.closed_form.signs) if mode.root in wanted)

    def _in_modes(
        self,
        modes: tuple[RootSigns, ...],
        form: ClosedForm,
        pose: np.ndarray,
        R_platform: np.ndarray,
    ) -> np.ndarray:
        """Leg coordinates in some modes of the closed form (m, N, size)."""
        form = form.in_mode(in_one(modes, len(pose)))
        many = np.tile(pose, (len(modes), 1)), np.tile(R_platform, (len(modes), 1, 1))
        return self._copies_at(form, *many).reshape(len(modes), *pose.shape[:-1], -1)

    def that_close(self, pose: np.ndarray) -> tuple[tuple[RootSigns, ...], np.ndarray]:
        """Assembly modes of the closed form that close the leg at one pose (6,), and q (m, size).

        Raises InputError when the leg has no closed form.
        """
        if self.closed_form is None:
            raise InputError(
                f"postures of leg {self.leg.name!r}",
                got="a leg that is closed by iteration",
                expected="a leg in closed form, whose postures can be counted",
                hint="choose one by joint coordinates close to it: near=[...]",
            )
        R, modes = turn_by_vector(pose[None, 3:]), all_modes(self.closed_form.signs)
        every = self._in_modes(modes, self.closed_form, pose[None], R)
        q = on_turn_of_home(self.leg.chain, every[:, 0], self.leg.chain.home)
        closed = _open_by(self.leg, every, pose[None], R, self.length)[:, 0] <= CLOSED
        closed &= ~shortened(self.leg.chain, q)
        return tuple(mode for mode, good in zip(modes, closed, strict=True) if good), q[closed]

    @property
    def recorded_form(self) -> RecordedForm | None:
        """The closed form, where it is one over recorded entries as well."""
        return None if isinstance(self.closed_form, Arm) else self.closed_form

    @property
    def posture_is_given(self) -> bool:
        """Whether home coordinates or an elbow choose the posture of the leg.

        Coordinates that are left out do, where their zeros are as the leg is drawn at home.
        """
        chain = self.leg.chain
        drawn = np.max(np.abs(self.home - chain.home), initial=0.0) <= CLOSED
        given = bool(np.any(chain.home_given & chain.free))
        return self.leg.elbow is not Elbow.HOME or given or bool(drawn)

    def alternatives(self, pose: np.ndarray) -> np.ndarray:
        """Coordinates (m, size) of postures at one pose (6,) that close the leg within its limits.

        All in closed form, the sign of a strut's length kept; else what Newton's method finds from
        random coordinates.
        """
        if self.closed_form is None:
            chain = self.leg.chain
            q = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (_STARTS, chain.size))
            turns = [screw.turns for screw in chain.freedoms]
            q = np.where(chain.free, q * np.where(turns, np.pi, self.length), chain.home)
            poses = np.tile(pose, (_STARTS, 1))
            _, (q,) = self._task.close(poses, [q])
            R = turn_by_vector(poses[:, 3:])
            closed = _open_by(self.leg, q[None], poses, R, self.length)[0] <= CLOSED
            q = on_turn_of_home(chain, q, chain.home)
            return q[closed & ~shortened(chain, q) & ~beyond_limits(chain, q)]
        modes, q = self.that_close(pose)
        root = self.closed_form.mode.root
        kept = [not isinstance(self.closed_form, Strut) or mode.root == root for mode in modes]
        return q[np.array(kept, dtype=bool) & ~beyond_limits(self.leg.chain, q)]

    def nearest(
        self,
        form: ClosedForm,
        every: np.ndarray,
        closed: np.ndarray,
        near: np.ndarray,
        given: np.ndarray,
    ) -> np.ndarray:
        """Which of some postures (m, N, size) is nearest to given coordinates (N,)."""
        path, places = self.leg.chain.main_path, self.leg.chain.main_places
        q, own = every[..., places], near[places]
        return nearest(path, q, closed, own, given, form.leading, self.length)

    def _leaves_loops_open(
        self, q: np.ndarray, pose: np.ndarray, R_platform: np.ndarray
    ) -> tuple[np.ndarray, PlacedChain]:
        """Where the leg meets the platform and a loop inside it stays open (N,); its chain.

        There the body after a block is turned so that its branches are no copies any more.
        """
        placed, found = _placed(self.leg, q, R_platform, pose[..., :3])
        return self.leaves_open(found), placed

    def leaves_open(self, ends: Iterable[Loop]) -> np.ndarray:
        """The same, of gaps at the platform and of loops (N,)."""
        first, *loops = (_size(gap, self.length) > _OPEN for gap in ends)
        return ~first & np.any(loops, axis=0)

    @cached_property
    def _task(self) -> NewtonTask:
        """The equations of the leg alone."""
        return NewtonTask((self.leg,), (), self.length)

    def closing_at_home(self) -> LegSolver:
        """The same, or one that iterates where the closed form leaves a loop open at home.

        Raises InputError when the leg does not close there.
        """
        if self.closed_form is not None:
            gap = self._gap_at_home(self.home)
            if not self.leg.chain.has_blocks or _size(gap, self.length) <= CLOSED:
                _check_home(self.leg, gap, self.length)
                return self
        chain = self.leg.chain
        _, (closed,) = self._task.close(self.home_pose[None, :], [chain.home[None, :]])
        home = on_turn_of_home(chain, closed, chain.home)[0]
        _check_home(self.leg, self._gap_at_home(home), self.length)
        return replace(self, closed_form=None, copies=np.arange(chain.size), home=home)

    def _gap_at_home(self, q: np.ndarray) -> Loop:
        """The gap that is open most, at home."""
        pose = self.home_pose
        _, found = _placed(self.leg, q, turn_by_vector(pose[3:]), pose[:3])
        return max(found, key=lambda gap: float(_size(gap, self.length)))

    def leaves_drive_open(
        self, pose: np.ndarray, R_platform: np.ndarray, q: np.ndarray, *, chosen: bool = False
    ) -> np.ndarray:
        """Where the coordinates q (N, size) of drives do not follow from the pose (N,).

        That of a crank under the far end of its rod does not. Nor do those of an arm in whose wrist
        two axes are in line, of which the pose decides the sum, unless they are chosen by others
        close by. An arm with more drives than its end has freedoms is not meant.
        """
        form = self.closed_form
        if isinstance(form, Rod):
            return form.leaves_drive_open(*frame_in_base(self.leg, R_platform, pose[:, :3]))
        if chosen:
            return np.zeros(len(pose), dtype=bool)
        if isinstance(form, Arm):
            found = form.meeting(q)[1]
        elif form is None and self._drives.any():
            found = self._drives_move_alone(pose, q)
        else:
            return np.zeros(len(pose), dtype=bool)
        return found & np.any(np.abs(q - self.home) > _MOVES, axis=-1)

    def _drives_move_alone(self, pose: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Where drives can move at singular postures that hold the platform still (N,).

        A step along a motion that closure leaves open has to lead to another posture that closes:
        where an arm is stretched out, it does not.
        """
        x = np.concatenate([pose, q], axis=-1)
        _, values, V_T = np.linalg.svd(self._task.rates(x))
        open_ = np.count_nonzero(values > _MOVES, axis=-1) < self._in_general[0]
        free = self.leg.chain.free
        for k in np.flatnonzero(open_):
            motion = np.zeros(q.shape[-1])
            motion[free] = V_T[k, np.count_nonzero(values[k] > _MOVES)]
            found = self._task.closed_near(pose[[k]], [q[[k]] + _STEP * motion])
            moved = np.abs(found.coordinates[0][0] - q[k])[self._drives]
            open_[k] = found.closed[0] and moved.max() > 0.1 * _STEP
        return open_

    @cached_property
    def _drives(self) -> np.ndarray:
        """Which coordinates are actuated (size,) bool."""
        chain = self.leg.chain
        return chain.free & np.array([isinstance(role, Actuated) for role in chain.roles], bool)

    @property
    def has_redundant_drives(self) -> bool:
        """Whether drives can move in any posture while the end stands still, as of seven turns."""
        return self.closed_form is None and bool(self._drives.any()) and self._in_general[1]

    @cached_property
    def _in_general(self) -> tuple[int, bool]:
        """Rank of the rates of closure in general, and whether drives can move alone there."""
        free = self.leg.chain.free
        q = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (1, free.size))
        x = np.concatenate([self.home_pose[None], np.where(free, q, self.home)], axis=-1)
        _, values, V_T = np.linalg.svd(self._task.rates(x)[0])
        rank = int(np.count_nonzero(values > _MOVES))
        return rank, bool(np.any(np.abs(V_T[rank:, self._drives[free]]) > _MOVES))

    def that_holds_at(self, pose: np.ndarray, R_platform: np.ndarray) -> LegSolver:
        """The same, or one that iterates where copies leave a loop open at one of the poses."""
        if self.closed_form is None:
            return self
        q = self._copies_at(self.closed_form, pose, R_platform)
        if not np.any(self._leaves_loops_open(q, pose, R_platform)[0]):
            return self
        return replace(self, closed_form=None, copies=np.arange(self.leg.chain.size))

    def _copies_at(self, form: ClosedForm, pose: np.ndarray, R_platform: np.ndarray) -> np.ndarray:
        """Coordinates in closed form, those of copies equal to those of the main path."""
        return self.in_form(form, *frame_in_base(self.leg, R_platform, pose[..., :3]))

    def in_form(self, form: ClosedForm, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Coordinates (N, size) in closed form, the end frame at (R, p) in that of the base."""
        q = form.solve(R, p)
        same = self.copies.size == q.shape[-1]
        return q if same else poses_side_by_side(q[..., self.copies], 1)


def recognised_solver(leg: Leg, home_pose: np.ndarray, length: float) -> LegSolver:
    """A solver with the closed form of a leg, its assembly mode not chosen yet.

    Raises InputError when an elbow is named for a leg that has no choice in closed form.
    """
    # No closed form takes joints that follow one another.
    copies = None if leg.chain.is_coupled else copied_places(leg.chain)
    closed_form = None if copies is None else _recognised(leg.chain.main_path)
    if leg.elbow is not Elbow.HOME and not isinstance(closed_form, Rod):
        raise InputError(
            f"elbow of leg {leg.name!r}",
            got=leg.elbow.value,
            expected="none: only a slide or crank with a rod has two ways in closed form",
            hint="choose the working mode of this leg by the home coordinates of its joints",
        )
    if closed_form is None or copies is None:
        copies = np.arange(leg.chain.size)
    return LegSolver(leg, closed_form, copies, home_pose, leg.chain.home, length)


def _placed(
    leg: Leg, q: np.ndarray, R_platform: np.ndarray, p_platform: np.ndarray
) -> tuple[PlacedChain, list[Loop]]:
    """A leg at coordinates, and its gaps."""
    placed = place_chain(leg.chain, q, leg.base.R, leg.base.p)
    return placed, list(gaps(leg, placed, *attachment_frame(leg, R_platform, p_platform)))


_KINDS = (recognise_strut, recognise_rod, recognise_sliding_rod, recognise_post, recognise_arm)


@kept
def _recognised(path: Chain) -> ClosedForm | None:
    """The closed form of a chain without blocks: by given points first, then by meeting axes."""
    for joined in (False, True):
        skeleton = skeleton_of(path, joined_where_axes_meet=joined)
        for recognise in _KINDS:
            if (found := recognise(skeleton)) is not None:
                return found
    return None


def _open_by(
    leg: Leg, q: np.ndarray, pose: np.ndarray, R_platform: np.ndarray, length: float
) -> np.ndarray:
    """How far postures (m, N, size) leave a leg open: part of the length, or radians (m, N)."""
    many = np.tile(R_platform, (len(q), 1, 1)), np.tile(pose[:, :3], (len(q), 1))
    _, found = _placed(leg, q.reshape(-1, q.shape[-1]), *many)
    return np.max([_size(gap, length) for gap in found], axis=0).reshape(q.shape[:-1])


def _size(gap: Loop, length: float) -> np.ndarray:
    """Of a gap (...): part of the length, or radians."""
    shift, turn = gap.missed
    return np.maximum(shift / length, turn)


def _check_home(leg: Leg, gap: Loop, length: float) -> None:
    """Refuse a home that leaves the gap that is open most."""
    if _size(gap, length) > CLOSED:
        (shift, turn), where = gap.missed, gap.name
        place = f"at the end of branch {where!r}" if where else "at the platform"
        raise OpenAtHomeError(
            f"home configuration of leg {leg.name!r}",
            got=f"a gap of {shift:.4g} m and {np.degrees(turn):.4g} deg {place}",
            expected="a leg that closes at the home pose"
            + (", and branches that end where the first one does" if where else ""),
            hint="check its dimensions and the directions of its frames and axes, or give the "
            "joints home coordinates near the closed configuration",
        )

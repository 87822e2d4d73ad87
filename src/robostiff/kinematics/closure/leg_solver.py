"""Closure of legs with equal chains: by their closed form if they have one, or by iteration."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.kinematics.closure.arm import Arm
from robostiff.kinematics.closure.assembly_mode import Followed, closed_near, follow, mode_of
from robostiff.kinematics.closure.assembly_mode import nearest as nearest_closed
from robostiff.kinematics.closure.leg_forms import (
    Post,
    RootSigns,
    all_modes,
    beyond_limits,
    nearest,
    on_turn_of_home,
    where_too_short,
)
from robostiff.kinematics.closure.loops import Loops, attachment_frame, loops_of_legs
from robostiff.kinematics.closure.rods import Rod, Strut
from robostiff.kinematics.frames import Loop, PlacedChain, place_chain
from robostiff.kinematics.pose import pose_of_end
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Actuated, Chain, Elbow, Leg, PlacedLeg
from robostiff.spatial.batch import poses_side_by_side, product, transpose

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


@frozen
class LegSolver:
    """Closes legs with equal chains at platform poses, in one assembly mode.

    Rows (legs N, ...) have all poses of the first leg, then those of the next.
    """

    legs: tuple[Leg, ...]
    closed_form: ClosedForm | None  # of the main path of their chain
    copies: np.ndarray  # (size,): places on the main path to whose coordinates its own are equal
    home_pose: np.ndarray  # (6,): pose coordinates of the home configuration
    homes: np.ndarray  # (legs, size): leg coordinates that close them there
    length: float  # characteristic length [m]

    @property
    def leg(self) -> Leg:
        """The first of the legs."""
        return self.legs[0]

    @property
    def home(self) -> np.ndarray:
        """Coordinates (size,) that close the first leg at home."""
        return self.homes[0]

    @property
    def chain(self) -> Chain:
        """The chain of all legs."""
        return self.legs[0].chain

    @cached_property
    def each(self) -> tuple[LegSolver, ...]:
        """Every leg for itself."""
        if len(self.legs) == 1:
            return (self,)
        pairs = zip(self.legs, self.homes, strict=True)
        return tuple(replace(self, legs=(leg,), homes=q[None]) for leg, q in pairs)

    def solve(
        self, pose: np.ndarray, R: np.ndarray, *, from_afar: bool = True
    ) -> tuple[list[np.ndarray], np.ndarray, PlacedChain | None]:
        """Coordinates (N, size) of each leg at platform poses, the nearest where out of reach.

        The second result is where a leg closes, but in another assembly mode than at home (N,); the
        third the chain of all legs at these coordinates, where that was needed to find them.
        Poses (N, 6) come with their rotation matrices, which the legs share. With `from_afar`,
        poses far from home are looked for in many small steps.
        """
        form, chain, count = self.closed_form, self.chain, len(pose)
        elsewhere, found = np.zeros(count, dtype=bool), []
        if form is None or isinstance(form, Arm):
            for one in self.each:
                if form is not None:
                    q = one._nearest_in(one._modes_at_home, one.home, pose, R)[0]
                elif from_afar:
                    there = one._followed(pose)
                    (q,), elsewhere = there.coordinates, elsewhere | there.elsewhere
                else:
                    home = np.tile(one.home, (count, 1))
                    q = nearest_closed(one._loops, np.concatenate([pose, home], axis=-1))[:, 6:]
                found.append(on_turn_of_home(chain, q, chain.home))
            return found, elsewhere, None
        q = on_turn_of_home(chain, self._in_form(form, R, pose[:, :3]), chain.home)
        found = np.split(q, len(self.legs))
        if not (chain.has_blocks and from_afar):
            return found, elsewhere, None
        placed, leaves_open = self._leaves_loops_open(q, R, pose[:, :3])
        if not np.any(leaves_open):
            return found, elsewhere, placed
        for one, q, open_ in zip(self.each, found, np.split(leaves_open, len(found)), strict=True):
            rows = np.flatnonzero(open_)
            there = one._followed(pose[rows])
            met = there.closed | there.elsewhere
            q[rows[met]] = there.coordinates[0][met]
            elsewhere[rows] |= there.elsewhere
            on_turn_of_home(chain, q, chain.home)
        return found, elsewhere, None

    def _followed(self, pose: np.ndarray) -> Followed:
        """The first leg at poses (N, 6), followed from home."""
        return follow(self._loops, np.concatenate([self.home_pose, self.home]), pose)

    def way_ends(self, pose: np.ndarray, R: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Where the leg is found not to reach poses (N, 6).

        By postures x on the straight ways to them: pose coordinates, then those of the leg.
        """
        form, home = self.closed_form, np.concatenate([self.home_pose, self.home])
        if form is None:
            return mode_of(self._loops, home).way_ends(x, pose)
        if isinstance(form, Arm) or self.chain.has_blocks:
            return np.zeros(len(pose), dtype=bool)
        return ~self.closes(self._in_form(form, R, pose[:, :3]), R, pose[:, :3])

    def solve_near(self, near: np.ndarray, pose: np.ndarray, R: np.ndarray) -> np.ndarray:
        """Coordinates (N, size) of a leg at platform poses, in the posture nearest to given ones.

        In closed form that is the nearest of all assembly modes. Otherwise the leg is followed from
        the given coordinates, and from the pose to which they bring its end.
        """
        near = np.where(self.chain.free, near, self.chain.home)
        q, left = np.tile(near, (len(pose), 1)), np.arange(len(pose))
        if self.closed_form is not None:
            q, closed = self._nearest_in(all_modes(self.closed_form.signs), near, pose, R)
            left = np.flatnonzero(self.chain.has_blocks & ~closed)
        if left.size:
            start = np.concatenate([pose_of_end(self.leg, near), near])
            found = follow(self._loops, start, pose[left])
            kept = np.flatnonzero(found.closed | (self.closed_form is None))
            q[left[kept]] = found.coordinates[0][kept]
        return on_turn_of_home(self.chain, q, near)

    def _nearest_in(
        self, modes: tuple[RootSigns, ...], near: np.ndarray, pose: np.ndarray, R: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates (N, size) of a leg nearest to given ones in some modes; where they close."""
        form, rows = self.closed_form, np.arange(len(pose))
        assert form is not None  # noqa: S101 - it has modes
        if len(modes) == 1:
            q, is_closed = self._in_form(form.in_mode(modes[0]), R, pose[:, :3]), rows >= 0
        else:
            every, closed = (x[:, 0] for x in self.in_modes(modes, pose, R))
            given = np.ones(self.chain.main_path.size, dtype=bool)
            chosen = nearest(self.chain, every, closed, near, given, form.leading, self.length)
            q, is_closed = every[chosen, rows], closed[chosen, rows]
        on_turn_of_home(self.chain, q, near)
        if isinstance(form, Arm) and (open_ := np.flatnonzero(form.meeting(q)[1])).size:
            # One motion of the drives is open: each posture is closed, and moved along that motion
            # until nothing of it leads nearer to the given coordinates.
            x = np.concatenate([pose[open_], np.tile(near, (len(open_), 1))], axis=-1)
            found, free = closed_near(self._loops, x), np.flatnonzero(self.chain.free)
            for _ in range(_SLIDES):
                x = found.x.copy()
                motion = np.linalg.svd(self._loops.rates(x))[2][:, -1]
                ahead = np.sum(motion * (near - x[:, 6:])[:, free], axis=-1, keepdims=True)
                x[:, 6 + free] += ahead * motion
                found = closed_near(self._loops, x)
            q[open_[found.closed]] = found.coordinates[0][found.closed]
        return q, is_closed

    @cached_property
    def _modes_at_home(self) -> tuple[RootSigns, ...]:
        """The mode of home; of an arm all that meet there, as of one that is stretched out."""
        form = self.closed_form
        if not isinstance(form, Arm):
            return (form.mode,) if form else ()
        (meets,) = form.meeting(self.home[None])[0].T
        own = np.array([form.mode.root, form.mode.first, form.mode.second])
        signs = [(mode, (mode.root, mode.first, mode.second)) for mode in all_modes(form.signs)]
        return tuple(mode for mode, other in signs if np.all(meets | (own == other)))

    @property
    def modes(self) -> tuple[RootSigns, ...]:
        """Assembly modes of the closed form that the elbow of the leg allows; none without one."""
        if self.closed_form is None:
            return ()
        wanted = {Elbow.PLUS: (1,), Elbow.MINUS: (-1,)}.get(self.leg.elbow, (1, -1))
        return tuple(mode for mode in all_modes(self.closed_form.signs) if mode.root in wanted)

    def in_modes(
        self, modes: tuple[RootSigns, ...], pose: np.ndarray, R: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Postures in some modes of the closed form (modes, legs, N, size), and which close."""
        form, shape = self.closed_form, (len(self.legs), len(modes), len(pose))
        assert form is not None  # noqa: S101 - it has modes
        signs = [(mode.root, mode.first, mode.second) for mode in modes] * len(self.legs)
        form = form.in_mode(RootSigns(*np.repeat(signs, len(pose), axis=0).T))
        at = np.tile(R, (len(modes), 1, 1)), np.tile(pose[:, :3], (len(modes), 1))
        q = self._in_form(form, *at)
        closed = self.closes(q, *at).reshape(shape)
        return np.moveaxis(q.reshape(*shape, -1), 0, 1), np.moveaxis(closed, 0, 1)

    def closes(self, q: np.ndarray, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Which coordinates of rows close their legs, with the platform at poses."""
        sizes = [_size(gap, self.length) for gap in self._placed(q, R, p)[1]]
        return np.max(sizes, axis=0) <= CLOSED

    def that_close(self, pose: np.ndarray) -> tuple[tuple[RootSigns, ...], np.ndarray]:
        """Assembly modes of the closed form that close the leg at one pose (6,), and q (m, size).

        Raises InputError when the leg has no closed form.
        """
        if self.closed_form is None:
            raise InputError(
                f"postures of leg {self.leg.name!r}",
                got=Words("a leg that is closed by iteration"),
                expected="a leg in closed form, whose postures can be counted",
                hint="choose one by joint coordinates close to it: near=[...]",
            )
        R, modes = turn_by_vector(pose[None, 3:]), all_modes(self.closed_form.signs)
        q, closed = (x[:, 0, 0] for x in self.in_modes(modes, pose[None], R))
        q = on_turn_of_home(self.chain, q, self.chain.home)
        closed &= ~where_too_short(self.chain, q)
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
        drawn = np.max(np.abs(self.home - self.chain.home), initial=0.0) <= CLOSED
        given = bool(np.any(self.chain.home_given & self.chain.free))
        return self.leg.elbow is not Elbow.HOME or given or bool(drawn)

    def alternatives(self, pose: np.ndarray) -> np.ndarray:
        """Coordinates (m, size) of postures at one pose (6,) that close the leg within its limits.

        All in closed form, the sign of a strut's length kept; else what Newton's method finds from
        random coordinates.
        """
        chain = self.chain
        if self.closed_form is None:
            q = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (_STARTS, chain.size))
            turns = [screw.turns for screw in chain.freedoms]
            q = np.where(chain.free, q * np.where(turns, np.pi, self.length), chain.home)
            poses = np.tile(pose, (_STARTS, 1))
            q = nearest_closed(self._loops, np.concatenate([poses, q], axis=-1))[:, 6:]
            closed = self.closes(q, turn_by_vector(poses[:, 3:]), poses[:, :3])
            q = on_turn_of_home(chain, q, chain.home)
            return q[closed & ~where_too_short(chain, q) & ~beyond_limits(chain, q)]
        modes, q = self.that_close(pose)
        root = self.closed_form.mode.root
        kept = [not isinstance(self.closed_form, Strut) or mode.root == root for mode in modes]
        return q[np.array(kept, dtype=bool) & ~beyond_limits(chain, q)]

    def _leaves_loops_open(
        self, q: np.ndarray, R: np.ndarray, p: np.ndarray
    ) -> tuple[PlacedChain, np.ndarray]:
        """The chain of rows, and where it meets the platform and a loop inside it stays open.

        There the body after a block is turned so that its branches are no copies any more.
        """
        placed, found = self._placed(q, R, p)
        first, *loops = (_size(gap, self.length) > _OPEN for gap in found)
        return placed, ~first & np.any(loops, axis=0)

    @cached_property
    def _loops(self) -> Loops:
        """The equations of the first leg alone."""
        return loops_of_legs((self.leg,), (), self.length)

    def closed_at_home(self) -> LegSolver:
        """A solver that iterates, from where that closes a leg at home."""
        chain = self.chain
        start = np.concatenate([self.home_pose, chain.home])
        closed = nearest_closed(self._loops, start[None])[:, 6:]
        homes = on_turn_of_home(chain, closed, chain.home)
        return replace(self, closed_form=None, copies=np.arange(chain.size), homes=homes)

    def gap_at_home(self) -> tuple[Loop, float]:
        """The gap of a leg that is open most at home, and its size."""
        pose = self.home_pose[None]
        _, found = self._placed(self.homes, turn_by_vector(pose[:, 3:]), pose[:, :3])
        return max(((gap, float(_size(gap, self.length)[0])) for gap in found), key=lambda x: x[1])

    def leaves_drive_open(
        self, pose: np.ndarray, R: np.ndarray, q: np.ndarray, *, chosen: bool = False
    ) -> np.ndarray:
        """Where the coordinates q (N, size) of drives of a leg do not follow from the pose (N,).

        That of a crank under the far end of its rod does not. Nor do those of an arm in whose wrist
        two axes are in line, of which the pose decides the sum, unless they are chosen by others
        close by. An arm with more drives than its end has freedoms is not meant.
        """
        form = self.closed_form
        if isinstance(form, Rod):
            return form.leaves_drive_open(*self._inside(R, pose[:, :3]))
        if chosen:
            return np.zeros(len(pose), dtype=bool)
        if isinstance(form, Arm):
            found = form.meeting(q)[1]
        elif form is None and self.drives.any():
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
        _, values, V_T = np.linalg.svd(self._loops.rates(x))
        open_ = np.count_nonzero(values > _MOVES, axis=-1) < self._in_general[0]
        for k in np.flatnonzero(open_):
            ahead = x[[k]]
            motion = V_T[k, np.count_nonzero(values[k] > _MOVES)]
            ahead[:, 6 + np.flatnonzero(self.chain.free)] += _STEP * motion
            found = closed_near(self._loops, ahead)
            moved = np.abs(found.coordinates[0][0] - q[k])[self.drives]
            open_[k] = found.closed[0] and moved.max() > 0.1 * _STEP
        return open_

    @cached_property
    def drives(self) -> np.ndarray:
        """Which coordinates are actuated (size,) bool."""
        driven = [isinstance(role, Actuated) for role in self.chain.roles]
        return self.chain.free & np.array(driven, dtype=bool)

    @property
    def has_redundant_drives(self) -> bool:
        """Whether drives can move in any posture while the end stands still, as of seven turns."""
        return self.closed_form is None and bool(self.drives.any()) and self._in_general[1]

    @cached_property
    def _in_general(self) -> tuple[int, bool]:
        """Rank of the rates of closure in general, and whether drives can move alone there."""
        rank, moving = self._loops.in_general(np.concatenate([self.home_pose, self.home]))
        return rank, bool(np.any(moving[6:][self.drives]))

    def that_holds_at(self, pose: np.ndarray, R: np.ndarray) -> LegSolver:
        """The same, or one that iterates where copies leave a loop open at one of the poses."""
        form, p = self.closed_form, pose[:, :3]
        if form is None or not np.any(self._leaves_loops_open(self._in_form(form, R, p), R, p)[1]):
            return self
        return replace(self, closed_form=None, copies=np.arange(self.chain.size))

    def placed(
        self,
        q: Sequence[np.ndarray],
        R: np.ndarray,
        p: np.ndarray,
        placed: PlacedChain | None = None,
    ) -> tuple[list[PlacedLeg], np.ndarray, np.ndarray]:
        """The legs at coordinates (N, size) of each, with the platform at (R, p).

        The chain of all of them may be placed already.

        Returns
        -------
        legs : list of PlacedLeg
        shifts, turns : (legs, N) arrays
            By how much each misses the platform, or a loop in it is open [m], [rad].
        """
        count, number = len(p), len(self.legs)
        rows = q[0] if number == 1 else poses_side_by_side(np.concatenate(q), 1)
        placed, found = self._placed(rows, R, p, placed)
        missed = zip(*(loop.gap for loop in found), strict=True)
        shift, turn = (x[0] if len(x) == 1 else np.max(x, axis=0) for x in missed)
        legs = self.one_by_one(PlacedLeg(self.leg.name, placed.elements, placed.p), count)
        return legs, shift.reshape(number, count), turn.reshape(number, count)

    def one_by_one(self, rows: PlacedLeg, count: int) -> list[PlacedLeg]:
        """The legs at so many poses each, from the first of them at the rows of all."""
        if len(self.legs) == 1:
            return [rows]
        each = [rows.at(slice(i * count, (i + 1) * count)) for i in range(len(self.legs))]
        return [replace(own, name=leg.name) for own, leg in zip(each, self.legs, strict=True)]

    def _placed(
        self, q: np.ndarray, R: np.ndarray, p: np.ndarray, placed: PlacedChain | None = None
    ) -> tuple[PlacedChain, list[Loop]]:
        """The chain at coordinates of rows, with the platform at poses, and its gaps."""
        if placed is None:
            placed = place_chain(self.chain, q, *self.bases(len(p)))
        return placed, placed.gaps(*self._ends(R, p))

    def _in_form(self, form: ClosedForm, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Coordinates of rows in closed form, those of copies equal to those of the main path."""
        q = form.solve(*self._inside(R, p))
        same = self.copies.size == q.shape[-1]
        return q if same else poses_side_by_side(q[..., self.copies], 1)

    def _inside(self, R: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Frames of rows at which the legs end, seen from those in which they begin."""
        R_end, p_end = self._ends(R, p)
        R_base, p_base = self.bases(len(p))
        back = transpose(R_base)
        return product(back, R_end), np.einsum("...ij,...j->...i", back, p_end - p_base)

    def _ends(self, R: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Frames of rows on the platform, at (R, p), at which the legs end."""
        if len(self.legs) == 1:
            return attachment_frame(self.leg, R, p)
        R_own, p_own = self._frames[1]
        at = p + np.einsum("nij,lj->lni", R, p_own)
        return _rows(product(R, R_own[:, None]), 2), _rows(at, 1)

    def bases(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Frames of rows in which the legs begin, for so many poses; one frame of one leg."""
        if len(self.legs) == 1:
            return self.leg.base.R, self.leg.base.p
        R, p = self._frames[0]
        return (
            _rows(np.broadcast_to(R[:, None], (len(R), count, 3, 3)), 2),
            _rows(np.broadcast_to(p[:, None], (len(R), count, 3)), 1),
        )

    @cached_property
    def _frames(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Axes (legs, 3, 3) and origins (legs, 3) of the bases, then of the attachments."""
        each = [leg.base for leg in self.legs], [leg.attachment for leg in self.legs]
        return [(np.stack([f.R for f in own]), np.stack([f.p for f in own])) for own in each]


def _rows(values: np.ndarray, own_axes: int) -> np.ndarray:
    """Of all legs at all poses along one axis, poses side by side."""
    return poses_side_by_side(values.reshape(-1, *values.shape[2:]), own_axes)


def _size(loop: Loop, length: float) -> np.ndarray:
    """Of a gap (...): part of the length, or radians."""
    shift, turn = loop.gap
    return np.maximum(shift / length, turn)

"""Finding the posture of a robot at a pose: every leg closed, and all parts placed in the world."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TypeAlias

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.closure import (
    LegSolver,
    Loops,
    follow,
    leg_solvers,
    legs_alike,
    loops_of_legs,
    reach,
)
from robostiff.kinematics.closure.assembly_mode import LAST_PART, mode_of
from robostiff.kinematics.closure.leg_forms import RootSigns, on_turn_of_home
from robostiff.kinematics.closure.loops import platform_mobility
from robostiff.kinematics.frames import PlacedChain, place_chain
from robostiff.kinematics.machine_pose import (
    ActuatorCoordinates,
    ToolPose,
    actuator_names,
    actuator_places,
)
from robostiff.kinematics.pose import (
    Given,
    JointCoordinates,
    Near,
    Pose,
    PoseRequest,
    home_coordinates,
    near_coordinates,
    platform_at_end,
    pose_of_end,
    requested_joints,
    requested_pose,
    requested_tool,
    rows_of,
    shortest_turn,
    six_coordinates,
)
from robostiff.kinematics.posture import Posture
from robostiff.kinematics.turn import turn_about, turn_by_vector
from robostiff.model import PlacedPlatform, Robot, Snapshot
from robostiff.spatial.batch import poses_side_by_side, product
from robostiff.spatial.rotation import vector_of_rotation

#: Joint coordinates (size,) of each leg that choose a posture.
NearLegs: TypeAlias = "Sequence[np.ndarray] | None"
# Poses (N, 6), rotations, coordinates of the legs, and where these close in another mode only
FoundPoses: TypeAlias = tuple[np.ndarray, np.ndarray, list[np.ndarray], np.ndarray]

# Where the legs may move the platform themselves, they do not stop at what counts as reached.
_MET = 1e-12
# Poses around home at which the coordinates that follow from the legs are compared with home.
_TRIED, _AROUND, _SEED = 8, 1e-2, 3


class PostureFinder:
    """Finds the postures of one robot; prepares the closure of its legs once.

    Raises
    ------
    InputError
        When a leg does not close in the home configuration, or the robot has symbols.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot: Robot = robot.in_floats
        self.home_pose: np.ndarray = home_coordinates(self.robot)
        self.length: float = reach(self.robot, self.home_pose)
        self._closing: dict[int, LegSolver] = {}

    def closing(self, i: int) -> LegSolver:
        """The way to close a leg by its number, whatever the others do."""
        self._close([i])
        return self._closing[i]

    def _close(self, numbers: Iterable[int]) -> None:
        """Prepare the closure of some legs, of those alike together."""
        new = [i for i in numbers if i not in self._closing]
        legs = [self.robot.legs[i] for i in new]
        self._closing |= zip(new, leg_solvers(legs, self.home_pose, self.length), strict=True)

    @cached_property
    def solvers(self) -> tuple[LegSolver, ...]:
        """The way to close each leg."""
        self._close(range(len(self.robot.legs)))
        solvers = (self._closing[i] for i in sorted(self._closing))
        return tuple(
            solver.that_holds_at(self._near_home.coordinates, self._near_home.R)
            if solver.leg.chain.has_blocks and self.robot.coordinates
            else solver
            for solver in solvers
        )

    @cached_property
    def homes(self) -> list[np.ndarray]:
        """Coordinates (size,) of each leg that close it at home."""
        return [solver.home for solver in self.solvers]

    def request(self, pose: Pose) -> PoseRequest:
        """Read a pose of any kind."""
        robot = self.robot
        if isinstance(pose, ToolPose):
            return requested_tool(robot, pose, self.home_pose)
        if isinstance(pose, ActuatorCoordinates):
            places = actuator_places(robot)
            at_home = np.concatenate([q[own] for q, own in zip(self.homes, places, strict=True)])
            given = pose.numbers(robot, at_home)
            if robot.is_serial and len(places[0]) == robot.legs[0].chain.size:
                return rows_of(given, Given.JOINTS)
            if free := self._free_of_drives:
                raise InputError(
                    f"actuator coordinates of {robot.name!r}",
                    got=", ".join(actuator_names(robot)),
                    expected="drives that determine the pose: the platform keeps "
                    f"{free} freedom{'s' if free > 1 else ''} at home while they are held",
                    hint="give a pose of the platform",
                )
            return rows_of(given, Given.DRIVES)
        if robot.is_serial and isinstance(pose, JointCoordinates):
            return requested_joints(robot, pose)
        if pose is None and robot.is_posed_by_joints:
            return rows_of(robot.legs[0].chain.home, Given.JOINTS)
        return requested_pose(robot, pose, self.home_pose)

    @cached_property
    def _free_of_drives(self) -> int:
        """How many freedoms the platform keeps at home while all drives are held."""
        held = actuator_places(self.robot)
        free = platform_mobility(self.robot, self.home_pose, self.homes, self.length, held)
        return free.shape[1]

    def find(self, pose: Pose, near: Near = None) -> Posture:
        """Posture at a pose or a batch of poses; as `find_posture`."""
        return self.at(self.request(pose), near)

    def at(self, request: PoseRequest, near: Near = None) -> Posture:
        """Posture at poses that were read by `request`.

        Coordinates that it leaves open follow from the legs. Those of the legs are of the assembly
        mode of home, or the nearest to given ones.
        """
        robot, close, chains, undetermined = self.robot, None, None, None
        if request.by is Given.JOINTS:
            if near is not None:
                expected = "none: joint coordinates pose this arm, and determine its posture"
                hint = "near=... chooses among the postures at a pose of the platform"
                raise InputError(f"near of {robot.name!r}", got=near, expected=expected, hint=hint)
            (leg,), q, elsewhere = robot.legs, [request.coordinates], None
            chains = [place_chain(leg.chain, q[0], leg.base.R, leg.base.p)]
            R, p = platform_at_end(leg, chains[0])
            pose, R = six_coordinates(R, p), poses_side_by_side(R, 2)
            return self.placed(request.batch, pose, R, q, chains=chains)
        close = near_coordinates(robot, near)
        if request.by is Given.POSE and (not request.open or self.open_stay_at_home):
            pose, R = request.coordinates, request.R
            q, elsewhere, chains = self._alone(request, close, from_afar=True)
        else:
            pose, R, q, elsewhere = self._together(request, close)
        # A crank that may stand at any angle stands at a given one.
        if not request.by_drives:
            each, chosen = zip(self.solvers, q, strict=True), near is not None
            every = [own.leaves_drive_open(pose, R, x, chosen=chosen) for own, x in each]
            undetermined = np.any(every, axis=0)
        return self.placed(request.batch, pose, R, q, elsewhere, chains, undetermined)

    def _together(self, request: PoseRequest, near: NearLegs) -> FoundPoses:
        """All legs closed together with the platform, which they move or turn, from home or near.

        Held are the drives, some coordinates of the pose, or tip and axis of the tool.
        """
        robot, home, rows, axis = self.robot, self.home_pose, request.coordinates, request.tool_axis
        legs, point, length = robot.legs, robot.reference_point, self.length
        start = aside = home
        wanted = np.empty(0)
        if request.by is Given.DRIVES:
            free = robot.space.rows
            loops = loops_of_legs(legs, free, length, actuator_places(robot))
            still = np.tile(np.delete(home, free), (len(rows), 1))
            given = np.concatenate([still, rows], axis=-1)
            aside = home if near is None else pose_of_end(legs[0], near[0])
        elif axis is not None:
            loops = loops_of_legs(legs, (6,), length, tool=(point, axis))
            wanted = shortest_turn(home, rows[:, 3:], axis)
            given = np.concatenate([rows[:, :3], vector_of_rotation(wanted)], axis=-1)
            start = aside = np.array([*(home[:3] + turn_by_vector(home[3:]) @ point), *home[3:], 0])
        else:
            loops = self._loops(request.open)
            given = rows[:, loops.given]
        near_by = None if near is None else np.concatenate([aside, *near])
        found = follow(loops, np.concatenate([start, *self.homes]), given, near_by)
        pose, q, elsewhere = found.pose, found.coordinates, found.elsewhere
        if request.open:
            # Legs that close at home's other coordinates need no way there, and are the nearest to
            # given ones. Where they cannot close at all, what each of them lacks there says more
            # than a compromise between them.
            pose, elsewhere = pose.copy(), elsewhere.copy()
            few = np.flatnonzero(~found.closed | (near is not None))
            if few.size:
                part = replace(request.part(few), open=())
                each, away, own = self._as_at_home(part, near)
                own |= ~(found.closed | found.elsewhere)[few]
                pose[few[own]], elsewhere[few[own]] = part.coordinates[own], away[own]
                for known, new in zip(q, each, strict=True):
                    known[few[own]] = new[own]
            return pose, turn_by_vector(pose[:, 3:]), q, elsewhere
        R = turn_by_vector(pose[:, 3:])
        if axis is not None:
            R = poses_side_by_side(product(wanted, turn_about(axis, found.x[:, 6])), 2)
            pose = six_coordinates(R, rows[:, :3] - np.einsum("nij,j->ni", R, point))
            q = [poses_side_by_side(own, 1) for own in q]
        each = zip(legs, q, near or self.homes, strict=True)
        return pose, R, [on_turn_of_home(leg.chain, own, by) for leg, own, by in each], elsewhere

    def _as_at_home(
        self, request: PoseRequest, near: NearLegs
    ) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
        """As `_alone`, at home's other coordinates; last where all legs meet the platform there."""
        each, away, _ = self._alone(request, near, from_afar=False)
        alone = self.placed(request.batch, request.coordinates, request.R, each, away)
        return each, away, alone.reached & alone.meets(_MET)

    def ways_end(self, pose: np.ndarray, gone: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Which poses (N, free) are out of reach, as the straight ways from home to them end (N,).

        By parts (N,) of the ways that are gone, and coordinates of all legs there (joints, N). Not
        all ends are found; in the last part of a way, where assembly modes may meet, none is.
        """
        rows = np.flatnonzero(gone < 1.0 - LAST_PART)
        found, request, legs = np.zeros(len(pose), bool), self.request(pose), self.robot.legs
        pose, R, home = request.coordinates, request.R, self.home_pose
        each = np.split(q.T, np.cumsum([leg.chain.size for leg in legs])[:-1], axis=-1)
        there = home + gone[:, None] * (pose - home)
        if not request.open or self.open_stay_at_home:
            pairs = zip(self.solvers, each, strict=True)  # closed forms answer at once
            for solver, own in sorted(pairs, key=lambda pair: pair[0].closed_form is None):
                x = np.concatenate([there, own], axis=-1)
                found[rows] = solver.way_ends(pose[rows], R[rows], x[rows])
                rows = rows[~found[rows]]
            return found
        placed = place_chain(legs[0].chain, each[0], legs[0].base.R, legs[0].base.p)
        loops, open_ = self._loops(request.open), list(request.open)
        there[:, open_] = six_coordinates(*platform_at_end(legs[0], placed))[:, open_]
        mode = mode_of(loops, np.concatenate([home, *self.homes]))
        x = np.concatenate([there, *each], axis=-1)
        rows = rows[mode.way_ends(x[rows], pose[rows][:, loops.given])]
        found[rows] = ~self._as_at_home(replace(request.part(rows), open=()), None)[-1]
        return found

    def leg_coordinates(self, request: PoseRequest) -> list[np.ndarray]:
        """Coordinates (N, size) of each leg, unplaced, where a request leaves none open."""
        return self._alone(request, None, from_afar=True)[0]

    def _alone(
        self, request: PoseRequest, near: NearLegs, *, from_afar: bool
    ) -> tuple[list[np.ndarray], np.ndarray, list[PlacedChain | None] | None]:
        """Each leg closed for itself, where one closes in another assembly mode only; chains."""
        pose, R = request.coordinates, request.R
        if near is not None:
            each = zip(self.solvers, near, strict=True)
            q = [solver.solve_near(own, pose, R) for solver, own in each]
            return q, np.zeros(len(pose), dtype=bool), None
        q, elsewhere = [np.zeros((0, 0))] * len(self.solvers), np.zeros(len(pose), dtype=bool)
        chains = []
        for places, legs in self.legs_alike:
            each, away, chain = legs.solve(pose, R, from_afar=from_afar)
            for place, own in zip(places, each, strict=True):
                q[place] = own
            elsewhere |= away
            chains.append(chain)
        return q, elsewhere, chains

    @kept
    def _loops(self, open_: tuple[int, ...]) -> Loops:
        """The closure of all legs together, which decide some coordinates of the pose."""
        return loops_of_legs(self.robot.legs, open_, self.length)

    def in_other_modes(self, posture: Posture) -> tuple[str, ...]:
        """Sentences about legs that reach one pose in another working mode than at home."""
        return tuple(
            f"leg {own.leg.name!r} reaches the pose in another working mode than at home only: "
            "choose it by joint coordinates close by: near=[...]"
            for own, closes in zip(self.solvers, posture.closed[0], strict=True)
            if not closes and own.closed_form is not None and own.that_close(posture.pose[0])[0]
        )

    def free_coordinates_reach(self, posture: Posture, near: Near = None) -> tuple[str, ...]:
        """A sentence where one pose of six coordinates is reached once the legs decide the rest."""
        places, robot = self.robot.coordinate_places, self.robot
        are_some = 0 < len(places) < robot.space.size
        if not (are_some and self.find(posture.pose[0, places], near).reached[0]):
            return ()
        names = " ".join(own.value for own in robot.coordinates)
        return (f"the robot has the free coordinates {names}: give these, the others follow",)

    @cached_property
    def coordinates_leave_drives_open(self) -> bool:
        """Whether drives can move away from home while the free coordinates stand still.

        So they can where home is singular, and the platform has more freedoms elsewhere.
        """
        places = self.robot.coordinate_places
        open_ = tuple(place for place in self.robot.space.rows if place not in places)
        if not (places and open_):
            return False
        _, moving = self._loops(open_).in_general(np.concatenate([self.home_pose, *self.homes]))
        return bool(np.any(moving[6:][np.concatenate([own.drives for own in self.solvers])]))

    @cached_property
    def legs_alike(self) -> list[tuple[tuple[int, ...], LegSolver]]:
        """Numbers of legs that are closed together, and their solver, group by group."""
        return legs_alike(self.solvers)

    @cached_property
    def open_stay_at_home(self) -> bool:
        """Whether the coordinates that the legs decide keep their home values all around home.

        Then no other value of them helps where a leg does not reach.
        """
        request = self._near_home
        q, *_ = self._alone(request, None, from_afar=False)
        around = self.placed(request.batch, request.coordinates, request.R, q)
        return bool(np.all(around.reached & around.meets(_MET)))

    @cached_property
    def _near_home(self) -> PoseRequest:
        """Poses around home, with the coordinates that follow from the legs as at home."""
        chosen = self.robot.coordinate_places
        scale = np.zeros(6)
        scale[list(self.robot.space.rows)] = 1.0
        scale = (scale * np.where(np.arange(6) < 3, self.length, 1.0))[chosen]
        steps = np.random.default_rng(_SEED).uniform(-_AROUND, _AROUND, (_TRIED, len(chosen)))
        return requested_pose(self.robot, self.home_pose[chosen] + steps * scale, self.home_pose)

    def placed(
        self,
        batch: tuple[int, ...],
        pose: np.ndarray,
        R: np.ndarray,
        q: list[np.ndarray],
        elsewhere: np.ndarray | None = None,
        chains: Sequence[PlacedChain | None] | None = None,
        undetermined: np.ndarray | None = None,
    ) -> Posture:
        """Posture at poses (N, 6), rotations R among them, with coordinates q of every leg.

        Chains of legs that are computed together may be placed already.
        """
        robot, p = self.robot, poses_side_by_side(pose[:, :3], 1)
        legs, nowhere = {}, np.zeros(len(pose), dtype=bool)
        gaps = np.empty((2, len(robot.legs), len(pose)))
        chains = chains or [None] * len(self.legs_alike)
        for (places, group), chain in zip(self.legs_alike, chains, strict=True):
            placed, *missed = group.placed([q[i] for i in places], R, p, chain)
            legs |= dict(zip(places, placed, strict=True))
            gaps[:, list(places)] = missed
        reference = p + np.einsum("...ij,j->...i", R, robot.reference_point)
        snapshot = Snapshot(
            robot.name, tuple(legs[i] for i in sorted(legs)), reference, robot.space, robot.title
        )
        if robot.platform is not None:
            platform = PlacedPlatform(robot.platform, robot.holds, R, p)
            snapshot = replace(snapshot, platform=platform)
        return Posture(
            robot=robot,
            batch=batch,
            pose=pose,
            coordinates=tuple(q),
            snapshot=snapshot,
            shift_gaps=gaps[0].T,
            turn_gaps=gaps[1].T,
            undetermined=nowhere if undetermined is None else undetermined,
            elsewhere=nowhere if elsewhere is None else elsewhere,
            length=self.length,
        )


@kept
def posture_finder(robot: Robot) -> PostureFinder:
    """The finder of a robot, prepared at first need and kept with the robot."""
    return PostureFinder(robot)


def find_posture(robot: Robot, pose: Pose = None, *, near: Near = None) -> Posture:
    """Posture of a robot at a pose or a batch of poses.

    Parameters
    ----------
    robot : Robot
    pose : RigidTransform, JointCoordinates, array of coordinates, or None
        None for the home configuration.
    near : joint coordinates, optional
        Of all legs, in a row or leg by leg [m, rad]: the posture nearest to them is chosen at each
        pose. When left out, it is the assembly mode of the home configuration.

    Raises
    ------
    InputError
        When the pose does not fit the robot, or a leg does not close in the home configuration.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> posture = find_posture(load("3-puu"), [[0, 0, 0.3], [1, 0, 0.3]])
    >>> posture.reached
    array([ True, False])
    """
    return posture_finder(robot).find(pose, near)


@frozen
class LegPosture:
    """One posture in which a leg reaches a pose."""

    leg: str
    coordinates: np.ndarray  #: (size,): of all its joints [m, rad]
    mode: RootSigns  #: signs that distinguish it from the others
    of_home: bool  #: whether it belongs to the assembly mode of home, which `stiffness` takes


def postures(robot: Robot, pose: Pose = None) -> dict[str, tuple[LegPosture, ...]]:
    """All postures in which each leg of a robot reaches a pose, that of home first.

    The legs are independent of one another: any choice of one posture for each leg is a posture of
    the robot. Its coordinates, leg by leg, choose it: ``stiffness(robot, pose, near=[...])``.

    Parameters
    ----------
    robot : Robot
        Whose legs close in closed form.
    pose : RigidTransform, array of coordinates, or None
        One pose, all coordinates of which are given; None for home.

    Returns
    -------
    dict of str to tuple of LegPosture
        By name of the leg; empty for a leg that does not reach the pose.

    Raises
    ------
    InputError
        When a leg is closed by iteration, the pose is given by joint coordinates, or there are
        several poses.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> found = postures(load("3-rrr"))
    >>> [posture.mode.root for posture in found["leg1"]]
    [1, -1]
    """
    finder = posture_finder(robot)
    request = finder.request(pose)
    if request.by_drives or request.batch:
        raise InputError(
            f"pose of {robot.name!r}",
            got="joint coordinates" if request.by_drives else request.batch,
            expected="one pose of the platform, whose postures are listed",
        )
    at = finder.at(request).pose[0]  # what the pose leaves open, the legs determine
    found = {}
    for solver in finder.solvers:
        modes, q = solver.that_close(at)
        home = getattr(solver.closed_form, "mode", None)
        name, each = solver.leg.name, zip(modes, q, strict=True)
        own = [LegPosture(name, coordinates, mode, mode == home) for mode, coordinates in each]
        found[name] = tuple(sorted(own, key=lambda one: not one.of_home))
    return found

"""Natural frequencies and mode shapes of a robot, also under load."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from functools import cache, cached_property, partial
from operator import getitem
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis import PartShare, Stiffness, stiffness
from robostiff.analysis.free_motion import free_motions_in_words
from robostiff.elastostatics.status import Status, StatusOfPoses
from robostiff.errors import InputError, NoAnswerError
from robostiff.frozen import field, frozen
from robostiff.kinematics import Near, Pose
from robostiff.kinematics.turn import turn_by_vector
from robostiff.linkage import DriveValues, Linkage
from robostiff.markup import InNotebooks
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.one_thread import in_one_thread
from robostiff.spatial import Space
from robostiff.statics.chains.beam_bowing import Beams, Bowing, Division
from robostiff.statics.equations.newton import FoundEquilibrium
from robostiff.statics.equations.problem import EquilibriumProblem
from robostiff.statics.equations.stability import energies_of
from robostiff.statics.equations.vibration import Vibrations, mass_rows, vibrations
from robostiff.statics.loaded_parts import BodyPlaces, body_places, shares
from robostiff.statics.loading.given_loads import Acting, Gravity, Laws, Loads, Masses, has_masses
from robostiff.statics.loading.loaded_posture import (
    LoadedPosture,
    Postures,
    as_snapshot,
    beside,
    postures_of,
    wrenches_of,
)
from robostiff.statics.solution import Solution, equilibrium_under

# So that beams have modes of their own, the first of them within some percent.
_BOWING = Bowing()
# Of the platform's motion beside that of the legs: below this it stays.
_STAYS = 1e-6
# Of a motion, rotations times the length of the robot: below this it is called a translation.
_TURNS = 1e-2
# Of a mode, by which bodies are moved to find how they move [rad].
_PART = 1e-3
# Of the largest root of a mass of the platform: none; and of the slowest frequency over another,
# when digits of that are lost.
_NONE, _FAR_APART = 1e-9, 1e-6
# Poses whose equations are solved together.
_TOGETHER = 32


@frozen
class Mode:
    """One natural vibration.

    Attributes
    ----------
    frequency : float
        [Hz]; 0 where nothing resists the motion, or the robot leaves the equilibrium.
    growth : float
        Rate at which the robot leaves an unstable equilibrium [1/s]; 0 of a vibration.
    twist : (r,) array
        Of the platform about its point, world axes, at the amplitude at which the velocity one
        second^-1 has the kinetic energy of half a joule [m, rad].
    """

    frequency: float
    growth: float
    twist: np.ndarray
    equilibrium: FoundEquilibrium = field(repr=False, compare=False)
    shape: np.ndarray = field(repr=False, compare=False)

    @cached_property
    def shares(self) -> tuple[PartShare, ...]:
        """Energies of elastic parts, and of springs between bodies that store one, by size."""
        found, legs = self.equilibrium, self.equilibrium.problem.legs
        motion = _of_legs(found.problem, self.shape)[: legs.numbers.total]
        stored = energies_of(legs, motion, np.zeros(legs.inner_modes.shape))
        if legs.springs:
            pulls = legs.pulls(found.state, found.loading.share_at(found.factor))
            stored += legs.spring_energies(pulls, motion)
        return shares(own for own in stored if own[-1] > 0)

    @cached_property
    def words(self) -> str:
        """How the platform moves, or the leg that vibrates while it stays.

        A translation where its rotation times the length of the robot is less than 1 % of it.
        """
        problem, twist = self.equilibrium.problem, self.twist
        if problem.size_of(twist) < _STAYS * problem.size_of_legs(_of_legs(problem, self.shape)):
            most = self.shares[0] if self.shares else None
            return "the platform stays" + (f": most in {most.name!r}" if most else "")
        size = np.linalg.norm(twist * problem.scale)
        turning = np.arange(len(twist)) >= Space.of_size(len(twist)).translations
        if np.linalg.norm((twist * problem.scale)[turning]) < _TURNS * size:
            twist = np.where(turning, 0.0, twist)
        point = self.equilibrium.state.p
        motion = free_motions_in_words(twist[None] / size, point, problem.length)[0]
        return f"the platform moves: {motion}"

    @cached_property
    def motion(self) -> BodyPlaces:
        """By how much all bodies have moved from the equilibrium.

        By so little that none has turned, or moved by the length of the robot, by more than a
        thousandth [rad].
        """
        found, step = self.equilibrium, _of_legs(self.equilibrium.problem, self.shape)
        part = _PART / max(found.problem.size_of_legs(step), found.problem.size_of(self.twist))
        moved = found.problem.legs.after_step(found.state, part * self.twist, part * step)
        return body_places(found.problem, moved).since(body_places(found.problem, found.state))

    def __str__(self) -> str:
        rate = f"{self.frequency:.4g} Hz" if self.growth == 0 else f"grows by {self.growth:.4g} /s"
        return f"{rate}: {self.words}"


@frozen(repr=False)
class Modes(StatusOfPoses, InNotebooks):
    """Natural vibrations of a robot, slowest first; or at many poses, under many loads, one a row.

    Attributes
    ----------
    name : str
    space : Space
    status_codes : (...) array of uint16
        Of the equilibrium about which it vibrates.
    squares : (k,) or (N, k) array
        Of angular frequencies [rad^2/s^2], as many as motions have mass; negative where the robot
        leaves the equilibrium; empty where there is none. Of many poses masked where one has none,
        or fewer.
    shapes : callable
        Motions (k, n) of all unknowns.
    solve : callable
        How the equilibrium about which it vibrates was found, or why there is none.
    one : callable
        Of many poses the modes at one, by its number.
    """

    name: str
    space: Space
    status_codes: np.ndarray
    squares: np.ndarray = field(default_factory=lambda: np.zeros(0))
    shapes: Callable[[], np.ndarray] = field(default=lambda: np.zeros((0, 0)), compare=False)
    solve: Callable[[], Solution] = field(default=lambda: Solution(Status.OK), compare=False)
    one: Callable[[int], Modes] | None = field(default=None, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or a pickle has: all of it worked out."""
        known = {"shapes": partial(copy, self.shapes()), "solve": partial(copy, self.solve())}
        one = None if self.one is None else partial(getitem, self.poses)
        return vars(self) | known | {"one": one}

    @property
    def posed(self) -> Snapshot | Network | CableRobot | None:
        """The robot at the unloaded posture."""
        solution = self.solve()
        return solution.loaded and solution.loaded.posed

    @property
    def snapshot(self) -> Snapshot | None:
        """The robot at that posture; None of a network."""
        return as_snapshot(self.posed)

    @property
    def equilibrium(self) -> FoundEquilibrium | None:
        """About which it vibrates; None where there is none, and of many poses."""
        return self.solve().found

    @cached_property
    def each(self) -> tuple[Mode, ...]:
        """The modes of one pose."""
        if self.equilibrium is None:
            return ()
        r, found = self.equilibrium.problem.size, []
        for square, shape in zip(self.squares, self.shapes(), strict=True):
            rate = float(np.sqrt(abs(square)))
            frequency, growth = (rate / (2 * np.pi), 0.0) if square >= 0 else (0.0, rate)
            found.append(Mode(frequency, growth, shape[len(shape) - r :], self.equilibrium, shape))
        return tuple(found)

    @property
    def poses(self) -> tuple[Modes, ...]:
        """Those at many poses, one by one."""
        return () if self.one is None else tuple(map(self.one, range(len(self))))

    @property
    def answered(self) -> np.ndarray:
        """Which poses have modes (...)."""
        return np.asarray(~np.ma.getmaskarray(self.squares).all(axis=-1))

    @property
    def frequencies(self) -> np.ndarray:
        """Of all modes (k,) [Hz].

        Of many poses (N, k); masked where there are none, or fewer.

        Raises
        ------
        NoAnswerError
            Where there is no equilibrium.
        """
        if not self.batch_shape and not self.squares.size:
            why = "; ".join(self.status.advice)
            raise NoAnswerError(f"no modes of {self.name!r} ({self.status}): {why}")
        return np.sqrt(np.maximum(self.squares, 0.0)) / (2 * np.pi)

    def __len__(self) -> int:
        return len(self.squares)

    def __getitem__(self, i: int | slice) -> Any:
        """A mode; of many poses, the modes at one."""
        if self.one is None or isinstance(i, slice):
            return (self.poses or self.each)[i]
        return self.one(range(len(self))[i])

    def __iter__(self) -> Iterator[Any]:
        return iter(self.poses or self.each)

    def __repr__(self) -> str:
        if self.batch_shape:
            answered = int(np.count_nonzero(self.answered))
            return f"<Modes of {self.name!r} at {len(self)} poses, {answered} with modes>"
        first = "; ".join(str(mode) for mode in self.each[:3])
        return f"<{len(self)} modes of {self.name!r}, status {self.status}: {first}>"


@in_one_thread
def modes(
    robot: Robot | Snapshot | Network | Linkage | CableRobot,
    pose: Pose | DriveValues = None,
    masses: Masses | None = None,
    *,
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, Any] | None = None,
    laws: Laws | None = None,
    beams: Beams = _BOWING,
    near: Near = None,
) -> Modes:
    """Natural frequencies and mode shapes of a robot at a pose, without load or under one.

    Small motions x about the equilibrium obey ``M x'' + K x = 0``, with K the second variation of
    the energy of all elastic parts less the work of the loads, as for `equilibrium`, over the
    motions that keep the robot together. Motions without mass follow in balance. Masses along an
    elastic part have the consistent mass matrix of a beam, with sections that turn and shear.

    Parameters
    ----------
    robot, pose, wrench, at, loads, gravity, preload, laws, near
        As for `equilibrium`; a batch of poses or of wrenches gives modes at each.
    masses : mapping of str to float, Mass or a sequence of them, optional
        What moves beside the masses of the model, by the name of the part before the body that
        carries it, ``leg/part``, of the node of a network, or ``platform`` [kg]. A mass without a
        centre or point is at that part or node, or at the reference point of the robot, whatever
        `at` is. These have no weight: `loads` take those.
    beams : Bowing or Linear
        As for `equilibrium`; each beam is two elements or more when their number is left open.
        Frequencies come from above: that of a beam within itself is 0.5 % high with one element for
        each half wave, and a beam of one element between two bodies has none.

    Returns
    -------
    Modes

    Raises
    ------
    InputError
        As for `equilibrium`; when nothing has a mass, or a given one is not more than zero.

    Examples
    --------
    >>> import robostiff as rs
    >>> spindle = {"platform": rs.Mass(150, inertia=[4, 4, 7])}
    >>> found = rs.modes(rs.load("hexapod"), masses=spindle)
    >>> len(found), found.frequencies[:2].round(1)
    (180, array([48.8, 48.8]))
    """
    postures = postures_of(robot, pose, near)
    given = beside(postures.batch, wrenches_of("wrench", wrench, postures.robot.space))
    acting = Acting(loads, gravity, preload, beams, at, laws or {}, Division(least=2))
    request = _Request(postures, acting, masses or {}, np.atleast_2d(given))
    if given.ndim == 1:
        return request.one(0)
    return request.all(_of_platforms(request, lambda: stiffness(postures.robot, pose, near=near)))


@frozen
class _Request:
    """Modes at postures, under wrenches (N, r), with masses beside those of the model."""

    postures: Postures
    acting: Acting
    masses: Masses
    wrenches: np.ndarray

    def one(self, i: int, known: Vibrations | None = None) -> Modes:
        """Modes at one pose; its vibrations at rest may be known."""
        postures, robot = self.postures, self.postures.robot
        loaded = cache(partial(postures.with_loads, i, self.acting, self.masses))
        again = partial(postures.loaded_at, i, masses=self.masses)
        solve = cache(lambda: equilibrium_under(loaded(), self.wrenches[i], again))
        status = solve().status if known is None else postures.status(i)
        if known is None and (found := solve().found) is not None:
            masses = cast("LoadedPosture", solve().loaded).masses
            (known,) = vibrations(found.problem, masses, found.known, found.state)
        about = robot.name, robot.space, np.asarray(int(status), dtype=np.uint16)
        if known is None:
            return Modes(*about)
        if not known[0].size:
            raise InputError(
                f"masses of {robot.name!r}",
                expected="masses of bodies, by name [kg]",
                hint='write masses={"platform": 150}, rs.Mass(12, inertia=...) in place of a '
                'number; --mass "platform=150 kg"; or mass: in the model file',
            )
        return Modes(*about, *known, solve)

    def all(self, known: np.ma.MaskedArray) -> Modes:
        """Modes at all poses, of which squares (N, k) of some are known: not masked."""
        postures, own = self.postures, dict[int, Vibrations]()
        rest = np.flatnonzero(known.mask.all(axis=-1)).tolist()
        for rows in (rest[k : k + _TOGETHER] for k in range(0, len(rest), _TOGETHER)):
            together = None
            if not np.any(self.wrenches[rows]):
                together = postures.as_robots(rows, self.acting, self.masses)
            if together and not (any(together[0].missing) or together[0].at_rest.lacks_digits):
                found = vibrations(*together, together[0].at_rest, together[0].unloaded)
                own |= zip(rows, found, strict=False)  # none where robots differ
        one = cache(lambda i: self.one(i, own.get(i)))
        codes = np.zeros(len(known), dtype=np.uint16)
        count = max([known.shape[1], *(len(one(i)) for i in rest)])
        squares = np.ma.masked_all((len(known), count))
        squares[:, : known.shape[1]] = known
        for i in rest:
            codes[i], squares[i, : len(one(i))] = int(one(i).status), one(i).squares
        return Modes(postures.robot.name, postures.robot.space, codes, squares, one=one)


def _of_platforms(request: _Request, find: Callable[[], Stiffness]) -> np.ma.MaskedArray:
    """Squares (N, k) without load at poses where masses are on the platform alone, by K.

    With ``K = L L^T`` they are the inverse squares of the singular values of ``L^-1 B^T``, where B
    is that of `mass_rows`, the same at all poses in the axes of the platform. Masked where K is not
    definite, or more is to be said of the pose; without columns where legs have masses, or loads.
    `find` is called for the stiffness at all of them.
    """
    robot, none = request.postures.robot, np.ma.masked_all((len(request.wrenches), 0))
    every = [x if isinstance(x, Sequence) else [x] for x in request.masses.values()]
    at_points = any(getattr(x, "point", None) is not None for several in every for x in several)
    if at_points or request.acting.at is not None or np.any(request.wrenches):
        return none  # they are not alike in the axes of each platform, or not at rest
    is_robot = isinstance(robot, Robot) and request.postures.batch and len(none)
    if not is_robot or any(map(has_masses, robot.legs)):
        return none
    first = request.postures.first.with_loads(0, request.acting, request.masses)
    problem = first.problem
    of_legs, _, (B,) = mass_rows(problem, first.masses, problem.unloaded)
    if len(of_legs) or not first.has_posture or problem.bears_loads or problem.has_laws:
        return none
    known = find()
    plain = (known.status_codes & ~np.uint16(Status.REDUNDANT_JOINTS)) == 0
    rows, scale = list(problem.rows), problem.scale
    B = B @ np.kron(np.eye(2), first.frame[0])[np.ix_(rows, rows)] / scale
    _, sizes, Vt = np.linalg.svd(B, full_matrices=False)
    B = (sizes[:, None] * Vt)[sizes > _NONE * np.max(sizes, initial=0.0)] * scale
    if not len(B):
        return none
    R = np.zeros((np.count_nonzero(plain), 6, 6))
    R[:, :3, :3] = R[:, 3:, 3:] = turn_by_vector(np.asarray(known.pose)[plain, 3:])
    L, turned = np.linalg.cholesky(np.ma.getdata(known.matrix)[plain]), R[:, rows][:, :, rows] @ B.T
    values = np.linalg.svd(np.linalg.solve(L, turned), compute_uv=False)
    found = np.ma.masked_all((len(none), len(B)))
    found[plain] = 1.0 / values**2
    found[np.flatnonzero(plain)[values[:, -1] < _FAR_APART * values[:, 0]]] = np.ma.masked
    return found


def _of_legs(problem: EquilibriumProblem, shape: np.ndarray) -> np.ndarray:
    """The part of the legs in a mode, as a step of all their unknowns (T + B,)."""
    step = np.zeros(problem.legs.numbers.total + len(problem.legs.beams))
    step[problem.free] = shape[: -problem.size]
    return step

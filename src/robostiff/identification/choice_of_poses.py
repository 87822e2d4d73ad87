"""Where to measure: postures whose readings determine parameters best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen
from robostiff.identification.measurements import Measurements
from robostiff.identification.readings import ReadingModel
from robostiff.identification.states import FiniteLoads, States
from robostiff.identification.unknowns import UnknownKind, identifiability, with_unknowns
from robostiff.kinematics import JointCoordinates, Pose, find_posture, posture_finder
from robostiff.kinematics.pose import joint_units
from robostiff.markup import number
from robostiff.model import Actuated, Robot
from robostiff.spatial import as_float, as_floats, check_whole

# Of the information of all candidates: what every choice has, so that few poses can be compared.
_RIDGE = 1e-10
# An exchange that makes less of a difference is none; and those of one start.
_GAIN, _MOST_SWEEPS = 1e-9, 50
# Standard deviations that a reading moves at least.
_SEEN = 5.0
_FORCES = "(3,) or (L, 3) [N]"
_RANDOM = 200  # choices at random, to compare with


@frozen
class DOptimal:
    """The volume of the errors of all parameters: determinant of their covariance."""

    in_words: ClassVar[str] = "geometric mean of relative standard deviations"


@frozen
class AOptimal:
    """The sum of the squared relative errors of all parameters: trace of their covariance."""

    in_words: ClassVar[str] = "root mean square of relative standard deviations"


@frozen(eq=False)
class TestPose:
    """The error that is left at postures after compensation: trace of ``T C T^T``.

    T are the rates of the loaded point with the parameters, C their covariance.

    Attributes
    ----------
    postures : (N, n) array or JointCoordinates
    wrenches : (r,) or (N, r) array
        [N, N m].
    """

    __test__ = False  # it is no test
    in_words: ClassVar[str] = "root mean square error at the test poses [m]"

    postures: Any
    wrenches: Any


@frozen(eq=False, repr=False)
class ChosenPoses:
    """Postures to measure at.

    Attributes
    ----------
    rows : (count,) array of int
        Among the candidates.
    postures : JointCoordinates or (count, n) array
    value : float
        Of the criterion: a geometric mean of relative standard deviations (`DOptimal`), the root of
        the mean of their squares (`AOptimal`), or of the errors at test poses [m].
    random : float
        The median of that of choices at random.
    std : dict of str to float
        Standard deviations of the parameters to be expected.
    left_out : int
        Candidates out of reach, beyond limits, near singular, or that hardly move.
    units : dict of str to str
        Of the parameters.
    criterion : str
        What `value` is, in words.
    """

    rows: np.ndarray
    postures: Any
    value: float
    random: float
    std: dict[str, float]
    left_out: int
    units: dict[str, str]
    criterion: str

    def __repr__(self) -> str:
        return (
            f"<ChosenPoses: {len(self.rows)}, criterion {number(self.value)}, "
            f"{number(self.random)} of a random choice, {self.left_out} candidates left out>"
        )


def random_postures(robot: Robot, count: int, seed: int = 0) -> JointCoordinates | np.ndarray:
    """Candidates all over the range of a robot: joints within limits, or poses around home.

    Joints without limits turn up to 120 degrees, and slide a tenth of the length of the robot, to
    each side; poses are this tenth and 0.15 rad around home.
    """
    from scipy.stats import qmc

    numeric = robot.numeric
    finder = posture_finder(numeric)
    if robot.is_posed_by_joints:
        chain = numeric.legs[0].chain
        units = np.array(joint_units(chain))
        width = chain.free * np.where(units == "m", 0.1 * finder.length, np.pi / 1.5)
        home = chain.home
        low, high = home - width, home + width
        for k, role in enumerate(chain.roles):
            if isinstance(role, Actuated) and role.limits is not None:
                low[k], high[k] = role.limits
    else:
        places = robot.coordinate_places
        width = np.where(np.array(places) < 3, 0.1 * finder.length, 0.15)
        low, high = finder.home_pose[places] - width, finder.home_pose[places] + width
    check_whole("count of postures", count)
    check_whole("seed of postures", seed, 0)
    u = qmc.Halton(len(low), rng=np.random.default_rng(seed)).random(count)
    q = low + u * (high - low)
    return JointCoordinates(q) if robot.is_posed_by_joints else q


def choose_poses(
    robot: Robot,
    candidates: Pose,
    count: int,
    parameters: Sequence[str],
    markers: Mapping[str, ArrayLike],
    *,
    criterion: DOptimal | AOptimal | TestPose = DOptimal(),
    forces: ArrayLike | None = None,
    hook: ArrayLike | None = None,
    body: str = "",
    sigma: float = 2e-5,
    fixed: Sequence[str] = (),
    existing: Measurements | None = None,
    repeats: bool = False,
    gravity: ArrayLike | str | None = None,
    starts: int = 10,
    seed: int = 0,
) -> ChosenPoses:
    """Choose postures at which loads and markers determine parameters best.

    The information of a posture is ``A^T A``, A the rates of its readings over their standard
    deviation; that of the choice is the sum, places of instrument and markers eliminated. Postures
    are exchanged, one for another, while the criterion gets better, from several random starts.

    Parameters
    ----------
    robot : Robot
    candidates : (N, n) array or JointCoordinates
    count : int
        How many are chosen.
    parameters, fixed : sequence of str
        As for `identify`.
    markers : mapping of str to (3,) array
        About where they are in the platform frame [m].
    criterion : DOptimal, AOptimal or TestPose
    forces : (3,) or (L, 3) array, optional
        Loads that are hung on at every posture, one after the other [N]; no load is one of them.
    hook : (3,) array, optional
        Where, in the frame of `body` [m]; its origin, or the reference point when left out.
    body : str
        On which these loads hang, such as ``arm/joint3``; the platform when left out.
    sigma : float
        Standard deviation of a coordinate that is read [m].
    existing : Measurements, optional
        What has been measured already, of markers of the same names.
    repeats : bool
        Whether a posture may be chosen several times.
    gravity : (3,) array or str, optional
        As for `equilibrium`.
    starts, seed : int

    Raises
    ------
    InputError
        When there are fewer candidates than postures to choose.
    NoAnswerError
        When all candidates together do not determine the parameters; it says which.

    References
    ----------
    Fedorov: Theory of Optimal Experiments, Academic Press 1972.
    """
    for name, value, least in (("count", count, 1), ("starts", starts, 1), ("seed", seed, 0)):
        check_whole(f"{name} of postures", value, least)
    by_joints = isinstance(candidates, JointCoordinates) or robot.is_posed_by_joints
    changed, unknowns = with_unknowns(
        robot, tuple(parameters), tuple(fixed), shared=False, by_joints=by_joints
    )
    kind = JointCoordinates if isinstance(candidates, JointCoordinates) else np.asarray
    q = getattr(candidates, "values", candidates)
    q = np.atleast_2d(as_floats("candidates", q, "postures (N, n)"))
    reached = find_posture(robot.numeric, kind(q))
    rows = np.flatnonzero(reached.reached & reached.within_limits)
    if len(rows) < (least := 1 if repeats else count):
        raise InputError(
            "candidates", got=Words(f"{len(rows)} in reach"), expected=f"at least {least}"
        )
    measured, places = _readings_at(kind, q[rows], markers, forces, hook, body, sigma)
    statics = FiniteLoads(States.of(changed, measured, np.eye(3)), changed, unknowns, gravity)
    turns = np.tile(np.eye(3), (len(places), 1, 1))  # of the markers
    frames = np.concatenate([np.zeros(6), places.ravel(), np.zeros(places.size)])
    sought = np.arange(len(frames)) < 6 + places.size
    names = tuple(markers)
    model = ReadingModel(measured, statics, unknowns, names, frames, sought, np.eye(3), turns)
    p, x = len(unknowns), np.array([*(u.nominal for u in unknowns), *frames[sought]])
    scale = np.array([abs(unknown.nominal) or 1e-3 for unknown in model.unknowns])
    J = (model.prediction(x)[1] * scale / model.sigma[:, None]).reshape(len(rows), -1, len(x))
    good, moved = _serve(model, J, x[:p])
    rows, J = rows[good], J[good]
    if len(rows) < least:
        raise InputError(
            "candidates",
            got=Words(f"{len(rows)} that serve"),
            expected=f"at least {least}",
            hint="the others are near singular, or their markers move by less than 5 sigma, at "
            f"most by {moved:.2g}: hang on larger loads, or state a smaller sigma",
        )
    of_existing = np.zeros((0, len(x)))
    if existing is not None:
        measured_before = model.of(existing, x)
        of_existing = measured_before.prediction(x)[1] * scale / measured_before.sigma[:, None]
    known = _determined(model, np.vstack([J.reshape(-1, len(x)), of_existing]) / scale)
    M, before = np.swapaxes(J, 1, 2) @ J, of_existing.T @ of_existing
    M, before = (m[..., known, :][..., known] for m in (M, before))
    judge = _Judge(
        M.sum(axis=0) + before, before, p, _exact_rates(criterion, statics, x[:p], scale[:p])
    )
    random = np.random.default_rng(seed)

    def drawn() -> np.ndarray:
        return random.choice(len(rows), count, replace=len(rows) < count)

    best, chosen = min(
        (_exchange(M, judge, drawn(), repeats) for _ in range(starts)), key=lambda choice: choice[0]
    )
    others = [judge.of(M[drawn()].sum(axis=0)[None])[0] for _ in range(_RANDOM)]
    std = np.sqrt(np.diag(judge.covariance(M[chosen].sum(axis=0)[None])[0])) * scale[:p]
    return ChosenPoses(
        rows[np.sort(chosen)],
        kind(q[rows[np.sort(chosen)]]),
        judge.shown(best),
        judge.shown(float(np.median(others))),
        dict(zip((unknown.name for unknown in unknowns), std.tolist(), strict=True)),
        len(q) - len(rows),
        {unknown.name: unknown.unit for unknown in unknowns},
        criterion.in_words,
    )


def _readings_at(
    kind: Callable[[np.ndarray], Any],
    q: np.ndarray,
    markers: Mapping[str, ArrayLike],
    forces: ArrayLike | None,
    hook: ArrayLike | None,
    body: str,
    sigma: float,
) -> tuple[Measurements, np.ndarray]:
    """Readings of all markers under each load, at postures of a kind by their numbers (N, n).

    Behind them the places of the markers (m, 3).
    """
    F = as_floats("forces", [] if forces is None else forces, _FORCES)
    if F.ndim not in {1, 2} or F.shape[-1] not in {0, 3}:
        raise InputError("forces", got=Words(f"shape {F.shape}"), expected=_FORCES)
    loads, names = np.vstack([np.zeros(3), F.reshape(-1, 3)]), list(markers)
    each = "three numbers each [m]"
    places = as_floats("markers", [*markers.values()], each, None, (len(names), 3))
    count = len(loads) * len(names)
    measured = Measurements(
        kind(np.repeat(q, count, axis=0)),
        np.zeros((len(q) * count, 3)),
        forces=np.tile(np.repeat(loads, len(names), axis=0), (len(q), 1)),
        hooks=None if hook is None else as_floats("hook", hook, "three numbers [m]", "m", (3,)),
        bodies=body,
        markers=names * (len(q) * len(loads)),
        sigma=as_float("sigma", sigma, "one number [m]", "m"),
    )
    return measured, places


def _determined(model: ReadingModel, rates: np.ndarray) -> np.ndarray:
    """Which unknowns rates (M, n) of all readings determine (n,).

    Those of the robot have to be; places of frames may be no matter, such as heights above a planar
    robot.
    """
    report = identifiability(rates, model.unknowns)
    lost = [u.name for k, u in enumerate(model.parameters) if k in report.fixed]
    if lost:
        words = [s for s in report.not_identified if any(name in s for name in lost)]
        raise NoAnswerError("no choice of these postures determines all: " + "; ".join(words))
    return np.setdiff1d(np.arange(rates.shape[1]), report.fixed)


def _serve(model: ReadingModel, J: np.ndarray, nominal: np.ndarray) -> tuple[np.ndarray, float]:
    """Candidates (N,) in equilibrium away from singular postures whose readings move; how far."""
    codes = model.statics.at(nominal).status_codes
    lost = (codes & int(Status.UNREACHABLE | Status.NO_EQUILIBRIUM)) != 0
    lost = lost[model.statics.states.of_readings].reshape(len(J), -1).any(axis=1)
    good = np.isfinite(J).all(axis=(1, 2)) & ~lost
    elastic = [k for k, u in enumerate(model.parameters) if u.kind is not UnknownKind.GEOMETRY]
    moved = np.nan_to_num(np.abs(J[:, :, elastic].sum(axis=2)).max(axis=1))  # in sigma
    return good & (moved >= _SEEN) if elastic else good, float(moved.max(initial=0.0))


def _exact_rates(
    criterion: DOptimal | AOptimal | TestPose,
    statics: FiniteLoads,
    values: np.ndarray,
    scale: np.ndarray,
) -> np.ndarray | None:
    """Rates (m, p), with scaled parameters, of what shall be exact; None where all of them shall.

    Of N test poses those of the loaded points, over the root of N.
    """
    if isinstance(criterion, DOptimal):
        return None
    if isinstance(criterion, AOptimal):
        return np.eye(len(values)) / len(values) ** 0.5
    robot = statics.robot
    q = getattr(criterion.postures, "values", criterion.postures)
    q = np.atleast_2d(as_floats("test poses", q, "postures (N, n)"))
    by_joints = isinstance(criterion.postures, JointCoordinates)
    rows, expected = list(robot.space.rows), "one, or one for each of the test poses [N, N m]"
    W, wrenches = as_floats("wrenches", criterion.wrenches, expected), np.zeros((len(q), 6))
    if W.shape not in {(len(rows),), (len(q), len(rows))}:
        raise InputError("wrenches of test poses", got=Words(f"shape {W.shape}"), expected=expected)
    wrenches[:, rows] = W
    postures = JointCoordinates(q) if by_joints else q
    readings = Measurements(postures, np.zeros((len(q), 3)), wrenches=wrenches)
    states = States.of(robot, readings, np.eye(3))
    rates = statics.with_states(states).verify(values)[0].at(values).rates[:, :3]
    if not np.isfinite(rates).all():
        raise InputError("test poses", got=Words("one near a singular posture"), expected="others")
    return rates.reshape(-1, len(values)) / len(q) ** 0.5 * scale


@frozen(eq=False)
class _Judge:
    """A criterion of information matrices (..., n, n), small where they are good.

    ``trace(T C T^T)`` of the covariance C; without T the logarithm of its determinant.
    """

    total: np.ndarray
    before: np.ndarray
    parameters: int
    T: np.ndarray | None

    def covariance(self, M: np.ndarray) -> np.ndarray:
        """Of the parameters (..., p, p); a little information of all candidates is added."""
        d = np.sqrt(np.diag(self.total))
        scaled = (M + self.before + _RIDGE * self.total) / np.outer(d, d)
        p = self.parameters
        return np.linalg.inv(scaled)[..., :p, :p] / np.outer(d[:p], d[:p])

    def of(self, M: np.ndarray) -> np.ndarray:
        """Values (...)."""
        C = self.covariance(M)
        if self.T is None:
            return np.linalg.slogdet(C)[1]
        return np.einsum("ij,...jk,ik->...", self.T, C, self.T)

    def shown(self, value: float) -> float:
        """A value as a standard deviation."""
        return float(np.exp(0.5 * value / self.parameters)) if self.T is None else value**0.5


def _exchange(
    M: np.ndarray, judge: _Judge, chosen: np.ndarray, repeats: bool
) -> tuple[float, np.ndarray]:
    """The value that no exchange of one posture betters, of M (N, n, n), and postures (k,)."""
    chosen = chosen.copy()
    value = float(judge.of(M[chosen].sum(axis=0)[None])[0])
    for _ in range(_MOST_SWEEPS):
        start = value
        for place in range(len(chosen)):
            rest = np.delete(chosen, place)
            free = np.arange(len(M)) if repeats else np.setdiff1d(np.arange(len(M)), rest)
            values = judge.of(M[rest].sum(axis=0) + M[free])
            best = int(np.argmin(values))
            if values[best] < value:
                value, chosen[place] = float(values[best]), free[best]
        if not start - value > _GAIN * max(abs(value), 1.0 if judge.T is None else 0.0):
            break
    return value, chosen

"""Recorded equilibria: the same as those of Newton's method in numbers, or computed by it."""

import pickle
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp

import robostiff as rs
from robostiff.compiled.closed import ClosedCode
from robostiff.kinematics import posture_finder
from robostiff.model import Branch, Chain, Leg, ParallelBlock, PlacedFreedom
from robostiff.recorded.closure import LAST
from robostiff.spatial import Frame
from robostiff.statics.chains.elements import FiniteJoint
from robostiff.statics.kernels.strut import buckling_of, struts_among
from robostiff.statics.loading.given_loads import Acting
from robostiff.statics.loading.loaded_posture import postures_of
from tests.statics.robots_under_load import loaded, same_as_each, struts

COUNT = 3
equilibrium: Any = rs.equilibrium
stiffness: Any = rs.stiffness


@cache
def compiled(name: str) -> rs.CompiledLoading:
    return rs.compile_loaded(rs.load(name), backend=rs.Backend.ARRAYS)


def postures(name: str, size: float = 0.05) -> Any:
    robot = rs.load(name)
    finder = posture_finder(robot)
    random = np.random.default_rng(3)
    if robot.is_posed_by_joints:
        chain = robot.legs[0].chain
        return rs.JointCoordinates(chain.home + 0.2 * random.uniform(-1, 1, (COUNT, chain.size)))
    places = robot.coordinate_places
    spread = size * np.where(np.array(places) < 3, finder.length, 2.0)
    return finder.home_pose[places] + spread * random.uniform(-1, 1, (COUNT, len(places)))


def loads(name: str, part: float) -> np.ndarray:
    """Wrenches under which the platform moves by about a part of the robot's length."""
    robot = rs.load(name)
    length = posture_finder(robot).length
    scale = np.where(np.array(robot.space.rows) < 3, 1.0, length)
    C = rs.compliance(robot) * np.outer(scale, scale)
    force = part * length / np.abs(C).max()
    return force * scale * np.random.default_rng(8).uniform(-1, 1, (COUNT, robot.space.size))


def given_in_all_ways(name: str) -> list[Any]:
    """Postures of an arm at joints, by drives and, where it has coordinates, at poses."""
    robot, q = rs.load(name), postures(name)
    forms: list[Any] = [q]
    if rs.actuator_names(robot):
        forms.append(rs.ActuatorCoordinates(q.values))
    if robot.coordinates:
        forms.append(rs.find_posture(robot, q).pose)
    return forms


@pytest.mark.parametrize("name", ["two-link-arm", "scara", "six-joint-arm"])
def test_an_arm_under_load_is_the_same_at_poses_at_joints_and_by_drives(name: str):
    robot, fast, F = rs.load(name), compiled(name), loads(name, 3e-3)
    for pose in given_in_all_ways(name):
        answer, sure = fast.evaluate(pose, F), equilibrium(robot, pose, F)
        assert fast.verified
        assert not answer.guarded.any()
        assert np.allclose(answer.displacement, sure.displacement, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["two-link-arm", "scara", "six-joint-arm", "planar-link"])
def test_an_arm_is_as_stiff_at_poses_at_joints_and_by_drives(name: str):
    robot, fast = rs.load(name), rs.compile(rs.load(name), backend=rs.Backend.ARRAYS)
    for pose in given_in_all_ways(name):
        answer, sure = fast.evaluate(pose), stiffness(robot, pose)
        assert answer.status_codes.tolist() == sure.status_codes.tolist()
        assert np.allclose(answer.values["K"], sure.K, rtol=1e-9, atol=1e-9 * np.abs(sure.K).max())


@pytest.mark.parametrize(
    "name",
    [
        "gough-stewart-b",
        "hexapod",
        "two-link-arm",
        "six-joint-arm",
        "3-puu",
        "3-rps",
        "orthoglide",
        "3-rpr-beams",
    ],
)
def test_they_are_equilibria(name: str):
    fast, robot = compiled(name), rs.load(name)
    # slender bars between hinges are near their own critical load sooner
    pose, wrench = postures(name), loads(name, 3e-4 if name == "orthoglide" else 3e-3)
    answer, sure = fast.evaluate(pose, wrench), equilibrium(robot, pose, wrench)
    assert fast.verified
    assert not answer.guarded.any()
    same_as_each(answer, sure, rtol=0, atol=1e-11 * min(posture_finder(robot).length, 1.0))
    for k, one in enumerate(sure):
        size = np.sqrt(np.diag(one.K))
        unloaded = stiffness(robot, pose if isinstance(pose, rs.JointCoordinates) else pose[k])
        K = unloaded[k].K if isinstance(pose, rs.JointCoordinates) else unloaded.K
        assert np.abs((K - one.K) / np.outer(size, size)).max() > 1e-5  # the load matters


@pytest.mark.parametrize("name", ["gough-stewart-b", "hexapod", "two-link-arm", "3-puu"])
def test_without_load_they_are_the_kernel(name: str):
    robot = rs.load(name)
    pose = postures(name)
    answer = compiled(name).evaluate(pose, np.zeros(robot.space.size))
    plain = rs.compile(robot, backend=rs.Backend.ARRAYS).evaluate(pose)
    for K, known in zip(answer.K, plain.values["K"], strict=True):
        size = np.sqrt(np.diag(known))
        assert np.abs((K - known) / np.outer(size, size)).max() < 1e-9
    assert np.abs(answer.displacement).max() < 1e-14


def test_half_the_critical_load_is_met_and_what_is_near_or_beyond_it_is_computed_with_care():
    robot, fast = rs.load("gough-stewart-b"), compiled("gough-stewart-b")
    home = posture_finder(robot).home_pose
    wrench = np.array([0, 0, -1e6, 0, 0, 0])
    critical = rs.critical_load(robot, wrench=wrench).factor
    parts = np.array([0.5, -0.5, 0.95, 1.2])
    F = critical * parts[:, None] * wrench
    answer = fast.evaluate(np.tile(home, (4, 1)), F)
    assert answer.guarded.tolist() == [False, False, True, True]
    same_as_each(answer, (equilibrium(robot, None, own) for own in F))


def test_four_steps_arrive_at_half_the_critical_load_and_newtons_are_squared():
    fast, home = compiled("gough-stewart-b"), posture_finder(rs.load("gough-stewart-b")).home_pose
    random = np.random.default_rng(2)
    poses = home + 0.02 * random.uniform(-1, 1, (64, 6))
    wrenches = np.tile([0, 0, -3.5e7, 0, 0, 2e5], (64, 1))
    code = fast.kernel.code
    assert isinstance(code, ClosedCode)
    assert code.whole is not None
    found = np.empty((code.rows, 64))
    inputs = np.ascontiguousarray(np.concatenate([poses.T, wrenches.T]))
    code.whole.evaluate(inputs, found)
    assert np.sqrt(found[-2]).max() < 1e-12
    assert np.all(found[-1] > 0)
    # where the tangent is not exact, steps shrink in proportion, not squared
    step = code.few.step.program
    names = step.inputs[len(inputs) :]
    values = dict(zip(step.inputs, (*inputs, *code.state), strict=True))
    sizes = []
    for _ in range(6):
        values |= zip(names, step.evaluated(values), strict=True)
        sizes.append(np.sqrt(values[LAST]))
    before, after = np.array(sizes[1:-1]), np.array(sizes[2:])
    seen = after > 1e-13
    assert np.count_nonzero(seen) > 100
    assert np.all(after[seen] < 8 * before[seen] ** 2)


@pytest.mark.parametrize("aside", [0.0, 1e-7, 1e-3])
def test_a_leg_is_a_strut_where_it_carries_what_a_spring_between_two_points_does(aside: float):
    """And no other: the axis of its last joint misses the centre of the two before it."""
    angles = np.radians([[0, 120, 120, 240, 240, 360], [60, 60, 180, 180, 300, 300]])
    base, top = (np.stack([np.cos(a), np.sin(a), 0 * a], axis=1) for a in angles)
    robot = struts(base, 0.6 * top + [0.01, 0.02, 0.8], 1e6, np.array([0, 0, 0.9]))
    leg = robot.legs[2]
    joint = leg.elements[-1]
    assert isinstance(joint, PlacedFreedom)
    across = np.cross(joint.axis, joint.axis[[1, 2, 0]])
    moved = replace(joint, point=joint.point + aside * across / np.linalg.norm(across))
    leg = replace(leg, elements=(*leg.elements[:-1], moved))
    robot = replace(robot, legs=(*robot.legs[:2], leg, *robot.legs[3:]))
    found = struts_among(postures_of(robot, None, None).loaded(0, Acting()).problem)
    assert found == ({0, 1, 2, 3, 4, 5} if aside == 0 else {0, 1, 3, 4, 5})


def test_a_leg_between_bearings_that_are_stiffer_along_one_axis_is_no_strut():
    """At home the leg is along that axis; it turns away from it."""
    robot = rs.load("hexapod")
    problem = postures_of(robot, None, None).loaded(0, Acting()).problem
    assert struts_among(problem) == set(range(6))
    chain = problem.legs.chains[0]
    k, first = next((k, e) for k, e in enumerate(chain.elements) if not isinstance(e, FiniteJoint))
    softer = replace(first, stiffness=first.stiffness * np.array([1, 1, 0.25]))
    elements = (*chain.elements[:k], softer, *chain.elements[k + 1 :])
    chains = (replace(chain, elements=elements), *problem.legs.chains[1:])
    other = replace(problem, legs=replace(problem.legs, chains=chains))
    assert struts_among(other) == set(range(1, 6))


def test_a_leg_of_two_struts_side_by_side_carries_what_both_do():
    """It is no strut itself, though each of its branches behaves as one."""
    robot, still = rs.load("gough-stewart-b"), Frame(np.eye(3), np.zeros(3))
    pair = tuple(Branch(own.name, own.base, own.chain, own.attachment) for own in robot.legs[:2])
    leg = Leg("pair", still, Chain((ParallelBlock(pair, "block"),)), still)
    other = replace(robot, legs=(leg, *robot.legs[2:]))
    fast = rs.compile_loaded(other, backend=rs.Backend.ARRAYS)
    pose, wrench = postures("gough-stewart-b"), loads("gough-stewart-b", 3e-3)
    found, sure = (own.evaluate(pose, wrench) for own in (fast, compiled("gough-stewart-b")))
    assert not found.guarded.any()
    assert np.abs(found.K - sure.K).max() < 1e-9 * np.abs(sure.K).max()


@pytest.mark.parametrize("force", [-5e5, 5e5])
def test_bounds_of_buckling_hold_at_other_postures_and_are_close(force: float):
    robot = rs.load("hexapod")
    finder = posture_finder(robot)
    random = np.random.default_rng(12)
    spread = 0.15 * np.array([1, 1, 1, 0.5, 0.5, 0.5]) * random.uniform(-1, 1, (9, 6))
    problems = [
        postures_of(robot, finder.home_pose + own, None).loaded(0, Acting()) for own in spread
    ]
    bounds = buckling_of([own.problem for own in problems[:6]], range(6), 1e5)
    for posture in problems[6:]:
        assert isinstance(posture.posed, rs.Snapshot)
        loaded = equilibrium(posture.posed, None, [0, 0, 6 * force, 0, 0, 0])
        for k, leg in enumerate(posture.posed.legs):
            joints = [e for e in leg.elements if isinstance(e, PlacedFreedom) and e.turns]
            d = joints[-1].point - joints[0].point
            length = float(np.linalg.norm(d))
            t = float(loaded.leg_wrenches[k][:3] @ d) / length
            margin = loaded.margins[leg.name]
            if bounds[k].shortest < length < bounds[k].longest:
                least = min([*bounds[k].checks(t, length, 0.0)[:-2], 1.0])
                assert margin - 0.05 < least < margin + 1e-3


def test_half_the_critical_load_of_struts_that_buckle_is_met_at_most_poses():
    robot, fast = rs.load("hexapod"), compiled("hexapod")
    down = np.array([0, 0, -1e6, 0, 0, 0])
    half = 0.5 * rs.critical_load(robot, wrench=down).factor
    random = np.random.default_rng(2)
    poses = posture_finder(robot).home_pose + 0.01 * random.uniform(-1, 1, (64, 6))
    answer = fast.evaluate(poses, half * down)
    assert answer.guarded_share < 0.2
    some = np.flatnonzero(~answer.guarded)[:3]
    same_as_each(answer[some], (equilibrium(robot, poses[k], half * down) for k in some))
    # what is near their critical load is computed with care
    F = [[0, 0, -f, 0, 0, 0] for f in (1e6, 1.2e7)]
    near = fast.evaluate(np.tile(posture_finder(robot).home_pose, (2, 1)), F)
    assert near.guarded.tolist() == [False, True]
    same_as_each(near, (equilibrium(robot, None, f) for f in F))


def test_forty_digits_give_the_same_under_forces_and_moments():
    robot, fast = rs.load("gough-stewart-b"), compiled("gough-stewart-b")
    random = np.random.default_rng(9)
    pose = posture_finder(robot).home_pose + 0.03 * random.uniform(-1, 1, (2, 6))
    wrench = np.array([[2e6, 1e6, -3e7, 4e5, 0, 6e5], [0, -4e6, 4e7, 1e6, 2e6, -5e5]])
    answer = fast.evaluate(pose, wrench)
    assert not answer.guarded.any()
    legs = rs.find_posture(robot, pose).snapshot.legs
    for i in range(2):
        joints = [[e for e in leg.elements if isinstance(e, PlacedFreedom)] for leg in legs]
        ends = [
            (np.broadcast_to(own[0].point, (2, 3))[i], own[-1].point[i] - pose[i, :3])
            for own in joints
        ]
        k = [next(e.stiffness for e in own if not e.is_passive) for own in joints]
        moved, K = exact_struts(ends, k, pose[i, :3], wrench[i], answer.displacement[i])
        size = np.sqrt(np.diag(K))
        assert np.abs((answer.K[i] - K) / np.outer(size, size)).max() < 1e-11
        assert np.abs(answer.displacement[i] - moved).max() < 1e-12


def exact_struts(
    ends: Any, k: Any, p: np.ndarray, wrench: np.ndarray, near: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where springs between points balance a wrench, and how that grows with twists (mpmath)."""
    with mp.workdps(40):

        def turned(r: Any, c: Any) -> Any:
            a = mp.sqrt(mp.fsum(x * x for x in r))
            s, h = (mp.sin(a) / a, (1 - mp.cos(a)) / a**2) if a else (mp.mpf(1), mp.mpf(0.5))
            rc = cross(r, c)
            rrc = cross(r, rc)
            return [c[j] + s * rc[j] + h * rrc[j] for j in range(3)]

        def cross(a: Any, b: Any) -> Any:
            return [a[j - 2] * b[j - 1] - a[j - 1] * b[j - 2] for j in range(3)]

        def carried(x: Any, twist: Any = (0,) * 6) -> Any:
            total = [mp.mpf(0)] * 6
            for (A, c), own in zip(ends, k, strict=True):
                rest = mp.sqrt(mp.fsum((mp.mpf(p[j]) + c[j] - A[j]) ** 2 for j in range(3)))
                arm = turned(twist[3:], turned(x[3:], [mp.mpf(y) for y in c]))
                d = [mp.mpf(p[j]) + x[j] + twist[j] + arm[j] - A[j] for j in range(3)]
                length = mp.sqrt(mp.fsum(y * y for y in d))
                f = [mp.mpf(own) * (length - rest) / length * y for y in d]
                total = [a + b for a, b in zip(total, [*f, *cross(arm, f)], strict=True)]
            return total

        def missing(*x: Any) -> Any:
            return [a - mp.mpf(b) for a, b in zip(carried(x), wrench, strict=True)]

        x = list(mp.findroot(missing, [mp.mpf(float(y)) for y in near], tol=1e-50))
        step, columns = mp.mpf(10) ** -15, []
        for j in range(6):
            ahead, behind = (
                carried(x, [sign * step if i == j else mp.mpf(0) for i in range(6)])
                for sign in (1, -1)
            )
            columns.append(
                [float((a - b) / (2 * step)) for a, b in zip(ahead, behind, strict=True)]
            )
        return np.array([float(y) for y in x]), np.array(columns).T


def test_parameters_are_inputs():
    robot = rs.load("gough-stewart-b", symbols=("k", "R"))
    fast = rs.compile_loaded(robot, parameters=("k", "R"), backend=rs.Backend.ARRAYS)
    nominal = {name: float(value) for name, value in robot.nominal.items()}
    values = {name: np.array([0.9, 1.05]) * nominal[name] for name in ("k", "R")}
    pose = posture_finder(rs.load("gough-stewart-b")).home_pose + np.zeros((2, 6))
    wrench = [1e5, 0, -1e6, 0, 2e4, 0]
    answer = fast.evaluate(pose, wrench, parameters=values)
    assert not answer.guarded.any()
    each = [{name: float(value[i]) for name, value in values.items()} for i in range(2)]
    same_as_each(answer, (equilibrium(robot.substituted(own), pose[0], wrench) for own in each))


ARM = {
    "arm/joint3": rs.Mass(12.0),
    "arm/upper arm": [rs.DeadForce([5, -8, -60]), rs.DeadForce([0, 9, 0], [0.2, 0.1, 0.4])],
    "platform": [rs.DeadForce([10, 20, -300], [0.3, 0.2, 0.9]), rs.Mass(5)],
}


@pytest.mark.parametrize(
    ("name", "standing"),
    [
        ("two-link-arm", {"gravity": "-y"}),
        ("six-joint-arm", {"gravity": [1.0, 2.0, -9.0]}),
        ("six-joint-arm", {"loads": ARM, "preload": {"arm/joint2": 40.0}}),
        ("gough-stewart-b", {"loads": {"platform": rs.Mass(2e5, point=[0.1, 0.2, 2.0])}}),
        ("gough-stewart-b", {"loads": {"platform": rs.Mass(2e5, [0.1, 0.2, 0.3])}}),
        ("3-rps", {"gravity": "-z"}),
    ],
    ids=[
        *("plane", "gravity", "loads and preload", "platform", "in its frame"),
        "telescopes closed by steps",
    ],
)
def test_weights_loads_and_preloads_act_beside_the_wrench(name: str, standing: Any):
    robot = rs.load(name)
    fast = rs.compile_loaded(robot, **standing, backend=rs.Backend.ARRAYS)
    pose, wrench = postures(name, 0.03), loads(name, 3e-3)
    answer, sure = fast.evaluate(pose, wrench), equilibrium(robot, pose, wrench, **standing)
    bare = equilibrium(robot, pose, wrench, gravity=[0, 0, 0])
    assert not answer.guarded.any()
    same_as_each(answer, sure, rtol=0, atol=1e-11)
    matter = np.abs(bare.displacement - sure.displacement).max(axis=1)
    assert np.all(matter > 1e5 * 1e-11)


def test_a_mass_may_be_a_parameter_and_what_is_guarded_has_its_weight():
    m = sp.Symbol("m")
    plain = rs.load("gough-stewart-b")
    robot = replace(
        plain, platform_masses=(rs.Mass(m, [0.2, 0.0, 1.5]),), gravity="-z", nominal={"m": 3e5}
    )
    fast = rs.compile_loaded(robot, parameters=["m"], backend=rs.Backend.ARRAYS)
    home = posture_finder(plain).home_pose
    values = np.array([0.0, 2.9e5, 4e5])
    wrench = [[0, 0, 0, 0, 0, 0], [0, 0, -5e6, 0, 0, 0], [0, 0, -6e7, 0, 0, 0]]
    answer = fast.evaluate(np.tile(home, (3, 1)), wrench, parameters={"m": values})
    assert answer.guarded.tolist() == [False, False, True]
    each = [
        equilibrium(robot.substituted({"m": value}), home, F)
        for value, F in zip(values, wrench, strict=True)
    ]
    same_as_each(answer, each)


def test_a_weight_at_the_reference_point_is_a_wrench():
    home = posture_finder(rs.load("gough-stewart-b")).home_pose[None]
    weight = rs.compile_loaded(
        rs.load("gough-stewart-b"), loads={"platform": [1e6, -2e6, -2e7]}, backend=rs.Backend.ARRAYS
    ).evaluate(home, np.zeros(6))
    wrench = compiled("gough-stewart-b").evaluate(home, [1e6, -2e6, -2e7, 0, 0, 0])
    size = np.abs(wrench.K).max()
    assert np.abs(weight.K - wrench.K).max() < 1e-13 * size
    assert np.abs(weight.displacement - wrench.displacement).max() < 1e-14


def test_poses_out_of_reach_and_beyond_limits_say_so_and_stop_no_other():
    robot, fast = rs.load("hexapod"), compiled("hexapod")
    home = posture_finder(robot).home_pose
    pose = home + np.outer([0, 30, 0.4], [0, 0, 1, 0, 0, 0])
    wrench = [0, 0, -1e4, 0, 0, 0]
    answer = fast.evaluate(pose, wrench)
    sure = equilibrium(robot, pose, wrench)
    assert answer.status_codes.tolist() == sure.status_codes.tolist()
    assert answer.answered.tolist() == sure.answered.tolist()
    assert "beyond-limits" in str(answer.status)


def test_a_kernel_travels():
    fast = compiled("two-link-arm")
    other = pickle.loads(pickle.dumps(fast))  # noqa: S301
    wrench = loads("two-link-arm", 1e-3)
    pose = postures("two-link-arm")
    assert np.array_equal(other.evaluate(pose, wrench).K, fast.evaluate(pose, wrench).K)


def test_what_has_no_kernel_is_refused_with_the_way_to_go():
    with pytest.raises(rs.NoAnswerError, match=r"free motions.*rs\.equilibrium"):
        rs.compile_loaded(rs.load("planar-link"))
    with pytest.raises(rs.InputError, match="a Robot"):
        rs.compile_loaded("hexapod")  # type: ignore[arg-type]
    with pytest.raises(rs.InputError, match="arm/nothing"):
        rs.compile_loaded(rs.load("six-joint-arm"), loads={"arm/nothing": [0, 0, -1]})
    with pytest.raises(rs.InputError, match="a robot without masses"):
        rs.compile_loaded(rs.load("gough-stewart-b"), gravity="-z")
    with pytest.raises(rs.InputError, match="6 numbers"):
        compiled("gough-stewart-b").evaluate(np.zeros((1, 6)), [0, 0, -1])
    with pytest.raises(rs.InputError, match=r"wrenches \(2,\)"):
        compiled("gough-stewart-b").evaluate(np.zeros((3, 6)), np.zeros((2, 6)))


@pytest.mark.parametrize(
    ("name", "body"),
    [("hexapod", "leg1/strut"), ("six-joint-arm", "arm/joint3"), ("six-joint-arm", "arm/forearm")],
)
def test_a_mass_in_the_frame_of_a_body_of_a_leg_turns_with_it(name: str, body: str):
    """At a pose where that frame is turned; it was refused."""
    robot, F = rs.load(name), np.linspace(20.0, -30, 6)[None]
    loads = {body: rs.Mass(5, centre=[0.02, -0.03, 0.1])}
    fast = rs.compile_loaded(robot, loads=loads, backend=rs.Backend.ARRAYS)
    home = np.broadcast_to(rs.stiffness(robot).pose, (1, 6))
    pose = home + np.array([0.02, -0.01, 0.03, 0.1, -0.2, 0.15])
    found = fast.evaluate(pose, F)
    assert not np.any(found.guarded)
    answer = loaded(robot, pose=pose[0], wrench=F[0], loads=loads)
    size = np.abs(answer.displacement).max()
    np.testing.assert_allclose(found.displacement[0], answer.displacement, atol=1e-7 * size)
    own = {body: rs.Mass(5)}
    other = loaded(robot, pose=pose[0], wrench=F[0], loads=own)
    assert np.abs(other.displacement - answer.displacement).max() > 1e-5 * size


@pytest.mark.parametrize("name", ["hexapod", "3-rrr"])
def test_one_pose_under_load_has_an_answer_without_an_axis_of_poses(name):
    fast = rs.compile_loaded(rs.load(name), backend=rs.Backend.ARRAYS, platforms=True)
    pose, size = postures(name)[0], fast.robot.space.size
    wrench = np.arange(1.0, 1.0 + size)
    one, several = (fast.evaluate(own, wrench) for own in (pose, pose[None]))
    assert (one.batch_shape, several.batch_shape) == ((), (1,))
    for result in ("K", "K_sym", "K_total", "displacement", "stable", "status_codes"):
        np.testing.assert_array_equal(getattr(one, result), getattr(several, result)[0])
    assert one.K.shape == (size, size)
    assert one.platforms is not None
    assert several.platforms is not None
    np.testing.assert_array_equal(one.platforms.axes, several.platforms.axes[0])

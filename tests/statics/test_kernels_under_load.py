"""Recorded equilibria: those of Newton's method in numbers, and their rates."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.kinematics import posture_finder
from robostiff.model import Branch, Chain, Leg, ParallelBlock, PlacedFreedom
from robostiff.spatial import Frame
from robostiff.statics.kernels.strut import struts_among
from robostiff.statics.loading.given_loads import Acting
from robostiff.statics.loading.loaded_posture import postures_of
from tests.files import written
from tests.generators.planted_poses import PoseSpace
from tests.identification.campaigns import column, model_file
from tests.statics.robots_under_load import SPRINGS, on, same_as_each, spring, struts

COUNT = 3
equilibrium: Any = rs.equilibrium
stiffness: Any = rs.stiffness


@cache
def compiled(name: str) -> rs.CompiledLoading:
    return rs.compile_loaded(rs.load(name), backend=rs.Backend.ARRAYS)


def postures(name: str, size: float = 0.05) -> Any:
    space = PoseSpace(rs.load(name))
    return space.pose(space.beside(COUNT, 0.2 if space.by_joints else size, 3))


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
    found = struts_among(postures_of(robot, None, None).with_loads(0, Acting()).problem)
    assert found == ({0, 1, 2, 3, 4, 5} if aside == 0 else {0, 1, 3, 4, 5})


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
    # all over the range of the struts it is known what these carry
    all_over = np.asarray(rs.random_postures(robot, 200, seed=5))
    light = fast.evaluate(all_over, [0, 0, -300, 0, 0, 0], again=False)
    assert not light.guarded.any()


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
    "arm/joint3": [rs.Mass(12.0), rs.Mass(5, centre=[0.02, -0.03, 0.1])],
    "arm/forearm": rs.Mass(5, centre=[0.02, -0.03, 0.1]),
    "arm/upper arm": [rs.DeadForce([5, -8, -60]), rs.DeadForce([0, 9, 0], [0.2, 0.1, 0.4])],
    "platform": [rs.DeadForce([10, 20, -300], [0.3, 0.2, 0.9]), rs.Mass(5)],
}
STANDING: dict[str, tuple[str, dict[str, Any]]] = {
    "plane": (
        "two-link-arm",
        {
            **{"gravity": "-y", "preload": {"arm/shoulder": 15.0}},
            "loads": {"arm/elbow": rs.Mass(5.0), "platform": rs.DeadForce([20, -9, 0])},
        },
    ),
    "arm": (
        "six-joint-arm",
        {"gravity": [1.0, 2.0, -9.0], "loads": ARM, "preload": {"arm/joint2": 40.0}},
    ),
    "platform": (
        "gough-stewart-b",
        {"loads": {"platform": [rs.Mass(2e5, point=[0.1, 0.2, 2.0]), rs.Mass(1e5, [0.1, 0.2, 1])]}},
    ),
    "struts": (
        "hexapod",
        {"gravity": "-z", "loads": {"leg1/strut": rs.Mass(50, centre=[0.02, -0.03, 0.1])}},
    ),
    "telescopes closed by steps": ("3-rps", {"gravity": "-z"}),
    "springs in a plane": ("3-rpr-beams", {}),
    "springs at blocks": ("orthoglide", {}),
}


@pytest.mark.parametrize("case", STANDING)
def test_weights_loads_preloads_and_springs_act_beside_the_wrench(case: str):
    """Each of them matters."""
    name, standing = STANDING[case]
    robot = rs.load(name).with_springs(SPRINGS.get(name, ()))
    fast = rs.compile_loaded(robot, **standing, backend=rs.Backend.ARRAYS)
    small = name in SPRINGS
    pose, wrench = postures(name, 0.02 if small else 0.03), loads(name, 3e-4 if small else 3e-3)
    answer, sure = fast.evaluate(pose, wrench), equilibrium(robot, pose, wrench, **standing)
    assert fast.verified
    assert not answer.guarded.any()
    limit = 1e-11 * min(posture_finder(robot).length, 1.0)
    same_as_each(answer, sure, rtol=0, atol=limit)
    without = [
        (robot, {**standing, key: [0.0] * 3 if key == "gravity" else {}}) for key in standing
    ]
    if robot.springs:
        without.append((robot.with_springs(), standing))
    for other, given in without:
        bare = equilibrium(other, pose, wrench, **given)
        assert np.all(np.abs(bare.displacement - sure.displacement).max(axis=1) > 1e5 * limit)


@pytest.mark.parametrize(
    ("name", "joint"),
    [("hexapod", "leg1/platform joint[2]"), ("delta", "leg1/rods/bar1/platform joint[1]")],
)
def test_a_preload_about_an_axis_of_a_ball_joint_keeps_its_axis(name: str, joint: str):
    preload = {joint: 20.0}
    fast = rs.compile_loaded(rs.load(name), preload=preload, backend=rs.Backend.ARRAYS)
    pose, F = postures(name)[:1], loads(name, 1e-3)[0]
    found = fast.evaluate(pose, F)
    alone = equilibrium(rs.load(name), pose[0], F, preload=preload)
    assert fast.verified
    assert not found.guarded[0]
    assert np.allclose(found.displacement[0], alone.displacement, rtol=1e-8, atol=1e-12)
    assert np.allclose(found.K[0], alone.K, rtol=0, atol=1e-8 * np.abs(alone.K).max())


def test_margins_are_those_beside_springs_without_tension():
    # A spring that resists heave without load is turned aside by a push, and does no longer.
    robot = rs.load("gough-stewart-b")
    home, K = rs.find_posture(robot).pose[0], rs.stiffness(robot).K
    below = on("base", *(home[:3] - [0, 0, 0.05]))
    own = spring(below, on("platform"), stiffness=5 * K[2, 2], free_length=0.05)
    robot = replace(robot, springs=(own,))
    fast = rs.compile_loaded(robot, backend=rs.Backend.ARRAYS)
    wrenches = np.zeros((9, 6))
    wrenches[:, 0] = K[0, 0] * np.linspace(0, 0.06, 9)
    margins = equilibrium(robot, home, wrenches).margin
    guarded = fast.evaluate(np.tile(home, (9, 1)), wrenches).guarded
    assert np.array_equal(guarded, margins < 0.3)
    assert np.count_nonzero(guarded) == 5


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


def test_one_pose_under_load_has_an_answer_without_an_axis_of_poses():
    name = "3-rrr"
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


STEPS = {"c2": 1e-8, "o2": 1e-4, "upper": 1e-4}


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory) -> rs.CompiledLoading:
    robot = rs.load(model_file("arm", tmp_path_factory.mktemp("arm")), symbols=tuple(STEPS))
    return rs.compile_loaded(
        robot, parameters=tuple(STEPS), platforms=True, drives=True, backend=rs.Backend.ARRAYS
    )


def evaluated(fast: rs.CompiledLoading, q: np.ndarray, *given: Any, **more: Any) -> Any:
    answer = fast.evaluate(rs.JointCoordinates(q), *given, **more)
    return answer, answer.platforms


@pytest.mark.parametrize("name", STEPS)
def test_rates_are_those_of_differences(fast: rs.CompiledLoading, name: str):
    """Of places under forces at a hook; deflections of drives are of a spring under its load."""
    q = np.repeat(column("arm", "joint_coordinates"), 3, axis=0)
    forces = np.tile(column("arm", "dead_forces_at_hook"), (len(q) // 3, 1))
    wrenches = np.hstack([forces, 0.3 * forces])
    hooks = column("arm", "hook_platform")[:, None] * forces[:, None, :]
    step, k = STEPS[name], fast.parameters.index(name)
    found = []
    for shift in (-step, 0.0, step):
        values = {name: fast.robot.nominal[name] + shift}
        answer, platforms = evaluated(fast, q, wrenches, hooks=hooks, parameters=values)
        assert not answer.guarded.any()
        found.append(platforms)
    before, here, after = found
    rate = (after.points - before.points) / (2 * step)
    np.testing.assert_allclose(here.rates[:, :3, k], rate, atol=1e-7 * np.abs(rate).max())
    turned = (after.axes - before.axes) @ np.swapaxes(here.axes, 1, 2) / (2 * step)
    spin = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1)
    np.testing.assert_allclose(here.rates[:, 3:, k], spin, atol=1e-7 * np.abs(spin).max())
    assert fast.drives == tuple(f"arm/joint{i}" for i in range(1, 7))
    rate = (after.drives - before.drives) / (2 * step)
    for i in range(2):
        size = np.abs(rate[:, i]).max()
        np.testing.assert_allclose(here.drive_rates[:, i, :, k], rate[:, i], atol=1e-7 * size)
    np.testing.assert_allclose(here.drives[:, 0, 1], 2e-6 * here.drives[:, 1, 1], rtol=1e-12)


@pytest.mark.parametrize(
    ("machine", "names"),
    [("3-rps", ("R", "r")), ("us-ups", ("r", "top")), ("examples/rocking-table.yaml", ("a", "b"))],
)
def test_joints_move_with_lengths_while_the_platform_is_at_its_pose(
    machine: str, names: tuple[str, ...]
):
    """Legs that close by iteration: a pose is held, and not their joints."""
    robot = rs.load(machine, symbols=names)
    parts = {"platforms": True, "drives": True, "backend": rs.Backend.ARRAYS}
    fast = rs.compile_loaded(robot, parameters=names, **parts)
    pose, force = np.asarray(rs.random_postures(robot.numeric, 1, 3)), np.array([100.0, -60, 200])
    hook, F = np.outer([0.1, 0.05, 0.1], force), [*force, 6, 4, 8]
    here = fast.evaluate(pose, F, hooks=hook).platforms
    for k, name in enumerate(fast.parameters):
        value = robot.nominal[name]
        values = value + 1e-4 * value * np.array([1.0, -1.0])
        given = {"hooks": hook, "parameters": {name: values}}
        ends = fast.evaluate(np.repeat(pose, 2, axis=0), F, **given).platforms
        moved = np.subtract(*ends.points) / np.subtract(*values)
        turned = np.subtract(*ends.axes) @ here.axes[0].T / np.subtract(*values)
        rate = np.concatenate([moved, [turned[2, 1], turned[0, 2], turned[1, 0]]])
        np.testing.assert_allclose(here.rates[0, :, k], rate, atol=1e-6 * np.abs(rate).max())
        for of_joints, drives in zip(here.drive_rates[0, :, :, k], range(2), strict=True):
            rate = np.subtract(*ends.drives[:, drives]) / np.subtract(*values)
            np.testing.assert_allclose(of_joints, rate, atol=1e-6 * np.abs(rate).max())


@pytest.mark.parametrize("is_stretched", [False, True])
def test_hooks_turn_with_the_platform(fast: rs.CompiledLoading, is_stretched: bool):
    """A force at a hook is a `Weight` of `equilibrium`; a stretched wrist is computed again."""
    q = column("arm", "joint_coordinates")[:1]
    if is_stretched:
        q = np.array([[0.2, 0.4, 0.3, 0.1, 0.0, 0.3]])
    force, hook = np.array([60.0, -30, -900]), column("arm", "hook_platform")
    answer, platforms = evaluated(fast, q, [*force, 0, 0, 0], hooks=np.outer(hook, force))
    assert answer.guarded.all() == is_stretched
    given = {"platform": [rs.Weight(force, hook)]}
    sure: Any = rs.equilibrium(fast.robot.numeric, rs.JointCoordinates(q[0]), loads=given)
    limit = 1e-9 if is_stretched else 1e-12
    np.testing.assert_allclose(platforms.points[0], sure.pose[:3], atol=limit)
    np.testing.assert_allclose(answer.displacement[0], sure.displacement, atol=limit)


@pytest.mark.filterwarnings("ignore::robostiff.PlausibilityWarning")
@pytest.mark.parametrize(("unit", "size"), [("um", 1e-3), ("m", 1e3)])
def test_robots_of_any_size_have_kernels(tmp_path: Path, unit: str, size: float):
    """Lengths and drives times s, forces times s^2: shifts are s times as large, turns the same."""
    text = Path("examples/exechon.yaml").read_text("utf-8").replace(" mm", f" {unit}")
    file = written(tmp_path / "size.yaml", text.replace("8e7 N/m", f"{8e7 * size} N/m"))
    pose, F = np.array([[-1.2, 0.1, 0.05]]), np.array([3000.0, 2000, -5000, 100, 50, -200])
    found, grown = (rs.compile_loaded(rs.load(x)) for x in ("examples/exechon.yaml", file))
    expected = found.evaluate(pose, F).displacement[0]
    of_force, of_shift = np.repeat([[size**2, size**3], [size, 1.0]], 3, axis=1)
    there = grown.evaluate(pose * [size, 1, 1], F * of_force)
    assert not there.guarded.any()
    np.testing.assert_allclose(there.displacement[0] / of_shift, expected, rtol=1e-9)


SMALL = """
robostiff: 1
name: small
source: made up for a test
sections: {rod: {circle: {diameter: 2 um}}}
legs:
  - name: arm
    chain:
      - {type: beam, name: column, to: [0, 0, 20 um], material: steel, section: rod}
      - {type: revolute, name: turn, axis: z, role: actuated, stiffness: 1e-8 N*m/rad}
      - {type: beam, name: arm, to: [20 um, 0, 0], y_axis: y, material: steel, section: rod}
      - type: telescope
        name: quill
        direction: -z
        role: actuated
        stiffness: 1000 N/m
        home: 10 um
        beams: [{share: 1, material: steel, section: rod}]
"""


def test_postures_near_home_are_near_in_a_small_arm(tmp_path: Path):
    """Slides are drawn in parts of its size, not of a metre, at which it would seem rigid."""
    robot = rs.load(written(tmp_path / "small.yaml", SMALL))
    q, F = np.array([[0.1, 1.1e-5]]), np.array([3e-6, 2e-6, -4e-6, 0, 0, 1e-11])
    found = rs.compile_loaded(robot).evaluate(rs.JointCoordinates(q), F)
    expected: Any = rs.equilibrium(robot, rs.JointCoordinates(q[0]), F)
    assert not found.guarded.any()
    np.testing.assert_allclose(found.displacement[0], expected.displacement, rtol=1e-9, atol=1e-17)

"""Legs in formulas: turned ones, posts, dependent joints."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.analytic.export import derivation_text, python_function
from robostiff.analytic.placement import agreement
from robostiff.analytic.placement.agreement import images_of_legs, numbers_of
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.analytic.springs.unit_wrenches import WrenchSearch
from robostiff.kinematics import posture_finder
from robostiff.kinematics.closure import Post
from robostiff.model import ALL_COORDINATES
from robostiff.network import network_of_snapshot
from robostiff.robots import robot_file
from tests.files import FILES

ALL = rs.ALL_PARAMETERS


def legs_of(robot):
    placed = place_robot(robot, rs.AtHome())
    search = WrenchSearch.of(placed)
    return placed, [search.sampled(own.leg) for own in placed.legs]


def stiffness_of(leg):
    """W (W^T C W)^-1 W^T over the wrenches that a leg transmits (samples, n, n)."""
    W = np.linalg.svd(leg.J)[0][:, :, leg.C.shape[1] - leg.transmitted :]
    return W @ np.linalg.inv(W.mT @ leg.C @ W) @ W.mT


def images(robot):
    placed = place_robot(robot, rs.AtHome())
    return images_of_legs(robot, numbers_of(placed).leg_stiffness, placed.length)


def turned(robot):
    each = images(robot).items()
    return {i: (first, str(way.part), way.mirror is not None) for i, (first, way) in each}


def test_legs_of_a_hexapod_are_turns_and_mirror_images_of_the_first():
    found = turned(rs.load("gough-stewart-b", symbols=ALL))
    assert {i: own[1:] for i, own in found.items() if not own[2]} == {
        2: ("1/3", False),
        4: ("2/3", False),
    }
    assert sorted(i for i, own in found.items() if own[2]) == [1, 3, 5]
    assert {first for first, *_ in found.values()} == {0}


@pytest.mark.parametrize("name", ["gough-stewart-b", "3-rrr", "3-upu", "3-puu", "hexapod"])
def test_a_turned_leg_that_is_closed_by_itself_holds_as_the_image_of_the_first(name):
    robot = rs.load(name, symbols=ALL)
    placed, each = legs_of(robot)
    rows = np.array(placed.entries.space.rows)
    assert images(robot)
    for i, (first, way) in images(robot).items():
        T = way.of(np.eye(6)).T[np.ix_(rows, rows)]
        image = T @ stiffness_of(each[first]) @ T.T
        assert each[first].redundant == each[i].redundant
        assert np.max(np.abs(image - stiffness_of(each[i]))) < 1e-12 * np.max(np.abs(image))


def test_legs_that_differ_in_the_tenth_digit_or_in_their_working_mode_are_no_turns():
    robot = rs.load("3-rrr", symbols=ALL)
    assert turned(robot) == {1: (0, "1/3", False), 2: (0, "2/3", False)}
    first, second, third = robot.legs
    assert turned(replace(robot, legs=(first, replace(second, elbow=rs.Elbow.MINUS), third))) == {}
    x, y, z = second.base.p
    nearly = replace(second.base, p=np.array([x * (1 + sp.Rational(1, 10**10)), y, z]))
    assert turned(replace(robot, legs=(first, replace(second, base=nearly), third))) == {}


def test_legs_that_are_alike_at_the_values_of_the_model_alone_are_no_turns(monkeypatch):
    monkeypatch.setattr(agreement, "SPREADS", (0.0,))
    robot = rs.load("gough-stewart-b", symbols=ALL)
    R, other = sp.Symbol("R", positive=True), sp.Symbol("other", positive=True)
    first, second, *others = robot.legs
    base = replace(second.base, p=np.array([sp.sympify(x).subs(R, other) for x in second.base.p]))
    nominal = {**robot.nominal, "other": robot.nominal["R"]}
    robot = replace(robot, legs=(first, replace(second, base=base), *others), nominal=nominal)
    assert other in rs.derive(robot).K.free_symbols


def test_stiffnesses_that_are_equal_in_numbers_alone_are_no_turns(tmp_path):
    """All legs were taken for turns of the first: an error, as the formula and numbers differ."""
    text = robot_file("gough-stewart-b").read_text(encoding="utf-8")
    text = text.replace("  k: 1e8 N/m", "  k: 1e8 N/m\n  soft: 1e8 N/m")
    for i in range(1, 7):
        text = text.replace(f"name: leg{i},", f"name: leg{i}, odd: {int(i == 6)},")
    page = tmp_path / "two-stiffnesses.yaml"
    page.write_text(text.replace("stiffness: k}", "stiffness: k + (soft - k)*odd}"), "utf-8")
    robot = rs.load(page, symbols=ALL)
    assert turned(robot) == {2: (0, "1/3", False), 4: (0, "2/3", False)}
    formula, values = rs.derive(robot), {**robot.nominal, "soft": 3e7}
    K = formula.lambdify()(**{s.name: values[s.name] for s in formula.symbols})
    np.testing.assert_allclose(K, rs.stiffness(robot.substituted(values)).K, rtol=1e-9, atol=1e-3)


def test_springs_on_the_platform_that_do_not_turn_with_their_legs(tmp_path):
    text = robot_file("hexapod").read_text(encoding="utf-8")
    head, mark, tail = text.rpartition("compliance: [1/k_joint, 1/k_joint")
    assert mark
    page = tmp_path / "hexapod.yaml"
    page.write_text(f"{head}compliance: [1/k_joint, 2/k_joint{tail}", encoding="utf-8")
    assert turned(rs.load(page, symbols=ALL)) == {}


def test_mirror_images_count_only_where_all_of_them_are_there():
    robot = rs.load("gough-stewart-b", symbols=ALL)
    found = turned(replace(robot, legs=robot.legs[:5]))
    assert found == {2: (0, "1/3", False), 4: (0, "2/3", False)}


def test_a_leg_that_is_rigid_in_a_direction_is_refused():
    with pytest.raises(rs.InputError, match="meets no compliance"):
        rs.derive(rs.load(FILES / "rigid-across.yaml", symbols=ALL))


WRIST = Path(__file__).parent / "data" / "3-sps-s.yaml"
STEEL_E = 210e9
SETS = 100
DIMENSIONS = {"R": 0.2, "r": 0.12, "h": 0.3, "t": 0.04, "tau": np.radians(20), "k": 2e7}

# A universal joint turns the platform about x, then about y; its point is above the platform.


def by_hand(values: dict[str, float], R_platform: np.ndarray) -> np.ndarray:
    """K of the wrist about its centre: a cantilever that only feels forces, and three struts."""
    R, r, h, t, tau, k = (values[name] for name in ("R", "r", "h", "t", "tau", "k"))
    A, inertia = np.pi * (0.03**2 - 0.022**2), np.pi / 4 * (0.03**4 - 0.022**4)
    bending = 3 * STEEL_E * inertia / h**3
    K = np.diag([bending, bending, STEEL_E * A / h, 0, 0, 0])
    for phi in np.arange(3) * 2 * np.pi / 3:
        b = R_platform @ [r * np.cos(phi + tau), r * np.sin(phi + tau), t]
        d = b - [R * np.cos(phi), R * np.sin(phi), -h]
        u = d / np.linalg.norm(d)
        w = np.concatenate([u, np.cross(b, u)])
        K += k * np.outer(w, w)
    return K


def is_same(a: np.ndarray, b: np.ndarray, size: float = 1e-11) -> bool:
    """Relative to both ends of an entry."""
    ends = np.sqrt(np.diagonal(b))
    return bool(np.all(np.abs(a - b) <= size * np.outer(ends, ends)))


@pytest.fixture(scope="module")
def wrist() -> rs.Robot:
    robot = rs.load(WRIST)
    assert isinstance(robot, rs.Robot)
    return robot


def test_the_wrist_in_symbols_is_what_is_written_by_hand():
    found = rs.derive(str(WRIST), pose=rs.AtSymbols())
    assert found.where == "at alpha, beta, gamma"
    random = np.random.default_rng(3)
    values = {name: x * random.uniform(0.7, 1.4, SETS) for name, x in DIMENSIONS.items()}
    angles = random.uniform(-0.3, 0.3, (SETS, 3))
    values |= dict(zip(("alpha", "beta", "gamma"), angles.T, strict=True))
    K = found.lambdify(*found.symbols)(*(values[str(s)] for s in found.symbols))
    for i, turn in enumerate(Rotation.from_euler("xyz", angles).as_matrix()):
        assert is_same(K[i], by_hand({name: x[i] for name, x in values.items()}, turn))


def test_the_wrist_at_home_needs_no_names_for_its_closure():
    found = rs.derive(str(WRIST))
    assert found.named is not None
    known = {str(d.symbol): str(d.expression) for d in found.named.definitions}
    assert known["L_a"] == "sqrt(d_a**2 + p_a)"
    assert (known["d_a"], known["p_a"]) == ("h + t", "R**2 - 2*R*r*cos(tau) + r**2")
    assert sum(entry == 0 for entry in found.K) == 20


def test_all_ways_agree_at_poses_of_the_wrist(wrist):
    finder = posture_finder(wrist)
    assert isinstance(finder.solvers[0].closed_form, Post)
    poses = np.random.default_rng(1).uniform(-0.3, 0.3, (6, 3))
    result = rs.stiffness(wrist, poses)
    compiled = rs.compile(wrist, backend=rs.Backend.ARRAYS)
    assert compiled.verified
    assert not compiled.takes_joints
    answer = compiled.evaluate(poses)
    assert not answer.guarded.any()
    for i, pose in enumerate(poses):
        expected = by_hand(DIMENSIONS, Rotation.from_rotvec(pose).as_matrix())
        assert is_same(result.K[i], expected)
        assert is_same(answer.values["K"][i], expected)
        network = network_of_snapshot(rs.find_posture(wrist, pose).snapshot.one(0))
        assert is_same(np.asarray(rs.stiffness(network).K), expected, 1e-9)


def test_a_post_holds_one_point_alone(wrist):
    free = replace(wrist, coordinates=ALL_COORDINATES)
    assert rs.find_posture(free, [0, 0, 0.3, 0.1, 0.2, 0.1]).reached.all()
    away = rs.find_posture(free, [0.01, 0, 0.3, 0.1, 0.2, 0.1])
    assert not away.reached.any()
    assert away.shift_gaps[0] == pytest.approx([0.01, 0, 0, 0], abs=1e-12)


def test_a_universal_joint_below_the_platform_moves_it():
    robot = rs.load(FILES / "3-sps-u.yaml")
    assert isinstance(robot, rs.Robot)
    finder = posture_finder(robot)
    assert isinstance(finder.solvers[0].closed_form, Post)
    poses = np.random.default_rng(2).uniform(-0.3, 0.3, (8, 2))
    posture = rs.find_posture(robot, poses)
    assert posture.reached.all()
    for pose, q in zip(posture.pose, posture.coordinates[0], strict=True):
        turn = Rotation.from_euler("XY", q).as_matrix()
        np.testing.assert_allclose(Rotation.from_rotvec(pose[3:]).as_matrix(), turn, atol=1e-12)
        np.testing.assert_allclose(pose[:3], [0, 0, 0.3] - turn @ [0, 0, 0.04], atol=1e-12)
    result, compiled = rs.stiffness(robot, poses), rs.compile(robot, backend=rs.Backend.ARRAYS)
    assert compiled.verified
    for K, expected in zip(compiled.evaluate(poses).values["K"], result.K, strict=True):
        assert is_same(K, expected)


@pytest.mark.parametrize("turn", [0.0, np.pi])
def test_slides_that_come_to_be_parallel(turn):
    robot = rs.load(FILES / "parallel-slides.yaml", symbols=rs.ALL_PARAMETERS)
    K = rs.derive(robot, pose=rs.AtSymbols()).lambdify()
    q = np.array([0.02, turn, 0.05, 1.2])
    at = {**robot.nominal, **{f"q{i + 1}": x for i, x in enumerate(q)}}
    at = {name: at[name] for name in K.arguments}
    numbers = rs.stiffness(robot.numeric, rs.JointCoordinates(q))
    assert numbers.status & rs.Status.REDUNDANT_JOINTS
    assert not K.holds(**at)
    with pytest.raises(rs.NoAnswerError):
        K(**at)
    # Beside it the formula holds.
    q[1] += 1e-3
    expected = rs.stiffness(robot.numeric, rs.JointCoordinates(q)).K
    assert K(**at | {"q2": q[1]}) == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize(("aside", "holds"), [(0.0, False), (1e-3, True)])
def test_a_strut_along_the_first_axis_of_its_universal_joint(aside, holds):
    robot = rs.load("gough-stewart-b-beams", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=rs.AtSymbols())
    K = derivation.lambdify()
    numeric = robot.numeric
    leg = numeric.legs[0]
    along = leg.base.R @ leg.chain.moving[0][0].freedoms[0].axis
    p = leg.base.p + 0.9 * along + [0, 0, aside] - leg.attachment.p
    result = rs.stiffness(numeric, RigidTransform.from_components(p, Rotation.identity()))
    assert bool(result.status & rs.Status.REDUNDANT_JOINTS) is not holds
    at = {**robot.nominal, **dict(zip("xyz", p, strict=True)), "alpha": 0, "beta": 0, "gamma": 0}
    at = {name: at[name] for name in K.arguments}
    assert bool(K.holds(**at)) is holds
    if holds:
        assert K(**at) == pytest.approx(result.K, abs=1e-8 * np.abs(result.K).max())
    words = " ".join(derivation_text(derivation).split())
    assert "the passive joints of each leg are independent" in words


@pytest.mark.parametrize("name", ["tripteron", "t3r1"])
def test_a_positive_length_is_not_zero_where_joints_coincide_there(name):
    # Rail joint and platform joint coincide: numbers have another mobility, K no limit there.
    derivation = rs.derive(name)
    nominal = rs.load(name, symbols=rs.ALL_PARAMETERS).nominal
    K = derivation.lambdify()
    at = {x: nominal[x] for x in K.arguments}
    assert K.holds(**at)
    assert not K.holds(**at | {"d": 0.0})
    assert "Delta_1 = 2*l - d" in derivation_text(derivation)


TRICEPT = Path(__file__).parents[2] / "examples" / "tricept.yaml"
ROBOTS = {TRICEPT: ("R", "h", "k"), "t3r1": rs.ALL_PARAMETERS, "us-ups": rs.ALL_PARAMETERS}


def values_at(robot, formula, pose):
    """Values of all symbols at the closed posture of a pose, and its stiffness in numbers."""
    posture = rs.find_posture(robot.numeric, pose)
    angles = Rotation.from_rotvec(posture.pose[0, 3:]).as_euler("xyz")
    names = "x", "y", "z", "alpha", "beta", "gamma"
    known = {**robot.nominal, **dict(zip(names, (*posture.pose[0, :3], *angles), strict=True))}
    for leg, q in zip(robot.legs, posture.coordinates, strict=True):
        known |= {re.sub(r"\W", "_", f"q_{leg.name}_{j}"): x for j, x in enumerate(q[0], start=1)}
    K = rs.stiffness(robot.numeric, posture.pose[0]).K
    return {s.name: known[s.name] for s in formula.symbols}, K


@pytest.mark.parametrize("name", ROBOTS)
def test_formulas_agree_with_numbers_where_the_legs_close(name):
    robot = rs.load(name, symbols=ROBOTS[name])
    formula = rs.derive(robot, pose=rs.AtSymbols())
    assert any(x.startswith("q_") for x in formula.following)
    space: dict = {}
    exec(python_function(formula), space)  # noqa: S102
    function, numeric = space["stiffness"], robot.numeric
    places = robot.coordinate_places
    home = np.array([*numeric.home.p, 0.0, 0.0, 0.0])[places]
    values: dict = {}
    for shift in np.random.default_rng(3).uniform(-0.02, 0.02, (3, len(places))):
        values, K = values_at(robot, formula, home + shift)
        scale = np.sqrt(np.diag(K))
        assert np.max(np.abs(function(**values) - K) / np.outer(scale, scale)) < 1e-9
    other = next(x for x in formula.following if x.startswith("q_"))
    with pytest.raises(ValueError, match="does not hold"):
        function(**{**values, other: values[other] + 0.1})

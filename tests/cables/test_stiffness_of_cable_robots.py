"""Cable robots: tensions, stiffness, and their response to a load."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.cables import TensionProblem, structure_matrix, weight_wrench, wrench_derivative
from robostiff.spatial import Space, skew
from tests.cables.machines import answered, random_robot, slack_event

STATUS = rs.Status


def test_without_tension_cables_hold_by_stretching_alone():
    robot = random_robot(0, weight=False)
    cables = tuple(replace(cable, least_tension=0.0) for cable in robot.cables)
    loose = rs.stiffness(replace(robot, cables=cables))
    assert loose.status == STATUS.UNTENSIONED
    np.testing.assert_allclose(loose.tensions, 0, atol=1e-12)
    W = structure_matrix(loose.placed)
    exact = W @ np.diag(loose.axial) @ W.T
    np.testing.assert_allclose(loose.K, exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())
    np.testing.assert_allclose(loose.taut_stiffness, 0, atol=1e-12)


def test_a_wrench_that_is_held_changes_by_its_derivative():
    robot = rs.load("cable-8")
    result = rs.cable_stiffness(robot, None, [20.0, -10, 30, 1, 2, -1])
    start, weight = result.reference_point, robot.weight
    assert weight is not None

    def held(d: np.ndarray) -> np.ndarray:
        R = Rotation.from_rotvec(d[3:]).as_matrix()
        forces = [(np.zeros(3), np.asarray(weight.force))]
        for cable, tension, k in zip(robot.cables, result.tensions, result.axial, strict=True):
            arm, before = R @ cable.attachment, cable.exit_point - start - cable.attachment
            v = cable.exit_point - start - d[:3] - arm
            length = np.linalg.norm(v)
            stretched = k * (length - np.linalg.norm(before))
            forces.append((arm, (tension + stretched) * v / length))
        return -np.sum([np.append(f, np.cross(arm, f)) for arm, f in forces], axis=0)

    h = 1e-6
    rates = np.stack([held(h * e) - held(-h * e) for e in np.eye(6)], axis=1) / (2 * h)
    derivative = wrench_derivative(result.K, held(np.zeros(6)))
    np.testing.assert_allclose(derivative, rates, atol=1e-9 * np.abs(rates).max())
    assert np.abs(result.K - rates).max() > 0.5  # of the moment


def test_another_point_is_the_matrix_of_a_robot_with_that_reference_point():
    robot = rs.load("cable-8")
    tensions = rs.GivenTensions(np.linspace(60, 130, 8))  # held by others too
    offset = np.array([0.2, -0.1, 0.4])
    other = rs.cable_stiffness(replace(robot, reference_point=offset), tensions=tensions)
    moved = rs.cable_stiffness(robot, tensions=tensions, at=robot.home.p + offset)
    np.testing.assert_allclose(moved.K, other.K, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(moved.missing_wrench, other.missing_wrench, atol=1e-9)


def test_a_small_load_moves_a_platform_that_others_hold_as_its_stiffness_says():
    """Given tensions that do not balance: a moment M that others hold adds -skew(M) / 2 to K."""
    robot, rule = random_robot(2), rs.GivenTensions(np.full(8, 300.0))
    found = rs.cable_stiffness(robot, tensions=rule)
    K = found.K.copy()
    K[3:, 3:] -= 0.5 * skew(found.missing_wrench[3:])
    for F in 1e-2 * np.eye(6):
        ends: list[Any] = [
            rs.cable_response(robot, wrench=s * F, tensions=rule).displacement for s in (1, -1)
        ]
        moved = 0.5 * np.subtract(*ends)
        np.testing.assert_allclose(K @ moved, F, rtol=0, atol=1e-7)


def test_the_matrix_of_a_plane_is_part_of_that_in_space():
    robot = rs.load("cable-4-planar")
    plane = rs.cable_stiffness(robot)
    tensions = rs.GivenTensions(plane.tensions)
    space = rs.cable_stiffness(replace(robot, space=Space.SPATIAL), tensions=tensions)
    rows = np.ix_([0, 1, 5], [0, 1, 5])
    np.testing.assert_allclose(space.K[rows], plane.K, rtol=1e-12, atol=1e-9)


def test_millimetres_decide_like_metres():
    robot = rs.load("cable-3-suspended")
    assert robot.weight is not None
    for factor in (1e-3, 1e3):
        scaled = replace(
            robot,
            cables=tuple(
                replace(c, exit_point=factor * c.exit_point, attachment=factor * c.attachment)
                for c in robot.cables
            ),
            home=rs.Frame(np.eye(3), factor * robot.home.p),
            weight=replace(robot.weight, point=factor * robot.weight.point),
        )
        result = rs.stiffness(scaled)
        assert (result.status, int(result.rank), int(result.held_rank)) == (STATUS.OK, 6, 3)


def test_platform_hung_in_its_centre_of_mass_is_free_to_turn():
    rope = rs.Cable("rope", [0, 0, 1], [0, 0, 0], EA=1e5)
    robot = rs.CableRobot("plumb", (rope,), rs.Frame.identity(), rs.Weight([0, 0, -100]))
    result = rs.stiffness(robot)
    assert result.status == STATUS.FREE_MOTIONS
    assert (int(result.rank), int(result.held_rank)) == (3, 1)
    motions = [str(motion) for motion in result.free_motions]
    assert motions == [f"rotation about {axis} through (0, 0, 0) m" for axis in "xyz"]
    assert result.compliance is None


def test_weight_below_steadies_and_weight_above_topples():
    """A pendulum with its mass c below the eye: K_rx = F c; above it, -F c."""
    rope = rs.Cable("rope", [0, 0, 1], [0, 0, 0], EA=1e5)
    for c in (-0.2, 0.2):
        weight = rs.Weight([0, 0, -100], [0, 0, c])
        result = rs.stiffness(rs.CableRobot("pendulum", (rope,), rs.Frame.identity(), weight))
        # The eye moves sideways: two pendulums in series.
        assert result.K[3, 3] == pytest.approx(-100 * c)
        assert (STATUS.UNSTABLE in result.status) == (c > 0)
        assert len(result.unstable_motions) == (2 if c > 0 else 0)


def test_crossed_tension_topples_a_platform_and_is_reported():
    """Turning a bar pulled across itself: elastic only along the cables, geometric negative."""
    exits, ends = np.array([[1.0, 0, 0], [-1, 0, 0]]), np.array([[-0.2, 0, 0], [0.2, 0, 0]])
    cables = tuple(
        rs.Cable(f"c{i}", exits[i], ends[i], EA=1e5, least_tension=100) for i in range(2)
    )
    robot = rs.CableRobot("bar", cables, rs.Frame.identity(), space=Space.PLANAR)
    result = rs.stiffness(robot)
    assert result.status == STATUS.UNSTABLE
    assert result.rank == 3
    assert str(result.unstable_motions[0]) == "rotation about z through (0, 0, 0) m"
    assert result.K[2, 2] == pytest.approx(2 * 100 * (0.04 / 1.2 - 0.2))


def test_winch_is_in_series():
    rope = rs.Cable("rope", [0, 0, 2], [0, 0, 0], EA=1e4, guide_length=3.0, winch_stiffness=500.0)
    robot = rs.CableRobot("pendulum", (rope,), rs.Frame.identity())
    result = rs.stiffness(robot)
    assert result.axial[0] == pytest.approx(1 / (5 / 1e4 + 1 / 500))
    soft = replace(rope, EA=None)
    assert rs.stiffness(replace(robot, cables=(soft,))).axial[0] == pytest.approx(500)


def test_nearest_tensions_of_fewer_cables_than_freedoms():
    robot = rs.load("cable-3-suspended")
    answer = rs.cable_tensions(robot)
    np.testing.assert_allclose(answer.tensions, 100 * np.sqrt(0.8**2 + 2**2) / 2, rtol=1e-12)
    assert rs.cable_tensions(robot, wrench=[1, 0, 0, 0, 0, 0]).status == STATUS.INFEASIBLE


def test_closed_form_is_the_nearest_where_no_limit_is_met():
    robot = rs.load("cable-8")
    closed = rs.cable_tensions(robot, tensions=rs.ClosedFormTensions(0.5))
    nearest = rs.cable_tensions(robot, tensions=rs.NearestTensions(0.5))
    np.testing.assert_allclose(closed.tensions, nearest.tensions, rtol=1e-9)


def test_closed_form_answers_within_limits_or_says_so():
    robot = rs.load("cable-8")
    rng = np.random.default_rng(1)
    poses = [0, 0, 1, 0, 0, 0] + rng.uniform(-1, 1, (400, 6)) * [1.8, 1.3, 0.9, 0.1, 0.1, 0.1]
    closed = rs.cable_tensions(robot, poses, tensions=rs.ClosedFormTensions())
    nearest = rs.cable_tensions(robot, poses, tensions=rs.NearestTensions(0.5))
    failed = (closed.status_codes & STATUS.FORM_DOES_NOT_HOLD) > 0
    assert (closed.feasible | failed).tolist() == nearest.feasible.tolist()
    assert closed.feasible.sum() > 50
    t = closed.values[closed.feasible]
    assert (t > 50 - 1e-6).all()
    assert (t < 720 + 1e-6).all()
    result = rs.cable_stiffness(robot, poses[closed.feasible], tensions=rs.ClosedFormTensions())
    assert np.abs(result.missing_wrench).max() < 1e-6


@pytest.mark.parametrize("level", [0.0, 0.3, 1.0])
def test_tensions_balance_weight_and_wrench(level):
    robot, wrench = rs.load("cable-8"), [30.0, -20, 50, 1, 0.5, -0.3]
    result = rs.cable_stiffness(robot, wrench=wrench, tensions=rs.NearestTensions(level))
    np.testing.assert_allclose(result.missing_wrench, 0, atol=1e-9)


def test_given_tensions_that_do_not_balance_are_said_to():
    robot = rs.load("cable-4-planar")
    result = rs.cable_stiffness(robot, tensions=rs.GivenTensions([100, 100, 100, 100.0]))
    assert result.status == STATUS.UNBALANCED
    np.testing.assert_allclose(result.missing_wrench, [0, 20, 0], atol=1e-9)
    balanced = rs.GivenTensions(rs.cable_tensions(robot).tensions)
    assert rs.cable_stiffness(robot, tensions=balanced).status == STATUS.OK
    beyond = rs.cable_stiffness(robot, tensions=rs.GivenTensions([1000, 100, 100, 100.0]))
    assert STATUS.BEYOND_LIMITS in beyond.status


def test_tensions_of_the_file_are_used():
    robot = random_robot(3)
    t = rs.cable_tensions(robot, wrench=np.zeros(6), tensions=rs.NearestTensions())
    assert t.rule == "nearest"
    given = replace(robot, cables=tuple(replace(c, tension=77.0) for c in robot.cables))
    assert rs.cable_tensions(given).values.tolist() == [77.0] * 8


def test_pose_without_tensions_is_a_status_and_its_numbers_an_exception():
    robot = rs.load("cable-8")
    poses = [[0, 0, 1, 0, 0, 0], [0, 0, 3.0, 0, 0, 0], [1.94, 1.44, 2, 0, 0, 0]]
    result = rs.stiffness(robot, poses)
    assert [str(rs.Status(int(c))) for c in result.status_codes] == [
        "ok",
        "infeasible",
        "unreachable",
    ]
    assert result.answered.tolist() == [True, False, False]
    assert result.rank.tolist() == [6, -1, -1]
    assert np.isfinite(result[result.answered].K).all()


@pytest.mark.parametrize("seed", [5, 52, 76])
def test_closed_form_takes_no_rounding_at_a_limit_for_a_violation(seed):
    """Without a load tensions of zero lie at their limits, in a batch as at each pose."""
    robot = random_robot(seed, 9, weight=False)
    loose = tuple(replace(own, least_tension=0.0) for own in robot.cables)
    robot = replace(robot, cables=loose)
    poses = np.random.default_rng(seed).uniform(-0.5, 0.5, (40, 6))
    rule = rs.ClosedFormTensions(0.5)
    whole = rs.cable_tensions(robot, poses, tensions=rule)
    for pose, code in zip(poses, whole.status_codes, strict=True):
        assert int(rs.cable_tensions(robot, pose, tensions=rule).status) == code


@pytest.mark.parametrize(
    ("name", "load"),
    [
        ("cable-8", [0, 0, -200, 0, 0, 0]),
        ("cable-8", [100, -50, 30, 1, 2, -1]),
        ("cable-8-suspended", [0, 300, -1000, 50, 0, 80]),
        ("cable-4-planar", [30, -100, 2]),
        ("cable-3-suspended", [50, 20, 0, 0, 0, 0]),
    ],
)
def test_forces_balance_under_the_load(name, load):
    response = rs.cable_response(rs.load(name), wrench=load)
    after = answered(response)
    pulled = structure_matrix(after.placed) @ response.tensions + weight_wrench(after.placed)
    np.testing.assert_allclose(pulled + np.array(load), 0, atol=1e-7)
    assert (response.tensions >= 0).all()
    zero = {name for name, t in zip(after.cable_names, response.tensions, strict=True) if t == 0}
    assert zero == set(response.slack)
    assert (STATUS.SLACK in response.status) == bool(response.slack)
    k, stretched = response.before.axial, after.placed.lengths - response.before.placed.lengths
    law = np.maximum(0, response.before.tensions + k * stretched)
    np.testing.assert_allclose(response.tensions, law, atol=1e-7)


@pytest.mark.parametrize(
    ("name", "load"),
    [
        ("cable-8", [0, 0, -200, 0, 0, 0]),
        ("cable-4-planar", [0, -100, 0]),
        ("cable-3-suspended", [50, 0, 0, 0, 0, 0]),
    ],
)
def test_first_slack_is_where_a_cable_loses_its_tension(name, load):
    robot, load = rs.load(name), np.array(load, dtype=float)
    event = slack_event(rs.cable_response(robot, wrench=load))
    below = rs.cable_response(robot, wrench=(event.factor - 1e-3) * load)
    above = rs.cable_response(robot, wrench=(event.factor + 1e-3) * load)
    assert below.slack == ()
    assert event.cable in above.slack
    i = answered(above).cable_names.index(event.cable)
    assert 0 < below.tensions[i] < 1e-2 * below.tensions.max()


def test_slack_cable_is_as_good_as_cut():
    robot = rs.load("cable-8")
    load = [0, 0, -300.0, 0, 0, 0]
    whole = rs.cable_response(robot, wrench=load)
    assert whole.slack == ("cable5", "cable6", "cable7", "cable8")
    taut = answered(whole).axial > 0
    W = structure_matrix(answered(whole).placed)[:, taut]
    elastic = W @ np.diag(answered(whole).axial[taut]) @ W.T
    np.testing.assert_allclose(answered(whole).elastic, elastic, atol=1e-9)
    # Four cables, two freedoms of the pendulum left to their tension.
    assert answered(whole).held_rank == 4
    assert answered(whole).rank == 6


def test_free_and_unstable_platforms_do_not_answer():
    rope = rs.Cable("rope", [0, 0, 1], [0, 0, 0], EA=1e5)
    for weight in (rs.Weight([0, 0, -100]), rs.Weight([0, 0, -100], [0, 0, 0.2])):
        robot = rs.CableRobot("plumb", (rope,), rs.Frame.identity(), weight)
        response = rs.cable_response(robot, wrench=[1, 0, 0, 0, 0, 0])
        assert STATUS.NO_EQUILIBRIUM in response.status
        assert response.carried == 0


def test_infeasible_pose_has_no_response():
    response = rs.cable_response(rs.load("cable-8"), [0, 0, 3, 0, 0, 0], wrench=[1, 0, 0, 0, 0, 0])
    assert response.status == STATUS.INFEASIBLE
    assert not response.has_answer

    lack = rs.cable_tensions(rs.load("cable-8"), [0, 0, 3, 0, 0, 0]).advice[0]
    assert response.advice[0] == lack
    assert "N or more beyond limits" in lack


@pytest.mark.parametrize("name", ["cable-8", "cable-8-suspended", "cable-4-planar"])
def test_infeasible_tensions_say_by_how_much_limits_are_missed(name):
    """With limits moved by so much there are tensions, found by another method, and not before."""
    robot = rs.load(name)
    force = 3 * float(np.max(robot.tension_limits[1]))
    for wrench in force * np.eye(robot.space.size)[: robot.space.translations]:
        answer = rs.cable_tensions(robot, wrench=wrench)
        assert answer.status == STATUS.INFEASIBLE
        missed = float(answer.advice[0].split(" are ")[1].split(" N ")[0])
        W = structure_matrix(answer.placed)[None]
        F = (wrench + weight_wrench(answer.placed))[None]
        least, greatest = robot.tension_limits
        for moved, status in ((0.998 * missed, STATUS.INFEASIBLE), (1.002 * missed, STATUS.OK)):
            problem = TensionProblem(W, F, least - moved, greatest + moved, level=0.0)
            assert rs.NearestTensions().choose(problem)[1] == [int(status)]


def test_a_wrench_that_no_tensions_balance_is_named():
    answer = rs.cable_tensions(rs.load("cable-3-suspended"), wrench=[0, 0, 0, 0, 0, 9])
    assert "that no tensions balance" in answer.advice[0]


def test_imbalance_before_the_load_is_held_by_others():
    robot = random_robot(2)
    rule = rs.GivenTensions(np.full(8, 300.0))
    response = rs.cable_response(robot, wrench=[0, 0, 0, 0, 0, 0], tensions=rule)
    assert response.displacement is not None
    np.testing.assert_allclose(response.displacement, 0, atol=1e-12)
    assert STATUS.UNBALANCED in response.status


def test_tensions_beyond_their_limits_are_named():
    response = rs.cable_response(rs.load("cable-8"), wrench=[20, 10, -50, 0, 0, 0])
    low = [i for i, t in enumerate(response.tensions) if t < 50]
    assert STATUS.BEYOND_LIMITS in response.status
    assert len(low) == 4
    for i, advice in zip(low, response.advice, strict=False):
        assert advice.startswith(f"the tension of 'cable{i + 1}' is {response.tensions[i]:.5g} N")
        assert "outside its limits 50 to 720 N" in advice

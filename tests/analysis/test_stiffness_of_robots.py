"""Stiffness of whole robots: points, batches, sums of legs, misuse, poses without an answer."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import Actuated, Chain, Joint, Locked
from tests.cases.metric import distance
from tests.generators.chains import FreeChain, random_beam, random_joint, snapshot_of
from tests.generators.machines import case_b, elbow_arm, five_bar

POSE = np.array([0.03, -0.02, 0.62, 0.1, -0.15, 0.2])


def test_methods_that_refuse_say_why():
    default = rs.stiffness(case_b(), POSE)
    assert distance(rs.stiffness(case_b(), POSE, method=rs.SaddlePoint()).K, default.K) <= 1e-9
    # beam legs and oblique joints: the index rules do not hold
    refused = rs.stiffness(case_b(), POSE, method=rs.IndexRules())
    assert rs.Status.FORM_DOES_NOT_HOLD in refused.status
    with pytest.raises(rs.NoAnswerError, match="oblique"):
        _ = refused.K
    assert any(line.startswith("index-rules: ") for line in refused.advice)
    # two beams of a serial arm: nothing to eliminate
    arm = rs.stiffness(elbow_arm(drives=None, elastic_links=True), method=rs.Block())
    assert distance(arm.K, rs.stiffness(elbow_arm(drives=None)).K) <= 1e-9


def test_singular_poses_are_never_nan():
    """Case B turned by 90 degrees about its axis is singular, and the way there is smooth."""
    turns = np.linspace(0, np.pi / 2, 41)
    poses = np.stack([np.array([0, 0, 0.6, 0, 0, a]) for a in turns])
    result = rs.stiffness(case_b(), poses)
    assert np.isfinite(result.K).all()
    assert int(result[0].rank) == 6
    exact = [int(rank) for rank in result.rank]
    assert exact[-1] == 5
    assert all(rank == 6 for rank in exact[:-1])
    assert len(result[-1].free_motions) == 1
    close = rs.stiffness(case_b(), [0, 0, 0.6, 0, 0, np.pi / 2 - 1e-7])
    assert rs.Status.ILL_CONDITIONED in close.status
    assert np.isfinite(close.K).all()


FREE = {
    "delta": ([0, 0, -0.6, 0, 0, 0.17], "x y z"),
    "3-prs": ([0.1, 0, 0, 0.4, 0.1, 0], "z rx ry"),
}


@pytest.mark.parametrize(("name", "pose", "names"), [(k, *own) for k, own in FREE.items()])
def test_a_pose_of_six_coordinates_whose_free_ones_are_reached_says_so(name, pose, names):
    robot = rs.load(name)
    places = robot.coordinate_places
    advice = f"the robot has the free coordinates {names}: give these, the others follow"
    result = rs.stiffness(robot, pose)
    assert result.advice[0] == advice
    assert "falls short" in result.advice[1]
    with pytest.raises(rs.NoAnswerError, match=advice):
        _ = result.K
    assert rs.stiffness(robot, np.array(pose)[places]).answered


@pytest.mark.parametrize("pose", [[0, 0, -1.6, 0, 0, 0.1], [0, 0, -1.6]])
def test_free_coordinates_that_are_not_reached_either_are_no_advice(pose):
    result = rs.stiffness(rs.load("delta"), pose)
    assert "falls short" in result.advice[0]
    assert not any("free coordinates" in own for own in result.advice)


def test_unreachable_poses():
    robot = five_bar()
    far = rs.stiffness(robot, [0.0, 1.5, 0, 0, 0, 0])
    assert far.status == rs.Status.UNREACHABLE
    assert far.free_motions == ()
    assert far.compliance is None
    with pytest.raises(rs.NoAnswerError, match=r"leg 'left' falls short of the pose by 529\.7 mm"):
        _ = far.K
    with pytest.raises(rs.NoAnswerError):
        _ = far.leg_stiffness
    with pytest.raises(rs.NoAnswerError, match="falls short"):
        far.required_compliance()
    batch = rs.stiffness(robot, [[0.0, 0.8, 0, 0, 0, 0], [0.0, 1.5, 0, 0, 0, 0]])
    assert batch.answered.tolist() == [True, False]
    assert np.isfinite(batch[batch.answered].K).all()
    with pytest.raises(rs.NoAnswerError, match=r"1 of 2 poses, the first being \(1,\)"):
        _ = batch.K


def test_beyond_limits_there_is_a_matrix_to_be_used_with_care():
    result = rs.stiffness(case_b(limits=(0.3, 0.6)), [0, 0, 0.9, 0, 0, 0])
    assert result.status == rs.Status.BEYOND_LIMITS
    assert np.isfinite(result.K).all()
    assert "outside its limits 300 to 600 mm" in result.complaints[0]


def test_arm_with_elastic_drives_only_has_a_compliance_but_no_stiffness():
    """Five drives: compliance of rank 5, one direction rigid."""
    arm = elbow_arm(elastic_links=False)
    elements = list(arm.legs[0].chain.elements)
    elements = [
        replace(e, role=Locked()) if isinstance(e, Joint) and e.name == "j6" else e
        for e in elements
    ]
    stiffened = replace(arm, legs=(replace(arm.legs[0], chain=Chain(tuple(elements))),))
    result = rs.stiffness(stiffened)
    assert rs.Status.RIGID_DIRECTION in result.status
    with pytest.raises(rs.NoAnswerError, match="without meeting any compliance"):
        _ = result.K
    (w,) = result.rigid_directions
    C = result.required_compliance()
    assert np.linalg.matrix_rank(C, tol=1e-12) == 5
    assert np.abs(C @ w).max() <= 1e-12 * np.abs(C).max() * np.abs(w).max()
    moved = rs.stiffness(stiffened, at=[0.4, -0.3, 0.2])
    (w_there,), C_there = moved.rigid_directions, moved.required_compliance()
    assert np.abs(C_there @ w_there).max() <= 1e-12 * np.abs(C_there).max() * np.abs(w_there).max()


def test_a_snapshot_has_its_own_pose():
    rng = np.random.default_rng(5)
    snapshot = snapshot_of(
        [FreeChain((random_beam(rng),), (random_joint(rng),), np.zeros(3))], np.zeros(3)
    )
    result = rs.stiffness(snapshot)
    assert result.pose is None
    assert int(result.rank) == 5


HEXAPOD = rs.load("hexapod")
TILTED = [0.06, 0.02, 0.9, 0, 0.1, 0]


def test_read_only_and_broadcast_poses_are_fine():
    poses = np.broadcast_to(TILTED, (4, 6))
    np.testing.assert_allclose(rs.stiffness(HEXAPOD, poses).K[3], rs.stiffness(HEXAPOD, TILTED).K)


def test_a_far_reference_point_changes_no_rank_and_no_status():
    robot = rs.load("gough-stewart-b-beams")
    near = rs.stiffness(robot)
    for away in (1e2, 1e4, 1e6):
        far = rs.stiffness(replace(robot, reference_point=np.array([away, 0, 0])))
        assert str(far.status) == "ok"
        assert int(far.rank) == 6
        np.testing.assert_allclose(far.K[:3, :3], near.K[:3, :3], rtol=1e-9, atol=1e-3)


def test_free_motions_described_from_far_away_are_the_same():
    robot = rs.load("gough-stewart-a")
    words = [str(motion) for motion in rs.stiffness(robot, at=[0, 0, 1e8]).free_motions]
    assert words == [f"rotation about {axis} through (0, 0, 2) m" for axis in "xyz"]


def test_stiffnesses_too_far_apart_are_said_to_be():
    robot = rs.load("gough-stewart-b")
    chain = robot.legs[0].chain
    stiff = tuple(
        replace(e, role=Actuated(1e24)) if e.name == "actuator" and isinstance(e, Joint) else e
        for e in chain.elements
    )
    leg = replace(robot.legs[0], chain=replace(chain, elements=stiff))
    result = rs.stiffness(replace(robot, legs=(leg, *robot.legs[1:])))
    assert "ill-conditioned" in str(result.status)

"""Coordinates follow home: its turn, its sign, its assembly mode and its spin."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.kinematics import place_chain
from robostiff.model import Coordinate, Element
from robostiff.spatial import Frame, Space
from tests.generators.elements import ROD, STEEL

FREE = rs.Passive()
DRIVE = rs.Actuated(1e7)
TURN = 2 * np.pi


def hexapod_below() -> rs.Robot:
    """Its platform hangs below the base, and its slides point up: their lengths are negative."""
    legs = []
    for i in range(6):
        base, top = np.radians(60 * i), np.radians(60 * i + (25 if i % 2 else -25))
        chain = rs.Chain(
            (
                rs.universal([1, 0, 0], [0, 1, 0], FREE),
                rs.prismatic([0, 0, 1], rs.Actuated(1e7, limits=(-1.2, -0.5)), home=[-0.8]),
                rs.spherical(FREE),
            )
        )
        at = 0.5 * np.array([np.cos(base), np.sin(base), 0.0])
        on = 0.3 * np.array([np.cos(top), np.sin(top), 0.0])
        legs.append(rs.Leg(f"leg{i}", Frame(np.eye(3), at), chain, Frame(np.eye(3), on)))
    return rs.Robot("below", tuple(legs), home=Frame(np.eye(3), np.array([0.0, 0.0, -0.8])))


def test_a_slide_of_negative_home_stays_negative_and_within_its_limits():
    robot = hexapod_below()
    result = rs.stiffness(robot)
    assert result.status is rs.Status.OK
    lengths = []
    for leg in robot.legs:
        lengths.append(np.linalg.norm(leg.base.p - leg.attachment.p - [0, 0, -0.8]))
        assert np.isclose(result.joint_coordinates[leg.name][2], -lengths[-1], rtol=1e-14)
    # the textbook K = J^T k J of a hexapod with stiff drives
    J = []
    for leg, length in zip(robot.legs, lengths, strict=True):
        B = leg.attachment.p - np.array([0, 0, 0.8])
        d = (B - leg.base.p) / length
        J.append(np.concatenate([d, np.cross(leg.attachment.p, d)]))
    J = np.array(J)
    assert np.allclose(result.K, 1e7 * J.T @ J, rtol=0, atol=1e-12 * np.abs(result.K).max())


def planar_crank(limits: tuple[float, float], home: float) -> rs.Robot:
    legs = []
    for i in range(3):
        turn = Rotation.from_euler("z", 2 * np.pi / 3 * i).as_matrix()
        chain = rs.Chain(
            (
                rs.revolute([0, 0, 1], rs.Actuated(1e4, limits=limits), home=[home]),
                rs.Rigid(Frame(np.eye(3), np.array([0.5, 0, 0]))),
                rs.revolute([0, 0, 1], FREE, home=[0.0]),
                rs.Rigid(Frame(np.eye(3), np.array([0.6, 0, 0]))),
                rs.revolute([0, 0, 1], FREE),
            )
        )
        base, on = turn @ [1.0, 0, 0], turn @ [0.1, 0, 0]
        legs.append(rs.Leg(f"leg{i}", Frame(turn, base), chain, Frame(np.eye(3), on)))
    return rs.Robot(
        "cranks",
        tuple(legs),
        home=Frame.identity(),
        coordinates=(Coordinate.X, Coordinate.Y, Coordinate.RZ),
        space=Space.PLANAR,
    )


def test_a_crank_is_reported_on_the_turn_of_its_home():
    # law of cosines: from the base the end is 0.9 away, straight towards the centre
    bend = np.degrees(np.arccos((0.5**2 + 0.9**2 - 0.6**2) / (2 * 0.5 * 0.9)))
    stiffnesses = []
    for limits, home, expected in (
        ((100, 300), 200, 180 + bend),
        ((-260, -60), -160, -180 + bend),
        ((460, 660), 560, 540 + bend),
        ((100, 300), 160, 180 - bend),
    ):
        robot = planar_crank(tuple(np.radians(limits)), np.radians(home))
        result = rs.stiffness(robot)
        assert result.status is rs.Status.OK, result.advice
        for q in result.joint_coordinates.values():
            assert np.isclose(np.degrees(q[0]), expected, rtol=1e-12)
        stiffnesses.append(result.K)
        if home != 560:
            continue
        poses = np.array([[0.0, 0.0, 0.0], [0.01, 0.02, 0.03]])
        answer = rs.compile(robot).evaluate(poses)
        assert not np.any(answer.status_codes)
        assert not np.any(answer.guarded)
        assert np.allclose(answer.values["K"], rs.stiffness(robot, poses).K, rtol=1e-10)
    assert np.allclose(stiffnesses[0], stiffnesses[1], rtol=1e-12)
    assert np.allclose(stiffnesses[0], stiffnesses[2], rtol=1e-11)


def test_limits_wider_than_a_turn_keep_the_turn_of_home_where_they_can():
    chain = planar_crank((-4.0, 4.0), 3.0).legs[0].chain
    leg = rs.Leg("leg", Frame.identity(), chain, Frame.identity())
    q = np.array([[4.0, 0.5, 0.0], [2.5, 0.5, 0.0], [-2.5, 0.5, 0.0]])
    placed = place_chain(chain, q, np.eye(3), np.zeros(3))
    robot = rs.Robot(
        "crank",
        (leg,),
        home=Frame(*_frame_at(chain, np.array([3.0, 0.5, 0.0]))),
        coordinates=(Coordinate.X, Coordinate.Y, Coordinate.RZ),
        space=Space.PLANAR,
    )
    turn = np.arctan2(placed.R[:, 1, 0], placed.R[:, 0, 0])
    poses = np.stack([placed.p[:, 0], placed.p[:, 1], turn], axis=-1)
    posture = rs.find_posture(robot, poses)
    # -2.5 and 3.78 are one angle, and both within limits: the one nearer to home is reported
    expected = np.array([4.0, 2.5, TURN - 2.5])
    assert np.allclose(posture.coordinates[0][:, 0], expected, atol=1e-12)
    assert posture.within_limits.all()


def _frame_at(chain: rs.Chain, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    placed = place_chain(chain, q, np.eye(3), np.zeros(3))
    return placed.R, placed.p


def _alone(chain: rs.Chain) -> rs.Robot:
    leg = rs.Leg("leg", Frame.identity(), chain, Frame.identity())
    return rs.Robot("alone", (leg,), home=Frame(*_frame_at(chain, chain.home)))


@pytest.mark.parametrize("letters", ["SPS", "SCS", "UCS", "SCU", "PSS"])
def test_a_spin_that_nothing_determines_stays_as_at_home(letters: str):
    random = np.random.default_rng([*letters.encode()])
    joints: dict[str, Element] = {}
    for name in "AB":
        joints["S" + name] = rs.spherical(FREE, home=random.normal(size=3).tolist())
        joints["U" + name] = rs.universal([1, 0.2, 0], [0, 1, 0.3], FREE, home=[1.9, -0.4])
    z = np.array([0.0, 0.0, 1.0])
    flat = rs.beam_link(0.3 * z, STEEL, ROD)
    if letters[0] == "P":
        slide = rs.prismatic([1, 0, 0], DRIVE, home=[0.2])
        chain = rs.Chain((slide, joints["SA"], flat, joints["SB"]))
    else:
        slide = rs.prismatic(z, DRIVE, home=[0.5])
        if letters[1] == "C":
            slide = rs.cylindrical(z, DRIVE, home=[0.5, 0.7])
        chain = rs.Chain((joints[letters[0] + "A"], slide, flat, joints[letters[2] + "B"]))
    q = rs.find_posture(_alone(chain)).coordinates[0][0]
    assert np.allclose(q, chain.home, atol=1e-9)

"""Which posture answers: working modes, assembly modes, both branches, and turns of home."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.kinematics import place_chain
from robostiff.model import Coordinate, Element
from robostiff.spatial import Frame, Space
from tests.files import FILES
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


def planar_crank(limits: tuple[float, float] | None, home: float) -> rs.Robot:
    """Three cranks with rods; the elbows point where home says."""
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


BAR = rs.Rigid(Frame(np.eye(3), np.array([0, 0, 0.5])), "rod")
UPU = rs.Chain(
    (
        rs.universal([0, 1, 0], [1, 0.3, 0], rs.Passive(), name="A"),
        BAR,
        rs.prismatic([0, 0, 1], rs.Actuated(1e7), name="P"),
        rs.universal([1, 0.2, 0], [0.1, 1, 0.2], rs.Passive(), name="B"),
    )
)
PUU = rs.Chain(
    (
        rs.prismatic([0, 0, 1], rs.Actuated(1e7), name="P"),
        rs.universal([0, 1, 0], [1, 0.2, 0], rs.Passive(), name="A"),
        rs.Rigid(Frame(np.eye(3), np.array([0.6, 0, -0.4])), "rod"),
        rs.universal([1, 0, 0.1], [0, 1, 0], rs.Passive(), name="B"),
    )
)


@pytest.mark.parametrize("chain", [UPU, PUU], ids=["UPU", "PUU"])
def test_poses_of_the_assembly_mode_of_home_are_reached_and_the_others_by_near(chain):
    home = place_chain(chain, chain.home, np.eye(3), np.zeros(3))
    leg = rs.Leg("leg", Frame.identity(), chain, Frame.identity())
    robot = rs.Robot("one leg", (leg,), home=Frame(home.R, home.p))
    q = random_coordinates(chain)
    placed = place_chain(chain, q, np.eye(3), np.zeros(3))
    T = np.tile(np.eye(4), (len(q), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = placed.R, placed.p
    poses = RigidTransform.from_matrix(T)
    posture = rs.find_posture(robot, poses)
    as_home = sign_at_first_joint(chain, q) == sign_at_first_joint(chain, chain.home[None])
    if chain is PUU:  # the slide has two roots as well
        as_home &= root_of_slide(q) == root_of_slide(chain.home[None])
    assert 0.2 < as_home.mean() < 0.8
    assert posture.reached[as_home].all()
    turned = posture.coordinates[0][as_home] - q[as_home]
    assert np.abs(np.sin(turned / 2)).max() < 1e-6
    for i in np.flatnonzero(~as_home)[:40]:
        other = rs.find_posture(robot, poses[i], near=q[i])
        assert other.reached.all()
        assert np.abs(other.coordinates[0][0] - q[i]).max() < 1e-6


def random_coordinates(chain: rs.Chain) -> np.ndarray:
    random = np.random.default_rng(4)
    q = random.uniform(-2.4, 2.4, (300, 5))
    q[:, 2 if chain is UPU else 0] = random.uniform(0.0, 0.3, 300)
    return q


def sign_at_first_joint(chain: rs.Chain, q: np.ndarray) -> np.ndarray:
    """Sign of b.(a x d): first axis a, second axis b, direction d of the rod, in the world."""
    freedoms = place_chain(chain, q, np.eye(3), np.zeros(3)).freedoms
    first, last = (0, 3) if chain is UPU else (1, 3)
    rod = freedoms[last].point - freedoms[first].point
    normal = np.cross(freedoms[first].axis, rod)
    return np.sign(np.einsum("ij,ij->i", freedoms[first + 1].axis, normal))


def root_of_slide(q: np.ndarray) -> np.ndarray:
    """On which side of its slide, along z, the rod of PUU ends."""
    freedoms = place_chain(PUU, q, np.eye(3), np.zeros(3)).freedoms
    return np.sign((freedoms[3].point - freedoms[1].point)[:, 2])


def capaman_poses(count: int, size: float, seed: int) -> np.ndarray:
    """Poses x, y, rz around home, up to some shift [m] and eight times as many radians."""
    return size * np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * [1, 1, 8]


def test_another_assembly_mode_is_no_answer() -> None:
    robot = rs.load("capaman")
    poses = capaman_poses(8, 0.05, 2)
    posture = rs.find_posture(robot, poses)
    away = np.flatnonzero(posture.elsewhere)
    assert 1 <= away.size < 7
    result = rs.stiffness(robot, poses)
    assert np.all(result.status_codes[away] & int(rs.Status.UNREACHABLE))
    one = rs.stiffness(robot, poses[away[0]])
    assert any("another assembly mode" in sentence for sentence in one.advice)
    with pytest.raises(rs.NoAnswerError, match="another assembly mode"):
        _ = one.K
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    answer = compiled.evaluate(poses)
    np.testing.assert_array_equal(answer.status_codes, result.status_codes)
    assert np.isnan(answer.matrix[away]).all()
    assert np.mean(answer.guarded[result.answered]) < 0.2
    ok = result.answered
    K, reference = answer.values["K"][ok], result[ok].K
    scale = np.abs(reference).max(axis=(1, 2), keepdims=True)
    assert np.abs((K - reference) / scale).max() < 1e-9


@pytest.mark.parametrize("aside", [0.03, 0.003, 0.001, 0.0003])
def test_a_way_that_passes_a_singularity_nearby(aside):
    """The end of the rod passes the axis of the table, which turns by half a turn then."""
    found = rs.stiffness(rs.load(FILES / "turntable.yaml"), [-0.12, aside, 0.5, 0, 0, 0])
    assert not found.status.is_bad
    (turn, _, hinge), out = found.joint_coordinates["leg"][:3], np.hypot(0.12, aside)
    np.testing.assert_allclose(turn, np.pi - np.arctan2(aside, 0.12), rtol=1e-12)
    np.testing.assert_allclose(0.5 + 0.5 * np.sin(hinge), out, rtol=1e-12)


@pytest.mark.parametrize(
    "pose", [[0.33705208, 0.18378791, 1.51070903], [0.34707656, -1.38325589, -0.67411408]]
)
def test_the_way_may_lead_through_telescopes_without_length(pose: list[float]) -> None:
    """Where it ends they have one: as on short steps from home, of which none jumps."""
    robot = rs.load("3-rps")
    found, home = rs.find_posture(robot, pose), rs.find_posture(robot)
    assert found.reached.all()
    coordinates = np.concatenate(home.coordinates, axis=1)[0]
    start = home.pose[0, robot.coordinate_places]
    for part in np.linspace(0, 1, 201)[1:]:
        near = rs.find_posture(robot, start + part * (np.array(pose) - start), near=coordinates)
        after = np.concatenate(near.coordinates, axis=1)[0]
        assert np.abs(after - coordinates).max() < 0.3
        coordinates = after
    np.testing.assert_allclose(
        np.concatenate(found.coordinates, axis=1)[0], coordinates, rtol=0, atol=1e-9
    )
    answer = rs.compile(robot, backend=rs.Backend.ARRAYS).evaluate(np.array(pose), again=False)
    assert not answer.guarded
    K = rs.stiffness(robot, pose).K
    np.testing.assert_allclose(answer.matrix, K, rtol=0, atol=1e-10 * np.abs(K).max())

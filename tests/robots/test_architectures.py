"""What theory says of each architecture: freedoms, over-constraint, and laws of its own."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.kinematics import PostureFinder, freedom_twists
from robostiff.model import PlacedBlock, PlacedFreedom, Robot
from robostiff.robots import robot_file
from tests.cases.metric import distance
from tests.robots.test_every_robot import random_poses

# Freedoms of the platform, and by how many wrenches more than needed the legs constrain it: the sum
# over the legs, less the 6 - f that f freedoms leave; and so for every block inside a leg (Gogu,
# Structural Synthesis of Parallel Robots, part 1, 2008).
THEORY = {
    # A leg of six freedoms constrains nothing.
    "hexa": ("x y z rx ry rz", 0),
    "hexaglide": ("x y z rx ry rz", 0),
    "hexapod-pus": ("x y z rx ry rz", 0),
    # A rod constrains by a force along itself, six rods altogether; three drives move them.
    "gantry-tau": ("x y z", 0),
    # A leg constrains by a force through the ball joint, along the crank and across the slide
    # (Ceccarelli 1997). Each parallelogram has the three constraints too many of planar loops.
    "capaman": ("x y rz", 9),
    # A leg of five constrains by one wrench: of a UPU it is a couple across all four axes (Tsai
    # 1996), of an RPS or PRS a force through the ball joint along the hinge (Hunt 1983).
    "3-upu": ("x y z", 0),
    "3-rps": ("z rx ry", 0),
    "3-prs": ("z rx ry", 0),
    # The forces along four US rods meet in a point, where three are needed.
    "us-ups": ("rx ry rz", 1),
    # Legs x, y and turn transmit a couple each and leg z two, where two are needed.
    "t3r1": ("x y z rz", 3),
    # A pair of arms resists a couple for each arm; its hinge passes one of the two on.
    "h4": ("x y z rz", 0),
    # Three forces through the centre a leg, where three are needed.
    "agile-eye": ("rx ry rz", 6),
}


@pytest.mark.parametrize("name", THEORY)
def test_freedoms_and_over_constraint(name):
    expected, surplus = THEORY[name]
    robot = rs.load(name)
    assert " ".join(c.value for c in robot.coordinates) == expected
    finder = PostureFinder(robot)
    posture = finder.find(np.vstack([finder.home_pose, random_poses(name, finder, 5)]))
    assert posture.reached.all()
    for i in range(len(posture.pose)):
        snapshot = posture.snapshot.one(i)
        free, found = freedoms_between(snapshot.legs, snapshot.reference_point)
        assert (free.shape[1], found) == (len(expected.split()), surplus)
    assert (rs.stiffness(robot, posture.pose).rank == 6).all()


def freedoms_between(branches, about):
    """Twists that branches side by side leave between two bodies, and their surplus constraints."""
    held, surplus = [], 0
    for branch in branches:
        columns = []
        for element in branch.elements:
            if isinstance(element, PlacedFreedom):
                columns.append(freedom_twists([element], about))
            elif isinstance(element, PlacedBlock):
                inside, more = freedoms_between(element.branches, about)
                columns.append(inside)
                surplus += more
        held.append(null_space(np.hstack(columns).T, rcond=1e-6))
    wrenches = np.hstack(held)
    free = null_space(wrenches.T, rcond=1e-6)
    return free, surplus + wrenches.shape[1] - (6 - free.shape[1])


UPRIGHT, DIAGONAL = np.array([0, 0, 1.0]), np.ones(3) / np.sqrt(3)


@pytest.mark.parametrize(
    ("name", "along"), [("hexaglide", 0), ("gantry-tau", 0), ("hexapod-pus", 2)]
)
def test_stiffness_is_the_same_all_along_parallel_rails(name, along):
    robot = rs.load(name)
    poses = random_poses(name, PostureFinder(robot), 5)
    moved = poses.copy()
    moved[:, along] += [-0.5, -0.1, 0.01, 0.3, 2.0]
    for K, K_moved in zip(rs.stiffness(robot, poses).K, rs.stiffness(robot, moved).K, strict=True):
        assert distance(K_moved, K) < 1e-11


def test_capaman_stands_as_high_as_its_cranks_on_average():
    finder = PostureFinder(rs.load("capaman"))
    posture = finder.find(random_poses("capaman", finder))
    cranks = np.stack([q[:, 0] for q in posture.coordinates])
    height = (0.09 * np.cos(cranks) + 0.11).mean(axis=0)
    np.testing.assert_allclose(posture.pose[:, 2], height, atol=1e-12)


@pytest.mark.parametrize("name", ["3-rps", "3-prs"])
def test_tilting_platform_sways_by_the_known_formula_and_has_no_torsion(name):
    """Bonev, Geometric Analysis of Parallel Mechanisms, Laval University (2002)."""
    robot, r = rs.load(name), 0.2
    finder = PostureFinder(robot)
    pose = random_poses(name, finder)
    angle, azimuth = np.hypot(pose[:, 3], pose[:, 4]), np.arctan2(-pose[:, 3], pose[:, 4])
    sway = r / 2 * (1 - np.cos(angle))
    np.testing.assert_allclose(pose[:, 0], -sway * np.cos(2 * azimuth), atol=1e-12)
    np.testing.assert_allclose(pose[:, 1], sway * np.sin(2 * azimuth), atol=1e-12)
    np.testing.assert_allclose(pose[:, 5], 0, atol=1e-12)


def radial_upu() -> Robot:
    """The 3-UPU with radial outer axes, at home beside the middle."""
    text = robot_file("3-upu").read_text()
    for old, new in [("turned: 0 deg", "turned: 90 deg"), ("[0, 0, h]", "[80 mm, 30 mm, h]")]:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return model_from_document(parse_document(text))


def test_3_upu_with_radial_axes_turns_freely_all_along_its_middle():
    """There the couples that the legs resist are all vertical; the struts' lines meet."""
    robot = radial_upu()
    assert rs.stiffness(robot).status == rs.Status.OK
    for z in (0.5, 0.65, 0.8):
        result = rs.stiffness(robot, [0, 0, z])
        assert (int(result.rank), result.status) == (4, rs.Status.FREE_MOTIONS)
        apex = z * 0.5 / (0.5 - 0.2)
        for motion in result.free_motions:
            assert motion.screw.is_rotation
            assert motion.screw.axis[2] == pytest.approx(0, abs=1e-9)
            assert motion.screw.point == pytest.approx([0, 0, apex], abs=1e-9)


def test_3_upu_with_radial_axes_is_refused_with_its_home_in_the_middle():
    with pytest.raises(rs.FileError, match="5 freedoms that the legs leave it"):
        rs.load("3-upu", {"turned": "90 deg"})


def test_t3r1_has_one_drive_for_each_translation_and_two_for_its_turn():
    finder = PostureFinder(rs.load("t3r1"))
    pose = random_poses("t3r1", finder)
    x, y, turn, z = (q[:, 0] for q in finder.find(pose).coordinates)
    np.testing.assert_allclose(np.stack([x, y, z], axis=-1), pose[:, :3], atol=1e-12)
    np.testing.assert_allclose(turn - y, 0.15 * np.sin(pose[:, 5]), atol=1e-12)


def test_t3r1_turns_freely_where_its_lever_points_along_the_drive():
    result = rs.stiffness(rs.load("t3r1"), [0, 0, 0, np.pi / 2])
    assert (int(result.rank), result.status) == (5, rs.Status.FREE_MOTIONS)
    (motion,) = result.free_motions
    assert str(motion) == "rotation about z through (0, 0, 0) m"


def test_agile_eye_at_home_has_a_motor_for_each_axis():
    """Motors and platform turn alike there, so that each motor takes the moment about its axis."""
    done = rs.deflection(rs.load("agile-eye"), wrench=[0, 0, 0, 3.0, 5.0, -7.0])
    assert [round(load.load, 9) for load in done.actuators] == [3.0, 5.0, -7.0]


def test_one_rod_too_many_shares_the_load_of_the_others():
    result = rs.deflection(rs.load("us-ups"), wrench=[0, 0, -1000.0, 0, 0, 0])
    rods = [part for part in result.parts if part.part == "rod"]
    assert len(rods) == 4
    assert np.ptp([part.energy for part in rods]) < 1e-9 * rods[0].energy
    np.testing.assert_allclose([load.load for load in result.actuators], 0, atol=1e-6)


HALF_CROSSBAR = 0.06  # m


@pytest.fixture(scope="module")
def posture():
    finder = PostureFinder(rs.load("h4"))
    return finder.find(np.vstack([finder.home_pose, random_poses("h4", finder, 20)]))


def test_bars_translate_and_the_crossbar_turns_between_them(posture):
    """Pierrot and Company: hinges follow the turn, and their middle is the platform."""
    hinges = np.stack([list(leg.freedoms)[-1].point for leg in posture.snapshot.legs])
    turn = posture.pose[:, 5]
    across = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
    np.testing.assert_allclose(hinges.mean(axis=0), posture.pose[:, :3], atol=1e-12)
    np.testing.assert_allclose(hinges[0] - hinges[1], 2 * HALF_CROSSBAR * across, atol=1e-12)
    for q in posture.coordinates:
        np.testing.assert_allclose(q[:, -1], turn, atol=1e-10)


def from_four_sides() -> str:
    """The model file with its two pairs opposite to each other."""
    text = robot_file("h4").read_text()
    for old, new in [
        ("at_y: d, end_y: d", "at_y: side*d, end_y: side*d"),
        ("at_y: -(d + R), end_y: -d", "at_y: -side*(d + R), end_y: -side*d"),
        ("azimuth: -90 deg", "azimuth: -side*90 deg"),
        ("coordinates: [x, y, z, rz]", ""),
    ]:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def test_with_arms_from_four_sides_the_nacelle_could_tilt():
    """Both pairs then resist the same couple, along the lines across their middle."""
    robot = model_from_document(parse_document(from_four_sides()))
    assert len(robot.coordinates) == 5
    result = rs.stiffness(robot)
    assert result.status == rs.Status.FREE_MOTIONS
    snapshot = rs.find_posture(robot).snapshot.one(0)
    turned = Rotation.from_euler("z", 180, degrees=True).as_matrix()
    R = np.kron(np.eye(2), turned)
    assert distance(R @ result.K @ R.T, result.K) < 1e-12
    free, _ = freedoms_between(snapshot.legs, snapshot.reference_point)
    assert free.shape[1] == 5


EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MODEL = EXAMPLES / "orthoglide-3-puu.yaml"
STEEL, BAR = rs.material("steel"), rs.tube(0.016, 0.012)
LENGTH, BETWEEN, DRIVE = 0.6, 0.1, 1.5e7
S = np.linspace(-0.12, 0.24, 10)
ALONG_ALL = np.outer(S, [1, 1, 1])


def both(parameters=None):
    """K along the diagonal of the Orthoglide and of the 3-PUU."""
    robots = rs.load("orthoglide", parameters), rs.load(MODEL, parameters)
    return [rs.stiffness(robot, ALONG_ALL).K for robot in robots]


def test_closed_forms_at_the_centre():
    torsion = 2 * STEEL.G * BAR.J / LENGTH
    pulled = STEEL.E * BAR.A * BETWEEN**2 / (2 * LENGTH)
    sheared = 6 * STEEL.E * BAR.Iy * BETWEEN**2 / LENGTH**3
    along = 1 / (1 / DRIVE + LENGTH / (2 * STEEL.E * BAR.A))
    turning = pulled + torsion + sheared, torsion
    for name, K_rr in zip(("orthoglide", MODEL), turning, strict=True):
        K = rs.stiffness(rs.load(name)).K
        assert distance(K, np.diag([along] * 3 + [K_rr] * 3)) < 1e-10
    assert turning[0] / turning[1] == pytest.approx(131.1, abs=0.05)
    nearly = 4 * (1 + STEEL.poisson_ratio) * BETWEEN**2 / (0.016**2 + 0.012**2)
    assert nearly == pytest.approx(turning[0] / turning[1], rel=0.01)


def test_legs_that_end_at_the_tool_make_both_alike_against_forces():
    one, other = (np.linalg.inv(K)[:, :3, :3] for K in both({"r": "0"}))
    np.testing.assert_allclose(other, one, atol=1e-8 * np.abs(one).max())

"""Arms from tables of Denavit and Hartenberg, against the product of four elementary matrices.

The product, the Jacobian and K = J^-T k J^-1 are written here with nothing of robostiff.
"""

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.model import Actuated, Coordinate, Rigid
from tests.files import written

QUARTER = np.pi / 2
STANDARD, MODIFIED = rs.DHConvention.STANDARD, rs.DHConvention.MODIFIED

# Columns: a [m], alpha [rad], d [m], theta [rad].
# User manual of Universal Robots for CB3, table C.3: UR5, series 3.
UR5 = [
    (0, QUARTER, 0.089159, 0),
    (-0.425, 0, 0, 0),
    (-0.39225, 0, 0, 0),
    (0, QUARTER, 0.10915, 0),
    (0, -QUARTER, 0.09465, 0),
    (0, 0, 0.0823, 0),
]
# Corke and Armstrong-Helouvry, A search for consensus among model parameters reported for the
# PUMA 560 robot, ICRA 1994; as in the Robotics Toolbox of Corke, without the height of its base.
PUMA = [
    (0, QUARTER, 0, 0),
    (0.4318, 0, 0, 0),
    (0.0203, -QUARTER, 0.15005, 0),
    (0, QUARTER, 0.4318, 0),
    (0, -QUARTER, 0, 0),
    (0, 0, 0, 0),
]
# Armstrong, Khatib and Burdick, The explicit dynamic model and inertial parameters of the PUMA 560
# arm, ICRA 1986: the table by proximal frames.
PUMA_MODIFIED = [
    (0, 0, 0, 0),
    (0, -QUARTER, 0.2435, 0),
    (0.4318, 0, -0.0934, 0),
    (-0.0203, QUARTER, 0.4331, 0),
    (0, -QUARTER, 0, 0),
    (0, QUARTER, 0, 0),
]
# KUKA KR 240 R2900-2 by proximal frames, from the origins of its joints in
# kr240_r2900_2_macro.xacro of kuka_robot_descriptions.
KR240 = [
    (0, np.pi, -0.645, 0),
    (0.33, QUARTER, 0, 0),
    (1.35, 0, 0, -QUARTER),
    (0.115, QUARTER, -1.22, 0),
    (0, -QUARTER, 0, 0),
    (0, QUARTER, -0.24, 0),
]
TABLES = {
    "UR5": (UR5, STANDARD),
    "Puma 560": (PUMA, STANDARD),
    "Puma 560, modified": (PUMA_MODIFIED, MODIFIED),
    "KR 240": (KR240, MODIFIED),
}
STIFFNESS = np.array([4e5, 5e5, 3e5, 6e4, 5e4, 3e4])


@pytest.fixture
def rng():
    return np.random.default_rng(20)


def turn(axis: str, angle: float) -> np.ndarray:
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    T = np.eye(4)
    T[j, j] = T[k, k] = np.cos(angle)
    T[k, j], T[j, k] = np.sin(angle), -np.sin(angle)
    return T


def shift(*p: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = p
    return T


def product(table, convention, q, slides=()):
    """Frames of the joints (z is the axis), and that of the last row; by the book."""
    T, joints = np.eye(4), []
    for i, ((a, alpha, d, theta), own) in enumerate(zip(table, q, strict=True)):
        slide, angle = (own, 0) if i in slides else (0, own)
        along_x = shift(a, 0, 0) @ turn("x", alpha)
        along_z = turn("z", theta + angle) @ shift(0, 0, d + slide)
        if convention is STANDARD:
            joints.append(T)
            T = T @ along_z @ along_x
        else:
            joints.append(T @ along_x)
            T = T @ along_x @ along_z
    return joints, T


def jacobian(joints, p, slides=()):
    """Columns: the twist of the tool at p by a unit motion of each joint."""
    columns = []
    for i, T in enumerate(joints):
        z, origin = T[:3, 2], T[:3, 3]
        still = i in slides
        columns.append([*z, 0, 0, 0] if still else [*np.cross(z, p - origin), *z])
    return np.array(columns).T


def arm(table, convention, **more):
    rows = [rs.DHRow(a=a, alpha=alpha, d=d, theta=theta) for a, alpha, d, theta in table]
    more = {"joint_stiffness": STIFFNESS, **more}
    return rs.serial_arm(rows, convention=convention, **more)


def rigid_parts(robot):
    """The parts between the joints, which are all rigid."""
    parts = robot.legs[0].chain.elements[1::2]
    rigid = [part for part in parts if isinstance(part, Rigid)]
    assert len(rigid) == len(parts)
    return rigid


def placed(robot, q):
    """The frame of the tool, 4 x 4."""
    pose = rs.stiffness(robot, rs.JointCoordinates(q)).pose
    T = shift(*pose[:3])
    T[:3, :3] = Rotation.from_rotvec(pose[3:]).as_matrix()
    return T


@pytest.mark.parametrize("name", TABLES)
def test_tool_and_stiffness_are_those_of_the_product(name, rng):
    table, convention = TABLES[name]
    robot = arm(table, convention)
    for q in rng.uniform(-2, 2, (5, 6)):
        joints, T = product(table, convention, q)
        np.testing.assert_allclose(placed(robot, q), T, atol=1e-12)
        J = jacobian(joints, T[:3, 3])
        compliance = J @ np.diag(1 / STIFFNESS) @ J.T
        found = rs.stiffness(robot, rs.JointCoordinates(q))
        np.testing.assert_allclose(
            rs.compliance(robot, rs.JointCoordinates(q)), compliance, rtol=1e-9, atol=1e-15
        )
        inverse = np.linalg.inv(J)
        K = inverse.T @ np.diag(STIFFNESS) @ inverse
        error = np.abs(found.K - K).max() / np.abs(K).max()
        assert error < 1e-15 * np.linalg.cond(J) ** 2 + 1e-12


def test_puma_is_where_its_author_prints_it():
    """Corke, Robotics, Vision and Control: fkine at qn = (0, pi/4, pi, 0, pi/4, 0)."""
    T = placed(arm(PUMA, STANDARD), [0, np.pi / 4, np.pi, 0, np.pi / 4, 0])
    printed = [[0, 0, 1, 0.5963], [0, 1, 0, -0.1501], [-1, 0, 0, -0.01435], [0, 0, 0, 1]]
    np.testing.assert_allclose(T, printed, atol=6e-5)


@pytest.mark.parametrize("convention", [STANDARD, MODIFIED])
def test_joint_that_slides(convention, rng):
    """Stanford arm, shaped as in Paul's book (1981); dimensions are chosen here."""
    table = [(0, -QUARTER, 0.4, 0), (0, QUARTER, 0.15, 0), (0, 0, 0.2, -QUARTER)]
    table += [(0, -QUARTER, 0, 0), (0, QUARTER, 0, 0), (0, 0, 0.1, 0)]
    rows = [
        rs.DHRow(a=a, alpha=alpha, d=d, theta=theta, slides=i == 2)
        for i, (a, alpha, d, theta) in enumerate(table)
    ]
    k = np.where(np.arange(6) == 2, 2e7, STIFFNESS)
    robot = rs.serial_arm(rows, convention=convention, joint_stiffness=k)
    q = rng.uniform(-1, 1, 6)
    joints, T = product(table, convention, q, slides=(2,))
    J = jacobian(joints, T[:3, 3], slides=(2,))
    np.testing.assert_allclose(placed(robot, q), T, atol=1e-12)
    np.testing.assert_allclose(
        rs.compliance(robot, rs.JointCoordinates(q)), J @ np.diag(1 / k) @ J.T, atol=1e-15
    )


def test_base_and_tool_move_the_arm_as_a_whole(rng):
    base = RigidTransform.from_components([1, 2, 0.5], Rotation.from_rotvec([0.3, -0.5, 0.8]))
    tool = RigidTransform.from_components([0.1, 0, 0.2], Rotation.from_rotvec([0, 0.7, 0]))
    q = rng.uniform(-2, 2, 6)
    _, T = product(UR5, STANDARD, q)
    found = placed(arm(UR5, STANDARD, base=base, tool=tool), q)
    np.testing.assert_allclose(found, base.as_matrix() @ T @ tool.as_matrix(), atol=1e-12)


def test_home_limits_names_and_poses():
    limits = [(-1, 1), None, (-2, 2), None, None, None]
    robot = arm(UR5, STANDARD, home=[0, -1.5, 1.5, -1.5, -1.5, 0], limits=limits)
    (leg,) = robot.legs
    assert leg.chain.home.tolist() == [0, -1.5, 1.5, -1.5, -1.5, 0]
    roles = leg.chain.roles
    assert [role.limits for role in roles if isinstance(role, Actuated)] == limits
    assert leg.chain.coordinate_names == tuple(f"joint{i}" for i in range(1, 7))
    assert robot.coordinates == ()
    free = arm(UR5, STANDARD, home=[0, -1.5, 1.5, -1.5, -1.5, 0], coordinates=tuple(Coordinate))
    at_home = rs.stiffness(free)
    moved = rs.stiffness(free, at_home.pose)
    np.testing.assert_allclose(moved.K, at_home.K, rtol=1e-6, atol=1e-3)


def test_symbols_stay_exact():
    a, k = sp.symbols("a k", positive=True)
    rows = [rs.DHRow(d=0.4, alpha=-QUARTER), rs.DHRow(a=a, alpha=0.3), rs.DHRow(a=0.25)]
    robot = rs.serial_arm(rows, convention=STANDARD, joint_stiffness=k)
    assert set(robot.symbols) == {a, k}
    first, second, _ = (part.transform for part in rigid_parts(robot))
    assert first.R.tolist() == [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    assert second.R[1, 1] == sp.cos(sp.Rational(3, 10))
    numbers = [rs.DHRow(d=0.4, alpha=-QUARTER), rs.DHRow(a=0.5, alpha=0.3), rs.DHRow(a=0.25)]
    plain = rs.serial_arm(numbers, convention=STANDARD, joint_stiffness=np.array(1e4))
    np.testing.assert_allclose(
        rs.compliance(robot.substituted({a: 0.5, k: 1e4})), rs.compliance(plain), atol=1e-18
    )


def test_quantities_of_pint():
    pint = pytest.importorskip("pint")
    Q = pint.get_application_registry().Quantity
    assert rs.DHRow(a=Q(425, "mm"), alpha=Q(90, "deg")) == rs.DHRow(a=0.425, alpha=np.pi / 2)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_weights_of_links_load_the_drives_by_the_gradient_of_their_potential(tmp_path, convention):
    rows = [(0.1, 1.2, 0.4, 0.1), (0.5, 0.3, -0.1, 0.2), (0.3, -0.8, 0.2, -0.4)]
    masses = [(12.0, [0.1, 0.02, -0.3]), (9.0, [-0.2, 0.1, 0.05]), (4.0, [0.0, -0.05, 0.1])]
    at, payload, tool = np.array([0.3, -0.5, 0.7]), (3.0, [0.02, 0.0, 0.08]), [0, 0, 0.12]
    lines = [
        f"    - {{a: {a}, alpha: {alpha}, d: {d}, theta: {theta}, stiffness: 1e5 N m/rad, "
        f"mass: {mass} kg, centre: {centre}}}"
        for (a, alpha, d, theta), (mass, centre) in zip(rows, masses, strict=True)
    ]
    text = f"""robostiff: 1
name: heavy
source: a test
gravity: -z
platform_masses: [{{mass: {payload[0]} kg, centre: {payload[1]}}}]
dh:
  convention: {convention}
  base: {{turn: [{{x: 0.4}}]}}
  tool: {{at: {tool}}}
  joints:
"""
    robot = rs.load(written(tmp_path / "heavy.yaml", text + "\n".join(lines) + "\n"))

    def potential(q):
        own = rs.DHConvention(convention)
        ends = [turn("x", 0.4) @ product(rows[:i], own, q[:i])[1] for i in range(1, 4)]
        bodies = [*zip(ends, masses, strict=True), (ends[-1] @ shift(*tool), payload)]
        return sum(mass * 9.80665 * (T @ [*centre, 1])[2] for T, (mass, centre) in bodies)

    h = 1e-6
    expected = [(potential(at - e) - potential(at + e)) / (2 * h) for e in h * np.eye(3)]
    bent = rs.deflection(robot, rs.JointCoordinates(at), gravity="-z")
    np.testing.assert_allclose([own.load for own in bent.actuators], expected, rtol=1e-7)

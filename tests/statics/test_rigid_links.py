"""Elastic drives between rigid links: against the kinematics of points at fixed distances."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.model import PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.network import JointElement, Network, Node
from robostiff.spatial import Space
from tests.cases.metric import distance
from tests.statics.robots_under_load import joint, loaded
from tests.statics.robots_under_load import root as root_of


def with_rigid_links(name: str) -> rs.Snapshot:
    """A shipped robot at home, its links rigid and its drives elastic."""
    snapshot = rs.find_posture(rs.load(name)).snapshot.one(0)

    def stripped(leg: PlacedLeg) -> PlacedLeg:
        kept = [e for e in leg.elements if not isinstance(e, PlacedSpring)]
        elements = [
            replace(e, branches=tuple(map(stripped, e.branches)))
            if isinstance(e, PlacedBlock)
            else e
            for e in kept
        ]
        return replace(leg, elements=tuple(elements), masses=())

    return replace(snapshot, legs=tuple(map(stripped, snapshot.legs)))


class Sticks:
    """Three drives, each with one end of a stick that keeps its length; the platform translates."""

    def __init__(
        self, moved: Callable[[int, float], np.ndarray], ends: np.ndarray, k: float
    ) -> None:
        self.moved, self.ends, self.k = moved, ends, k
        self.lengths = [np.linalg.norm(ends[i] - moved(i, 0.0)) for i in range(3)]

    def drive(self, i: int, p: np.ndarray) -> float:
        q = 0.0
        for _ in range(12):
            u = self.ends[i] + p - self.moved(i, q)
            q -= 0.5 * (self.lengths[i] ** 2 - u @ u) / (u @ self.rate(i, q))
        return q

    def rate(self, i: int, q: float, h: float = 1e-5) -> np.ndarray:
        """Of the near end of a stick by its drive."""
        return (self.moved(i, q + h) - self.moved(i, q - h)) / (2 * h)

    def drives(self, p: np.ndarray) -> np.ndarray:
        return np.array([self.drive(i, p) for i in range(3)])

    def missing(self, p: np.ndarray, F: np.ndarray) -> np.ndarray:
        """``F - sum k q dq/dp``; along a stick u, ``u . dp = u . dm/dq dq``."""
        total = F.copy()
        for i, q in enumerate(self.drives(p)):
            u = self.ends[i] + p - self.moved(i, q)
            total -= self.k * q * u / (u @ self.rate(i, q))
        return total / self.k

    def rest(self, F: np.ndarray) -> np.ndarray:
        found = root(self.missing, np.zeros(3), args=(F,), tol=1e-15)
        return np.array(found.x)


def sticks(name: str) -> Sticks:
    """Dimensions as in the model files."""
    if name == "3-puu":
        phi = np.radians([15, 135, 255])
        out = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
        up = np.array([0, 0, 1.0])
        height = np.sqrt(0.7**2 - 0.35**2)
        ends = 0.15 * out + 0.3 * up
        return Sticks(lambda i, q: 0.5 * out[i] + (0.3 + height + q) * up, ends, 2e7)
    if name == "orthoglide":
        axes = np.eye(3)
        return Sticks(lambda i, q: (q - 0.65) * axes[i], -0.05 * axes, 1.5e7)
    phi = np.radians([0, 120, 240])
    out = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
    across = np.stack([-np.sin(phi), np.cos(phi), 0 * phi], axis=1)
    h = np.sqrt(0.8**2 - 0.5**2)

    def elbow(i: int, q: float) -> np.ndarray:
        down = np.cross(across[i], out[i])
        return 0.2 * out[i] + 0.35 * (np.cos(q) * out[i] + np.sin(q) * down)

    return Sticks(elbow, 0.05 * out - [0, 0, h], 3e4)


FORCES = {"3-puu": [9e4, -2e5, 1.2e5], "orthoglide": [2e5, -3e5, 1e5], "delta": [900, 500, -2000]}


@pytest.mark.parametrize("name", FORCES)
def test_displacement_loads_of_drives_and_compliance(name: str):
    """Far from home, by some centimetres; legs with too many hinges (Orthoglide) among them."""
    robot, reference = with_rigid_links(name), sticks(name)
    F = np.array(FORCES[name], dtype=float)
    p = reference.rest(F)
    answer = loaded(robot, wrench=[*F, 0, 0, 0])
    assert str(answer.status) == "rigid-direction"
    assert answer.stable
    assert np.linalg.norm(p) > 5e-3
    assert np.allclose(answer.displacement, [*p, 0, 0, 0], rtol=0, atol=1e-9)
    loads = [part.load for part in answer.parts if part.load]
    assert np.allclose(np.abs(loads), reference.k * np.abs(reference.drives(p)), rtol=1e-6)
    h = 1e-3 * np.linalg.norm(F)
    C = np.stack([reference.rest(F + d) - reference.rest(F - d) for d in h * np.eye(3)], axis=1)
    C = C / (2 * h)
    assert np.allclose(answer.compliance[:3, :3], C, atol=1e-4 * np.abs(C).max())
    assert np.abs(answer.compliance[3:]).max() < 1e-10 * np.abs(C).max()
    with pytest.raises(rs.NoAnswerError, match="its compliance is there"):
        _ = answer.K
    held = loaded(robot, displacement=answer.displacement)
    assert str(held.status) == "rigid-direction"
    assert held.stable
    assert np.allclose(held.wrench, [*F, 0, 0, 0], rtol=1e-6, atol=1e-6 * np.abs(F).max())
    assert np.isclose(held.energy, answer.energy, rtol=1e-9)
    against = loaded(robot, displacement=[0, 0, 1e-3, 1e-3, 0, 0])
    assert str(against.status) == "rigid-direction+no-equilibrium"
    assert against.advice[0].startswith("rigid parts do not let the platform move so")


@pytest.mark.parametrize(
    "name", ["3-puu", "orthoglide", "h4", "hexa", "3-prs", "tripteron", "capaman"]
)
def test_small_loads_have_the_linear_compliance(name: str):
    """Also of K, where it exists."""
    robot = with_rigid_links(name)
    linear, answer = rs.stiffness(robot), loaded(robot)
    C = linear.required_compliance()
    assert np.allclose(answer.compliance, C, rtol=0, atol=1e-9 * np.abs(C).max())
    has_matrix = not linear.status & rs.Status.RIGID_DIRECTION
    assert has_matrix == answer.status.has_stiffness
    if has_matrix:
        assert np.allclose(answer.K, linear.K, rtol=0, atol=1e-9 * np.abs(linear.K).max())
    wrench = np.array([3.0, -1, 2, 0.2, 0.1, -0.3])[: robot.space.size]
    bent = loaded(robot, wrench=1e-3 * wrench).displacement
    assert np.allclose(bent, 1e-3 * C @ wrench, rtol=0, atol=1e-5 * np.abs(bent).max())


def test_loads_at_bodies_and_their_linear_limit():
    """A weight on an arm of the Delta turns its motor alone, and moves the platform by that."""
    robot = with_rigid_links("delta")
    motor = robot.legs[0].elements[0]
    assert isinstance(motor, PlacedFreedom)
    loads = {"leg1/motor": rs.DeadForce([0, 0, -1.0], motor.point + np.array([0.1, 0, 0]))}
    small = rs.deflection(robot, loads=loads)
    answer = loaded(robot, loads=loads)
    assert np.allclose(small.twist, answer.displacement, rtol=1e-3, atol=1e-11)
    assert np.abs(small.twist[:3]).max() > 1e-7


def test_a_lever_is_a_pendulum():
    """``k q = F L cos q``; upright it buckles at ``F = k / L``."""
    tip, k = np.array([0.5, 0, 0]), 50.0
    lever = joint("hinge", [0, 0, 0], [0, 0, 1], "R", k)
    robot = rs.Snapshot("lever", (PlacedLeg("lever", (lever,), tip),), tip, Space.PLANAR)
    q = root_of(lambda q: k * q - 0.5 * 60 * np.cos(q), 0, 1.5)
    answer = loaded(robot, wrench=[0, 60, 0])
    assert np.isclose(answer.displacement[2], q, rtol=1e-12)
    assert np.isclose(answer.compliance[2, 2], 1 / (k + 0.5 * 60 * np.sin(q)), rtol=1e-12)
    found = rs.critical_load(robot, wrench=[-1, 0, 0], up_to=110.0)
    assert np.isclose(found.factor, k / 0.5, rtol=1e-6)
    path = rs.load_path(robot, None, [0, 60, 0], [0.5, 1.0])
    assert np.isclose(float(path.displacement[1, 2]), q, rtol=1e-12)
    assert np.isnan(path.K.values).all()
    mode = rs.modes(robot, masses={"platform": 2.0}, wrench=[0, 60, 0])
    exact = np.sqrt((k + 0.5 * 60 * np.sin(q)) / (2.0 * 0.25)) / (2 * np.pi)
    assert np.isclose(mode.frequencies[0], exact, rtol=1e-9)


def parallelogram(free: Sequence[str]) -> Network:
    """Rigid bars on a motor carry a coupler in space, and an elastic wrist on it the tool.

    Axes along z, and those that are given by ``joint/axis``: the loop closes with three more.
    """
    R = Rotation.from_rotvec([0.3, -0.5, 0.7]).as_matrix()
    axes = dict(zip("xyz", R.T, strict=True))
    places = {
        "l0": ("ground", "left", [0, 0, 0]),
        "l1": ("left", "coupler", [0.1, 0.5, 0]),
        "r0": ("ground", "right", [0.4, 0, 0]),
        "r1": ("right", "coupler", [0.5, 0.5, 0]),
    }
    joints = []
    for name, (a, b, point) in places.items():
        role = rs.Actuated(2e4) if name == "l0" else rs.Passive()
        own = ["z", *(axis for joint, axis in (x.split("/") for x in free) if joint == name)]
        freedoms = (PlacedFreedom(axes[x], R @ point, 0.0, f"{name}{x}", role) for x in own)
        joints.append(JointElement(name, a, b, tuple(freedoms)))
    tip = R @ [0.7, 0.6, 0.3]
    wrist = tuple(
        PlacedFreedom(axis, R @ [0.7, 0.6, 0.1], pitch, f"w{x}{pitch}", rs.Actuated(k))
        for pitch, k in ((None, 3e5), (0.0, 4e3))
        for x, axis in axes.items()
    )
    joints.append(JointElement("wrist", "coupler", "tool", wrist))
    nodes = ["ground", "left", "right", "coupler", "tool"]
    points = [np.zeros(3)] * 4 + [tip]
    return Network(
        "parallelogram",
        tuple(Node(name, at) for name, at in zip(nodes, points, strict=True)),
        ("ground",),
        "tool",
        tip,
        joints=tuple(joints),
    )


@pytest.mark.parametrize("load", [1e-3, 1.0, 30.0])
def test_a_rigid_loop_that_is_closed_twice_holds_no_more(load: float):
    """Of four parallel axes, or with three more so that no closure is there twice: it moves alike.

    What holds the second closures is rounding, which is no direction that the platform lacks.
    """
    wrench = load * np.array([20.0, -30, 25, 2, -3, 4])
    twice, once = (
        loaded(parallelogram(free), wrench=wrench) for free in ((), ("r0/x", "r1/x", "r1/y"))
    )
    assert twice.status.has_stiffness
    np.testing.assert_allclose(
        twice.displacement, once.displacement, rtol=0, atol=1e-9 * np.abs(once.displacement).max()
    )
    assert distance(twice.K, once.K) < 1e-9
    linear = rs.stiffness(parallelogram(()))
    if load < 1:
        assert distance(twice.K, linear.K) < 1e-5

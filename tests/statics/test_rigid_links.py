"""Elastic drives between rigid links: against the least energy of bodies in the world."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.model import Chain, Link, ParallelBlock, PlacedFreedom, PlacedLeg
from robostiff.network import JointElement, Network, Node
from robostiff.spatial import Frame
from tests.campaign.bodies import elastic_energy
from tests.campaign.minima import least
from tests.cases.metric import distance
from tests.generators.chains import on_rigid_links
from tests.statics.robots_under_load import bodies_of, loaded


def with_rigid_links(name: str) -> rs.Snapshot:
    """A shipped robot at home, its links rigid and its drives elastic."""
    snapshot = rs.find_posture(rs.load(name)).snapshot.one(0)
    return replace(snapshot, legs=tuple(map(on_rigid_links, snapshot.legs)))


def of_rigid_links(name: str) -> rs.Robot:
    """A shipped robot with rigid parts in place of its links."""

    def rigid(chain: Chain) -> Chain:
        return replace(chain, elements=tuple(map(stiff, chain.elements)))

    def stiff(e: Any) -> Any:
        if isinstance(e, ParallelBlock):
            return replace(e, branches=tuple(replace(b, chain=rigid(b.chain)) for b in e.branches))
        return rs.Rigid(Frame(np.eye(3), np.asarray(e.to)), e.name) if isinstance(e, Link) else e

    robot = rs.load(name)
    legs = tuple(replace(leg, chain=rigid(leg.chain)) for leg in robot.legs)
    return replace(robot, legs=legs, platform_masses=())


FORCES = {"3-puu": [9e4, -2e5, 1.2e5], "orthoglide": [2e5, -3e5, 1e5], "delta": [900, 500, -2000]}


@pytest.mark.parametrize("name", FORCES)
def test_displacement_energy_and_compliance(name: str):
    """Far from home, by some centimetres; legs with too many hinges (Orthoglide) among them."""
    robot, F = with_rigid_links(name), np.array([*FORCES[name], 0, 0, 0], dtype=float)
    own = bodies_of(of_rigid_links(name))
    truth = least(own, F)
    answer = loaded(robot, wrench=F)
    assert str(answer.status) == "rigid-direction"
    assert answer.stable
    assert np.linalg.norm(truth.displacement) > 5e-3
    assert np.allclose(answer.displacement, truth.displacement, rtol=0, atol=1e-9)
    assert np.isclose(answer.energy, elastic_energy(own.bodies, truth.state), rtol=1e-6, atol=0)
    C = truth.compliance
    assert np.allclose(answer.compliance, C, rtol=0, atol=1e-6 * np.abs(C).max())
    assert np.abs(answer.compliance[3:]).max() < 1e-10 * np.abs(C).max()
    with pytest.raises(rs.NoAnswerError, match="its compliance is there"):
        _ = answer.K
    held = loaded(robot, displacement=answer.displacement)
    assert str(held.status) == "rigid-direction"
    assert held.stable
    assert np.allclose(held.wrench, F, rtol=1e-6, atol=1e-6 * np.abs(F).max())
    assert np.isclose(held.energy, answer.energy, rtol=1e-9, atol=0)
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


def _arm_of_drives(tilts: np.ndarray) -> rs.Snapshot:
    """Drives about x and z, and a slide along y: nothing turns about y but for `tilts` (6, 3)."""
    axes = np.eye(3)[[2, 0, 0, 0, 2, 1]] + tilts
    points = np.array([[3, 0, 2], [11, -8, 6], [5, 4, -12], [-7, -4, 0], [-5, 6, -8], [-1, 4, 6]])
    stiffness = (1.2e6, 2.8e6, 1.9e4, 2.6e6, 1.3e5, 2.2e6)
    each = zip(axes, points / 10, (1.4, 0.0, 0.0, 0.0, 0.6, None), stiffness, strict=True)
    drives = tuple(
        PlacedFreedom(axis / np.linalg.norm(axis), point, pitch, f"j{i}", rs.Actuated(k))
        for i, (axis, point, pitch, k) in enumerate(each)
    )
    return rs.Snapshot("arm", (PlacedLeg("arm", drives, np.zeros(3)),), np.zeros(3))


def test_a_direction_that_rounding_alone_moves_is_rigid():
    rng = np.random.default_rng(3)
    exact, rounded = (_arm_of_drives(s * rng.normal(size=(6, 3))) for s in (0.0, 1e-12))
    wrench, loads = rng.normal(size=6), {"arm/j4": rs.DeadForce([1, -2, 3], [0.1, 0.2, 0.3])}
    for ask in (rs.deflection, rs.equilibrium):
        truth, answer = (ask(arm, wrench=1e-3 * wrench, loads=loads) for arm in (exact, rounded))
        assert answer.status == truth.status == rs.Status.RIGID_DIRECTION
        assert answer.energy == pytest.approx(truth.energy, rel=1e-6)
    assert rs.deflection(rounded, wrench=wrench).twist == pytest.approx(
        rs.deflection(exact, wrench=wrench).twist, rel=1e-6, abs=1e-12
    )


@pytest.mark.parametrize("tilt", [1e-16, 1e-13])
def test_rigid_parts_that_carry_all_drive_nothing(tilt: float):
    rows = [rs.DHRow(a=0.5), rs.DHRow(a=0.4), rs.DHRow(a=0.1)]
    stands = Frame(Rotation.from_rotvec([0.7 * tilt, tilt, 0]).as_matrix(), np.zeros(3))
    arms = (
        rs.serial_arm(
            rows, convention=rs.DHConvention.STANDARD, joint_stiffness=[2e4, 2e4, 1e4], base=base
        )
        for base in (Frame.identity(), stands)
    )
    at, wrench, force = rs.JointCoordinates([0.3, 0.4, 0.5]), [10, 20, 30, 1, 2, 3], [0, 0, -80]
    level, tilted = (rs.deflection(arm, at, wrench, loads={"arm/joint1": force}) for arm in arms)
    assert tilted.status == level.status == rs.Status.RIGID_DIRECTION
    assert tilted.twist == pytest.approx(level.twist, rel=1e-9, abs=1e-12)

"""An arm just beside its wrist singularity, hinges almost in one place: what is said, and found.

Near the singularity one direction of the platform is nearly rigid; nothing is free.
"""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import Passive, PlacedFreedom, PlacedLeg
from robostiff.spatial import Space
from tests.statics.robots_under_load import joint

#: Lengths of an arm of six turns, three of them crossing in pairs [m], and its twists.
OFFSETS = 0.089159, 0.0, 0.0, 0.10915, 0.09465, 0.0823
LENGTHS = 0.0, -0.425, -0.39225, 0.0, 0.0, 0.0
TWISTS = np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0
WRENCH = np.array([3, 5, -10, 1, 0.3, -0.5])
STIFF = 2e4


def arm(beside: float, passive: int | None = None) -> rs.Snapshot:
    """Rigid links and elastic drives; so far beside its wrist singularity [rad]."""
    T, elements = np.eye(4), []
    for i, q in enumerate((0.3, -1.1, 1.2, -0.7, beside, 0.4)):
        elements.append(joint(f"joint{i + 1}", T[:3, 3], T[:3, 2], "R", STIFF))
        c, s, ca, sa = np.cos(q), np.sin(q), np.cos(TWISTS[i]), np.sin(TWISTS[i])
        a, d = LENGTHS[i], OFFSETS[i]
        T = T @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    if passive is not None:
        elements[passive] = replace(elements[passive], role=Passive())
    tip = T[:3, 3]
    return rs.Snapshot("arm", (PlacedLeg("leg", tuple(elements), tip),), tip, Space.SPATIAL)


def columns(robot: rs.Snapshot) -> np.ndarray:
    """What a turn of each joint does to the tip (6, 6)."""
    turns = [e for e in robot.legs[0].elements if isinstance(e, PlacedFreedom)]
    tip = robot.reference_point
    return np.array([np.r_[np.cross(e.axis, tip - e.point), e.axis] for e in turns]).T


@pytest.mark.parametrize("beside", [1e-2, 1e-4, 3e-5, 1e-5])
def test_arm_beside_its_wrist_singularity_is_not_free(beside: float):
    """``C = J J^T / k``; the load so small that it moves in proportion."""
    robot = arm(beside)
    J = columns(robot)
    found = rs.equilibrium(robot, wrench=1e-4 * WRENCH)
    assert found.status is rs.Status.OK
    twist = 1e-4 * J @ J.T @ WRENCH / STIFF
    assert np.allclose(found.displacement, twist, rtol=1e-5, atol=1e-6 * np.abs(twist).max())
    assert np.isclose(found.energy, 0.5 * 1e-4 * WRENCH @ twist, rtol=1e-5, atol=0)
    if beside > 1e-5:  # the load drives it through the singularity
        critical = rs.critical_load(robot, wrench=[0, 0, -1, 0, 0, 0], up_to=10)
        assert (critical.status, critical.is_found) == (rs.Status.OK, False)


@pytest.mark.parametrize("beside", [1e-5, 1e-6, 1e-8, 0])
def test_frequencies_beside_the_singularity_tend_to_those_in_it_or_there_are_none(beside: float):
    """Of a mass at the tip: by C, in which nothing is large."""
    robot = arm(beside)
    J, found = columns(robot)[:3], rs.modes(robot, masses={"platform": 10})
    wanted = np.sqrt(1 / np.linalg.eigvalsh(10 * J @ J.T / STIFF))[::-1] / (2 * np.pi)
    if 0 < beside < 3e-6:
        assert (found.status, len(found)) == (rs.Status.ILL_CONDITIONED, 0)
    else:
        assert np.allclose(found.frequencies, wanted, rtol=1e-6)


@pytest.mark.parametrize("beside", [1e-6, 1e-7, 1e-8])
def test_arm_too_near_its_singularity_says_that_digits_are_few(beside: float):
    robot = arm(beside)
    assert rs.stiffness(robot).status is rs.Status.ILL_CONDITIONED
    for wrench in (WRENCH, 1e-4 * WRENCH):
        found = rs.equilibrium(robot, wrench=wrench)
        assert (found.status, found.has_answer) == (rs.Status.ILL_CONDITIONED, False)
    assert rs.critical_load(robot, wrench=WRENCH).status is rs.Status.ILL_CONDITIONED


@pytest.mark.parametrize("beside", [1e-5, 3e-6])
def test_load_that_drives_an_arm_through_its_singularity_says_that_digits_are_few(beside: float):
    random = np.random.default_rng(1)
    for size in (1, 100):
        for wrench in size * random.normal(size=(2, 6)):
            found = rs.equilibrium(arm(beside), wrench=wrench)
            assert found.status in (rs.Status.OK, rs.Status.ILL_CONDITIONED)
            assert found.has_answer == (found.status is rs.Status.OK)


@pytest.mark.parametrize("beside", [1e-1, 1e-4, 1e-5, 4e-6])
@pytest.mark.parametrize("passive", [0, 3, 4])
def test_free_joint_beside_the_singularity_is_found(beside: float, passive: int):
    robot = arm(beside, passive)
    assert rs.Status.FREE_MOTIONS in rs.stiffness(robot).status
    assert rs.equilibrium(robot, wrench=np.zeros(6)).status is rs.Status.FREE_MOTIONS


def pair_of_hinges(gap: float) -> rs.Snapshot:
    """Two legs in the plane; one ends in two hinges, so far apart."""
    foot, pin, tip = np.array([-1.4, 0.3, 0]), np.array([-2.0, 0.9, 0]), np.zeros(3)
    x, y, z = np.eye(3)

    def held(at: np.ndarray, k: float):
        return (
            joint("x", at, x, "P", 5e8),
            joint("y", at, y, "P", 3e5),
            joint("turn", at, z, "R", k),
        )

    pair = joint("near", pin, z, "R"), joint("nearer", pin + gap * np.array([0.3, -1, 0]), z, "R")
    legs = PlacedLeg("a", (*held(foot, 5e4), *pair), tip), PlacedLeg("b", held(tip, 2e4), tip)
    return rs.Snapshot("pair", legs, tip, Space.PLANAR)


@pytest.mark.parametrize("gap", [1e-3, 1e-4, 1e-5, 1e-7, 0.0])
def test_a_pair_of_hinges_almost_in_one_place_carries_a_moment_or_says_that_digits_are_few(gap):
    """What both hinges of a pair carry grows as their gap shrinks; it is no free motion.

    In one place they carry none, and one of them is redundant.
    """
    robot, loads = pair_of_hinges(gap), {"a/turn": rs.DeadForce([3, -8, 0], [-2.1, 0.4, 0])}
    bent = rs.deflection(robot, wrench=[1, 2, 3], loads=loads)
    little = {"a/turn": rs.DeadForce([3e-5, -8e-5, 0], [-2.1, 0.4, 0])}
    found = rs.equilibrium(robot, wrench=[1e-5, 2e-5, 3e-5], loads=little)
    few = 0 < gap < 1e-4
    expected = rs.Status.ILL_CONDITIONED if few else rs.Status.OK
    expected = rs.Status.REDUNDANT_JOINTS if gap == 0 else expected
    assert (bent.status, found.status, found.has_answer) == (expected, expected, not few)
    alone = rs.equilibrium(robot, wrench=[1, 2, 3])
    assert (alone.status, alone.has_answer) == (expected, not few)
    if gap in (1e-3, 1e-4):
        truth = [1.31814776e-09, 1.04547347e-05, 5.16996356e-05]  # by 200 digits
        assert bent.twist == pytest.approx(truth, rel=1e-6)
        assert found.displacement == pytest.approx(1e-5 * np.array(truth), rel=1e-5)


@pytest.mark.parametrize("beside", [1e-5, 1e-6])
def test_batches_and_kernels_of_an_arm_whose_home_is_beside_its_singularity(beside: float):
    rows = [rs.DHRow(a=a, alpha=t, d=d) for a, t, d in zip(LENGTHS, TWISTS, OFFSETS, strict=True)]
    home = [0.3, -1.1, 1.2, -0.7, beside, 0.4]
    standard = rs.DHConvention.STANDARD
    robot = rs.serial_arm(rows, convention=standard, joint_stiffness=[STIFF] * 6, home=home)
    there, wrench = rs.JointCoordinates(np.array([home, home])), 1e-4 * WRENCH
    status = rs.Status.OK if beside > 3e-6 else rs.Status.ILL_CONDITIONED
    assert np.all(rs.modes(robot, there, {"platform": 10}).status_codes == int(status))
    by_kernel = rs.compile_loaded(robot).evaluate(there, np.array([wrench, wrench]))
    assert np.all(by_kernel.status_codes == int(status))

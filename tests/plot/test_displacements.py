"""The deformed shape is mechanics: legs stay closed, joints move as they may, beams bend."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.model import PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring, parallelogram
from robostiff.plot.displacement import BodyMotion, Motions, motion_under
from robostiff.plot.picture import LineWeight, Path
from robostiff.plot.posed_robot import picture_of_posed
from tests.generators.robots import KINDS_OF_ROBOTS, random_robot
from tests.plot.machines import HERE, LOAD, robot, turn, twist_about

BENDING = ("hexapod", "3-puu", "3-rrr", "tripteron")


def under_load(name: str) -> tuple[rs.Snapshot, rs.Deflection, Motions]:
    machine = robot(name)
    bent = rs.deflection(machine, wrench=np.array(LOAD)[list(machine.space.rows)])
    snapshot = rs.find_posture(machine).snapshot.one(0)
    return snapshot, bent, motion_under(snapshot, bent)


@pytest.mark.parametrize("name", rs.shipped_robots())
def test_deformed_legs_end_on_the_displaced_platform(name: str):
    machine = robot(name)
    if not isinstance(machine, rs.Robot):
        pytest.skip("has no legs")
    answer = rs.stiffness(machine)
    # A load that every robot carries: what it takes to move the platform a little.
    t = 1e-4 * np.random.default_rng(1).standard_normal(answer.space.size)
    bent = rs.deflection(machine, wrench=answer.K @ t)
    assert bent.has_answer
    snapshot = rs.find_posture(machine).snapshot.one(0)
    motions = motion_under(snapshot, bent)
    for leg in snapshot.legs:
        check_closed(leg, f"{leg.name}/", motions, motions["platform"])


def bodies_of(leg: PlacedLeg, motions: Motions) -> list[BodyMotion]:
    """Motions of the base and of the bodies behind the elements of a leg."""
    still = BodyMotion(np.zeros((3, 3)), np.zeros(3))
    return [still, *(motions[f"{leg.name}/{own.name}"] for own in leg.elements)]


def lines_of(snapshot: rs.Snapshot, bent: rs.Deflection, scale: float) -> dict[str, list[Path]]:
    """The lines of every leg from base to platform [m]."""
    picture = picture_of_posed(snapshot, bent, rs.plot.Colouring.NONE, exaggeration=scale)
    metre = 1e-3 if "mm" in picture.axes[0] else 1.0
    drawn = [
        replace(item, points=metre * item.points)
        for item in picture.items
        if isinstance(item, Path) and not item.dashed
    ]
    return {
        leg.name: [line for line in drawn if line.about.partition("/")[0] == leg.name]
        for leg in snapshot.legs
    }


def check_closed(leg: PlacedLeg, prefix: str, motions: Motions, wanted: BodyMotion) -> None:
    """A leg ends on the body that it holds, and so do the branches of its parallel blocks."""
    last = motions[prefix + leg.elements[-1].name]
    assert last.displacement(leg.end) == pytest.approx(
        wanted.displacement(leg.end), rel=1e-7, abs=1e-12
    )
    assert turn(last) == pytest.approx(turn(wanted), rel=1e-7, abs=1e-11)
    for block in leg.elements:
        if isinstance(block, PlacedBlock):
            for branch in block.branches:
                check_closed(branch, prefix, motions, motions[prefix + block.name])


@given(st.sampled_from(KINDS_OF_ROBOTS), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_legs_of_random_robots_close(kind: str, number: int, seed: int):
    rng = np.random.default_rng(seed)
    snapshot = random_robot(rng, kind, number)
    answer = rs.stiffness(snapshot)
    if not answer.answered or answer.rank == 0:
        return
    t = 1e-4 * rng.standard_normal(6)
    bent = rs.deflection(snapshot, wrench=answer.K @ t)
    if not bent.has_answer:
        return
    motions = motion_under(snapshot, bent)
    s = np.repeat([1.0, float(answer.length)], 3)
    wanted = twist_about(motions["platform"], answer.origin)
    size = np.linalg.norm(wanted * s)
    for leg in snapshot.legs:
        gap = (twist_about(bodies_of(leg, motions)[-1], answer.origin) - wanted) * s
        assert np.linalg.norm(gap) <= 1e-6 * size


@pytest.mark.parametrize("name", BENDING)
def test_joints_move_as_they_may_and_springs_as_their_compliance_says(name: str):
    """Bodies differ by the twist of the joint between them; springs store what their parts say."""
    snapshot, bent, motions = under_load(name)
    energies = {(part.leg, part.part): part.energy for part in bent.parts}
    for leg in snapshot.legs:
        for element, (before, after) in zip(
            leg.elements, pairwise(bodies_of(leg, motions)), strict=True
        ):
            assert not isinstance(element, PlacedBlock)
            turned = turn(after) - turn(before)
            shift = after.displacement(element.point) - before.displacement(element.point)
            if isinstance(element, PlacedFreedom):
                along, other = (turned, shift) if element.is_rotation else (shift, turned)
                assert np.cross(along, element.axis) == pytest.approx(np.zeros(3), abs=1e-12)
                assert other == pytest.approx(np.zeros(3), abs=1e-12)
            elif isinstance(element, PlacedSpring):
                C, R = element.elasticity.compliance, element.rotation
                if np.linalg.matrix_rank(C) == 6:
                    own = np.concatenate([R.T @ shift, R.T @ turned])
                    energy = 0.5 * own @ np.linalg.solve(C, own)
                    expected = energies[leg.name, element.name]
                    assert energy == pytest.approx(expected, rel=1e-6, abs=1e-15)


def test_cantilever_bends_as_its_textbook_line():
    """w(x) = F x^2 (3 L - x) / (6 E I), exaggerated."""
    steel = rs.material("steel")
    section = rs.rectangle(0.01, 0.02)
    beam = rs.beam_link((0.5, 0, 0), steel, section, y_axis=(0, 1, 0), theory=rs.EulerBernoulli())
    leg = rs.Leg("arm", HERE, rs.Chain((beam,)), HERE)
    cantilever = rs.Robot("cantilever", (leg,))
    bent = rs.deflection(cantilever, wrench=[0, 0, -20.0, 0, 0, 0])
    snapshot = rs.find_posture(cantilever).snapshot.one(0)
    ((member,),) = lines_of(snapshot, bent, 50.0).values()
    assert member.weight is LineWeight.BOLD
    x = member.points[:, 0]
    tip = bent.twist[2]
    assert member.points[-1, 2] == pytest.approx(50 * tip)
    assert member.points[:, 2] == pytest.approx(
        50 * tip * x**2 * (1.5 - x) / (2 * 0.5**3), rel=1e-9
    )


def test_all_branches_of_a_block_are_joined_to_a_block_behind_it():
    """The far pin of the second bar hung in the air."""
    near, far = (rs.revolute([0, 1, 0], rs.Passive(), name=name) for name in ("near", "far"))
    blocks = [
        parallelogram(
            rs.Chain((near, rs.beam_link(bar, rs.material("steel"), rs.circle(0.02)), far)), across
        )
        for bar, across in (([0, 0, 0.3], [0.1, 0, 0]), ([0.4, 0, 0], [0, 0, 0.1]))
    ]
    chain = rs.Chain((blocks[0], replace(blocks[1], name="second")))
    still = rs.Frame.identity()
    home = rs.Frame(np.eye(3), np.array([0.4, 0, 0.3]))
    arm = rs.Robot("arm", (rs.Leg("arm", still, chain, still),), home=home)
    picture = picture_of_posed(rs.find_posture(arm).snapshot.one(0))
    paths = [item.points for item in picture.items if isinstance(item, Path)]
    ends = np.array([path[i] for path in paths for i in (0, -1)])
    for pin in ([50.0, 0, 300], [-50.0, 0, 300]):  # mm
        assert np.sum(np.linalg.norm(ends - pin, axis=1) < 1e-6) >= 2

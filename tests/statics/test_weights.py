"""Weights and masses: of legs, of networks, of drives."""

import json
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import circle
from robostiff.io.snapshot import read_snapshot, snapshot_to_data
from robostiff.kinematics import find_posture, with_masses
from robostiff.model import Chain, Leg, Mass, PlacedLeg, PlacedMass, Robot
from robostiff.spatial import Frame
from robostiff.statics.loading import loaded_posture
from tests.io.urdf.examples import robot_of, with_side
from tests.io.urdf.test_masses import ARM, SIDE
from tests.statics.mass_matrices import mass_matrix
from tests.statics.robots_under_load import loaded, number

STEEL = rs.material("steel")
L, D = 0.8, 0.02
EI = STEEL.E * np.pi * D**4 / 64
LINE_WEIGHT = number(STEEL.density) * np.pi * D**2 / 4 * 9.80665


def arm(*elements: object, gravity: object = None, **options: object) -> Robot:
    frame = Frame(np.eye(3), np.zeros(3))
    leg = Leg("arm", frame, Chain(tuple(elements)), frame)  # type: ignore[arg-type]
    return Robot("arm", (leg,), coordinates=(), gravity=gravity, **options)  # type: ignore[arg-type]


def rod(length: float = L, **options: object) -> rs.Link:
    return rs.beam_link([length, 0, 0], STEEL, circle(D), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(("elements", "rods"), [(1, 1), (2, 1), (5, 1), (1, 2), (2, 3)])
def test_tip_of_a_cantilever_under_its_own_weight(elements: int, rods: int):
    """w L^4 / 8 EI and w L^3 / 6 EI, exact for any number of elements while small; rods that were
    not named are different ones."""
    small = 1e-4
    robot = arm(*[rod(L / rods)] * rods, gravity=[0, 0, -9.80665 * small])
    answer = loaded(robot, beams=rs.Bowing(elements))
    w = LINE_WEIGHT * small
    assert np.isclose(answer.displacement[2], -w * L**4 / (8 * EI), rtol=1e-6, atol=0)
    assert np.isclose(answer.displacement[4], w * L**3 / (6 * EI), rtol=1e-6, atol=0)
    (reaction,) = answer.reactions
    assert np.isclose(reaction[2], -w * L, rtol=1e-12)
    assert np.isclose(reaction[4], -w * L**2 / 2, rtol=1e-6)  # about the tip


@pytest.mark.parametrize("elements", [1, 3])
@pytest.mark.parametrize("part", [0.0, 0.3, 0.5, 1.0])
def test_mass_on_a_beam_bends_it_where_it_lies(part: float, elements: int):
    """P a^2 (3 L - a) / 6 EI at the tip, for a mass of its own at a."""
    a, P = part * L, 0.02 * 9.80665
    robot = arm(rod(mass=Mass(0.02, [a, 0, 0])), gravity="-z")
    answer = loaded(robot, beams=rs.Bowing(elements))
    wanted = -P * a * a * (3 * L - a) / (6 * EI)
    assert np.isclose(answer.displacement[2], wanted, rtol=1e-4, atol=1e-12)
    assert np.isclose(answer.reactions[0][2], -P)


def test_column_buckles_under_its_own_weight():
    """q L^3 = 7.8373 EI (Greenhill); the error falls with the square of the elements."""
    factor = 10.0
    q = 7.8373 * EI / L**3
    upright = rs.beam_link([0, 0, L], STEEL, circle(D), mass=factor * q * L / 9.80665)
    errors = []
    for elements in (1, 2, 4):
        answer = loaded(arm(upright, gravity="-z"), beams=rs.Bowing(elements))
        assert rs.Status.BEYOND_CRITICAL_LOAD in answer.status
        # the least disturbance decides which way it leaves, the factor does not
        errors.append(abs(number(answer.critical_factor) * factor - 1))
    assert errors[1] < 5e-3
    assert errors[2] < 3e-4  # the shortening of the column among it


def every_mass(leg: PlacedLeg) -> Iterator[PlacedMass]:
    yield from leg.masses
    for block in leg.blocks:
        for branch in block.branches:
            yield from every_mass(branch)


@pytest.mark.parametrize("name", ["hexapod", "delta", "h4", "orthoglide", "six-joint-arm", "3-prs"])
def test_the_base_carries_all_weights(name: str):
    """Forces add up to the weight at any load, moments to that of the unloaded posture."""
    robot = rs.load(name)
    small = np.array([1.0, -2.0, -9.0]) * 1e-3
    answer = loaded(robot, gravity=small, wrench=[1e-3, 0, 0, 0, 2e-3, 0])
    snapshot = with_masses(find_posture(robot)).one(0)
    wanted = np.array([1e-3, 0, 0, 0, 2e-3, 0])
    for leg in snapshot.legs:
        for mass in every_mass(leg):
            force = float(mass.value) * small
            arm_ = mass.centre - snapshot.reference_point
            wanted = wanted + np.concatenate([force, np.cross(arm_, force)])
    total = np.sum(answer.reactions, axis=0)
    assert np.allclose(total[:3], wanted[:3], rtol=1e-10, atol=1e-12)
    assert np.allclose(total[3:], wanted[3:], atol=2e-5 * np.abs(wanted).max())
    heavy = loaded(robot, gravity=1e3 * small, beams=rs.Bowing(2))
    assert np.allclose(
        np.sum(heavy.reactions, axis=0)[:3], 1e3 * (wanted[:3] - [1e-3, 0, 0]), rtol=1e-9
    )


def test_gravity_of_the_robot_and_of_the_question():
    robot = arm(rod(), gravity="-z")
    own, asked = loaded(robot), loaded(arm(rod()), gravity=[0, 0, -9.80665])
    assert np.array_equal(own.displacement, asked.displacement)
    assert np.allclose(loaded(arm(rod())).displacement, 0)


def test_weight_lowers_the_critical_load():
    """P = pi^2 EI / 4 L^2 - 0.3 q L, Timoshenko and Gere, for an upright column."""
    q = 4.0 * EI / L**3
    upright = rs.beam_link([0, 0, L], STEEL, circle(D), mass=q * L / 9.80665)
    options = {"wrench": [0, 0, -1, 0, 0, 0], "beams": rs.Bowing(4), "up_to": 1e5}
    found = rs.critical_load(arm(upright, gravity="-z"), **options)
    euler = np.pi**2 * EI / (4 * L * L)
    assert np.isclose(found.factor, euler - 0.3 * q * L, rtol=0.02)
    weightless = rs.critical_load(arm(upright, gravity="-z"), gravity=[0, 0, 0], **options)
    assert np.isclose(weightless.factor, euler, rtol=3e-4)


def test_parts_of_one_name_are_numbered_and_refused_in_a_snapshot():
    """Loads and masses are known by names."""
    hinge = rs.revolute([0, 0, 1], rs.Actuated(1e3), name="beam1")
    chain = Chain((rod(), hinge, rod(), rod(name="tip")))
    assert [e.name for e in chain.elements] == ["beam2", "beam1", "beam3", "tip"]
    robot = arm(*chain.elements, gravity=[0, 0, -0.1])
    assert rs.compile_loaded(robot, backend=rs.Backend.ARRAYS).verified
    placed = find_posture(arm(rod(), rod())).snapshot.one(0)
    (leg,) = placed.legs
    twice = replace(leg, elements=(leg.elements[0], replace(leg.elements[1], name="beam1")))
    with pytest.raises(rs.InputError, match="arm/beam1, twice, expected each name once"):
        loaded(replace(placed, legs=(twice,)))


def test_a_force_at_a_point_of_a_body():
    """In the frame of the body, which a mass there hangs in as well."""
    robot = rs.load("hexapod")
    mass = {"leg1/strut": rs.Mass(12, centre=[0.1, 0.02, 0.3])}
    force = {"leg1/strut": rs.Weight([0, 0, -12 * 9.80665], [0.1, 0.02, 0.3])}
    one, other = (rs.equilibrium(robot, loads=own, gravity="-z") for own in (mass, force))
    assert np.abs(one.displacement).max() > 1e-9
    np.testing.assert_allclose(one.displacement, other.displacement, atol=1e-16)


def test_gravity_acts_on_masses_among_the_loads():
    """As the refusal of gravity on a robot without masses advises: here the masses are loads."""
    robot, mass = rs.load("gough-stewart-b"), rs.Mass(12.0)
    down = loaded(robot, loads={"platform": mass})
    for gravity, factor in (("-z", 1.0), ([0, 0, -1.62], 1.62 / 9.80665)):
        answer = loaded(robot, loads={"platform": [mass]}, gravity=gravity)
        assert np.isclose(answer.displacement[2], factor * down.displacement[2], rtol=1e-5, atol=0)
        small = rs.deflection(robot, loads={"platform": mass}, gravity=gravity)
        assert np.isclose(small.twist[2], answer.displacement[2], rtol=1e-5, atol=0)
    fast = rs.compile_loaded(
        robot, loads={"platform": mass}, gravity="-z", backend=rs.Backend.ARRAYS
    )
    home = find_posture(robot).pose
    found = fast.evaluate(home.reshape(1, 6), np.zeros(6)).displacement[0]
    assert np.allclose(found, down.displacement, rtol=1e-9, atol=1e-15)


def test_loads_that_do_not_all_act_are_no_answer(monkeypatch: pytest.MonkeyPatch):
    """As the base would carry less than is given."""
    robot = rs.load("delta")
    name = f"{robot.legs[0].name}/{next(iter(find_posture(robot).snapshot.legs[0].parts)).name}"
    loads = {name: [0, 0, -10.0], "platform": [1.0, 0, 0]}
    loaded(replace(robot), loads=loads)  # the posture with its loads stays with that one
    own: Any = loaded_posture.loaded_legs
    without = lambda *before, **more: own(*(*before[:4], {}, *before[5:]), **more)  # noqa: E731
    monkeypatch.setattr(loaded_posture, "loaded_legs", without)
    with pytest.raises(rs.NoAnswerError, match="loads are not those that are given"):
        loaded(robot, loads=loads)
    with pytest.raises(rs.NoAnswerError, match="loads are not those that are given"):
        rs.deflection(robot, loads=loads)


def test_centres_of_given_masses_are_in_the_frames_of_their_bodies():
    """As those of the model, at any posture: on the platform, behind a joint, and on a link."""
    at, m = rs.JointCoordinates([np.pi / 2]), Mass(1.0, [0.5, 0, 0])
    arm = partial(rs.serial_arm, convention=rs.DHConvention.STANDARD, joint_stiffness=[1000.0])
    bare, own = arm([rs.DHRow(a=1.0)]), arm([rs.DHRow(a=1.0, masses=(m,))])
    frequency = np.sqrt(1000 / 1.5**2) / (2 * np.pi)
    behind = Mass(1.0, [1.5, 0, 0])  # as the frame of the joint has it
    for given in ({"platform": m}, {"arm/joint1": behind}):
        assert np.allclose(rs.modes(bare, at, given).frequencies, frequency, rtol=1e-9)
        pull = [-10.0, 0, 0]
        sunk = rs.deflection(bare, at, loads=given, gravity=pull)
        assert np.isclose(sunk.twist[5], 10 * 1.5 / 1000, rtol=1e-9)
        far = loaded(bare, pose=at, loads=given, gravity=[-0.01, 0, 0])
        assert np.isclose(far.displacement[5], 0.01 * 1.5 / 1000, rtol=1e-6, atol=0)
    assert np.allclose(rs.modes(own, at).frequencies, frequency, rtol=1e-9)
    world = {"platform": Mass(1.0, point=[0, 1.5, 0])}
    assert np.allclose(rs.modes(bare, at, world).frequencies, frequency, rtol=1e-9)


def test_a_joint_of_several_freedoms_stands_where_its_first_does():
    """A cylindrical joint that has slid is as a slider and a hinge, by number and by kernel."""
    slid, foot, bar = [0.3, 0.2], rod(0.5, name="foot"), rod(0.4)
    drive = rs.Actuated(1e4)
    whole = arm(foot, rs.cylindrical([0, 0, 1], drive, home=slid, name="joint"), bar)
    single = arm(
        foot,
        rs.prismatic([0, 0, 1], drive, home=slid[:1], name="joint"),
        rs.revolute([0, 0, 1], drive, home=slid[1:], name="hinge"),
        bar,
    )
    force, place = np.array([30.0, -20.0, 10.0]), [0.5, 0.0, 0.0]
    wanted = loaded(single, loads={"arm/hinge": rs.DeadForce(force, place)}).displacement
    found = loaded(whole, loads={"arm/joint": force})
    assert np.allclose(found.displacement, wanted, rtol=0, atol=1e-13)
    kernel = rs.compile_loaded(whole, loads={"arm/joint": force}, backend=rs.Backend.ARRAYS)
    answer = kernel.evaluate(rs.JointCoordinates([slid]), np.zeros(6))
    assert np.allclose(answer.displacement, wanted, rtol=0, atol=1e-10)


ZERO = rs.JointCoordinates([0.0, 0.0])


def test_a_rotor_vibrates_beside_its_arm():
    """``sqrt(k / (J + m L^2))``; a slide carries kilograms."""
    k, J, m, L = 900.0, 0.7, 3.0, 0.5
    frame = Frame(np.eye(3), np.zeros(3))
    bar = rs.Rigid(Frame(np.eye(3), np.array([L, 0, 0])), "bar")
    for joint, exact in (
        (rs.revolute([0, 0, 1], rs.Actuated(k, inertia=J)), k / (J + m * L**2)),
        (rs.prismatic([0, 0, 1], rs.Actuated(k, inertia=J)), k / (J + m)),
    ):
        arm = rs.Robot("arm", (rs.Leg("arm", frame, rs.Chain((joint, bar)), frame),))
        found = rs.modes(arm, masses={"platform": m}).frequencies
        assert np.allclose(found, np.sqrt(exact) / (2 * np.pi), rtol=1e-9)
        alone = rs.modes(arm).frequencies  # without any other mass
        assert np.allclose(alone, np.sqrt(k / J) / (2 * np.pi), rtol=1e-9)


def test_model_files_and_snapshots_keep_it(tmp_path: Path):
    path = tmp_path / "arm.yaml"
    text = """
robostiff: 1
name: arm
source: chosen
legs:
  - name: leg
    chain:
      - {type: revolute, name: j, axis: y, role: actuated, stiffness: 1000 N m/rad, inertia: rotor}
      - {type: rigid, to: [1, 0, 0]}
parameters: {rotor: 0.2 kg m^2}
platform_masses: [{name: tool, mass: 3 kg}]
"""
    path.write_text(text, encoding="utf-8")
    robot = rs.load(path)
    exact = np.sqrt(1000 / 3.2) / (2 * np.pi)
    assert np.allclose(rs.modes(robot).frequencies, exact, rtol=1e-9)
    snapshot = with_masses(rs.find_posture(robot)).one(0)
    again = tmp_path / "arm.json"
    again.write_text(json.dumps(snapshot_to_data(snapshot)), encoding="utf-8")
    assert np.allclose(rs.modes(read_snapshot(again)).frequencies, exact, rtol=1e-9)
    for old, new, message in (
        ("inertia: rotor", "inertia: 2 kg", "a moment of inertia"),
        ("role: actuated, stiffness: 1000 N m/rad", "role: passive", "actuated joints only"),
    ):
        path.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(rs.FileError, match=message):
            rs.load(path)


TRANSMISSION = """<transmission name="t"><type>any</type><joint name="j1"/><actuator name="m">
  {}</actuator></transmission></robot>"""


@pytest.mark.parametrize(
    "drive",
    [
        '<drake:gear_ratio value="50"/><drake:rotor_inertia value="2e-4"/>',
        "<mechanicalReduction>50</mechanicalReduction><rotorInertia>2e-4</rotorInertia>",
    ],
)
def test_a_transmission_of_a_urdf_has_it(tmp_path: Path, drive: str):
    """Times the square of the reduction: as in the side file, where that has one."""
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace("</robot>", TRANSMISSION.format(drive)), encoding="utf-8")
    bare = tmp_path / "bare.urdf"
    bare.write_text(ARM, encoding="utf-8")
    side = with_side(tmp_path, SIDE)
    rotor = mass_matrix(robot_of(path, side), ZERO) - mass_matrix(robot_of(bare, side), ZERO)
    assert np.allclose(rotor, np.diag([0.5, 0.0]), atol=1e-12)
    given = SIDE.replace("stiffness: 2e4 N m/rad", "stiffness: 2e4 N m/rad, inertia: 0.3 kg m^2")
    other = robot_of(path, with_side(tmp_path, given))
    rotor = mass_matrix(other, ZERO) - mass_matrix(robot_of(bare, with_side(tmp_path, SIDE)), ZERO)
    assert np.allclose(rotor, np.diag([0.3, 0.3]), atol=1e-12)


def test_an_armature_of_a_urdf_is_at_the_joint(tmp_path: Path):
    path = tmp_path / "arm.urdf"
    text = ARM.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><dynamics armature="0.4"/>', 1)
    path.write_text(text, encoding="utf-8")
    with_rotor = mass_matrix(robot_of(path, with_side(tmp_path, SIDE)), ZERO)
    path.write_text(ARM, encoding="utf-8")
    bare = mass_matrix(robot_of(path, with_side(tmp_path, SIDE)), ZERO)
    assert np.allclose(with_rotor - bare, np.diag([0.4, 0.0]), atol=1e-12)

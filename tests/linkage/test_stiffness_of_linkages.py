"""Stiffness of linkages: as networks, as robots of legs, and at random."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.linkage_stiffness import ConfigurationsOfLinkage
from robostiff.elasticity import circle, material
from robostiff.elastostatics import Status
from robostiff.kinematics import ActuatorCoordinates
from robostiff.linkage import Connection, Linkage, close, essential, robot_of
from robostiff.linkage.essential import network_of
from robostiff.model import (
    Actuated,
    Link,
    Mass,
    Passive,
    beam_link,
    cylindrical,
    planar,
    revolute,
    spherical,
)
from robostiff.spatial import Frame
from tests.campaign.moved_linkages import by_forces, fitting, moved_linkage, open_by, random_frame

FOUR_BAR = Path(__file__).parents[2] / "examples" / "four-bar.xml"
ANGLES = [-0.3, 0.0, 0.4]
F = np.array([10.0, -20, 30, 1, 2, 3])


@pytest.fixture(scope="module")
def four_bar():
    return rs.load_linkage(FOUR_BAR)


def _alike(result, network):
    own = rs.stiffness(network)
    assert result.status == own.status
    assert result.rank == own.rank
    np.testing.assert_allclose(result.reference_point, own.reference_point, atol=1e-12)
    size = np.sqrt(np.diag(own.matrix))
    np.testing.assert_array_less(np.abs(result.matrix - own.matrix), 1e-9 * np.outer(size, size))


def test_at_values_it_is_the_network_at_these(four_bar):
    _alike(rs.stiffness(four_bar), rs.network_at(four_bar))
    every = rs.stiffness(four_bar, {"crank": ANGLES})
    assert every.batch_shape == (3,)
    for i, angle in enumerate(ANGLES):
        network = rs.network_at(four_bar, {"crank": angle})
        _alike(every[i], network)
        _alike(rs.stiffness(four_bar, {"crank": angle}), network)
    assert every.joint_coordinates["crank"][:, 0].tolist() == ANGLES


@pytest.mark.parametrize("values", [None, {"crank": 0.35}, {"crank": -0.2}])
def test_the_network_and_its_energy_check_the_direct_form(four_bar, values):
    checked = rs.verify(four_bar, values)
    assert checked.agree
    assert [one.method for one in checked.comparisons] == ["network", "energy"]
    assert checked.reference.method.name == "wrench-basis"


def test_values_come_by_name_in_rows_or_as_coordinates_of_actuators(four_bar):
    rows = np.reshape(ANGLES, (3, 1))
    expected = rs.stiffness(four_bar, {"crank": ANGLES}).K
    ways = (rows, ActuatorCoordinates({"crank": ANGLES}), ActuatorCoordinates(rows))
    for values in ways:
        assert np.array_equal(rs.stiffness(four_bar, values).K, expected)
    table = rs.stiffness(four_bar, {"crank": [ANGLES, ANGLES]})
    # Arrays of another length may be rounded otherwise.
    scale = np.abs(expected).max()
    np.testing.assert_allclose(table.K, [expected, expected], rtol=0, atol=1e-13 * scale)
    assert rs.stiffness(four_bar, np.zeros((0, 1))).K.shape == (0, 6, 6)


def test_out_of_reach_is_a_status_with_the_gap():
    """Bars of 500 mm end where the feet are 500 mm apart."""
    linkage = rs.load_linkage("double-pantograph")
    every = rs.stiffness(linkage, {"screw": [0.2, -0.1]})
    assert every.status_codes.tolist() == [Status.UNREACHABLE, Status.OK]
    assert every.rank.tolist() == [-1, 6]
    one = every[0]
    assert "100 mm" in one.advice[0]
    assert one.compliance is None
    C = rs.compliance(linkage, {"screw": [0.2, -0.1]})
    assert np.ma.getmaskarray(C)[:, 0, 0].tolist() == [True, False]


def test_deflection_compliance_and_indices_are_those_of_the_networks(four_bar):
    values = {"crank": ANGLES}
    bent = rs.deflection(four_bar, values, F)
    C = rs.compliance(four_bar, values)
    found = rs.indices(four_bar, values)
    for i, angle in enumerate(ANGLES):
        network = rs.network_at(four_bar, {"crank": angle})
        expected = rs.deflection(network, None, F)
        np.testing.assert_allclose(bent.twist[i], expected.twist, rtol=1e-9)
        for one in (bent[i], rs.deflection(four_bar, {"crank": angle}, F)):
            assert [p.part for p in one.parts] == [p.part for p in expected.parts]
            np.testing.assert_allclose(one.energy, expected.energy, rtol=1e-9)
        np.testing.assert_allclose(C[i], rs.compliance(network), rtol=1e-8, atol=1e-8 * C[i].max())
        expected = rs.indices(network).collinear.smallest
        np.testing.assert_allclose(found[i].collinear.smallest, expected, rtol=1e-9)


@cache
def _with_record():
    """A linkage that records itself at once, and its answer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ConfigurationsOfLinkage, "pays", (0, 1, 10**9))
        linkage = rs.load_linkage(FOUR_BAR)
        return linkage, rs.stiffness(linkage, {"crank": [*ANGLES, 0.7]})


def test_many_poses_are_answered_by_the_record():
    _, answer = _with_record()
    fresh = rs.load_linkage(FOUR_BAR)
    assert answer.recorded is not None
    assert not any("details" in name for name in vars(answer))
    for i, angle in enumerate([*ANGLES, 0.7]):
        _alike(answer[i], rs.network_at(fresh, {"crank": angle}))
    assert not any("details" in name for name in vars(answer))
    about = rs.stiffness(fresh, {"crank": ANGLES[0]}, at=[0, 0, 0]).K
    own = answer.about(np.zeros(3))[0].K
    np.testing.assert_allclose(own, about, rtol=1e-9, atol=1e-9 * about.max())


def test_a_record_that_differs_from_the_network_is_an_error():
    _, answer = _with_record()
    question: Any = answer.question
    asked = ConfigurationsOfLinkage(question.driven, question.numbers)
    assert answer.recorded is not None
    asked.recorded = replace(answer.recorded, values={"K": 1.01 * answer.recorded.matrix})
    with pytest.raises(rs.DisagreementError, match="record of a linkage"):
        rs.Stiffness(asked, asked.rows)[0].details()


def test_another_tolerance_is_not_left_to_the_record():
    linkage, _ = _with_record()
    strict = rs.stiffness(linkage, {"crank": [0.1]}, tolerance=rs.Tolerance(independence=1e-8))
    assert strict.recorded is None


def test_rigid_bars_have_a_compliance_and_a_deflection(four_bar):
    """Nothing bends but the crank's drive: no K, and the compliance of the drive alone."""
    rigid = tuple(
        replace(c, element=None, after=_end(c)) if isinstance(c.element, Link) else c
        for c in four_bar.connections
    )
    linkage = replace(four_bar, connections=rigid)
    values = {"crank": ANGLES}
    answer = rs.stiffness(linkage, values)
    assert all(Status(int(code)) & Status.RIGID_DIRECTION for code in answer.status_codes)
    C = rs.compliance(linkage, values)
    bent = rs.deflection(linkage, values, F)
    for i, angle in enumerate(ANGLES):
        network = rs.network_at(linkage, {"crank": angle})
        np.testing.assert_allclose(C[i], rs.compliance(network), atol=1e-9 * np.abs(C[i]).max())
        expected = rs.deflection(network, None, F).twist
        np.testing.assert_allclose(bent.twist[i], expected, atol=1e-9 * np.abs(expected).max())
        assert bent[i].leg_wrenches == ()


def _end(connection):
    """The frame of body b behind a bar that does not bend."""
    assert isinstance(connection.element, Link)
    return Frame(np.eye(3), np.asarray(connection.element.to)) @ connection.after


def _element(rng, name, kind):
    home = rng.uniform(-1, 1, 2).tolist()
    axis, other = rng.normal(size=3), rng.normal(size=3)
    match kind:
        case 0:
            return rs.beam_link(axis, material("steel"), circle(0.03), name=name)
        case 1:
            return rs.universal(axis, other, rs.Passive(), home=home, name=name)
        case 2:
            return rs.revolute(axis, rs.Actuated(3e4), home=home[:1], name=name)
        case 3:
            return rs.prismatic(axis, rs.Actuated(2e6), home=home[:1], name=name)
        case 5:
            return rs.helical(axis, 0.1, rs.Passive(), home=home[:1], name=name)
    return rs.revolute(axis, rs.Passive(), home=home[:1], name=name)


def _parallel(rng, legs):
    """Legs of six elements, some described from platform to base, and an arm that dangles."""
    frames = {"base": Frame.identity(), "platform": random_frame(rng)}
    connections = []
    for leg in range(legs):
        bodies = ["base", *(f"{leg}.{i}" for i in range(5)), "platform"]
        frames |= {body: random_frame(rng) for body in bodies[1:-1]}
        kinds = rng.permutation([0, 1, 2, 3, 5, 0])
        for i, kind in enumerate(kinds):
            a, b = bodies[i : i + 2] if rng.random() < 0.5 else bodies[i : i + 2][::-1]
            name = f"leg{leg}.{i}"
            connections.append(fitting(rng, "space", name, a, b, frames, _element(rng, name, kind)))
    frames["hook"] = random_frame(rng)
    hook = fitting(rng, "space", "hook", "0.2", "hook", frames, _element(rng, "hook", 4))
    rng.shuffle(connections)
    tip = rng.normal(size=3)
    return Linkage("random", (hook, *connections), "base", "platform", tip), frames


@pytest.mark.parametrize("legs", [1, 2, 3])
@pytest.mark.parametrize("seed", range(2))
def test_a_robot_and_a_network_of_one_linkage_agree(legs, seed):
    linkage, frames = _parallel(np.random.default_rng([legs, seed]), legs)
    part = essential(linkage)
    assert len(part.connections) == 6 * legs
    found = close(part)
    assert found.is_closed
    for body, frame in found.frames.items():
        assert np.allclose(frame.p, frames[body].p, atol=1e-9)
        assert np.allclose(frame.R, frames[body].R, atol=1e-9)
    robot = robot_of(part, found)
    assert robot is not None
    one, other = rs.stiffness(robot), rs.stiffness(network_of(part, found))
    assert one.rank == other.rank
    scale = np.abs(other.K).max()
    assert np.abs(one.K - other.K).max() < 1e-8 * scale
    assert np.allclose(one.reference_point, other.reference_point, atol=1e-9)


def test_legs_that_share_a_body_are_no_robot():
    linkage, frames = _parallel(np.random.default_rng(4), 2)
    rng = np.random.default_rng(5)
    bridge = fitting(rng, "space", "bridge", "0.2", "1.3", frames, _element(rng, "bridge", 0))
    part = essential(Linkage("l", (*linkage.connections, bridge), "base", "platform", np.zeros(3)))
    assert robot_of(part, close(part)) is None


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    "masses",
    [
        (Mass(3.0),),
        (Mass(2.0, span=(0.0, 0.25)), Mass(1.0, span=(0.25, 1.0))),
        (Mass(3.0, [0.1, 0.2, 0.3], inertia=[0.1, 0.2, 0.25]), Mass(1.0, inertia=[0.1, 0.1, 0.1])),
    ],
)
def test_masses_of_a_link_that_hangs_are_those_of_one_that_holds_the_platform(masses, turned):
    """A drive stores the same energy and swings as fast, if the link hardly bends."""
    to, here = np.array([0.5, 0.1, 0.2]), Frame.identity()
    shift, hinge = np.array([0.2, 0.1, 0]), revolute([0.2, 0.3, 1], Actuated(2e3), name="drive")
    ways = "hand", "tip", Frame(here.R, shift)
    if turned:
        masses = tuple(
            replace(own, centre=own.centre - to)
            if own.centre is not None
            else replace(own, span=own.span and (1 - own.span[1], 1 - own.span[0]))
            for own in masses
        )
        to, ways = -to, ("tip", "hand", here)
    beam = beam_link(to, material("steel"), circle(0.002), name="beam")
    stiff = rs.Elasticity(1e-9 * beam.elasticity.compliance)
    beam = replace(beam, elasticity=stiff, masses=masses)
    link = Connection("beam", *ways, beam, Frame(here.R, -shift) if turned else here)
    parts = Connection("drive", "base", "hand", here, hinge, here), link
    held, hung = (Linkage("l", parts, "base", end, np.zeros(3)) for end in ("tip", "hand"))
    known, found = (
        {part.part: part.energy for part in rs.equilibrium(each, gravity="-y").parts}["drive"]
        for each in (held, hung)
    )
    assert found == pytest.approx(known, rel=1e-8)
    first, *_ = rs.modes(held).frequencies
    assert rs.modes(hung).frequencies == pytest.approx([first], rel=1e-5)


def test_coordinates_of_all_drives_need_no_names_under_load_either():
    lift = rs.load_linkage("double-pantograph")
    load = [100.0, 50, -30, 1, 1, 1]
    by_name = rs.equilibrium(lift, {"screw": -0.1}, load).displacement
    for values in ([-0.1], [[-0.1]], np.array([-0.1]), rs.ActuatorCoordinates([-0.1])):
        np.testing.assert_array_equal(rs.equilibrium(lift, values, load).displacement, by_name)
        assert rs.modes(lift, values, {"platform": 1.0}).frequencies[0] > 0


@pytest.mark.parametrize("first", [cylindrical, planar])
def test_a_slide_on_the_base_moves_an_axis_that_does_not_turn(first):
    """The loop ends at the base as well: neither its end nor the axis depends on coordinates."""
    rng = np.random.default_rng(5)
    frames = {"base": Frame.identity()} | {body: random_frame(rng) for body in "abcd"}
    x, y, z = rng.normal(size=(3, 3))
    elements = {
        "first": ("base", "a", first(x, Passive())),
        "crank": ("a", "b", revolute(y, Actuated(1e5))),
        "bar": ("b", "c", beam_link(z, material("steel"), circle(0.03))),
        "ball": ("c", "d", spherical(Passive())),
        "last": ("d", "base", cylindrical(z, Passive())),
    }
    linkage = Linkage(
        "loop",
        tuple(
            fitting(rng, "space", n, a, b, frames, replace(e, name=n))
            for n, (a, b, e) in elements.items()
        ),
        "base",
        "c",
        np.zeros(3),
    )
    found = close(linkage, {"crank": 0.05})
    assert found.is_closed
    assert open_by(linkage, found) < 1e-9
    answer, truth = rs.stiffness(linkage, {"crank": 0.05}), by_forces(linkage, found)
    assert truth is not None
    assert not truth.in_doubt
    assert answer.rank == truth.rank
    assert (truth.K is None) == bool(answer.status & rs.Status.RIGID_DIRECTION)
    if truth.K is not None:
        np.testing.assert_allclose(answer.matrix, truth.K, atol=1e-8 * np.abs(truth.K).max())


@pytest.mark.parametrize("number", [0, 1, 2, 3, 66])
def test_random_linkages_are_as_forces_say(number):
    """That of number 66 has a record, and a drive that follows."""
    assert not moved_linkage(np.random.default_rng([20261122, number]))


@pytest.mark.parametrize(
    ("away", "status"),
    [(1e-3, rs.Status.OK), (1e-5, rs.Status.OK), (1e-9, rs.Status.ILL_CONDITIONED)],
)
def test_loops_that_are_nearly_singular_leave_few_digits(away, status):
    """A flat pantograph: heights follow from its stroke by a square root, of half the digits."""
    lift = rs.load_linkage("double-pantograph")
    answer = rs.stiffness(lift, {"screw": 0.1 - away})
    assert answer.status == status
    # Beside the true stiffness, proportional to the stroke that is left, up to what remains of it.
    assert answer.matrix[2, 2] == pytest.approx(0.99e6 * away, rel=1e-2)

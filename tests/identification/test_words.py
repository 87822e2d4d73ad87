"""What measurements do not tell is named."""

from __future__ import annotations

import numpy as np
import pytest

import robostiff as rs
from robostiff.identification.unknowns import Unknown, UnknownKind, identifiability
from tests.files import written
from tests.identification.campaigns import (
    arm_campaign,
    arm_frames,
    case,
    column,
    hexapod_campaign,
    hexapod_frames,
    machine,
)


def test_vertical_loads_do_not_strain_an_upright_axis():
    robot = machine("arm")
    found = rs.identify(robot, arm_campaign(loads=(0, 1)), ["arm/joint*"])
    assert [s.partition(":")[0] for s in found.not_identified] == [
        "no measurement depends on arm/joint1"
    ]
    assert (
        "(a force that is parallel to its axis, or meets it, does not)" in found.not_identified[0]
    )
    assert "arm/joint1" not in found.std
    assert found.values["arm/joint1"] == pytest.approx(2.5e-6)
    assert rs.FitStatus.NOT_IDENTIFIED in found.status
    assert found.status.is_bad
    for name in ("arm/joint1", "arm/joint1.zero"):  # none of its own, and no compliance
        with pytest.raises(rs.InputError, match="expected a compliance that was found: arm/joint2"):
            found.stiffness_interval(name)


def test_zeros_of_the_ends_are_frames():
    """The first zero turns the robot in the instrument, the last one the markers."""
    robot = machine("arm")
    weights = arm_campaign(loads=(0,))
    asked = ["arm/joint1.zero", "arm/joint2.zero", "arm/joint6.zero"]
    found = rs.identify(robot, weights, asked)
    assert len(found.not_identified) == 2
    first, last = sorted(found.not_identified, key=lambda s: "joint6" in s.partition(":")[2])
    assert first == (
        "no measurement distinguishes arm/joint1.zero and the place and turn of the instrument: "
        "arm/joint1.zero keeps its value"
    )
    assert last.startswith("no measurement distinguishes arm/joint6.zero, ")
    assert "instrument" not in last
    assert last.endswith(": arm/joint6.zero keeps its value")


def test_lengths_that_are_frames(tmp_path):
    """Of two parallel axes the shift along them is the first height; the tool is the markers'."""
    text = case("arm")["arm_yaml"].replace("to: [0.18, 0, 0.48]", "to: [0.18, 0, height]")
    text = text.replace("to: [0.12, 0, 0]", "to: [flange, 0, 0]")
    text = text.replace("to: [0, 0, upper]", "to: [0, aside, upper]")
    text = text.replace("  upper: 0.7 m", "  upper: 0.7 m\n  height: 0.48 m\n  flange: 0.12 m\n"
                        "  aside: 0 m\n  aside3: 0 m")  # fmt: skip
    text = text.replace("to: [fore, 0, 0]", "to: [fore, aside3, 0]")
    file = written(tmp_path / "lengths.yaml", text)
    names = ["height", "flange", "aside", "aside3"]
    robot = rs.load(file, symbols=names)
    found = rs.identify(robot, arm_campaign(loads=(0,)), names)
    alike = [s.removeprefix("no measurement distinguishes ") for s in found.not_identified]
    told = {s.partition(",")[0].partition(" and")[0]: s for s in alike}
    assert "instrument z" in told["height"]
    assert "height keeps its value" in told["height"]
    assert {"a x", "b x", "c x"} <= set(
        told["flange"].replace(" and ", ", ").replace(": ", ", ").split(", ")
    )
    pair = [s for s in found.not_identified if "aside and aside3" in s or "aside3 and aside" in s]
    assert len(pair) == 1
    assert len(found.not_identified) == 3


def test_a_strut_with_its_bearing(tmp_path):
    text = case("hexapod")["model_yaml"].replace(
        "      - {type: spherical, role: passive}",
        "      - {type: spring, name: bearing, compliance: [0, 0, 1e-9 m/N, 0, 0, 0]}\n"
        "      - {type: spherical, role: passive}",
    )
    robot = rs.load(written(tmp_path / "bearings.yaml", text))
    asked = ["leg*/strut", "leg*/bearing"]
    found = rs.identify(robot, hexapod_campaign(), asked, frames=hexapod_frames())
    assert sorted(found.not_identified) == [
        f"only the sum of leg{k}/bearing and leg{k}/strut is determined: leg{k}/bearing keeps its "
        "value"
        for k in range(1, 7)
    ]
    sums = [found.values[f"leg{k}/strut"] + found.values[f"leg{k}/bearing"] for k in range(1, 7)]
    np.testing.assert_allclose(sums, column("hexapod", "estimate"), rtol=1e-8)
    alone = rs.identify(robot, hexapod_campaign(), asked, fixed=["leg*/bearing"],
                        frames=hexapod_frames())  # fmt: skip
    assert alone.not_identified == ()


@pytest.mark.parametrize(
    ("r", "told", "weak"), [(0.88, False, False), (0.92, True, False), (0.985, False, True)]
)
def test_correlations_are_told_from_09_and_weak_from_098(r, told, weak):
    """Of rates whose covariance has this correlation."""
    several = [Unknown(name, UnknownKind.COMPLIANCE, 1.0, "m/N") for name in ("one", "other")]
    covariance = np.array([[1.0, -r], [-r, 1.0]])
    found = identifiability(np.linalg.cholesky(np.linalg.inv(covariance)).T, several)
    words = "errors of one go together with those of other, correlations above "
    assert [own.startswith(f"{words}0.9:") for own in found.correlated] == [True] * told
    assert [own.startswith(f"{words}0.98:") for own in found.weak] == [True] * weak
    assert found.not_identified == ()


def test_coordinates_of_a_whole_frame_are_its_place_and_turn():
    """One sentence names what has no effect: the frame, or the coordinate of it that has none."""
    of = "the instrument"
    several = [
        Unknown(f"instrument {turn}{a}", UnknownKind.FRAME, 0.0, unit, frame=(what, of))
        for turn, what, unit in (("", "place", "m"), ("turn ", "turn", "rad"))
        for a in "xyz"
    ]
    frame = ("place", "m1")
    several += [Unknown(f"m1 {a}", UnknownKind.FRAME, 0.0, "m", frame=frame) for a in "xyz"]
    spring = Unknown("spring", UnknownKind.COMPLIANCE, 1.0, "m/N")
    J = np.diag([1.0] * 10)
    J[:, 0] = J[:, 1:7].sum(axis=1)  # the spring moves readings as the instrument does
    J[9, 9] = 0.0
    found = identifiability(J, [spring, *several])
    assert found.not_identified[0].startswith("no measurement depends on m1 z; ")
    assert found.not_identified[1:] == (
        "no measurement distinguishes spring and the place and turn of the instrument: spring "
        "keeps its value",
    )


def test_a_compliance_at_its_bound_has_an_interval_on_one_side():
    robot = machine("arm")
    found = rs.identify(
        robot, arm_campaign(), ["arm/joint*"], frames=arm_frames(),
        bounds={"arm/joint2": (1.5e-6, 1.0)},
    )  # fmt: skip
    low, high = found.interval()["arm/joint2"]
    assert low == found.values["arm/joint2"] == pytest.approx(1.5e-6, rel=1e-4)
    assert high == pytest.approx(low + 1.644853627 * found.std["arm/joint2"])
    assert rs.FitStatus.AT_BOUND in found.status


def test_fewer_numbers_than_unknowns():
    robot = machine("arm")
    few = arm_campaign().chosen([0])
    found = rs.identify(robot, few, ["arm/joint*"], frames=arm_frames())
    assert found.status is rs.FitStatus.TOO_FEW_ROWS
    assert found.status.is_bad
    assert found.status.words == "too-few-rows"
    (advice,) = found.advice
    assert advice.startswith("3 numbers were read, for 6 unknowns: arm/joint1, arm/joint2")
    assert found.values == found.std == {}
    with pytest.raises(rs.NoAnswerError, match="3 numbers were read"):
        _ = found.robot


def test_millimetres_read_as_metres():
    robot = machine("arm")
    wrong = arm_campaign()
    wrong = rs.Measurements(
        wrong.postures, 1000 * wrong.values, forces=wrong.forces, hooks=wrong.hooks,
        markers=wrong.markers, sigma=wrong.sigma,
    )  # fmt: skip
    with pytest.raises(rs.InputError, match="look at the units of readings and joints"):
        rs.identify(robot, wrong, ["arm/joint*"])


def test_a_factor_of_a_bearing_is_one_of_its_compliance():
    """All entries grow alike."""
    robot, name = rs.load("hexapod"), "leg1/base bearings.factor"
    found = rs.identify(robot, hexapod_campaign(), [name], frames=hexapod_frames())
    factor = found.values[name]
    pairs = zip(robot.legs[0].chain.elements, found.robot.legs[0].chain.elements, strict=True)
    for before, after in pairs:
        if isinstance(before, rs.Link) and isinstance(after, rs.Link):
            expected = before.elasticity.compliance * (
                factor if before.name == "base bearings" else 1.0
            )
            np.testing.assert_allclose(after.elasticity.compliance, expected, rtol=1e-14)
    assert factor != 1.0


def test_readings_that_no_robot_has_are_no_fault_of_the_postures(monkeypatch):
    """Readings of 70 m end where rates are not known; only singular postures were blamed."""
    lost = "robostiff.identification.readings.ReadingModel.prediction"

    def nowhere(model, x):
        return np.full(len(model.values), np.nan), np.zeros((len(model.values), len(x)))

    monkeypatch.setattr(lost, nowhere)
    with pytest.raises(rs.InputError, match="look at the units of readings and loads"):
        rs.identify(machine("arm"), arm_campaign(), ["arm/joint*"], frames=arm_frames())


@pytest.mark.parametrize("name", ["leg y/drive", "leg z/drive"])
def test_a_single_unknown_that_no_load_strains(name: str):
    """Its rates are rounding, and there is no other of its kind beside which they are none."""
    robot = rs.load("tripteron")
    loads = np.array([[0, 0, 0, 0, 0, 0], [100.0, 0, 0, 0, 0, 0]])
    moved = [1.02 * rs.deflection(robot, wrench=load).twist[:3] for load in loads]
    read = rs.Measurements(
        np.zeros((2, 3)) + rs.find_posture(robot).pose[0, robot.coordinate_places], moved,
        wrenches=loads, kinds=rs.Reading.DISPLACEMENT, sigma=1e-7,
    )  # fmt: skip
    found = rs.identify(robot, read, [name], frames=rs.KnownFrames({"marker": [0, 0, 0]}))
    assert rs.FitStatus.NOT_IDENTIFIED in found.status
    assert found.not_identified[0].startswith(f"no measurement depends on {name}: ")
    assert found.values == {name: pytest.approx(2.5e-8)}
    assert name not in found.std


def test_rates_that_are_rounding_beside_the_readings():
    J = np.array([[1e-14], [0.0]])
    unknowns = [Unknown("c", UnknownKind.COMPLIANCE, 1.0, "m/N")]
    assert identifiability(J, unknowns, 1.0).fixed == (0,)
    assert identifiability(J, unknowns, 1e-4).fixed == ()


@pytest.mark.parametrize("name", ["tool", "arm"])
def test_lengths_of_hybrid_machines_need_drives_as_postures(name: str):
    """They move the drives of a platform in its place, though not those of home."""
    robot = rs.load("examples/tricept-with-head.yaml", symbols=(name,))
    read = rs.Measurements(
        [[0.1, 0.05, -1.6, 0.1, 0.2]] * 2, [[0, 0, 0], [1e-4, 0, 0]], sigma=1e-6,
        wrenches=[[0] * 6, [900, 500, -2000, 0, 0, 0]], kinds=rs.Reading.DISPLACEMENT,
    )  # fmt: skip
    frames = rs.KnownFrames({"marker": [0, 0, -0.45]})
    with pytest.raises(rs.InputError, match=f"'{name}' of .*: got a length or an angle, with pos"):
        rs.identify(robot, read, [name], frames=frames)

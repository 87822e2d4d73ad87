"""A tapered beam is its segments in series: under loads, in its modes, in kernels and in files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import robostiff as rs
from robostiff.elasticity import Elasticity, beam_compliance, tapered_compliance
from robostiff.io.document import parse_document
from robostiff.io.snapshot import snapshot_from_document, snapshot_to_data
from robostiff.linkage import Connection
from robostiff.linkage.essential import turned_round

ARM = """
robostiff: 1
name: arm
source: a test
gravity: "-z"
legs:
  - name: arm
    chain:
      - {{type: revolute, name: j1, axis: z, role: actuated, stiffness: 3e5 N m/rad}}
{0}
      - {{type: revolute, name: j2, axis: y, role: actuated, stiffness: 2e5 N m/rad}}
{1}
"""
BEAM = (
    "      - {{type: beam, name: {}, to: {}, y_axis: [0, 1, 0], material: steel, theory: {}, {}}}"
)
THICK = "section: {tube: {outer_diameter: 60 mm, inner_diameter: 50 mm}}"
THIN = "section: {rectangle: {width_y: 20 mm, height_z: 30 mm}}"
TAPER = f"taper: [{{share: 0.3, {THICK}}}, {{share: 0.7, {THIN}}}]"
F, Q = np.array([300, 200, -500, 10, 20, 30.0]), rs.JointCoordinates([0.3, 0.9])


@pytest.fixture(scope="module", params=["euler-bernoulli", "timoshenko"])
def arms(request: Any, tmp_path_factory: Any) -> list[Any]:
    """An arm of tapered beams, and the same with each segment as a beam."""
    tapered, apart = [], []
    for name, end in (("upper", (0, 0.5)), ("lower", (0.4, 0.1))):
        x, z = end
        tapered.append(BEAM.format(name, [x, 0, z], request.param, TAPER))
        each = ((0.3, THICK), (0.7, THIN))
        apart.append(
            "\n".join(
                BEAM.format(f"{name}{i}", [s * x, 0, s * z], request.param, section)
                for i, (s, section) in enumerate(each)
            )
        )
    folder, found = tmp_path_factory.mktemp("arms"), []
    for name, beams in (("tapered", tapered), ("apart", apart)):
        path = Path(folder / f"{name}.yaml")
        path.write_text(ARM.format(*beams), encoding="utf-8")
        found.append(rs.load(path))
    return found


@pytest.mark.parametrize(
    "beams", [rs.Bowing(), rs.Bowing(3), rs.Bowing(2, inner_modes=True), rs.Linear()], ids=str
)
def test_an_equilibrium_is_that_of_the_segments(arms: list[Any], beams: Any):
    one, other = (rs.equilibrium(arm, Q, F, beams=beams) for arm in arms)
    np.testing.assert_allclose(one.displacement, other.displacement, rtol=1e-10)
    np.testing.assert_allclose(one.K, other.K, rtol=1e-10)
    energy = {part.part: part.energy for part in one.shares}
    each = {part.part: part.energy for part in other.shares}
    assert energy["upper"] == pytest.approx(each["upper0"] + each["upper1"], rel=1e-9)


def test_modes_small_loads_and_critical_loads_are_those_of_the_segments(arms: list[Any]):
    for options in ({}, {"wrench": F, "beams": rs.Bowing(3)}):
        one, other = (rs.modes(arm, Q, **options).frequencies for arm in arms)
        np.testing.assert_allclose(one, other, rtol=1e-9)
    one, other = (rs.deflection(arm, Q, F, gravity="-z").twist for arm in arms)
    np.testing.assert_allclose(one, other, rtol=1e-10)
    same = rs.Bowing(1, inner_modes=True)  # by default each divides as it bends
    one, other = (rs.critical_load(arm, Q, F, beams=same).factor for arm in arms)
    assert one == pytest.approx(other, rel=1e-9)


def test_kernels_under_load_are_those_of_the_segments(tmp_path: Path):
    """Of one beam: that of a tapered beam is known to be that of its segments."""
    arm = ARM.format(BEAM.format("upper", [0.2, 0, 0.5], "timoshenko", TAPER), "")
    (tmp_path / "arm.yaml").write_text(arm, encoding="utf-8")
    robot: Any = rs.load(tmp_path / "arm.yaml")
    rows = [[0.3, 0.9], [0.1, 0.2]]
    found = rs.compile_loaded(robot).evaluate(rs.JointCoordinates(rows), F)
    assert not found.guarded.any()
    each = [rs.equilibrium(robot, rs.JointCoordinates(q), F) for q in rows]
    wanted = np.stack([one.displacement for one in each])
    np.testing.assert_allclose(found.displacement, wanted, rtol=1e-9, atol=1e-15)


def test_a_snapshot_file_keeps_segments(arms: list[Any]):
    snapshot: Any = rs.equilibrium(arms[0], Q, F).snapshot
    again = snapshot_from_document(parse_document(json.dumps(snapshot_to_data(snapshot))))
    found, expected = (rs.equilibrium(own, None, F) for own in (again, snapshot))
    np.testing.assert_allclose(found.displacement, expected.displacement, rtol=1e-9)


E, L, DIAMETERS = 210e9, 0.5, (0.04, 0.02)
STEEL = rs.Material("steel", E, E / 2.6)


def mast(elasticity: Elasticity) -> rs.Robot:
    here = rs.Frame(np.eye(3), np.zeros(3))
    link = rs.Link(np.array([2 * L, 0, 0]), elasticity, np.eye(3), "mast")
    return rs.Robot("mast", (rs.Leg("mast", here, rs.Chain((link,)), here),), coordinates=())


def test_a_mast_that_is_thinner_above_buckles_as_its_two_columns():
    """``tan(k1 L) tan(k2 L) = k2 / k1`` with P = E I k^2 of each, clamped below, free above."""
    I = np.pi / 64 * np.array(DIAMETERS) ** 4

    def missing(P: float) -> float:
        k1, k2 = np.sqrt(P / (E * I))
        return float(np.tan(k1 * L) * np.tan(k2 * L) - k2 / k1)

    exact: Any = brentq(missing, 1.0, 0.999 * E * I[1] * (np.pi / 2 / L) ** 2)
    segments = [(L, STEEL, rs.circle(d)) for d in DIAMETERS]
    each = tuple(beam_compliance(*segment) for segment in segments)
    robot = mast(Elasticity(tapered_compliance(segments), segments=each))
    found = rs.critical_load(robot, None, [-1000.0, 0, 0, 0, 0, 0])
    assert 0 <= 1000 * found.factor / exact - 1 < 1e-3


def test_the_matrix_of_a_taper_is_no_beam_of_another_length():
    """It is that of a shorter beam soft in shear, too; nothing says that it is one."""
    C = tapered_compliance([(L, STEEL, rs.circle(d)) for d in DIAMETERS])
    assert Elasticity(C).beams == ()
    (beam,) = Elasticity(C, segments=()).beams
    assert beam.length < 1.2 * L
    uniform = Elasticity(beam_compliance(2 * L, STEEL, rs.circle(0.04)))
    assert [own.length for own in uniform.beams] == pytest.approx([2 * L])


def test_a_beam_from_its_other_end_is_a_beam():
    """Legs of linkages lead from the base to the platform, whichever way links are written."""
    here = rs.Frame(np.eye(3), np.zeros(3))
    segments = [(0.4 * L, STEEL, rs.circle(0.04)), (0.6 * L, STEEL, rs.circle(0.02))]
    each = tuple(beam_compliance(*segment) for segment in segments)
    own = Elasticity(tapered_compliance(segments), segments=each)
    axes = rs.beam_link([0, 0.3, 0.4], STEEL, rs.circle(0.02)).axes
    link = rs.Link(np.array([0, 0.3, 0.4]), own, axes, "rod")
    back: Any = turned_round(Connection("rod", "a", "b", here, link, here)).element
    other = tapered_compliance(segments[::-1])
    np.testing.assert_allclose(back.elasticity.compliance, other, atol=1e-12 * np.abs(other).max())
    np.testing.assert_allclose(back.axes[:, 0], -axes[:, 0])
    assert back.elasticity.beams == own.beams[::-1]
    uniform = rs.beam_link([0, 0.3, 0.4], STEEL, rs.circle(0.02))
    back = turned_round(Connection("rod", "a", "b", here, uniform, here)).element
    assert back.elasticity.beams == uniform.elasticity.beams


@pytest.mark.parametrize("wrong", ["order", "bar"])
def test_segments_that_are_not_the_spring_are_refused(arms: list[Any], wrong: str):
    snapshot: Any = rs.equilibrium(arms[0], Q, F).snapshot
    data = snapshot_to_data(snapshot)
    (spring, *_) = [part for part in data["legs"][0]["chain"] if "segments" in part]
    if wrong == "order":
        spring["segments"] = spring["segments"][::-1]
    else:
        spring["segments"][0] = np.diag(np.diagonal(spring["segments"][0])).tolist()
    with pytest.raises(rs.InputError, match="together that of the spring"):
        snapshot_from_document(parse_document(json.dumps(data)))

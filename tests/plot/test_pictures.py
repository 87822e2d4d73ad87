"""What is to be seen are the results, in the units that stand beside them."""

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.plot.bars_and_curves import Measure
from robostiff.plot.picture import Arrow, Face, Marks, Mesh, Path, Scene
from robostiff.plot.posed_robot import Colouring, picture_of_posed
from robostiff.plot.stiffness_pictures import Kind, Shade
from robostiff.plot.surfaces import Quality
from tests.plot.machines import (
    HERE,
    LOAD,
    POSE,
    held_across_x,
    hexapod_deflection,
    hexapod_stiffness,
    robot,
)
from tests.project.shown_output import ROOT

DATA = rs.plot.PictureData()
STAR = ROOT / "tests/model/star-platform.yaml"
HEXAPOD = rs.find_posture(robot("hexapod"), POSE).snapshot.one(0)


def labelled(scene: Scene) -> dict:
    return {item.label: item for item in scene.items if item.label}


def test_robot_has_its_joints_where_they_are():
    found = labelled(picture_of_posed(HEXAPOD))
    passive = [f.point for leg in HEXAPOD.legs for f in leg.freedoms if f.is_passive]
    assert found["passive joint"].points == pytest.approx(np.array(passive))
    assert found["passive joint"].about[0] == "leg1/base joint[0]"
    assert found["reference point"].points == pytest.approx(HEXAPOD.reference_point[None])
    ends = {tuple(leg.end) for leg in HEXAPOD.legs}
    assert {tuple(corner) for corner in found["platform"].corners} == ends


@pytest.mark.parametrize("colouring", [Colouring.LEGS, Colouring.PARTS])
def test_lines_have_the_energy_share_of_their_leg_or_part(colouring: Colouring):
    bent = hexapod_deflection()
    scene = picture_of_posed(HEXAPOD, bent, colouring)
    drawn = {
        item.about: item.paint for item in scene.items if isinstance(item, Path) and item.about
    }
    shares: dict[str, float] = {}
    for part in bent.parts:
        key = part.leg if colouring is Colouring.LEGS else f"{part.leg}/{part.part}"
        shares[key] = shares.get(key, 0.0) + 100 * part.share
    for about, paint in drawn.items():
        name = about.partition(":")[0]
        assert paint == pytest.approx(shares[name.split("/")[0] if name not in shares else name])
    assert scene.scale is not None
    assert scene.scale.label == "share of elastic energy [%]"
    assert scene.scale.low == 0
    assert scene.scale.high == pytest.approx(max(shares.values()))


def test_exaggeration_is_round_and_named_and_displaces_the_platform():
    bent = hexapod_deflection()
    scene = picture_of_posed(HEXAPOD, bent)
    (note,) = scene.notes
    factor = float(note.split()[-1])
    assert factor / 10 ** np.floor(np.log10(factor)) in {1, 2, 5}
    moved = labelled(scene)["reference point"].points[0]
    assert moved == pytest.approx(HEXAPOD.reference_point + factor * bent.twist[:3])
    plain = picture_of_posed(HEXAPOD, bent, exaggeration=0)
    assert labelled(plain)["reference point"].points[0] == pytest.approx(HEXAPOD.reference_point)
    assert not plain.notes


def test_load_is_drawn_along_itself_with_its_size():
    found = labelled(picture_of_posed(HEXAPOD, hexapod_deflection(), exaggeration=0))
    force = found[f"force {np.linalg.norm(LOAD[:3]):.3g} N"]
    along = force.tip - force.start
    assert along / np.linalg.norm(along) == pytest.approx(
        np.array(LOAD[:3]) / np.linalg.norm(LOAD[:3])
    )
    assert force.tip == pytest.approx(HEXAPOD.reference_point)
    assert "moment 20 N m" in found


def test_small_robots_are_drawn_in_millimetres_and_planar_ones_from_above():
    snapshot = rs.find_posture(robot("3-rrr")).snapshot.one(0)
    scene = picture_of_posed(snapshot)
    assert scene.axes == ("x [mm]", "y [mm]", "z [mm]")
    assert scene.is_flat
    assert labelled(scene)["reference point"].points == pytest.approx(
        1e3 * snapshot.reference_point[None]
    )


def test_load_out_of_the_plane_is_seen_in_space():
    arm = robot("two-link-arm")
    snapshot = rs.find_posture(arm).snapshot.one(0)
    inside = rs.deflection(arm, wrench=[10, 5, 0, 0, 0, 1])
    outside = rs.deflection(arm, wrench=[0, 0, -10, 0, 0, 0])
    assert picture_of_posed(snapshot, inside).is_flat
    assert not picture_of_posed(snapshot, outside).is_flat


def test_flexible_platform_is_drawn_with_the_energy_of_its_beams():
    machine: Any = rs.load(str(STAR))
    bent = rs.deflection(machine, wrench=LOAD)
    snapshot = rs.find_posture(machine).snapshot.one(0)
    scene = picture_of_posed(snapshot, bent, Colouring.PARTS)
    drawn = {item.about.partition(":")[0]: item for item in scene.items if isinstance(item, Path)}
    assert snapshot.platform is not None
    for part in snapshot.platform.platform.parts:
        share = sum(p.share for p in bent.parts if (p.leg, p.part) == ("platform", part.name))
        assert drawn[f"platform/{part.name}"].paint == pytest.approx(100 * share)
    still = picture_of_posed(snapshot, bent, exaggeration=0).items
    beams = [one for one in still if isinstance(one, Path) and one.about.startswith("platform/")]
    assert len(beams) == len(snapshot.platform.platform.parts)
    assert all(len(beam.points) == 2 for beam in beams)


def test_ellipsoid_has_the_principal_compliances_as_semi_axes():
    result = hexapod_stiffness()
    scene = rs.plot.ellipsoid(result, Quality.COMPLIANCE, backend=DATA)
    assert scene.axes[0] == "x [nm/N]"
    C = np.linalg.inv(result.K)[:3, :3] * 1e9
    (mesh,) = (item for item in scene.items if isinstance(item, Mesh))
    inverse = np.linalg.inv(C)
    assert np.linalg.norm(mesh.vertices @ inverse, axis=1) == pytest.approx(1.0)
    lengths = [np.ptp(i.points, axis=0) / 2 for i in scene.items if isinstance(i, Path)]
    assert [np.linalg.norm(v) for v in lengths] == pytest.approx(np.linalg.eigvalsh(C))
    assert [f"{v:.3g} nm/N" for v in np.linalg.eigvalsh(C)] == [
        item.label for item in scene.items if isinstance(item, Path)
    ]


def test_directions_without_limit_are_named_and_not_closed():
    result = rs.stiffness(robot("gough-stewart-a"))
    scene = rs.plot.ellipsoid(result, Quality.COMPLIANCE, backend=DATA)
    labels = [item.label for item in scene.items if isinstance(item, Path)]
    assert labels[1:] == ["free: unlimited"] * 2
    assert "free in 2 directions" in scene.notes
    (mesh,) = (item for item in scene.items if isinstance(item, Mesh))
    assert len(mesh.triangles) == 4  # two plates


def test_planar_robots_have_an_ellipse():
    result = rs.stiffness(robot("3-rrr"))
    scene = rs.plot.ellipsoid(result, Quality.COMPLIANCE, backend=DATA)
    assert scene.is_flat
    (face,) = (item for item in scene.items if isinstance(item, Face))
    C = np.linalg.inv(result.K)[:2, :2]
    unit = face.corners[:, :2] @ np.linalg.inv(C)
    sizes = np.linalg.norm(unit, axis=1)
    assert sizes == pytest.approx(np.full(len(sizes), sizes[0]))


def test_robot_that_is_free_all_around_has_no_ellipsoid():
    free = rs.Passive()
    joints = (rs.planar((0, 0, 1), free), rs.prismatic((0, 0, 1), free), rs.spherical(free))
    drive = rs.revolute((1, 0, 0), rs.Actuated(10.0))
    result = rs.stiffness(
        rs.Robot("loose", (rs.Leg("leg", HERE, rs.Chain((*joints, drive)), HERE),))
    )
    with pytest.raises(rs.NoAnswerError, match="free in all directions"):
        rs.plot.ellipsoid(result)


def test_free_motions_are_drawn_on_their_screws_with_their_words():
    result = rs.stiffness(robot("gough-stewart-a"))
    scene = rs.plot.free_motions(result, backend=DATA)
    assert scene.axes[0] == "x [mm]"
    words = [str(motion) for motion in result.free_motions]
    found = labelled(scene)
    assert [label for label in found if label != "reference point"] == words
    for motion in result.free_motions:
        way = found[str(motion)].points / 1e3  # drawn in millimetres
        assert motion.screw.point is not None
        away = way - motion.screw.point
        across = away - np.outer(away @ motion.screw.axis, motion.screw.axis)
        radius = np.linalg.norm(across, axis=1)
        assert radius == pytest.approx(np.full(len(radius), radius[0]))
    assert scene.notes == ("rank 3 of 6",)


def test_free_translation_is_an_arrow_both_ways():
    scene = rs.plot.free_motions(held_across_x(), backend=DATA)
    (arrow,) = (item for item in scene.items if isinstance(item, Arrow))
    assert arrow.both_ways
    assert arrow.label == "translation along x"
    along = arrow.tip - arrow.start
    assert np.cross(along, [1, 0, 0]) == pytest.approx(np.zeros(3))


def test_robot_without_free_motions_says_so():
    scene = rs.plot.free_motions(hexapod_stiffness(), backend=DATA)
    assert scene.title == "hexapod: no free motion"
    assert [type(item) for item in scene.items] == [Marks]


@pytest.mark.parametrize("kind", Kind)
def test_cells_hold_the_matrix_in_the_unit_of_their_block(kind: Kind):
    result = hexapod_stiffness()
    A = result.K if kind is Kind.STIFFNESS else np.linalg.inv(result.K)
    picture = rs.plot.matrix(result, kind, backend=DATA)
    prefixes = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6}
    ends = {"N/m", "N/rad", "N m/m", "N m/rad", "m/N", "m/(N m)", "rad/N", "rad/(N m)"}
    for (i, j), entry in np.ndenumerate(A):
        unit = picture.units[2 * (i >= picture.split) + (j >= picture.split)]
        factor = 1.0 if unit in ends else prefixes[unit[0]]
        assert (unit if unit in ends else unit[1:]) in ends
        shown = float(picture.texts[i][j].replace("−", "-")) * factor
        assert shown == pytest.approx(entry, rel=6e-3)
    assert (picture.split, len(picture.units)) == (3, 4)


def test_shade_is_a_signed_logarithm_and_zeros_are_plain():
    result = rs.stiffness(robot("gough-stewart-a"))
    K = result.K
    picture = rs.plot.matrix(result, backend=DATA)
    s = np.repeat([1.0, float(result.length)], 3)
    scaled = K / np.outer(s, s)
    part = np.abs(scaled) / np.abs(scaled).max()
    plain = part <= 1e-12
    assert np.any(plain)
    assert np.array_equal(np.isnan(picture.shades), plain)
    assert all(picture.texts[i][j] == "0" for i, j in np.argwhere(plain))
    expected = np.sign(scaled) * np.maximum(1 + np.log10(np.where(plain, 1, part)) / 4, 0.05)
    assert picture.shades[~plain] == pytest.approx(expected[~plain])


def test_shade_of_coupling_is_one_on_the_diagonal():
    picture = rs.plot.matrix(hexapod_stiffness(), shade=Shade.COUPLING, backend=DATA)
    K = hexapod_stiffness().K
    assert np.diag(picture.shades) == pytest.approx(np.ones(6))
    assert picture.shades[0, 4] == pytest.approx(K[0, 4] / np.sqrt(K[0, 0] * K[4, 4]))


def test_bars_are_the_shares_of_the_parts_leg_by_leg():
    bent = hexapod_deflection()
    (panel,) = rs.plot.energy_shares(bent, backend=DATA).panels
    legs = list(panel.groups)
    assert legs == [leg.name for leg in HEXAPOD.legs]
    drawn = {
        (leg, series.name): value
        for series in panel.series
        for leg, value in zip(legs, series.values, strict=True)
    }
    assert drawn == {(p.leg, p.part): pytest.approx(100 * p.share) for p in bent.parts}
    totals = [float(note.split()[0]) for note in panel.notes]
    assert sum(totals) == pytest.approx(100, abs=0.4)


def test_comparison_tells_both_values_and_their_ratio():
    first, second = hexapod_stiffness(), rs.stiffness(robot("gough-stewart-b-beams"))
    picture = rs.plot.comparison(first, second, measure=Measure.DIAGONAL, backend=DATA)
    forces, moments = picture.panels
    assert forces.label == "force / displacement [MN/m]"
    assert moments.label == "moment / rotation [MN m/rad]"
    for k, panel in enumerate(picture.panels):
        part = slice(3 * k, 3 * k + 3)
        one, other = (series.values for series in panel.series)
        assert 1e6 * one == pytest.approx(np.diag(first.K)[part])
        assert 1e6 * other == pytest.approx(np.diag(second.K)[part])
        for text, ratio in zip(panel.series[1].texts, other / one, strict=True):
            assert float(text.partition("× ")[2].rstrip(")")) == pytest.approx(ratio, rel=6e-3)


def test_comparison_of_deflections_keeps_signs():
    first = hexapod_deflection()
    second = rs.deflection(robot("hexapod"), POSE, [-2 * f for f in LOAD])
    displacement, rotation = rs.plot.comparison(
        first, second, names=("one", "twice back"), backend=DATA
    ).panels
    assert displacement.label == "displacement [µm]"
    assert [series.name for series in rotation.series] == ["one", "twice back"]
    assert displacement.series[1].values == pytest.approx(-2 * displacement.series[0].values)
    assert displacement.series[0].values == pytest.approx(1e6 * first.twist[:3])
    assert all("(× −2)" in text for text in displacement.series[1].texts)

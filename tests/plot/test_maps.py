"""Plots of maps show the values of the poses that have some, and mark the others."""

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.maps.variables import EXCLUDED, NOT_COMPUTED, status_flags
from robostiff.plot.picture import Bands, Marks, Mesh
from robostiff.plot.theme import Theme
from tests.plot.machines import robot, tripod_map

DATA = rs.plot.PictureData()
XY: dict[str, Any] = {"x": "x", "y": "y", "backend": DATA}


def map_with(status=0, rank=6, value=1e-8):
    """The map of the tripod with one reachable pose, (2, 2, 1), made something else."""
    found = tripod_map().copy(deep=True)
    found["status"][2, 2, 1] = status
    found["rank"][2, 2, 1] = rank
    found["worst_deflection"][2, 2, 1] = value
    return found


def names_at(picture, j: int, i: int) -> list[str]:
    return [region.name for region in picture.regions if region.where[j, i]]


@pytest.mark.parametrize(
    ("status", "rank", "value", "name"),
    [
        (64, -1, np.nan, "unreachable"),
        (EXCLUDED, -1, np.nan, "excluded"),
        (NOT_COMPUTED, -1, np.nan, "not-computed"),
        (16, 6, np.nan, "rigid-direction"),
        (32, 6, np.nan, "form-does-not-hold"),
        (1, 5, np.nan, "rank-deficient"),
        # values of a singular pose: very stiff, or nothing at all
        (1, 5, 1e-30, "rank-deficient"),
        (1, 5, 0.0, "rank-deficient"),
        (64, -1, 0.0, "unreachable"),
        (0, 6, np.nan, "no value"),
    ],
)
def test_pose_without_an_answer_is_its_region_and_no_value(status, rank, value, name):
    picture = rs.plot.map_slice(
        map_with(status, rank, value), "worst_deflection", **XY, at={"z": 0.3}
    )
    assert names_at(picture, 2, 2) == [name]
    assert np.isnan(picture.values[2, 2])
    plain = rs.plot.map_slice(tripod_map(), "worst_deflection", **XY, at={"z": 0.3})
    others = np.ones(plain.values.shape, dtype=bool)
    others[2, 2] = False
    assert picture.values[others] == pytest.approx(plain.values[others], nan_ok=True)


@pytest.mark.parametrize(("status", "name"), [(4, "ill-conditioned"), (8, "beyond-limits")])
def test_doubtful_pose_keeps_its_value_under_a_hatching(status: int, name: str):
    picture = rs.plot.map_slice(map_with(status, 6, 2e-5), "worst_deflection", **XY, at={"z": 0.3})
    (region,) = (region for region in picture.regions if region.name == name)
    assert region.is_over
    assert picture.values[2, 2] == pytest.approx(20)


def test_robot_that_is_free_by_design_has_its_own_full_rank():
    grid = rs.Grid(x=rs.Axis(-0.05, 0.05, 3), y=rs.Axis(-0.05, 0.05, 3))
    found = rs.stiffness_map(robot("gough-stewart-a"), grid)
    at = {"principal_translation": 0}
    rank = int(found["rank"].min())
    picture = rs.plot.map_slice(found, "translational_stiffness", **XY, at=at)
    assert np.all(np.isnan(picture.values))
    assert [region.name for region in picture.regions] == ["rank-deficient"]
    own = rs.plot.map_slice(found, "translational_stiffness", **XY, at=at, full_rank=rank)
    assert np.all(np.isfinite(own.values))


def test_planar_robots_are_full_at_rank_three():
    grid = rs.Grid(x=rs.Axis(0.4, 0.5, 3), y=rs.Axis(0.3, 0.4, 3))
    stiff = rs.stiffness_map(robot("3-rpr"), grid)
    assert not rs.plot.map_slice(
        stiff, "rotational_stiffness", **XY, at={"principal_rotation": 0}
    ).regions
    worst = rs.stiffness_map(robot("3-rpr"), grid, [rs.Quantity.WORST_DEFLECTION])
    assert not rs.plot.map_slice(worst, "worst_deflection", **XY).regions
    vague = worst.copy()
    del vague.attrs["wrench_order"]
    with pytest.raises(rs.InputError, match="full_rank=3"):
        rs.plot.map_slice(vague, "worst_deflection", **XY)
    assert not rs.plot.map_slice(vague, "worst_deflection", **XY, full_rank=3).regions


def test_every_region_has_a_look_of_its_own():
    flags = {name: flag for flag, name in status_flags().items()}
    looks = {}
    for name, status, rank, value in [
        *((name, flag, 6, 1e-8) for name, flag in flags.items()),
        ("rank-deficient", 0, 5, 1e-8),
        ("no value", 0, 6, np.nan),
    ]:
        found = map_with(status, rank, value)
        picture = rs.plot.map_slice(found, "worst_deflection", **XY, at={"z": 0.3})
        for region in picture.regions:
            if region.name == name:
                looks[name] = region.style(Theme.LIGHT.palette)
    assert len(looks) == len(set(looks.values())) == 11


@pytest.mark.parametrize(
    ("time", "label", "places"), [([2, 5], "time [s]", [2, 5]), (None, "pose", [0, 1])]
)
def test_a_list_of_poses_is_drawn_over_its_time_or_its_numbers(time, label, places):
    path = rs.PoseList(("x", "z"), [[0, 0.3], [0.1, 0.35]], time=time)
    found = rs.stiffness_map(robot("3-puu"), path, [rs.Quantity.WORST_DEFLECTION])
    picture = rs.plot.map_overview(found, backend=DATA)
    assert isinstance(picture, Bands)
    assert picture.x.label == label
    np.testing.assert_array_equal(picture.x.values, places)
    (curve,) = picture.values
    np.testing.assert_allclose(curve, 1e6 * found.worst_deflection.values, rtol=1e-6)
    axes = rs.plot.map_overview(found)
    assert axes.get_legend() is None
    figure = axes.figure
    box = figure.get_tightbbox(figure.canvas.get_renderer())
    assert box.x0 >= 0


def test_isosurface_lies_where_the_map_has_the_value():
    found = tripod_map()
    level = float(found.worst_deflection.median())
    scene = rs.plot.map_isosurface(
        found, "worst_deflection", level, x="x", y="y", z="z", backend=DATA
    )
    (mesh,) = (item for item in scene.items if isinstance(item, Mesh))
    # every vertex lies on an edge or a diagonal of a cell whose ends are on both sides
    at = {name: mesh.vertices[:, i] for i, name in enumerate("xyz")}
    assert len(mesh.vertices) > 0
    for name, values in at.items():
        assert values.min() >= float(found[name].min())
        assert values.max() <= float(found[name].max())
    assert f"{level * 1e6:.4g}" in mesh.label
    (marks,) = (item for item in scene.items if isinstance(item, Marks))
    assert marks.label == "unreachable"
    assert len(marks.points) == int(((found.status & 64) != 0).sum())
    assert scene.is_equal


def test_named_components_are_chosen_by_name():
    grid = rs.Grid(x=rs.Axis(-0.1, 0.1, 3), y=rs.Axis(-0.1, 0.1, 2))
    load = [0, 0, -1000, 0, 0, 0]
    found = rs.stiffness_map(robot("hexapod"), grid, [rs.Quantity.DEFLECTION], wrench=load)
    picture = rs.plot.map_slice(found, "displacement", **XY, at={"displacement_axis": "dz"})
    expected = found.displacement.sel(displacement_axis="dz").transpose("y", "x").values
    assert picture.values == pytest.approx(1e6 * expected)
    assert picture.title == "hexapod: dz"
    with pytest.raises(rs.InputError, match="expected dx or dy or dz"):
        rs.plot.map_slice(found, "displacement", **XY, at={"displacement_axis": "z"})


def test_a_cut_outside_of_the_map_has_a_warning():
    """A coordinate in millimetres showed the end of the map without a word."""
    found = tripod_map()
    low, high = float(found.z.min()), float(found.z.max())
    with pytest.warns(rs.PlausibilityWarning, match=f"z = 300 m: the map has values from {low:g}"):
        rs.plot.map_slice(found, "worst_deflection", **XY, at={"z": 300.0})
    for z in (low, high, (low + high) / 2):
        rs.plot.map_slice(found, "worst_deflection", **XY, at={"z": z})

"""Plots of maps show the values of the poses that have some, and mark the others."""

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.maps.variables import EXCLUDED, NOT_COMPUTED, status_flags
from robostiff.plot.picture import Bands, Field, Marks, Mesh
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


def test_slice_has_the_values_of_the_map():
    found = tripod_map()
    picture = rs.plot.map_slice(found, "worst_deflection", **XY, at={"z": 0.31})
    shown = found.worst_deflection.isel(z=1).transpose("y", "x").values
    known = np.isfinite(shown)
    assert picture.scale is not None
    assert picture.scale.label == "worst deflection [µm/N]"
    assert 0 < known.sum() < known.size
    assert picture.values[known] * 1e-6 == pytest.approx(shown[known])
    assert np.all(np.isnan(picture.values[~known]))
    assert picture.title == "3-puu: z = 0.3 m"
    assert (picture.x.label, picture.y.label) == ("x [m]", "y [m]")
    assert picture.scale.low == pytest.approx(1e6 * shown[known].min())
    assert picture.notes == (f"{100 * known.mean():.0f} % of the poses have a value",)


def test_axes_can_be_swapped_and_components_chosen():
    found = tripod_map()
    at = {"z": 0.3, "principal_translation": 2}
    one = rs.plot.map_slice(found, "translational_stiffness", x="x", y="y", at=at, backend=DATA)
    other = rs.plot.map_slice(found, "translational_stiffness", x="y", y="x", at=at, backend=DATA)
    assert one.values == pytest.approx(other.values.T, nan_ok=True)
    stiffest = found.translational_stiffness.isel(z=1, principal_translation=2)
    assert np.nanmax(one.values) == pytest.approx(float(stiffest.max()) / 1e6)
    assert "principal translation 3 of 3" in one.title


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


def test_ranks_and_statuses_have_names_and_no_scale():
    found = map_with(status=1, rank=5)
    ranks = rs.plot.map_slice(found, "rank", **XY, at={"z": 0.3})
    assert [region.name for region in ranks.regions] == ["rank 6", "rank 5", "unreachable"]
    assert names_at(ranks, 2, 2) == ["rank 5"]
    statuses = rs.plot.map_slice(found, "status", **XY, at={"z": 0.3})
    assert {region.name for region in statuses.regions} == {"ok", "free-motions", "unreachable"}
    assert names_at(statuses, 2, 2) == ["free-motions"]
    for picture in (ranks, statuses):
        assert picture.scale is None
        assert np.all(np.sum([region.where for region in picture.regions], axis=0) == 1)
        assert len({region.style(rs.plot.Theme.LIGHT.palette) for region in picture.regions}) == 3
        rs.plot.Matplotlib().draw(picture)
    palette = Theme.LIGHT.palette
    kept = {region.name: region.style(palette) for region in statuses.regions}["unreachable"]
    usual = rs.plot.map_slice(found, "worst_deflection", **XY, at={"z": 0.3}).regions
    assert kept == next(region.style(palette) for region in usual if region.name == "unreachable")


def test_an_overview_chooses_what_is_left_open():
    found = tripod_map()
    picture = rs.plot.map_overview(found, backend=DATA)
    assert isinstance(picture, Field)
    assert picture.scale is not None
    assert picture.scale.label == "worst deflection [µm/N]"
    assert picture.title == "3-puu: z = 0.3 m"
    own = rs.plot.map_overview(found, "translational_stiffness", at={"x": 0.1}, backend=DATA)
    assert isinstance(own, Field)
    assert own.title == "3-puu: x = 0.1 m, principal translation 1 of 3"
    assert (own.x.label, own.y.label) == ("y [m]", "z [m]")
    bands = rs.plot.map_overview(found, None, at={"x": 0, "y": 0}, backend=DATA)
    assert isinstance(bands, Bands)
    assert bands.values.shape[1] == 3
    with pytest.raises(rs.InputError, match="all coordinates cut"):
        rs.plot.map_overview(found, at={"x": 0, "y": 0, "z": 0.3})


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


def test_isolines_are_round_and_between_the_ends():
    picture = rs.plot.map_slice(tripod_map(), "worst_deflection", **XY, at={"z": 0.3}, isolines=4)
    assert picture.scale is not None
    low, high = picture.scale.low, picture.scale.high
    assert 1 <= len(picture.isolines) <= 5
    assert all(low <= level <= high for level in picture.isolines)
    chosen = rs.plot.map_slice(
        tripod_map(), "worst_deflection", **XY, at={"z": 0.3}, isolines=[5e-5, 3e-5]
    )
    assert chosen.isolines == pytest.approx((30, 50))


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


def test_bands_are_percentiles_of_the_poses_with_a_value():
    found = tripod_map()
    picture = rs.plot.map_bands(found, "worst_deflection", along="x", backend=DATA)
    assert picture.percents == (5, 25, 50, 75, 95)
    for i in range(len(found.x)):
        values = found.worst_deflection.isel(x=i).values
        known = values[np.isfinite(values)]
        if len(known):
            percentiles = 1e6 * np.percentile(known, picture.percents)
            assert picture.values[:, i] == pytest.approx(percentiles, rel=1e-6)
        else:
            assert np.isnan(picture.values[:, i]).all()
    (region,) = picture.shares
    assert region.name == "unreachable"
    assert region.where == pytest.approx(((found.status & 64) != 0).mean(("y", "z")).values)


@pytest.mark.parametrize("variable", ["rank", "status"])
def test_ranks_and_statuses_along_a_coordinate_are_shares_of_all_poses(variable):
    found = tripod_map()
    picture = rs.plot.map_bands(found, variable, along="x", backend=DATA)
    assert picture.percents == ()
    shares = {region.name: region.where for region in picture.shares}
    assert sum(shares.values()) == pytest.approx(np.ones(len(found.x)))
    assert shares["unreachable"] == pytest.approx(((found.status & 64) != 0).mean(("y", "z")))
    if variable == "rank":
        assert shares["rank 6"] == pytest.approx((found["rank"] == 6).mean(("y", "z")))


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

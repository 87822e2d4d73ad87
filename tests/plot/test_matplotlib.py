"""Figures of Matplotlib: texts that fit, and colours that are told apart."""

import sys
from itertools import combinations
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3D

import robostiff as rs
from robostiff.plot import Matplotlib, Theme, Width
from robostiff.plot.bars_and_curves import compensation_picture
from robostiff.plot.picture import Path
from robostiff.plot.posed_robot import picture_of_posed
from robostiff.plot.theme import contrast, luminance
from tests.plot.machines import (
    POSE,
    all_plots,
    hexapod_deflection,
    hexapod_stiffness,
    robot,
    tripod_map,
)

DATA = rs.plot.PictureData()


@pytest.mark.parametrize(
    ("width", "theme"), [(Width.HALF, Theme.DARK), (Width.FULL, Theme.LIGHT)], ids=str
)
def test_every_plot_fits_its_figure_and_no_texts_overlap(width: Width, theme: Theme):
    before = dict(mpl.rcParams)
    plots = all_plots(Matplotlib(width=width, theme=theme))
    assert dict(mpl.rcParams) == before
    assert pyplot.get_fignums() == []
    for name, ax in plots.items():
        figure = ax.figure
        assert isinstance(figure, Figure)
        assert figure.get_figwidth() == pytest.approx(width.value / 25.4)
        figure.draw_without_rendering()
        whole = figure.get_tightbbox()
        assert whole.y0 >= 0, name
        assert whole.y1 <= figure.get_figheight() + 1e-6, name
        assert whole.x0 >= -0.02, name
        assert whole.x1 <= figure.get_figwidth() + 0.02, name
        assert to_hex(figure.get_facecolor()) == theme.palette.ground
        axes = [axis for own in figure.axes for axis in (own.xaxis, own.yaxis)]
        spaces = [axis.get_tick_space() for axis in axes]
        with mpl.rc_context({"xtick.labelsize": 20, "ytick.labelsize": 20}):
            assert [axis.get_tick_space() for axis in axes] == spaces, name
        legends = [own.get_legend() for own in [ax, *ax.child_axes] if own.get_legend()]
        boxes = [text.get_window_extent() for one in legends for text in one.get_texts()]
        boxes += [ax.title.get_window_extent()]
        for own in [ax, *ax.child_axes]:
            for axis in (own.xaxis, own.yaxis):
                if own.axison and axis.label.get_visible() and axis.label.get_text():
                    boxes.append(axis.label.get_window_extent())
        for i, one in enumerate(boxes):
            for other in boxes[i + 1 :]:
                assert not one.overlaps(other), name


def test_lines_of_the_robot_are_those_of_the_picture():
    snapshot = rs.find_posture(robot("hexapod"), POSE).snapshot.one(0)
    picture = picture_of_posed(snapshot, hexapod_deflection())
    ax = rs.plot.robot(robot("hexapod"), POSE, deflection=hexapod_deflection())
    lines = [line for line in ax.lines if isinstance(line, Line3D) and line.get_marker() == "None"]
    drawn = [np.stack(line.get_data_3d(), axis=1) for line in lines]
    wanted = [item.points for item in picture.items if isinstance(item, Path)]
    for points in wanted:
        assert any(p.shape == points.shape and np.allclose(p, points) for p in drawn)


def test_cells_of_the_matrix_are_those_of_the_picture():
    picture = rs.plot.matrix(hexapod_stiffness(), backend=DATA)
    ax: Any = rs.plot.matrix(hexapod_stiffness())
    cells = ax.images[0].get_array().filled(np.nan)
    assert cells == pytest.approx(picture.shades, nan_ok=True)
    texts = {text.get_position(): text.get_text() for text in ax.texts}
    for (i, j), _ in np.ndenumerate(picture.shades):
        assert texts[j, i] == picture.texts[i][j]
    assert set(picture.units) <= {text.get_text() for text in ax.texts}


def test_bars_are_as_long_as_the_shares():
    (panel,) = rs.plot.energy_shares(hexapod_deflection(), backend=DATA).panels
    ax = rs.plot.energy_shares(hexapod_deflection())
    for container, series in zip(ax.containers, panel.series, strict=True):
        assert [bar.get_width() for bar in container] == pytest.approx(series.values)
    assert [t.get_text() for t in ax.get_legend().get_texts()] == [s.name for s in panel.series]


def test_slice_draws_values_and_regions_in_their_places():
    picture = rs.plot.map_slice(
        tripod_map(), "worst_deflection", x="x", y="y", at={"z": 0.3}, backend=DATA
    )
    ax = rs.plot.map_slice(tripod_map(), "worst_deflection", x="x", y="y", at={"z": 0.3})
    mesh: Any = next(c for c in ax.collections if isinstance(c, QuadMesh))
    assert mesh.get_array().filled(np.nan) == pytest.approx(picture.values, nan_ok=True)
    (patch,) = ax.patches
    (region,) = picture.regions
    path = patch.get_path()
    for j, y in enumerate(picture.y.values):
        for i, x in enumerate(picture.x.values):
            # even-odd by rectangle: each pose lies in at most one of them
            inside = any(
                (c[:, 0].min() < x < c[:, 0].max()) and (c[:, 1].min() < y < c[:, 1].max())
                for c in path.vertices.reshape(-1, 5, 2)
            )
            assert inside == region.where[j, i]
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["unreachable"]
    assert patch.get_hatch()


def test_a_map_without_values_has_no_scale():
    grid = rs.Grid(x=rs.Axis(-0.1, 0.1, 3), y=rs.Axis(-0.1, 0.1, 3))
    ax = rs.plot.map_overview(rs.stiffness_map(robot("gough-stewart-a"), grid))
    assert ax.figure.axes == [ax]


def test_points_of_a_path_have_whole_numbers():
    poses = np.array([[0, 0, 0.9, 0, 0, 0]] * 4) + np.linspace(0, 0.1, 4)[:, None] * np.eye(6)[0]
    picture = compensation_picture(rs.compensate(robot("hexapod"), poses, [300, 0, 0, 0, 0, 0]))
    places = Matplotlib().draw(picture).get_xticks()
    np.testing.assert_array_equal(places, np.round(places))


def test_bands_are_filled_between_the_percentiles():
    picture = rs.plot.map_bands(tripod_map(), "worst_deflection", along="x", backend=DATA)
    ax = rs.plot.map_bands(tripod_map(), "worst_deflection", along="x")
    median = ax.lines[0].get_ydata()
    assert np.asarray(median) == pytest.approx(picture.values[2], nan_ok=True)
    labels = [text.get_text() for text in ax.child_axes[0].get_legend().get_texts()]
    assert labels[-1] == "no value: unreachable"
    assert "5 to 95 % of the poses with a value" in labels


def test_axes_of_others_are_used_and_those_of_the_wrong_kind_refused():
    figure = Figure(figsize=(6, 3))
    plain, space = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="3d")
    assert rs.plot.matrix(hexapod_stiffness(), backend=Matplotlib(plain)) is plain
    assert rs.plot.robot(robot("hexapod"), backend=Matplotlib(space)) is space
    assert figure.get_size_inches().tolist() == [6, 3]
    with pytest.raises(rs.InputError, match="projection"):
        rs.plot.robot(robot("hexapod"), backend=Matplotlib(plain))
    with pytest.raises(rs.InputError, match="plain axes"):
        rs.plot.matrix(hexapod_stiffness(), backend=Matplotlib(space))
    assert isinstance(space, Axes3D)


def test_missing_package_is_named_with_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    for backend in (Matplotlib(), rs.plot.Plotly()):
        with pytest.raises(rs.InputError, match=r"pip install 'robostiff\[plot\]'"):
            rs.plot.robot(robot("hexapod"), backend=backend)


# Machado, Oliveira, Fernandes: A physiologically-based model for simulation of color vision
# deficiency, IEEE TVCG 15(6), 2009: severity 1, linear RGB.
BLINDNESS = {
    "none": np.eye(3).tolist(),
    "protan": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deutan": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
}


def linear(colour: str) -> np.ndarray:
    s = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIE L*a*b* of linear RGB."""
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    t = to_xyz @ np.clip(rgb, 0, 1) / [0.9505, 1.0, 1.089]
    f = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("theme", Theme)
@pytest.mark.parametrize("sight", BLINDNESS)
def test_first_categories_are_distinguished(theme: Theme, sight: str):
    eye = np.array(BLINDNESS[sight])
    seen = [lab(eye @ linear(colour)) for colour in theme.palette.categories[:5]]
    for one, other in combinations(seen, 2):
        assert np.linalg.norm(one - other) > 12


@pytest.mark.parametrize("theme", Theme)
def test_texts_lines_and_numbers_are_read_on_their_ground_and_values_grow_lighter(theme: Theme):
    palette = theme.palette
    assert contrast(palette.ink, palette.ground) > 7
    assert contrast(palette.muted, palette.ground) > 4.5
    for colour in palette.categories[:4]:
        assert contrast(colour, palette.ground) > 2.5
    light = [luminance(colour) for colour in palette.values]
    assert light == sorted(light)
    for where in np.linspace(0, 1, 41):
        cell = palette.along(palette.signed, float(where))
        assert contrast(cell, palette.on(cell)) > 4

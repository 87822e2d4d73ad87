"""What Plotly draws is what the picture says, on light and on dark ground."""

import re
from typing import Any

import numpy as np
import plotly.io as pio
import pytest

import robostiff as rs
from robostiff.plot import Plotly, Theme
from robostiff.plot.backend import plotly_figure
from robostiff.plot.picture import Mesh, Path, PlainColour, Scene
from robostiff.plot.posed_robot import picture_of_posed
from robostiff.plot.theme import named_colours
from tests.plot.machines import POSE, all_scenes, hexapod_deflection, robot, tripod_map

PLOTLY: Any = Plotly()


DATA = rs.plot.PictureData()


@pytest.mark.parametrize("theme", Theme)
def test_every_figure_has_the_colours_of_its_theme_and_nothing_is_registered(theme: Theme):
    before = (pio.templates.default, list(pio.templates))
    for figure in all_scenes(Plotly(theme)).values():
        layout = figure.layout.template.layout
        assert layout.paper_bgcolor == theme.palette.ground
        assert layout.font.color == theme.palette.ink
        assert figure.layout.height > 200
        assert len(figure.to_json()) > 1000
    assert (pio.templates.default, list(pio.templates)) == before


class _ByNames:
    """Draws with names of colours, and checks what these become in each theme."""

    def draw(self, picture: Any) -> None:
        named = named_colours()
        drawn = str(plotly_figure(picture, named).to_json())
        for theme, colours in zip(Theme, zip(*named.pairs, strict=True), strict=True):
            shown = re.sub(r"hsl\((\d+),0%,0%\)", lambda at, c=colours: c[int(at[1])], drawn)
            assert shown == plotly_figure(picture, theme.palette).to_json()


def test_a_figure_drawn_with_names_of_colours_is_that_of_each_theme():
    all_scenes(_ByNames())


def test_lines_of_the_robot_are_those_of_the_picture():
    snapshot = rs.find_posture(robot("hexapod"), POSE).snapshot.one(0)
    picture = picture_of_posed(snapshot, hexapod_deflection())
    figure = rs.plot.robot(robot("hexapod"), POSE, deflection=hexapod_deflection(), backend=PLOTLY)
    drawn = [np.stack([t.x, t.y, t.z], axis=1) for t in figure.data if t.type == "scatter3d"]
    for item in picture.items:
        if isinstance(item, Path):
            assert any(p.shape == item.points.shape and np.all(p == item.points) for p in drawn)
    named = [trace.name for trace in figure.data if trace.showlegend]
    assert named == [item.label for item in picture.items if item.label]


def test_surface_is_that_of_the_picture():
    found = tripod_map()
    level = float(found.worst_deflection.median())
    scene = rs.plot.map_isosurface(
        found, "worst_deflection", level, x="x", y="y", z="z", backend=DATA
    )
    (mesh,) = (item for item in scene.items if isinstance(item, Mesh))
    figure = rs.plot.map_isosurface(
        found, "worst_deflection", level, x="x", y="y", z="z", backend=PLOTLY
    )
    (drawn,) = (trace for trace in figure.data if trace.type == "mesh3d")
    assert np.stack([drawn.x, drawn.y, drawn.z], axis=1) == pytest.approx(mesh.vertices)
    assert np.stack([drawn.i, drawn.j, drawn.k], axis=1).tolist() == mesh.triangles.tolist()


@pytest.mark.parametrize("long", [(1, 1, 1), (3, 0.1, 0.1), (0.1, 0.1, 3), (2, 2, 0.2)])
def test_the_camera_sees_the_whole_box_and_fills_the_place(long):
    box = np.array([np.zeros(3), long], dtype=float)
    line = Path(box, PlainColour.INK)
    drawn = plotly_figure(Scene("a box", ("x", "y", "z"), (line,)), Theme.LIGHT.palette)
    scene = drawn.layout.scene
    eye, centre = (
        np.array([getattr(own, axis) for axis in "xyz"])
        for own in (scene.camera.eye, scene.camera.center)
    )
    ratio = [getattr(scene.aspectratio, axis) for axis in "xyz"]
    corners = np.stack(np.meshgrid(*[(-r / 2, r / 2) for r in ratio]), axis=-1).reshape(-1, 3)
    ahead = (centre - eye) / np.linalg.norm(centre - eye)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    seen = [(corners - eye) @ axis / ((corners - eye) @ ahead) for axis in (right, up)]
    half = np.tan(np.pi / 8)  # Plotly sees 45 degrees upwards
    assert np.abs(seen[1]).max() < half
    assert np.abs(seen[0]).max() < 1.3 * half
    assert max(np.ptp(seen[1]), np.ptp(seen[0]) / 1.3) > 1.1 * half

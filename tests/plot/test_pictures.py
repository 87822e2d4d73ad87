"""Pictures of robots and results, in data: what is drawn where."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.plot import LAYERS, Layers, Marks, Mesh, Path, Quality, Text, layers_of
from robostiff.plot.picture import Face
from robostiff.plot.surfaces import ellipsoid_mesh, isosurface, plate, principal_axes, screw_line
from robostiff.spatial import Screw
from tests.plot.machines import held_across_x, hexapod_stiffness, robot

DATA = rs.plot.PictureData()


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


ALL = frozenset(LAYERS)


def shown(name: str, pose=None, load=(0.0, 0, 0, 0, 0, 0), **options) -> Layers:
    robot = rs.load(name)
    answer = (
        rs.cable_response(robot, pose, load)
        if isinstance(robot, rs.CableRobot)
        else rs.deflection(robot, pose, load)
    )
    return layers_of(answer, **options)


@pytest.mark.parametrize("name", ["hexapod", "cable-8"])
def test_layers_are_those_that_are_chosen(name):
    load = np.array([10.0, 0, 0, 0, 0, 0])
    assert shown(name, load=load).items.keys() == {own for own in ALL if LAYERS[own]}
    assert shown(name, load=load, chosen=ALL).items.keys() == ALL
    assert shown(name, load=load, chosen=()).items == {}
    at_rest = shown(name, chosen=ALL)
    assert at_rest.items.keys() == ALL - {"shape without load"}
    assert not at_rest.items["load"]
    assert any(isinstance(item, Text) for item in at_rest.items["names of joints"]) is (
        name == "hexapod"
    )


def test_the_reference_point_is_drawn_in_metres_and_moves_with_the_load():
    load = [500.0, 0, 0, 0, 0, 0]
    drawn, rest = shown("hexapod", load=load, exaggeration=1000.0), shown("hexapod")
    places = [own.points[0] for one in (drawn, rest) for own in one.items["robot"][-1:]
              if isinstance(own, Marks)]  # fmt: skip
    bent = rs.deflection(rs.load("hexapod"), wrench=load)
    np.testing.assert_allclose(places[1], bent.stiffness.reference_point, atol=1e-12)
    np.testing.assert_allclose(places[0] - places[1], 1000 * bent.twist[:3], atol=1e-12)
    assert "displacements × 1000" in drawn.notes
    points = np.concatenate([own.points for own in rest.items["robot"] if isinstance(own, Path)])
    low, high = rest.box
    assert np.all(points >= low - 0.2 * rest.size)
    assert np.all(points <= high + 0.2 * rest.size)


def test_ellipsoids_keep_the_scale_of_an_earlier_picture():
    first = shown("gough-stewart-b")
    away = [0, 0, 1.0, 0, 0, 0]
    same, own = shown("gough-stewart-b", away, scales=first.scales), shown("gough-stewart-b", away)
    assert same.scales == first.scales
    assert own.scales[Quality.COMPLIANCE] != first.scales[Quality.COMPLIANCE]

    def longest(drawn: Layers) -> float:
        axes = [x.points for x in drawn.items["ellipsoid of displacements"] if isinstance(x, Path)]
        return max(float(np.linalg.norm(axis[1] - axis[0])) for axis in axes)

    soft = [np.linalg.eigvalsh(rs.compliance(rs.load("gough-stewart-b"), p)[:3, :3])[-1]
            for p in (None, away)]  # fmt: skip
    assert longest(same) / longest(first) == pytest.approx(soft[1] / soft[0], rel=1e-9)
    assert longest(own) == pytest.approx(longest(first), rel=0.3)
    assert any(isinstance(x, Mesh) for x in first.items["ellipsoid of displacements"])


BLOCKS = {
    Quality.COMPLIANCE: ("C", slice(0, 3)),
    Quality.STIFFNESS: ("K", slice(0, 3)),
    Quality.ROTATIONAL_COMPLIANCE: ("C", slice(3, 6)),
    Quality.ROTATIONAL_STIFFNESS: ("K", slice(3, 6)),
}


@pytest.mark.parametrize("quality", Quality, ids=lambda q: q.value)
def test_principal_axes_put_the_block_together_again(quality: Quality):
    result = hexapod_stiffness()
    matrix, part = BLOCKS[quality]
    block = (result.K if matrix == "K" else np.linalg.inv(result.K))[part, part]
    axes = principal_axes(result, quality)
    again = axes.directions.T @ np.diag(axes.lengths) @ axes.directions
    assert again == pytest.approx(block, rel=1e-9, abs=1e-12 * np.abs(block).max())
    assert not np.any(axes.is_free)


def test_free_translation_has_compliance_without_limit_and_stiffness_of_none():
    """Two wires along y and z hold a point, x is free."""
    axes = principal_axes(held_across_x(), Quality.COMPLIANCE)
    assert axes.lengths.tolist() == pytest.approx([1 / 3e6, 1 / 2e6, np.inf])
    assert np.abs(axes.directions) == pytest.approx(np.eye(3)[[2, 1, 0]])
    stiff = principal_axes(held_across_x(), Quality.STIFFNESS)
    assert stiff.lengths.tolist() == pytest.approx([0, 2e6, 3e6])
    assert np.abs(stiff.directions) == pytest.approx(np.eye(3))
    assert stiff.is_free.tolist() == [True, False, False]


@pytest.mark.parametrize("open_axes", [(), (2,), (1, 2)])
def test_points_of_the_surface_obey_its_equation(open_axes: tuple[int, ...]):
    half = np.diag([3.0, 2.0, 1.0])
    vertices, triangles = ellipsoid_mesh(half, open_axes)
    closed = [i for i in range(3) if i not in open_axes]
    assert np.sum((vertices[:, closed] / np.diag(half)[closed]) ** 2, axis=1) == pytest.approx(1.0)
    assert triangles.min() == 0
    assert triangles.max() == len(vertices) - 1


@pytest.mark.parametrize("pitch", [0.0, 0.02, -0.3])
def test_way_of_a_screw_is_that_of_a_point_that_turns_and_advances(pitch: float):
    e = np.array([1.0, 2, 2]) / 3
    point = np.array([0.3, -0.1, 0.2])
    screw = Screw(e, point, pitch)
    axis, way = screw_line(screw, np.array([1.0, 1, 1]), 0.5)
    steps = np.diff(way, axis=0)
    middle = (way[1:] + way[:-1]) / 2
    # the velocity of each point is that of the screw: w x (p - point) + pitch w
    velocity = np.cross(e, middle - point) + pitch * e
    rate = np.linalg.norm(steps[0]) / np.linalg.norm(velocity[0])
    assert steps == pytest.approx(rate * velocity, abs=2e-3 * rate * np.abs(velocity).max())
    along = way @ e
    assert np.ptp(along) <= 2 * 0.5 + 1e-12
    assert np.cross(axis[1] - axis[0], e) == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.cross(axis[0] - point, e) == pytest.approx(np.zeros(3), abs=1e-12)


def test_isosurface_of_a_distance_is_a_closed_sphere():
    line = np.linspace(-1.2, 1.2, 25)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    vertices, triangles = isosurface(np.sqrt(x**2 + y**2 + z**2), 0.987, (line, line, line))
    assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.987, abs=5e-3)
    p = vertices[triangles]
    area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum()
    assert area == pytest.approx(4 * np.pi * 0.987**2, rel=0.01)
    # closed: every edge belongs to two triangles
    corners = np.round(p / 1e-9).astype(np.int64)
    edges: dict[frozenset[tuple[int, ...]], int] = {}
    for one in corners:
        names = [tuple(corner) for corner in one]
        for a, b in ((0, 1), (1, 2), (2, 0)):
            edge = frozenset((names[a], names[b]))
            if len(edge) == 2:
                edges[edge] = edges.get(edge, 0) + 1
    assert set(edges.values()) == {2}


def test_isosurface_ends_where_there_are_no_values():
    line = np.linspace(0, 1, 5)
    values = np.broadcast_to(line, (5, 5, 5)).copy()
    values[:3] = np.nan
    vertices, _ = isosurface(values, 0.4, (line, line, line))
    assert vertices[:, 0].min() == line[3]
    assert len(isosurface(np.full((5, 5, 5), np.nan), 0.4, (line, line, line))[0]) == 0


def test_plate_goes_around_in_order_and_needs_an_area():
    angle = np.random.default_rng(2).permutation(np.linspace(0, 2 * np.pi, 6, endpoint=False))
    corners = np.stack([np.cos(angle), np.sin(angle), np.full(6, 0.3)], axis=1)
    around = plate(corners)
    assert around is not None
    sides = np.linalg.norm(around - np.roll(around, 1, axis=0), axis=1)
    assert sides == pytest.approx(np.ones(6))
    assert plate(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])) is None
    assert plate(corners[:2]) is None

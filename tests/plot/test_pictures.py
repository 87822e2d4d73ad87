"""What is to be seen are the results, layer by layer, in the units that stand beside them."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.plot import LAYERS, Layers, Marks, Mesh, Path, Quality, Text, layers_of
from robostiff.plot.picture import Face
from tests.plot.machines import hexapod_stiffness, robot

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


def test_a_pose_out_of_reach_has_no_picture():
    with pytest.raises(rs.NoAnswerError, match="no picture of '3-rrr'"):
        shown("3-rrr", [5.0, 0, 0], [0.0, 0, 0])

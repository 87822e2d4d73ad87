"""What is to be seen are the results, in the units that stand beside them."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.plot.picture import Face, Mesh, Path
from robostiff.plot.surfaces import Quality
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

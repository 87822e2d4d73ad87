"""Networks and linkages under finite loads and in their modes, and force-deflection curves."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.network import Network
from robostiff.plot.displacement import STILL, finite_motions, motion_under
from robostiff.plot.picture import Arrow, Marks, Path
from tests.statics.robots_under_load import loaded
from tests.statics.test_load_paths import LIMIT, shallow_truss

DATA = rs.plot.PictureData()
STRUCTURES = ("double-pantograph", "examples/portal.json")
LOAD = np.array([20.0, 10, -30, 1, 2, 3])


@pytest.mark.parametrize("name", STRUCTURES)
def test_bodies_move_as_in_the_linear_answer_when_loads_are_small(name):
    robot, F = rs.load(name), 1e-4 * LOAD
    answer = loaded(robot, wrench=F)
    assert isinstance(answer.posed, Network)
    network = answer.posed
    finite, linear = (
        finite_motions(network, answer.places),
        motion_under(network, rs.deflection(robot, wrench=F)),
    )
    assert set(finite) == set(linear) - set(network.fixed)
    points = np.array([node.point for node in network.nodes])
    for body in linear:
        expected = np.array([linear[body].displacement(p) for p in points])
        found = [finite.get(body, STILL).displacement(p) for p in points]
        np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max() + 1e-13)


@pytest.mark.parametrize("name", STRUCTURES)
def test_the_platform_is_drawn_where_it_comes_to_rest(name):
    answer = loaded(rs.load(name), wrench=LOAD)
    true, rest = (
        rs.plot.equilibrium(answer, exaggeration=times, backend=DATA) for times in (1.0, 0.0)
    )
    at = [
        next(
            own for own in scene.items if isinstance(own, Marks) and own.label == "reference point"
        )
        for scene in (true, rest)
    ]
    unit = 1e3 if "mm" in true.axes[0] else 1.0
    moved = (at[0].points[0] - at[1].points[0]) / unit
    np.testing.assert_allclose(moved, answer.displacement[:3], atol=1e-12)
    assert any(isinstance(own, Arrow) for own in true.items)
    dashed = [own for own in true.items if isinstance(own, Path) and own.dashed]
    assert dashed
    assert dashed[0].label == "without load"


def test_both_ends_of_a_mode_lie_on_opposite_sides_of_rest():
    modes = rs.modes(rs.load("double-pantograph"), masses={"platform": 10})
    one, other = (rs.plot.mode(modes, 1, side, backend=DATA) for side in (1.0, -1.0))
    assert one.title.startswith("double-pantograph, mode 1: ")
    lines = [[own.points for own in scene.items if isinstance(own, Path)] for scene in (one, other)]
    rest = [own.points for own in one.items if isinstance(own, Path) and own.dashed]
    beams = [
        [own.points for own in scene.items if isinstance(own, Path) and "lower" in own.about]
        for scene in (one, other)
    ]
    assert len(lines[0]) == len(lines[1])
    middles = [0.5 * (a[[0, -1]] + b[[0, -1]]) for a, b in zip(*beams, strict=True)]
    assert middles
    for middle in middles:
        nearest = min(np.abs(line[[0, -1]] - middle).max() for line in rest if len(line) > 1)
        assert nearest < 1e-9 * 600


@pytest.fixture(scope="module")
def curve():
    return rs.load_path(shallow_truss(), None, [0, -LIMIT, 0], [0.25, 0.5, 1.5])


def test_stable_and_unstable_parts_of_a_path(curve):
    picture = rs.plot.load_curve(curve, backend=DATA)
    stable, unstable, asked = picture.curves
    assert (picture.x_label, stable.name, unstable.name) == ("dy [mm]", "stable", "unstable")
    assert unstable.is_dashed
    along = 1e3 * curve.path_displacement.sel(twist="dy").values
    assert np.allclose(stable.x[curve.path_stable.values], along[curve.path_stable.values])
    assert np.isnan(stable.x[~curve.path_stable.values]).all()
    assert np.array_equal(np.isfinite(asked.x), curve.stable.values)
    met = np.isfinite(stable.x) & np.isfinite(unstable.x)
    assert met.sum() == 1  # the dashed line begins where the other ends


def test_matplotlib_draws_it(curve):
    axes = rs.plot.load_curve(curve, "dx")
    assert axes.get_xlabel().startswith("dx")
    styles = [line.get_linestyle() for line in axes.get_lines()]
    assert styles == ["-", "--", "None"]  # equilibria at the given loads are marks alone


def test_slips(curve):
    with pytest.raises(rs.InputError, match="expected dx, dy, rz"):
        rs.plot.load_curve(curve, "dz")
    with pytest.raises(rs.InputError, match=r"what rs.load_path returns"):
        rs.plot.load_curve(curve[["K"]])

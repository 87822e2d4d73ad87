"""Force-deflection curves as pictures."""

import numpy as np
import pytest

import robostiff as rs
from tests.statics.test_load_paths import LIMIT, shallow_truss

DATA = rs.plot.PictureData()


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

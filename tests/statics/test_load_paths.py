"""Force-deflection curves against closed forms, and through limit points."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import PlacedLeg, Snapshot
from robostiff.spatial import Space
from robostiff.statics import critical_point
from tests.statics.robots_under_load import joint, loaded

A, B, K = 0.5, 0.1, 1e5


def shallow_truss(rise: float = B) -> Snapshot:
    """Two struts over a span 2 A, their common point above it: von Mises' truss."""
    z, tip = [0, 0, 1], np.array([0, rise, 0])
    legs = []
    for name, x in (("left", -A), ("right", A)):
        foot = np.array([x, 0, 0])
        u = (tip - foot) / np.linalg.norm(tip - foot)
        parts = (
            joint(f"{name} foot", foot, z),
            joint(f"{name} strut", foot, u, "P", K),
            joint(f"{name} head", tip, z),
        )
        legs.append(PlacedLeg(name, parts, tip))
    guide = (joint("x", tip, [1, 0, 0], "P", 1e4), joint("y", tip, [0, 1, 0], "P"))
    legs.append(PlacedLeg("guide", (*guide, joint("turn", tip, z, "R", 1e4)), tip))
    return Snapshot("truss", tuple(legs), tip, Space.PLANAR)


def push(h: np.ndarray) -> np.ndarray:
    """Force downwards that holds the point at height h: 2 k (L0 - L) h / L."""
    L = np.hypot(A, h)
    return 2 * K * (np.hypot(A, B) - L) * h / L


LIMIT = float(np.max(push(np.linspace(0, B, 20001))))


def test_path_follows_a_truss_through_its_limit_point():
    curve = rs.load_path(shallow_truss(), None, [0, -LIMIT, 0], [0.5, 0.99, 1.5])
    h = B + curve.path_displacement.sel(twist="dy").values
    F = curve.path_factor.values * LIMIT
    assert np.allclose(F, push(h), atol=1e-7 * LIMIT)
    assert F.max() > 0.9 * LIMIT
    assert F[-1] < 0  # it has snapped through, and would have to be held back
    stable = curve.path_stable.values
    at_limit = float(np.linspace(0, B, 20001)[np.argmax(push(np.linspace(0, B, 20001)))])
    assert np.array_equal(stable, np.abs(h) >= at_limit - 1e-6)
    assert not stable.all()


@pytest.mark.parametrize("rise", [1e-3, 1e-2, B])
@pytest.mark.parametrize("times", [0.1, 1e2, 1e4])
def test_a_small_snap_under_a_large_load_is_not_jumped_over(rise: float, times: float):
    """At ``h = A sqrt((L0/A)^(2/3) - 1)`` the push is largest."""
    rest = np.hypot(A, rise)
    h = A * np.sqrt((rest / A) ** (2 / 3) - 1)
    limit = 2 * K * (rest - np.hypot(A, h)) * h / np.hypot(A, h)
    found = rs.critical_load(shallow_truss(rise), None, [0, -times * limit, 0])
    assert found.is_limit
    assert found.factor * times == pytest.approx(1, rel=1e-8)


def test_curve_is_that_of_equilibria():
    truss, factors = shallow_truss(), np.array([-0.5, 0.0, 0.5, 0.99, 1.5])
    curve = rs.load_path(truss, None, [0, -LIMIT, 0], factors)
    for i, factor in enumerate(factors):
        alone = loaded(truss, wrench=[0, -factor * LIMIT, 0])
        assert int(alone.status) == curve.status_code[i]
        assert alone.stable == bool(curve.stable[i])
        if alone.has_answer:
            assert np.array_equal(alone.displacement, curve.displacement[i])
            assert np.array_equal(alone.K_total, curve.K_total[i])
            assert np.isclose(alone.energy, curve.energy[i])
    assert [str(rs.EquilibriumStatus(int(c))) for c in curve.status_code.values[:4]] == ["ok"] * 4
    assert rs.EquilibriumStatus.BEYOND_CRITICAL_LOAD & int(curve.status_code[4])
    h = B + curve.displacement.sel(twist="dy").values[:4]
    assert np.allclose(push(h), factors[:4] * LIMIT, atol=1e-6 * LIMIT)


def test_slope_of_a_curve_is_its_stiffness():
    robot, F = rs.load("3-puu"), np.array([300.0, 0, 0, 0, 0, 0])
    step = 1e-3
    curve = rs.load_path(robot, None, F, [1 - step, 1, 1 + step])
    rate = (curve.displacement[2] - curve.displacement[0]).values / (2 * step)
    wanted = np.linalg.solve(curve.K_total[1].values, F)
    assert np.allclose(rate[:3], wanted[:3], rtol=1e-5)


def test_bad_calls():
    robot = rs.load("hexapod")
    with pytest.raises(rs.InputError, match="factors of a load path"):
        rs.load_path(robot, None, [0, 0, -1, 0, 0, 0])
    with pytest.raises(rs.InputError, match="a load that grows"):
        rs.load_path(robot, None, np.zeros(6), [1.0])
    far = rs.load_path(rs.load("3-puu"), [1, 0, 0.3], [0, 0, -1, 0, 0, 0], [1.0])
    assert str(rs.EquilibriumStatus(int(far.status_code[0]))) == "unreachable"
    assert far.sizes["step"] == 0


def test_critical_point_stands_on_the_path():
    """The curve is stable up to it, and not beyond: no stretch between is drawn as either."""
    from tests.statics.robots_under_load import column

    curve = rs.load_path(column(100.0, 1e7, 0.5, 1e9), None, [0, -1.0, 0], [100.0, 600.0])
    stable, factor = curve.path_stable.values, curve.path_factor.values
    last = np.flatnonzero(stable)[-1]
    assert np.isclose(factor[last], 400.0, rtol=1e-3)  # 2 k / L
    assert not stable[last + 1 :].any()
    assert stable[: last + 1].all()
    assert factor[-1] == 600


def test_law_of_a_joint_acts_along_the_path():
    import sympy as sp

    q = sp.Symbol("q")
    law = {"left/left strut": rs.ForceLaw(K * q + 1e9 * q**3)}
    factors = [0.5, 0.9]
    curve = rs.load_path(shallow_truss(), None, [0, -LIMIT, 0], factors, laws=law)
    for i, factor in enumerate(factors):
        alone = loaded(shallow_truss(), wrench=[0, -factor * LIMIT, 0], laws=law)
        assert np.allclose(alone.displacement, curve.displacement[i], rtol=1e-12)
    linear = rs.load_path(shallow_truss(), None, [0, -LIMIT, 0], factors)
    assert np.abs(linear.displacement - curve.displacement).max() > 1e-5


def test_margin_that_leaps_past_zero_has_the_factor_of_the_leap(monkeypatch: pytest.MonkeyPatch):
    """As where a leg turns singular on the way, and its stiffness runs to minus infinity."""
    real = critical_point.least_margin

    def leaping(problem: Any, found: Any, unloaded: Any) -> Any:
        leg, own = real(problem, found, unloaded)
        return leg, replace(own, value=0.3 if found.factor < 0.123 else -1e9)

    monkeypatch.setattr(critical_point, "least_margin", leaping)
    answer = loaded(shallow_truss(), wrench=[0, -3 * LIMIT, 0])
    assert answer.critical_factor == pytest.approx(0.123, rel=1e-6)


def test_a_path_ends_at_the_largest_factor():
    curve = rs.load_path(rs.load("3-puu"), None, [500, 0, 0, 0, 0, 0], [1.0, 2.0])
    assert curve.path_factor.values.max() == curve.path_factor.values[-1] == 2.0
    last, given = curve.path_displacement.values[-1], curve.displacement.values[-1]
    assert np.allclose(last, given, rtol=0, atol=1e-10)

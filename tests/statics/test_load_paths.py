"""Force-deflection curves against closed forms, and through limit points."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import robostiff as rs
from robostiff.model import PlacedLeg, Snapshot
from robostiff.spatial import Space
from robostiff.statics.equations import equilibrium_path
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
    assert [str(rs.Status(int(c))) for c in curve.status_code.values[:4]] == ["ok"] * 4
    assert rs.Status.BEYOND_CRITICAL_LOAD & int(curve.status_code[4])
    h = B + curve.displacement.sel(twist="dy").values[:4]
    assert np.allclose(push(h), factors[:4] * LIMIT, atol=1e-6 * LIMIT)


def test_from_a_pose_out_of_reach_there_is_no_path():
    far = rs.load_path(rs.load("3-puu"), [1, 0, 0.3], [0, 0, -1, 0, 0, 0], [1.0])
    assert str(rs.Status(int(far.status_code[0]))) == "unreachable"
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
        assert np.allclose(alone.displacement, curve.displacement[i], rtol=1e-12, atol=1e-15)
    linear = rs.load_path(shallow_truss(), None, [0, -LIMIT, 0], factors)
    assert np.abs(linear.displacement - curve.displacement).max() > 1e-5


def test_margin_that_leaps_past_zero_has_the_factor_of_the_leap(monkeypatch: pytest.MonkeyPatch):
    """As where a leg turns singular on the way, and its stiffness runs to minus infinity."""
    real = equilibrium_path.least_margin

    def leaping(found: Any) -> Any:
        return replace(real(found), value=0.3 if found.factor < 0.123 else -1e9)

    monkeypatch.setattr(equilibrium_path, "least_margin", leaping)
    answer = loaded(shallow_truss(), wrench=[0, -3 * LIMIT, 0])
    assert answer.critical_factor == pytest.approx(0.123, rel=1e-6)


def test_a_path_ends_at_the_largest_factor():
    curve = rs.load_path(rs.load("3-puu"), None, [500, 0, 0, 0, 0, 0], [1.0, 2.0])
    assert curve.path_factor.values.max() == curve.path_factor.values[-1] == 2.0
    last, given = curve.path_displacement.values[-1], curve.displacement.values[-1]
    assert np.allclose(last, given, rtol=0, atol=1e-10)


def test_a_snap_into_another_stable_posture_is_seen():
    """The shipped 3-RPR is nearly singular at home: a small force turns it by a degree.

    Held at a turn, it needs ``s(turn)`` of the force; the first greatest s is critical.
    """
    base = np.array([[0.0, 0], [1, 0], [0.4, 0.9]])
    on_platform = np.array([[-0.1, -0.07], [0.12, -0.06], [0, 0.11]])
    k, home, F = np.array([1e6, 1.5e6, 8e5]), np.array([0.45, 0.35]), np.array([100.0, 0, 0])
    rest = np.linalg.norm(home + on_platform - base, axis=1)

    def pull(x: np.ndarray, turn: float) -> np.ndarray:
        c, s = np.cos(turn), np.sin(turn)
        arms = on_platform @ np.array([[c, s], [-s, c]])
        along = home + x + arms - base
        length = np.linalg.norm(along, axis=1)
        f = (k * (length - rest) / length)[:, None] * along
        return np.append(f.sum(0), np.sum(arms[:, 0] * f[:, 1] - arms[:, 1] * f[:, 0]))

    def share(turn: float) -> float:
        def open_(v: np.ndarray) -> np.ndarray:
            return pull(v[:2], turn) - 1e4 * v[2] * F

        v, h = np.zeros(3), 1e-6
        for _ in range(8):
            J = np.array([(open_(v + h * e) - open_(v - h * e)) / (2 * h) for e in np.eye(3)]).T
            v = v - np.linalg.solve(J, open_(v))
        assert np.abs(open_(v)).max() < 1e-8
        return float(1e4 * v[2])

    first: Any = minimize_scalar(
        lambda turn: -share(turn), bounds=(0, 0.005), options={"xatol": 1e-9}
    )
    critical, robot = -first.fun, rs.load("3-rpr")
    assert rs.critical_load(robot, None, F).factor == pytest.approx(critical, rel=1e-6)
    times = np.array([0.3, 0.99, 1.5, 118, 1000])
    for one in times:
        answer = loaded(robot, wrench=one * critical * F)
        assert (answer.critical_factor is None) == (one < 1)
        if one > 1:
            assert rs.Status.BEYOND_CRITICAL_LOAD in answer.status
            assert answer.critical_factor == pytest.approx(1 / one, rel=1e-6)
        if answer.has_answer:
            assert share(answer.displacement[2]) == pytest.approx(one * critical, rel=1e-6)
    fast = rs.compile_loaded(robot)
    kernel = fast.evaluate(np.tile([*home, 0], (len(times), 1)), times[:, None] * critical * F)
    assert not kernel.guarded[0]
    beyond = [
        rs.Status.BEYOND_CRITICAL_LOAD in own
        for own in map(rs.Status, kernel.status_codes.tolist())
    ]
    assert np.array_equal(beyond, times > 1)


@pytest.mark.parametrize(("name", "seed"), [("orthoglide", 5), ("hexapod", 0)])
def test_critical_loads_do_not_depend_on_the_steps_of_the_path(name, seed):
    """Beside them equations are nearly singular, and slender bars may leap to a bent shape."""
    wrench = np.random.default_rng(seed).normal(size=6) * np.repeat([1e5, 1e4], 3)
    robot = rs.load(name)
    factor = rs.critical_load(robot, wrench=wrench).factor
    found = rs.load_path(robot, wrench=wrench, factors=[0.0, 1.1 * factor])
    assert abs(float(found.critical_factor[0]) - factor) < 5e-7 * factor

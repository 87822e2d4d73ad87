"""Robots beyond the paper in closed form, tied to the numerical form by substitution."""

import numpy as np
import pytest
import sympy as sp

from robostiff.analysis import stiffness
from robostiff.analytic import rank_formula, snapshot_formula
from robostiff.analytic.export import derivation_text
from robostiff.errors import InputError
from robostiff.model import PlacedLeg, Snapshot, with_entries
from robostiff.spatial import Space
from tests.analytic.formulas import X, Z, sliding, three_puu, turning, unit, vector


def at_numbers(snapshot, values):
    """The same snapshot with numbers for its symbols."""
    return with_entries(snapshot, lambda x: float(sp.sympify(x).evalf(30, subs=values)))


def check_against_numbers(snapshot, values, tolerance=1e-10):
    K = snapshot_formula(snapshot).K
    found = np.array(K.evalf(30, subs=values), dtype=float)
    expected = stiffness(at_numbers(snapshot, values)).K
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    size = np.where(size > 0, size, size.max())
    assert np.max(np.abs(found - expected) / size) < tolerance
    return K


def test_planar_3_rpr_at_a_general_pose():
    x, y, c, s = sp.Symbol("x"), sp.Symbol("y"), sp.cos(sp.Symbol("t")), sp.sin(sp.Symbol("t"))
    a, b = sp.symbols("a b", positive=True)
    k = sp.Symbol("k", positive=True)
    legs = []
    bases = [(0, 0), (a, 0), (a / 2, a)]
    corners = [(-b, -b), (b, -b), (0, b)]
    for i, ((X0, Y0), (u, v)) in enumerate(zip(bases, corners, strict=True)):
        A = vector(X0, Y0, 0)
        B = vector(x + c * u - s * v, y + s * u + c * v, 0)
        elements = (turning("A", A, Z), sliding("slide", A, unit(B - A), k), turning("B", B, Z))
        legs.append(PlacedLeg(f"leg{i}", elements, B))
    robot = Snapshot("3-RPR", tuple(legs), vector(x, y, 0), Space.PLANAR)
    values = {x: 0.45, y: 0.35, sp.Symbol("t"): 0.3, a: 1.0, b: 0.12, k: 1e6}
    K = check_against_numbers(robot, values)
    singular = K.subs({sp.Symbol("t"): 0, x: a / 2, y: a / 3})
    assert rank_formula(singular).rank == 2  # the three slides meet in one point


def test_a_leg_without_compliance_on_its_path_is_refused():
    L = sp.Symbol("L", positive=True)
    hinge = turning("hinge", vector(0, 0, 0), Z)
    spring = sliding("slide", vector(0, 0, 0), X, sp.Symbol("k", positive=True))
    leg = PlacedLeg("stiff", (hinge, spring), vector(L, 0, 0))
    with pytest.raises(InputError, match="meets no compliance"):
        snapshot_formula(Snapshot("stiff", (leg,), vector(L, 0, 0)))


def test_a_snapshot_in_formulas_is_a_formula_as_others_are():
    formula = snapshot_formula(three_puu())
    values = {s.name: 0.5 + 0.1 * i for i, s in enumerate(formula.symbols)}
    K = formula.lambdify()(**values)
    put_in = formula.subs(values)
    assert np.array(put_in.K, dtype=float) == pytest.approx(K, rel=1e-12)
    assert np.array(sum(put_in.legs, sp.zeros(6)), dtype=float) == pytest.approx(K, abs=1e-12)
    assert derivation_text(formula).startswith("Cartesian stiffness matrix of 3-PUU\n")

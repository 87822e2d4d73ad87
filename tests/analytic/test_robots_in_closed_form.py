"""Whole robots in closed form against printed formulas and known structure, exactly."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analysis import stiffness
from robostiff.analytic import canonical, rank_formula, snapshot_formula
from robostiff.analytic.export import derivation_text
from robostiff.errors import InputError
from robostiff.model import PlacedLeg, Snapshot, with_entries
from robostiff.spatial import Space
from tests.analytic.formulas import X, Z, derived, sliding, three_puu, turning, unit, vector
from tests.files import FILES


def symbol(derivation, name):
    return next(s for s in derivation.symbols if s.name == name)


def printed_section_6(derivation, length_squared, d, d_squared, spin):
    """Eq. (27) and (28) with their letters."""
    r, h, k = (symbol(derivation, name) for name in "rhk")
    K = sp.diag(d_squared, d_squared, 2 * h**2, r**2 * h**2, r**2 * h**2, spin)
    K[0, 4] = K[4, 0] = r * h * d
    K[1, 3] = K[3, 1] = -r * h * d
    return canonical(3 * k / length_squared * K)


def at_random(derivation, robot, numeric_K, count=3):
    """Largest relative difference from the numerical form at random values of the symbols."""
    random, worst = np.random.default_rng(5), 0.0
    for _ in range(count):
        values = {k: v * random.uniform(0.9, 1.1) for k, v in robot.nominal.items()}
        pose = {name: 0.05 * random.uniform(0.5, 1) for name in derivation.coordinates}
        given = {s: (values | pose)[s.name] for s in derivation.symbols}
        K = np.array(derivation.substituted(given).evalf(30), dtype=float)
        expected = numeric_K(robot.substituted(values), pose)
        worst = max(worst, np.max(np.abs(K - expected)) / np.max(np.abs(expected)))
    return worst


def test_case_a_is_eq_27_entry_by_entry():
    derivation = derived("gough-stewart-a")
    R, r, h = (symbol(derivation, name) for name in "Rrh")
    d = R - r
    printed = printed_section_6(derivation, d**2 + h**2, d, d**2, 0)
    assert canonical(derivation.K - printed) == sp.zeros(6)


def test_case_b_is_eq_28_entry_by_entry():
    derivation = derived("gough-stewart-b")
    R, r, h = (symbol(derivation, name) for name in "Rrh")
    L2 = R**2 - R * r + r**2 + h**2
    spin = sp.Rational(3, 2) * r**2 * R**2
    printed = printed_section_6(derivation, L2, R / 2 - r, R**2 - R * r + r**2, spin)
    assert canonical(derivation.K - printed) == sp.zeros(6)


@pytest.mark.parametrize("name", ["gough-stewart-a", "gough-stewart-b", "3-puu"])
def test_legs_add_up_to_the_robot_and_each_is_its_wrenches(name):
    derivation = derived(name)
    assert derivation.is_closed
    assert not any(entry.has(sp.Float) for entry in derivation.K)
    total = sp.zeros(derivation.K.rows)
    for leg in derivation.legs:
        pairs = zip(leg.wrenches, leg.compliances, strict=True)
        K = sum((w * w.T / c for w, c in pairs), sp.zeros(derivation.K.rows))
        assert canonical(K - leg.K).is_zero_matrix
        total += leg.K
    assert canonical(total - derivation.K).is_zero_matrix


def test_beams_as_legs_give_case_b_with_their_own_stiffness():
    """Legs are extensional springs E A / L, whatever else their beams could carry."""
    struts, beams = derived("gough-stewart-b"), derived("gough-stewart-b-beams")
    R, r, h, k = (symbol(struts, name) for name in ("R", "r", "h", "k"))
    D, d = symbol(beams, "D"), symbol(beams, "d")
    L = sp.sqrt(R**2 - R * r + r**2 + h**2)
    E = sp.Integer(210) * 10**9
    expected = struts.K.subs(k, E * sp.pi * (D**2 - d**2) / (4 * L))
    assert canonical(beams.K - expected).is_zero_matrix


def test_planar_3_rpr_at_a_general_pose():
    robot = rs.load("3-rpr", symbols=())
    derivation = rs.derive(robot, pose=rs.AtSymbols(), form=rs.Closed())
    assert derivation.coordinates == ("x", "y", "gamma")
    assert rank_formula(sum((leg.K for leg in derivation.legs[:2]), sp.zeros(3))).rank == 2

    def numeric(own, pose):
        return rs.stiffness(own, [pose["x"], pose["y"], pose["gamma"]]).K

    assert at_random(derivation, robot, numeric) < 1e-10


def test_branches_are_taken_at_nominal_values_not_elsewhere():
    """Cranks of another length than the samples would close straight, and carry no torque."""
    robot = rs.load("3-rrr", symbols=("R", "r", "l1", "l2", "k"))
    derivation = rs.derive(robot, form=rs.Steps())
    assert at_random(derivation, robot, lambda numeric, _: rs.stiffness(numeric).K, 1) < 1e-10


def test_2r_arm_is_salisburys_formula():
    """K = J^-T K_theta J^-1 in translation, the wrist being free to turn."""
    derivation = rs.derive(FILES / "2r-arm.yaml", pose=rs.AtSymbols(), form=rs.Closed())
    l1, l2, k1, k2, q1, q2 = (symbol(derivation, n) for n in ("l1", "l2", "k1", "k2", "q1", "q2"))
    J = sp.Matrix([l1 * sp.cos(q1) + l2 * sp.cos(q1 + q2), l1 * sp.sin(q1) + l2 * sp.sin(q1 + q2)])
    J = J.jacobian([q1, q2])
    inverse = J.adjugate() / J.det()
    expected = inverse.T * sp.diag(k1, k2) * inverse
    assert canonical(derivation.K[:2, :2] - expected).is_zero_matrix
    assert derivation.K[2, :].is_zero_matrix


def test_a_parameter_with_the_name_of_a_coordinate_is_distinguished():
    derivation = rs.derive("hexapod", symbols=("alpha",), pose=rs.AtSymbols())
    assert derivation.where == "at x, y, z, alpha = alpha_P, beta, gamma"
    assert {"alpha", "alpha_P"} <= {s.name for s in derivation.symbols}


def test_given_coordinates_are_exact_and_agree():
    robot = rs.load("gough-stewart-b", symbols=("k",))
    derivation = rs.derive(robot, pose=rs.AtCoordinates({"x": 0.1, "gamma": np.radians(10)}))
    assert derivation.where == "at x = 1/10, gamma = pi/18"
    K = np.array(derivation.substituted({symbol(derivation, "k"): 1e8}).evalf(30), dtype=float)
    expected = rs.stiffness(robot.numeric, [0.1, 0, 0.8, 0, 0, np.radians(10)]).K
    np.testing.assert_allclose(K, expected, atol=1e-10 * np.max(expected))


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


def test_a_planar_3_rpr_as_a_snapshot():
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

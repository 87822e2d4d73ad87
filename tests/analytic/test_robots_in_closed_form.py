"""Robots in closed form, against formulas by hand and numbers."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import canonical, snapshot_formula
from robostiff.analytic.export import derivation_text
from robostiff.model import parallelogram
from robostiff.spatial import Frame, Space
from tests.analytic.formulas import derived, three_puu
from tests.files import FILES, text_of


def symbol(derivation, name):
    return next(s for s in derivation.symbols if s.name == name)


def printed_section_6(derivation, length_squared, d, d_squared, spin):
    """Eq. (27) and (28) with their letters."""
    r, h, k = (symbol(derivation, name) for name in "rhk")
    K = sp.diag(d_squared, d_squared, 2 * h**2, r**2 * h**2, r**2 * h**2, spin)
    K[0, 4] = K[4, 0] = r * h * d
    K[1, 3] = K[3, 1] = -r * h * d
    return canonical(3 * k / length_squared * K)


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


def test_a_snapshot_in_formulas_is_a_formula_as_others_are():
    formula = snapshot_formula(three_puu())
    values = {s.name: 0.5 + 0.1 * i for i, s in enumerate(formula.symbols)}
    K = formula.lambdify()(**values)
    put_in = formula.subs(values)
    assert np.array(put_in.K, dtype=float) == pytest.approx(K, rel=1e-12)
    assert np.array(sum(put_in.legs, sp.zeros(6)), dtype=float) == pytest.approx(K, abs=1e-12)
    assert derivation_text(formula).startswith("Cartesian stiffness matrix of 3-PUU\n")


def written(tmp_path, text):
    file = tmp_path / "robot.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def symbols_of(derivation, *names):
    by_name = {symbol.name: symbol for symbol in derivation.symbols}
    return [by_name[name] for name in names]


def cubic(a, k):
    return sp.diag(2 * k * sp.eye(3), 2 * k * a**2 * (sp.eye(3) + sp.ones(3)))


def test_planar_arm_of_beams_closes_with_all_symbols_and_stays_short():
    robot = rs.load(FILES / "2r-beams.yaml", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=rs.AtSymbols(), form=rs.Closed())
    assert max(len(sp.Add.make_args(sp.numer(e).expand())) for e in derivation.K) < 100
    given = robot.nominal | {"q1": 0.4, "q2": 0.9}
    found = derivation.substituted({s: given[s.name] for s in derivation.symbols})
    expected = rs.stiffness(robot.numeric, rs.JointCoordinates([0.4, 0.9])).K
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.max(np.abs(np.array(found.evalf(30), dtype=float) - expected) / size) < 1e-10


def test_3_puu_about_its_centre_is_pull_and_torque_of_three_rods():
    """Each rod pulls with k, drive and traction in series, and turns with k_tau = G J / L."""
    derivation = rs.derive(FILES / "3-puu.yaml")
    R, r, L, k_a, E, A, G, J = symbols_of(derivation, "R", "r", "L", "k_a", "E", "A", "G", "I_t")
    s = (R - r) / L
    c = sp.sqrt(L**2 - (R - r) ** 2) / L
    k, k_tau = 1 / (c**2 / k_a + L / (E * A)), G * J / L
    tilt = sp.Rational(3, 2) * (r**2 * c**2 * k + s**2 * k_tau)
    expected = sp.diag(
        *[sp.Rational(3, 2) * s**2 * k] * 2, 3 * c**2 * k, tilt, tilt, 3 * c**2 * k_tau
    )
    coupling = sp.Rational(3, 2) * r * s * c * k
    expected[0, 4] = expected[4, 0] = -coupling
    expected[1, 3] = expected[3, 1] = coupling
    assert canonical(derivation.K - expected).is_zero_matrix


@pytest.mark.filterwarnings("ignore:.*nothing in the file uses 'h'")
def test_cubic_platform_about_its_centre_and_above(tmp_path):
    """2 k in every direction; 8 k a^2 about one diagonal, 2 k a^2 square to it."""
    at_centre = rs.derive(written(tmp_path, text_of("cubic.yaml").replace("HEIGHT", "0")))
    a, k = symbols_of(at_centre, "a", "k")
    assert at_centre.K == sp.ImmutableMatrix(cubic(a, k))
    above = rs.derive(written(tmp_path, text_of("cubic.yaml").replace("HEIGHT", "h")))
    a, k, h = symbols_of(above, "a", "k", "h")
    lever = sp.Matrix([[0, -h, 0], [h, 0, 0], [0, 0, 0]])
    J = sp.Matrix(sp.BlockMatrix([[sp.eye(3), lever], [sp.zeros(3), sp.eye(3)]]))
    expected = J.T * cubic(a, k) * J
    assert canonical(above.K - expected).is_zero_matrix


NOMINAL = {"k": 3e6, "l": 0.5, "w": 0.1}


def bars_that_only_stretch(k, length, width) -> rs.Robot:
    """A planar parallelogram of two bars along x, each a spring of stiffness k."""
    z = [0, 0, 1]
    free, spring = rs.Passive(), rs.Actuated(k)
    bar = rs.Chain(
        (
            rs.revolute(z, free, name="near pin"),
            rs.prismatic([1, 0, 0], spring, home=[length], name="bar"),
            rs.revolute(z, free, name="far pin"),
        )
    )
    across = np.array([0, width, 0], dtype=object)
    still = Frame(np.eye(3, dtype=int), np.zeros(3, dtype=int))
    leg = rs.Leg("leg", still, rs.Chain((parallelogram(bar, across),)), still)
    home = Frame(np.eye(3, dtype=int), np.array([length, 0, 0], dtype=object))
    return rs.Robot("parallelogram", (leg,), home=home, space=Space.PLANAR, nominal=NOMINAL)


def test_planar_parallelogram_by_hand():
    """Bars along x at y = +-w/2 feel dx -+ w/2 rz: K = diag(2 k, 0, k w^2/2)."""
    k, length, w = sp.symbols("k l w", positive=True)
    robot = bars_that_only_stretch(k, length, w)
    K = sp.Matrix(rs.derive(robot, form=rs.Closed()).K)
    assert sp.simplify(K - sp.diag(2 * k, 0, k * w**2 / 2)) == sp.zeros(3)
    numeric = rs.stiffness(robot.numeric)
    assert np.abs(numeric.K - np.diag([6e6, 0, 1.5e4])).max() < 1e-6
    assert int(numeric.rank) == 2

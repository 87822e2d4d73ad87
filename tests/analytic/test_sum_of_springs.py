"""Robots at home as a person writes them: unit wrenches, and compliances that stay sums."""

import re

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import (
    decoupling_conditions,
    fixed_point_formula,
    free_motion_formulas,
    rank_formula,
)
from robostiff.analytic.export import (
    c_function,
    derivation_html,
    derivation_latex,
    derivation_markdown,
    derivation_text,
    python_function,
)
from robostiff.analytic.springs.sum_of_springs import different_entries, operations_of
from tests.analytic.formulas import DATA, derived
from tests.analytic.test_printed_formulas import kept
from tests.analytic.test_right_or_refused import distance, function_of, values_for

NAMES = ("gsb-drive", "3-prs", "3-rrr", "3-upu", "orthoglide", "tripteron", "us-ups")
# Operations of K and of what its names stand for, and lines in which it is printed: a long one is
# dearer than a further name. Of those of h4, 11 are entries of K.
LONGEST = {
    **{"hexapod": (65, 10), "3-prs": (40, 10), "3-rps": (60, 10), "3-puu": (40, 10)},
    **{"3-rrr": (58, 10), "3-upu": (60, 10), "delta": (62, 10), "orthoglide": (20, 10)},
    **{"tripteron": (65, 10), "us-ups": (110, 10), "h4": (105, 16), "gantry-tau": (365, 40)},
}


@pytest.mark.parametrize("name", LONGEST)
def test_a_formula_on_file_is_as_short_as_a_person_would_write_it(name):
    count = re.match(r"(\d+) operations, (\d+) lines", kept()[name, "home"])
    assert count is not None
    assert all(int(x) <= most for x, most in zip(count.groups(), LONGEST[name], strict=True))


def test_a_formula_of_a_file_is_as_short():
    named = derived("gsb-drive").named
    lines = [d for d in named.definitions if d.expression.free_symbols]
    assert len(lines) + len(different_entries(named.K)) <= 10
    assert operations_of(named.K, named.definitions) <= 55
    assert named.K == named.K.T
    assert named.K[0, 0] == named.K[1, 1]


@pytest.mark.parametrize("name", NAMES)
def test_wrenches_have_unit_length_and_a_dimension(name):
    for leg in derived(name).legs:
        for w in leg.wrenches:
            t = 2 if len(w) == 3 else 3
            force = w[:t, 0] if not w[:t, 0].is_zero_matrix else w[t:, 0]
            values = {s: 0.3 + 0.01 * i for i, s in enumerate(sorted(w.free_symbols, key=str))}
            values |= {s: 0.9 for s in values if s.name in ("l", "h")}
            if name != "3-rrr":  # closes at few lengths
                assert float(abs(sum(x**2 for x in force).evalf(subs=values))) == pytest.approx(1)


def test_two_arms_on_a_hinge_leave_a_couple_that_spares_it():
    """A couple across both arms, and forces; no compliance is a fraction of several springs."""
    named = derived("h4").named
    c_a, c_b, d = (sp.Symbol(x, positive=True) for x in ("c_a", "c_b", "d"))
    assert c_a * d**2 / 2 + c_b in [x.expression for x in named.definitions]
    couples = [w for w in named.legs[0].wrenches if w[:3, 0].is_zero_matrix]
    assert couples == [sp.ImmutableMatrix([0, 0, 0, sp.sqrt(2) / 2, sp.sqrt(2) / 2, 0])]


def test_shared_energies_of_one_spring_cancel():
    """Three parallel rods hold by couples that meet a multiple of one rod's compliance."""
    named = derived("gantry-tau").named
    assert named is not None
    (_, _, third) = named.legs[2].compliances
    a, l, EA = (sp.Symbol(x, positive=True) for x in ("a", "l", "EA_1"))
    assert third == 3 * l / (8 * EA * a**2)


def test_a_planar_leg_of_two_beams_is_as_in_a_textbook(tmp_path):
    text = (DATA / "planar-leg.yaml").read_text(encoding="utf-8")
    of_numbers = text.replace("home: theta1", "home: 0.5 rad").replace(
        "home: theta2", "home: 0.8 rad"
    )
    assert of_numbers != text
    (tmp_path / "numbers.yaml").write_text(of_numbers, encoding="utf-8")
    for file in (DATA / "planar-leg.yaml", tmp_path / "numbers.yaml"):
        robot = rs.load(file, symbols=rs.ALL_PARAMETERS)
        derivation = rs.derive(robot)
        assert len(derivation.legs[0].wrenches) == 1
        named = derivation.named
        assert named is not None
        assert operations_of(named.K, named.definitions) <= 40
        K = function_of(derivation)(**values_for(derivation, robot.nominal))
        assert distance(K, rs.stiffness(robot.numeric).K) < 1e-9
    named = derived("planar-leg").named
    assert named is not None
    k, l1, l2, t2 = (sp.Symbol(x, positive=True) for x in ("k", "l1", "l2", "theta2"))
    EA_1, EA_2, EI_1 = (sp.Symbol(x, positive=True) for x in ("EA_1", "EA_2", "EI_1"))
    (c,) = (d.expression for d in named.definitions if d.symbol.name == "c_a")
    found = sp.sympify(str(c))
    across = l1**2 / k + l1**3 / (3 * EI_1)
    wanted = across * sp.sin(t2) ** 2 + l1 * sp.cos(t2) ** 2 / EA_1 + l2 / EA_2
    assert sp.expand(found - sp.sympify(str(wanted))) == 0


def test_exports_have_the_names():
    derivation = derived("gsb-drive")
    assert "c_a = 1/k + L_a/EA_1" in derivation_text(derivation)
    assert "K_C_33 = 6*h**2/(L_a**2*c_a)" in derivation_text(derivation)
    for written in (derivation_latex(derivation), derivation_markdown(derivation)):
        assert r"\frac{1}{k} + \frac{L_{a}}{\mathrm{EA}_{1}}" in written
    assert "<mi>c</mi>" in derivation_html(derivation)
    assert "double c_a" in c_function(derivation)
    assert "c_a = " in python_function(derivation)


def test_a_beam_as_stiff_as_its_drive_is_no_special_case():
    derivation = derived("gsb-drive")
    robot = rs.load(DATA / "gsb-drive.yaml", symbols=rs.ALL_PARAMETERS)
    function = function_of(derivation)
    nominal = robot.nominal
    values = {s: nominal[s.name] for s in derivation.symbols}
    known = dict(values)
    for d in derivation.named.definitions:
        known[d.symbol] = float(d.expression.evalf(20, subs=known))
    equal = known[sp.Symbol("EA_1", positive=True)] / known[sp.Symbol("L_a", positive=True)]
    for factor in (1, 1 + 1e-12, 1 - 1e-9, 1 + 1e-6, 0.5, 2):
        own = {**nominal, "k": equal * factor}
        K = function(**values_for(derivation, own))
        assert distance(K, rs.stiffness(robot.substituted(own)).K) < 1e-12
        wanted = rs.stiffness(robot.substituted(own)).K
        written = np.array(derivation.K.xreplace({s: own[s.name] for s in values}), dtype=float)
        assert distance(written, wanted) < 1e-12


@pytest.mark.parametrize("name", ["3-rrr", "delta"])
def test_minors_vanish_as_their_common_factors_say(name):
    """Exponents are slopes of the logarithm of the determinant towards the zeros."""
    derivation = derived(name)
    found = rank_formula(derivation)
    symbols = sorted(derivation.symbols, key=str)
    values = {s: sp.Rational(900 + 37 * i, 997) for i, s in enumerate(symbols)}
    powers = found.common_minor.as_powers_dict()
    for factor in found.exceptions:
        s = min(factor.free_symbols, key=str)
        at_0, at_1 = (factor.xreplace({**values, s: sp.Integer(i)}) for i in (0, 1))
        zero = at_0 / (at_0 - at_1)  # it is linear
        sizes = []
        for away in (1e-12, 1e-14):
            at = {**values, s: zero + sp.Rational(away)}
            sizes.append(sp.log(abs(derivation.K.xreplace(at).evalf(60).det())))
        slope = (sizes[0] - sizes[1]) / sp.log(100)
        assert abs(float(slope) - int(powers[factor])) < 1e-3, factor


def test_questions_in_names_have_the_answers_of_the_formula():
    for name in ("gough-stewart-a", "gough-stewart-b", "3-prs"):
        derivation = derived(name)
        in_names, written_out = rank_formula(derivation), rank_formula(derivation.K)
        assert in_names.rank == written_out.rank
        if name != "3-prs":
            assert in_names == written_out
            assert free_motion_formulas(derivation) == free_motion_formulas(derivation.K)
            assert fixed_point_formula(derivation) == fixed_point_formula(derivation.K)
            assert decoupling_conditions(derivation) == decoupling_conditions(derivation.K)

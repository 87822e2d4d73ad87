"""Short formulas: sums of springs, and what is written shorter."""

import re
from functools import cache, partial

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analytic import (
    canonical,
    decoupling_conditions,
    fixed_point_formula,
    free_motion_formulas,
    name_combinations,
    rank_formula,
    snapshot_formula,
)
from robostiff.analytic.exact.definition import Definition, operations_in
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.reading.short_writing import Written, shortest
from robostiff.analytic.springs.sum_of_springs import different_entries, operations_of
from tests.analytic.export.derivations import ALL
from tests.analytic.export.programs import in_python
from tests.analytic.formulas import (
    CASE_A,
    CASE_B,
    DATA,
    L_A,
    L_B,
    cubic_platform,
    derived,
    stewart,
    three_puu,
)
from tests.analytic.test_printed_formulas import kept
from tests.analytic.test_right_or_refused import values_for
from tests.cases.metric import apart

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


@pytest.mark.filterwarnings("ignore:.*nothing in the file uses 'theta")
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
        K = in_python(derivation)(**values_for(derivation, robot.nominal))
        assert apart(K, rs.stiffness(robot.numeric).K) < 1e-9
    named = derived("planar-leg").named
    assert named is not None
    k, l1, l2, t2 = (sp.Symbol(x, positive=True) for x in ("k", "l1", "l2", "theta2"))
    EA_1, EA_2, EI_1 = (sp.Symbol(x, positive=True) for x in ("EA_1", "EA_2", "EI_1"))
    (c,) = (d.expression for d in named.definitions if d.symbol.name == "c_a")
    found = sp.sympify(str(c))
    across = l1**2 / k + l1**3 / (3 * EI_1)
    wanted = across * sp.sin(t2) ** 2 + l1 * sp.cos(t2) ** 2 / EA_1 + l2 / EA_2
    assert sp.expand(found - sp.sympify(str(wanted))) == 0


def test_a_beam_as_stiff_as_its_drive_is_no_special_case():
    derivation = derived("gsb-drive")
    robot = rs.load(DATA / "gsb-drive.yaml", symbols=rs.ALL_PARAMETERS)
    function = in_python(derivation)
    nominal = robot.nominal
    values = {s: nominal[s.name] for s in derivation.symbols}
    known = dict(values)
    for d in derivation.named.definitions:
        known[d.symbol] = float(d.expression.evalf(20, subs=known))
    equal = known[sp.Symbol("EA_1", positive=True)] / known[sp.Symbol("L_a", positive=True)]
    for factor in (1, 1 + 1e-12, 1 - 1e-9, 1 + 1e-6, 0.5, 2):
        own = {**nominal, "k": equal * factor}
        K = function(**values_for(derivation, own))
        assert apart(K, rs.stiffness(robot.substituted(own)).K) < 1e-12
        wanted = rs.stiffness(robot.substituted(own)).K
        written = np.array(derivation.K.xreplace({s: own[s.name] for s in values}), dtype=float)
        assert apart(written, wanted) < 1e-12


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


R, r, h, k, L = sp.symbols("R r h k L_a", positive=True)
AT = {s: np.array([0.7, 1.1, 0.9]) + 0.2 * i for i, s in enumerate((R, r, h, k))}


def platform():
    """Entries of a Gough-Stewart platform by the length of its legs."""
    length = Definition(L, sp.sqrt(R**2 - R * r + h**2 + r**2))
    below = 1 / L**2
    entries = (
        3 * k * (R**2 - R * r + r**2) * below,
        3 * h * k * r * (R - 2 * r) * below / 2,
        6 * h**2 * k * below + k,
        3 * h**2 * k * r**2 * below,
        sp.Rational(9, 2) * R**2 * k * r**2 * below,
    )
    return Written(entries, (length,))


def operations(written):
    return sum(map(operations_in, (*written.results, *(d.expression for d in written.definitions))))


def short():
    return shortest(platform(), {s.name for s in AT}, AT)


def test_what_is_found_is_shorter_and_the_same():
    start, found = platform(), short()
    assert operations(found) < operations(start)
    before = values_of(start.results, AT, start.definitions)
    after = values_of(found.results, AT, found.definitions)
    np.testing.assert_allclose(after, before, rtol=1e-13)


def test_no_pole_is_added():
    # A ratio to h would be shorter: s_b = h^2 k/L_a^2, and s_b/h beside it.
    start, found = platform(), short()
    at = AT | {h: 0 * AT[h]}
    after = values_of(found.results, at, found.definitions)
    np.testing.assert_allclose(after, values_of(start.results, at, start.definitions), rtol=1e-13)


@pytest.mark.parametrize("name", ["delta", "h4"])
def test_a_name_has_one_dimension(name):
    # Stiffnesses and lengths are in one name where that is a compliance, and nowhere else.
    named = derived(name).named
    assert named is not None
    springs = ("k", "EA", "EI", "GJ", "c_")
    for d in named.definitions:
        has_springs = any(s.name.startswith(springs) for s in d.expression.free_symbols)
        assert not has_springs or d.symbol.name.startswith(springs)


# Closed formulas; that in steps is not.
FORMULAS = {
    "27": partial(stewart, *CASE_A, L_A),
    "28": partial(stewart, *CASE_B, L_B),
    "cubic": cache(lambda: snapshot_formula(cubic_platform(h)).K),
    "3-PUU": cache(lambda: snapshot_formula(three_puu()).K),
    **{name: partial(lambda own: ALL[own].K, name) for name in ALL if name != "in_steps"},
}


def written_out(named):
    matrix = named.matrix
    for definition in reversed(named.definitions):
        matrix = matrix.xreplace({definition.symbol: definition.expression})
    return matrix


@pytest.mark.parametrize("name", FORMULAS)
def test_substituting_back_gives_the_same_matrix_and_no_entry_is_longer(name):
    K = FORMULAS[name]()
    named = name_combinations(K)
    if name in {"all_functions", "badly_named", "numbers_only"}:
        assert named.matrix == K
    else:
        assert canonical(written_out(named)) == canonical(K)
    defined = [d.symbol for d in named.definitions]
    assert len({*defined, *K.free_symbols}) == len(defined) + len(K.free_symbols)
    for i, definition in enumerate(named.definitions):
        assert not definition.expression.free_symbols & set(defined[i:])
    for before, after in zip(sp.ImmutableMatrix(K), named.matrix, strict=True):
        assert after.count_ops() <= before.count_ops()


@st.composite
def symmetric_matrices(draw):
    x, y, z, k = sp.symbols("x y z k", positive=True)
    sums = [x - y, x + y, x - y + z, x**2 + y**2, (x - y) ** 2 + z**2, x * y + z, k + x]
    pieces = [*sums, x, k, sp.sqrt((x - y) ** 2 + z**2), sp.cos(z), sp.Integer(2)]
    entry = st.lists(st.tuples(st.sampled_from(pieces), st.integers(-2, 2)), max_size=3)
    entries = [sp.Mul(*(p**e for p, e in draw(entry))) for _ in range(3)]
    a, b, c = (draw(st.sampled_from([*entries, entries[0] + entries[1]])) for _ in range(3))
    return sp.ImmutableMatrix([[a, b, 0], [b, c, a], [0, a, b]])


@given(symmetric_matrices())
def test_random_matrices_stay_the_same(K):
    assert canonical(written_out(name_combinations(K))) == canonical(K)

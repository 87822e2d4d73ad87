"""Names for what recurs: the matrix stays the same, and reads as people write it."""

from functools import cache, partial

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic import Derivation, canonical, name_combinations, snapshot_formula
from robostiff.analytic.export import (
    c_function,
    derivation_latex,
    derivation_markdown,
    derivation_text,
    derivation_typst,
    python_function,
)
from robostiff.analytic.export.entries import factored_matrix
from tests.analytic.export.derivations import ALL
from tests.analytic.formulas import (
    CASE_A,
    CASE_B,
    K11,
    L_A,
    L_B,
    R,
    cubic_platform,
    h,
    r,
    stewart,
    three_puu,
)

L = sp.Symbol("L", positive=True)


def shown(named):
    return [f"{d.symbol} = {d.expression}" for d in named.definitions]


def test_equation_27_as_the_paper_prints_it():
    named = name_combinations(stewart(*CASE_A, L_A))
    assert shown(named) == ["d_a = R - r", "L_a = sqrt(d_a**2 + h**2)"]
    d_a, L_a = (definition.symbol for definition in named.definitions)
    factor, rest = factored_matrix(named.matrix)
    assert factor == 3 * K11 / L_a**2
    expected = sp.diag(d_a**2, d_a**2, 2 * h**2, r**2 * h**2, r**2 * h**2, 0)
    expected[0, 4] = expected[4, 0] = r * h * d_a
    expected[1, 3] = expected[3, 1] = -r * h * d_a
    assert rest == sp.ImmutableMatrix(expected)


def test_equation_28():
    """The side R^2 - R r + r^2 = d_a^2 + R r of the paper is a length of its own."""
    named = name_combinations(stewart(*CASE_B, L_B))
    assert shown(named) == [
        "d_a = R - 2*r",
        "L_a = sqrt(R**2 - R*r + r**2)",
        "L_b = sqrt(L_a**2 + h**2)",
    ]
    d_a, L_a, L_b = (definition.symbol for definition in named.definitions)
    factor, rest = factored_matrix(named.matrix)
    assert factor == 3 * K11 / (2 * L_b**2)
    assert rest[0, 0] == 2 * L_a**2
    assert rest[0, 4] == r * h * d_a
    assert rest[5, 5] == 3 * r**2 * R**2


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


def test_names_avoid_those_that_are_taken():
    d_a, x = sp.symbols("d_a x")
    named = name_combinations(sp.Matrix([[d_a + x, 0], [0, x * (d_a + x)]]), taken=["d_b"])
    assert shown(named) == ["d_c = d_a + x"]


def test_sums_of_stiffnesses_have_another_letter():
    k_1, k_2, x = sp.symbols("k_1 k_2 x")
    assert shown(name_combinations(sp.diag(k_1 + k_2, x * (k_1 + k_2)))) == ["k_a = k_1 + k_2"]


def test_what_could_be_negative_is_no_length():
    x, y = sp.symbols("x y", positive=True)
    p = x**2 - 3 * x * y + y**2
    assert shown(name_combinations(sp.diag(p, x * p))) == ["p_a = x**2 - 3*x*y + y**2"]


def test_what_occurs_once_gets_no_name():
    x, y, z = sp.symbols("x y z")
    assert name_combinations(sp.diag(x + y, x + z, 1)).definitions == ()


def test_one_sum_for_each_leg_is_kept_apart():
    """A sum of long fractions is not brought over one denominator."""
    x, y, z, k = sp.symbols("x y z k", positive=True)
    first, second = (x - y) ** 2 + z**2, (x + y) ** 2 + z**2
    K = sp.ImmutableMatrix([[k / first + k / second, z / first], [z / first, z / second]])
    named = name_combinations(K)
    assert shown(named) == ["L_a = sqrt(z**2 + (x + y)**2)", "L_b = sqrt(z**2 + (x - y)**2)"]
    L_a, L_b = (d.symbol for d in named.definitions)
    assert named.matrix[0, 0] == k / L_a**2 + k / L_b**2


def test_lengths_of_legs_are_found_in_multiplied_out_denominators():
    """Squares are completed: 2 b^2 - 2 b x - 2 b y + x^2 + y^2 is (b - x)^2 + (b - y)^2."""
    b, x, y, k = sp.symbols("b x y k", positive=True)
    squared = sp.expand((x - b) ** 2 + (y - b) ** 2)
    K = sp.ImmutableMatrix(sp.diag(k / squared, x / squared))
    assert shown(name_combinations(K)) == ["L_a = sqrt((b - x)**2 + (b - y)**2)"]


def test_definitions_stand_above_the_matrix_in_every_language():
    K = stewart(*CASE_A, L_A)
    derivation = Derivation("K_C", K, (), K)
    for written, definition, matrix in (
        (
            derivation_text(derivation),
            "d_a = R - r\nL_a = sqrt(d_a**2 + h**2)",
            "K_C = 3*K11/L_a**2",
        ),
        (derivation_latex(derivation), r"L_{a} &= \sqrt{d_{a}^{2} + h^{2}}", r"\begin{bmatrix}"),
        (derivation_markdown(derivation), r"L_{a} &= \sqrt{d_{a}^{2} + h^{2}}", r"\begin{bmatrix}"),
        (derivation_typst(derivation), "d_(a) = R - r", 'mat(delim: "["'),
        (python_function(derivation), "d_a = R - r", "K[..., 0, 0]"),
        (c_function(derivation), "double d_a = R - r", "K[0] ="),
    ):
        assert definition in written
        assert matrix in written
        assert written.index(definition) < written.index(matrix)

"""Short writing and names for what recurs: shorter, the same, and as people write it."""

from functools import cache, partial

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic import canonical, name_combinations, snapshot_formula
from robostiff.analytic.exact.definition import Definition, operations_in
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.reading.short_writing import Written, shortest
from tests.analytic.export.derivations import ALL
from tests.analytic.formulas import (
    CASE_A,
    CASE_B,
    L_A,
    L_B,
    cubic_platform,
    derived,
    stewart,
    three_puu,
)

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

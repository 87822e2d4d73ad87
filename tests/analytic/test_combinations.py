"""Names for what recurs: the matrix stays the same, and reads as people write it."""

from functools import cache, partial

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic import canonical, name_combinations, snapshot_formula
from tests.analytic.export.derivations import ALL
from tests.analytic.formulas import CASE_A, CASE_B, L_A, L_B, cubic_platform, h, stewart, three_puu

L = sp.Symbol("L", positive=True)


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

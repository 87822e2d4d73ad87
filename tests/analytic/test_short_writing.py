"""The search for short writing: what it finds, and the laws that no move breaks."""

import numpy as np
import pytest
import sympy as sp

from robostiff.analytic.exact.definition import Definition, operations_in
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.reading.short_writing import Written, shortest
from tests.analytic.formulas import derived

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

"""Sparse systems on recorded entries against dense solutions in numbers."""

from __future__ import annotations

import numpy as np

from robostiff.record import Entry, Program, Record
from robostiff.recorded.newton_step import LinearEquation, SparseElimination

#: Which unknowns stand in which equation; x and y first, then what couples them.
PATTERN = (("x", "y"), ("x", "y", "u"), ("x", "v"), ("y", "u", "v"), ("u", "v", "x"))
UNKNOWNS = ("x", "y", "u", "v")


def random_rates(rng: np.random.Generator, count: int) -> dict[str, np.ndarray]:
    return {
        f"{i} {name}": rng.uniform(0.5, 2, count) for i, row in enumerate(PATTERN) for name in row
    }


def dense(values: dict[str, float], rows: int) -> np.ndarray:
    A = np.zeros((rows, len(UNKNOWNS)))
    for i, row in enumerate(PATTERN[:rows]):
        for name in row:
            A[i, UNKNOWNS.index(name)] = values[f"{i} {name}"]
    return A


def test_solutions_and_determinants_at_other_places_than_the_samples():
    rng = np.random.default_rng(3)
    record = Record(random_rates(rng, 5))
    right = [1.0, -2.0, 0.5, 3.0]
    equations = [
        LinearEquation({name: record.input(f"{i} {name}") for name in row}, right[i])
        for i, row in enumerate(PATTERN[:4])
    ]
    elimination = SparseElimination()
    left = elimination.eliminate(equations, ["x", "y"])
    assert all(set(equation.rates) <= {"u", "v"} for equation in left)
    assert elimination.eliminate(left, ["u", "v"]) == []
    assert elimination.undetermined == []
    found = elimination.solution()
    entries = [*(found[name] for name in UNKNOWNS), *elimination.determinants()]
    program = Program.of(record, entries)
    whole = []
    for _ in range(4):
        values = {name: float(own[0]) for name, own in random_rates(rng, 1).items()}
        *x, first, second = program.evaluated(values)
        A = dense(values, 4)
        np.testing.assert_allclose(x, np.linalg.solve(A, right), rtol=1e-9)
        whole.append(first * second / np.linalg.det(A))
    np.testing.assert_allclose(np.abs(whole), 1, rtol=1e-9)
    np.testing.assert_allclose(whole, whole[0], rtol=1e-9)


def test_unknowns_that_nothing_determines_and_equations_that_follow():
    """Twice the same equation; an unknown that stands nowhere."""
    record = Record({"a": np.array([1.0, 2.0]), "b": np.array([3.0, -1.0])})
    a, b = record.input("a"), record.input("b")
    elimination = SparseElimination()
    twice = [LinearEquation({"x": a}, b), LinearEquation({"x": a * 2}, b * 2)]
    (left,) = elimination.eliminate(twice, ["x", "z"])
    assert left.rates == {}
    assert isinstance(left.right, Entry)
    np.testing.assert_allclose(left.right.sample, 0, atol=1e-15)
    assert elimination.undetermined == ["z"]
    found = elimination.solution()
    assert found["z"] == 0
    np.testing.assert_allclose(found["x"].sample, [3.0, -0.5])


def test_a_pivot_is_large_at_every_sample():
    """The entry that nearly vanishes at one sample is not divided by."""
    record = Record({"a": np.array([1e-6, 2.0]), "b": np.array([1.5, 1.0])})
    elimination = SparseElimination()
    rows = [
        LinearEquation({"x": record.input("a"), "y": 1}, 1),
        LinearEquation({"x": record.input("b"), "y": 1}, 2),
    ]
    elimination.eliminate(rows, ["x", "y"])
    for pivot in elimination.pivots[0]:
        size = np.abs(pivot.sample) if isinstance(pivot, Entry) else abs(pivot)
        assert np.min(size) > 0.1


def test_units_of_rows_do_not_choose_pivots():
    """Rows in millimetres, weighed by their unit, are eliminated as those in metres."""
    rng = np.random.default_rng(8)
    record = Record(random_rates(rng, 5))
    units = (1.0, 1.0, 1.0, 1e3)

    def order(factors: tuple[float, ...], weights: tuple[float, ...]) -> list[str]:
        elimination = SparseElimination()
        equations = [
            LinearEquation(
                {name: record.input(f"{i} {name}") * factors[i] for name in row}, 1.0, weights[i]
            )
            for i, row in enumerate(PATTERN[:4])
        ]
        elimination.eliminate(equations, UNKNOWNS)
        return list(elimination.solution())

    plain = order((1.0,) * 4, (1.0,) * 4)
    assert order(units, tuple(1 / unit for unit in units)) == plain
    assert order(units, (1.0,) * 4) != plain

import copy
import json

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.export import derivation_data, derivation_from_data
from robostiff.errors import InputError
from tests.analytic.export.derivations import ALL, equation_4, in_steps
from tests.analytic.export.expressions import expressions


def through_json(derivation):
    text = json.dumps(derivation_data(derivation), allow_nan=False)
    return derivation_from_data(json.loads(text))


@pytest.mark.parametrize("name", ALL)
def test_round_trip_is_exact(name):
    derivation = ALL[name]
    again = through_json(derivation)
    assert again == derivation
    assert sp.srepr(again.K) == sp.srepr(derivation.K)
    assert derivation_data(again) == derivation_data(derivation)


@given(expressions)
def test_random_expressions(expression):
    K = sp.ImmutableMatrix(sp.diag(expression, 0, 1))
    derivation = Derivation("K", K, (), K)
    again = through_json(derivation)
    assert again == derivation
    assert sp.srepr(again.K[0, 0]) == sp.srepr(expression)


ASSUMPTIONS = [
    {},
    {"positive": True},
    {"real": True},
    {"nonnegative": True, "integer": True},
    {"zero": False},
    {"positive": False, "finite": True},
    {"imaginary": True},
    {"prime": True},
    {"real": False},
    {"extended_real": True},
    {"infinite": True},
    sp.Symbol("L", real=True).assumptions0,  # of a symbol that was renamed
]


@pytest.mark.parametrize("assumptions", ASSUMPTIONS, ids=str)
def test_assumptions_are_kept(assumptions):
    K = sp.ImmutableMatrix(sp.diag(sp.Symbol("L", **assumptions), 0, 0))
    again = through_json(Derivation("K", K, (), K))
    assert again.K == K
    assert next(iter(again.K.free_symbols)).assumptions0 == (
        next(iter(K.free_symbols)).assumptions0
    )


def test_few_assumptions_are_written():
    data = derivation_data(ALL["oblique"])
    assert {"name": "d_a", "assumptions": {"positive": True}} in data["symbols"]
    assert {"name": "phi", "assumptions": {"real": True}} in data["symbols"]


def test_trees_are_readable():
    data = derivation_data(equation_4())
    assert data["stages"][0]["J"] == [["rat", "0", "1"], ["rat", "0", "1"], ["rat", "1", "1"]]
    assert data["K0"][0][2] == ["sym", "K_13"]


@pytest.mark.parametrize(
    "entry",
    [
        sp.gamma(sp.Symbol("x")),
        sp.Function("f")(sp.Symbol("x")),
        sp.Symbol("x") ** sp.Symbol("y"),
        sp.oo,
        sp.zoo,
        sp.I,
        sp.Dummy("x"),
        sp.Symbol("x", commutative=False),
        sp.Symbol("x") + sp.Symbol("x", positive=True),
    ],
    ids=str,
)
def test_what_cannot_be_kept_is_refused(entry):
    K = sp.ImmutableMatrix(3, 3, lambda i, j: entry if i == j == 0 else 0)
    with pytest.raises(InputError):
        derivation_data(Derivation("K", K, (), K))


DEEP = ["sym", "x"]
for _ in range(5000):
    DEEP = ["fn", "sin", DEEP]
HOSTILE_TREES = [
    "__import__('os').system('true')",
    ["sym", "__import__('os')"],
    ["sym", ["K_11"]],
    ["fn", "eval", ["sym", "K_11"]],
    ["fn", "__class__", ["sym", "K_11"]],
    ["fn", "sin"],
    ["fn", "sin", ["sym", "K_11"], ["sym", "K_11"]],
    ["fn", ["sin"], ["sym", "K_11"]],
    ["lambda", ["sym", "K_11"]],
    ["rat", "1", "0"],
    ["rat", "1", "-2"],
    ["rat", "2", "4"],
    ["rat", "1e9", "1"],
    ["rat", "0x10", "1"],
    ["rat", "١", "1"],
    ["rat", "1\n", "1"],
    ["rat", "9" * 100_000, "1"],
    ["rat", 1, 2],
    ["float", "1", 10**30, 53],
    ["float", "1", 0, 10**9],
    ["float", "1", True, 53],
    ["float", "9" * 40, 0, 53],
    ["float", "nan", 0, 53],
    ["const", "I"],
    ["^", ["rat", "10", "1"], ["rat", "1000000000", "1"]],
    ["^", ["sym", "K_11"], ["sym", "K_12"]],
    ["^", ["sym", "K_11"]],
    ["^", ["rat", "10", "1"], ["^", ["rat", "10", "1"], ["rat", "10", "1"]]],
    ["+", ["sym", "K_11"]],
    ["*"],
    [],
    None,
    1.5,
    {"sym": "K_11"},
    ["sym"],
    [["sym", "K_11"]],
    DEEP,
    [None, DEEP],
    {"a": DEEP},
]


@pytest.mark.parametrize("tree", HOSTILE_TREES, ids=range(len(HOSTILE_TREES)))
def test_trees_that_are_no_expressions_are_refused(tree):
    data = derivation_data(equation_4())
    data["K"][0][0] = tree
    with pytest.raises(InputError):
        derivation_from_data(data)


def test_towers_of_powers_are_read_without_being_computed():
    tower = ["rat", "10", "1"]
    for _ in range(60):
        tower = ["^", tower, ["rat", "999", "1"]]
    data = derivation_data(equation_4())
    data["K"][0][0] = tower
    assert derivation_from_data(data).K[0, 0].is_Pow


def changed(path, value):
    data = copy.deepcopy(derivation_data(in_steps()))
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return data


OTHER_SHAPES = [
    (["schema"], "robostiff derive 2"),
    (["schema"], "robostiff stiffness 1"),
    (["schema"], 1),
    (["name"], 3),
    (["name"], "x" * 10**6),
    (["extra"], 1),
    (["symbols"], {}),
    (["symbols"], [{"name": "L"}]),
    (["symbols"], [{"name": "L", "assumptions": {"positive": 1}}]),
    (["symbols"], [{"name": "L", "assumptions": {"commutative": False}}]),
    (["symbols"], [{"name": "L", "assumptions": {"__class__": True}}]),
    (["symbols"], [{"name": "L", "assumptions": {"positive": True, "negative": True}}]),
    (["symbols"], [{"name": "L", "assumptions": {}}] * 2),
    (["symbols"], [{"name": "", "assumptions": {}}]),
    (["symbols"], [{"name": "x" * 1000, "assumptions": {}}]),
    (["symbols"], []),
    (["symbols", 0, "assumptions"], DEEP),
    (["K"], [[]]),
    (["K"], [["rat", "0", "1"]] * 6),
    (["K"], "K"),
    (["K0", 2], []),
    (["stages"], None),
    (["stages", 0, "J"], []),
    (["stages", 0, "joint"], None),
    (["stages", 0, "hidden"], 1),
    (["stages", 0], []),
    (["definitions", 0, "symbol"], "nobody"),
    (["definitions", 0, "expression"], ["sym", "mu_1"]),
    (["definitions", 6, "expression"], ["sym", "mu_1"]),
    (["definitions", 1, "symbol"], "u_1_1"),
]


@pytest.mark.parametrize(("path", "value"), OTHER_SHAPES, ids=range(len(OTHER_SHAPES)))
def test_data_of_another_shape_are_refused(path, value):
    with pytest.raises(InputError):
        derivation_from_data(changed(path, value))


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=10,
)


@given(json_values, st.sampled_from(["K", "K0", "stages", "symbols", "definitions", "name"]))
def test_any_other_data_are_refused(value, key):
    with pytest.raises(InputError):
        derivation_from_data(value)
    data = derivation_data(equation_4())
    data[key] = value
    try:
        derivation_from_data(data)
    except InputError:
        return
    assert key in {"name", "stages", "definitions"}

"""Robots with symbols: exact, the same as the robot of numbers at the values of the file."""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.errors import FileError
from robostiff.model import Actuated, with_entries
from robostiff.model.entries import formulas
from robostiff.robots import robot_file
from robostiff.spatial import exact_number

NAMES = [name for name in rs.shipped_robots() if "\nparameters:" in robot_file(name).read_text()]


def load(*arguments, **options) -> Any:
    return rs.load(*arguments, **options)


def arrays(part):
    """All arrays and plain numbers of a robot, as arrays of floats."""
    if isinstance(part, np.ndarray):
        yield part
    elif isinstance(part, float):
        yield np.array(part)
    elif isinstance(part, tuple):
        for member in part:
            yield from arrays(member)
    elif is_dataclass(part):
        for field in fields(part):
            yield from arrays(getattr(part, field.name))


@pytest.mark.parametrize("name", NAMES)
def test_all_parameters_as_symbols_give_the_numbers_back(name):
    numbers = load(name)
    symbolic = load(name, symbols=rs.ALL_PARAMETERS)
    back = symbolic.numeric
    assert symbolic.symbols
    assert all(isinstance(e, sp.Expr) and not e.has(sp.Float) for e in formulas(symbolic))
    assert not back.symbols
    assert not back.has_formulas
    for found, wanted in zip(arrays(back), arrays(numbers), strict=True):
        assert found.dtype == float
        # Beside larger entries, those that are zero but for rounding are zero exactly.
        scale = np.abs(wanted).max(initial=0.0)
        np.testing.assert_allclose(found, wanted, rtol=1e-14, atol=1e-14 * min(scale, 1.0))
    K, K_numbers = rs.stiffness(back).K, rs.stiffness(numbers).K
    np.testing.assert_allclose(K, K_numbers, rtol=0, atol=1e-12 * np.abs(K_numbers).max())


def test_symbols_have_the_names_and_signs_of_their_parameters():
    robot = load("gough-stewart-b", {"h": "750 mm"}, symbols=("h", "R"))
    assert robot.symbols == (sp.Symbol("R", positive=True), sp.Symbol("h", positive=True))
    assert robot.nominal == {"h": 0.75, "R": 0.5}
    assert robot.home.p.tolist() == [0, 0, sp.Symbol("h", positive=True)]
    third = robot.legs[2]
    assert third.base.p[0] == -sp.Symbol("R", positive=True) / 2
    assert third.attachment.p[0] == -sp.Rational(3, 10)


def test_parameter_that_is_not_positive_is_only_real(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(MODEL)
    robot = load(file, symbols=("z", "twice"))
    assert robot.symbols == (sp.Symbol("twice", positive=True), sp.Symbol("z", real=True))
    assert robot.nominal == {"z": 0.0, "twice": 0.6}


def test_computed_parameter_follows_or_is_kept(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(MODEL)
    L, twice = sp.Symbol("L", positive=True), sp.Symbol("twice", positive=True)
    assert load(file, symbols=("L",)).legs[0].base.p[0] == 2 * L
    assert load(file, symbols=("L", "twice")).legs[0].base.p[0] == twice
    everything = load(file, symbols=rs.ALL_PARAMETERS)
    assert [str(symbol) for symbol in everything.symbols] == ["L", "k", "z"]


def test_limits_stay_numbers_and_closed_coordinates_are_kept():
    numbers = load("hexapod")
    robot = load("hexapod", symbols=rs.ALL_PARAMETERS)
    role = next(role for role in robot.legs[0].chain.roles if isinstance(role, Actuated))
    assert role.limits == (0.08, 0.6)
    assert role.stiffness == sp.Symbol("k_screw", positive=True)
    assert robot.coordinates == numbers.coordinates


def test_substituting_some_keeps_the_rest_exact():
    robot = load("gough-stewart-b", symbols=("R", "r", "h"))
    r = sp.Symbol("r", positive=True)
    one = robot.substituted({"R": 2 * r, "h": 0.7})
    assert one.symbols == (r,)
    assert one.legs[0].base.p[0] == 2 * r
    assert one.home.p[2] == sp.Rational(7, 10)
    assert one.nominal == {"r": 0.3}
    numbers = one.substituted({r: 0.3})
    assert numbers.legs[0].base.p.tolist() == [0.6, 0.0, 0.0]
    assert numbers.home.p.dtype == float


def test_robot_of_exact_numbers_is_computed_like_one_of_floats():
    robot = load("3-rrr")
    exact = with_entries(robot, exact_number)
    assert exact.has_formulas
    np.testing.assert_array_equal(rs.stiffness(exact).K, rs.stiffness(robot).K)


def test_entries_of_another_kind_are_left_alone():
    class Entry:
        free_symbols = frozenset("x")

        def __sub__(self, other):
            return self

        __neg__ = __add__ = __radd__ = __rsub__ = __sub__

    # Symbols become such entries, numbers stay floats.
    other: Any = with_entries(
        load("hexapod", symbols=("R", "cylinder", "k_screw")),
        lambda entry: float(entry) if entry.is_number else Entry(),
    )
    assert isinstance(other.legs[0].base.p[0], Entry)
    telescope: Any = other.legs[0].chain.elements[2]
    assert isinstance(telescope.beams[0].fixed, Entry)
    assert isinstance(telescope.role.stiffness, Entry)
    assert other.legs[0].attachment.p.dtype == float
    assert other.legs[0].base.p[2] == 0.0
    assert isinstance(other.legs[0].base.p[2], float)


@pytest.mark.parametrize("question", [rs.stiffness, rs.find_posture, rs.compliance])
def test_question_of_numbers_names_the_symbols(question):
    robot = load("gough-stewart-b", symbols=("R", "h"))
    with pytest.raises(rs.InputError, match=r"without a number: R, h.*robot.substituted"):
        question(robot)


def test_symbol_without_a_nominal_value_is_named():
    L = sp.Symbol("L")
    link = rs.beam_link([L, 0, 0], rs.material("steel"), rs.circle(0.02))
    leg = rs.Leg("arm", rs.Frame.identity(), rs.Chain((link,)), rs.Frame.identity())
    with pytest.raises(rs.InputError, match=r"got 'L'.*robot.substituted\(\{'L'"):
        _ = rs.Robot("arm", (leg,), coordinates=()).numeric


def test_file_is_checked_by_its_numbers_first(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(MODEL.replace("[L, 0, 0]", "[L, 0, k]"))
    with pytest.raises(FileError, match="a length"):
        load(file, symbols=rs.ALL_PARAMETERS)


MODEL = """
robostiff: 1
name: arm
source: a test
parameters: {L: 300 mm, k: 1e5 N m/rad, z: 0 mm, twice: 2*L}
legs:
  - name: arm
    base: {at: [twice, 0, z]}
    chain:
      - {type: revolute, axis: z, role: actuated, stiffness: k}
      - {type: beam, to: [L, 0, 0], material: steel, section: {circle: {diameter: 20 mm}}}
"""

"""Models in symbols: parameters of files, frames, and formulas in place of numbers."""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.errors import FileError
from robostiff.model import Actuated, Chain, Leg, Rigid, Robot, beam_axes, revolute, with_entries
from robostiff.model.checks import rotation_matrix, unit_vector
from robostiff.model.entries import formulas
from robostiff.robots import robot_file
from robostiff.spatial import Frame, exact_number
from tests.files import text_of, written

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
            if field.compare:  # what shear would add is of numbers alone
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
    robot = load(written(tmp_path / "arm.yaml", MODEL), symbols=("z", "twice"))
    assert robot.symbols == (sp.Symbol("twice", positive=True), sp.Symbol("z", real=True))
    assert robot.nominal == {"z": 0.0, "twice": 0.6}


def test_computed_parameter_follows_or_is_kept(tmp_path):
    file = written(tmp_path / "arm.yaml", MODEL)
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


def test_file_is_checked_by_its_numbers_first(tmp_path):
    file = written(tmp_path / "arm.yaml", MODEL.replace("[L, 0, 0]", "[L, 0, k]"))
    with pytest.raises(FileError, match="a length"):
        load(file, symbols=rs.ALL_PARAMETERS)


MODEL = text_of("arm-of-two-lengths.yaml")


L, R, r, h, d, k, E, G = sp.symbols("L R r h d k E G", positive=True)
q = sp.Symbol("q", real=True)
STEEL = rs.material("steel")
SOFT = rs.Material("soft", E=E, G=G)


def at(values, formulas):
    """The numbers of an array of formulas."""
    array = np.asarray(formulas, dtype=object)
    return np.array([float(sp.sympify(e).subs(values)) for e in array.flat]).reshape(array.shape)


def test_beam_between_two_symbolic_points():
    values = {R: 0.5, r: 0.3, h: 0.8, E: 2e11, G: 8e10, d: 0.03}
    to = [r - R, 0, h]
    link = rs.beam_link(to, SOFT, rs.circle(d), theory=rs.Timoshenko())
    numbers = rs.beam_link(
        [-0.2, 0, 0.8], rs.Material("soft", 2e11, 8e10), rs.circle(0.03), theory=rs.Timoshenko()
    )
    np.testing.assert_allclose(at(values, link.to), numbers.to, rtol=1e-15)
    np.testing.assert_allclose(at(values, link.axes), numbers.axes, atol=1e-15)
    np.testing.assert_allclose(
        at(values, link.elasticity.compliance), numbers.elasticity.compliance, rtol=1e-13
    )


def test_length_is_free_of_absolute_values_and_trigonometry():
    link = rs.beam_link([L * sp.cos(q), L * sp.sin(q), 0], SOFT, rs.circle(d))
    assert link.elasticity.compliance[0, 0] == 4 * L / (sp.pi * E * d**2)
    assert not any(entry.has(sp.Abs) for entry in link.axes.flat)


def test_numbers_beside_formulas_become_exact():
    link = rs.beam_link([1, 1, 0], rs.material("steel"), rs.circle(d))
    assert link.elasticity.compliance[0, 0] == 4 * sp.sqrt(2) / (210 * 10**9 * sp.pi * d**2)
    spring = rs.translational_spring(k, [1, 1, 0])
    assert spring.compliance[0, 1] == 1 / (2 * k)
    assert rs.Material.isotropic("soft", E, 0.3).G == 5 * E / 13


@pytest.mark.parametrize("y_axis", [[0, 0, 1], [0.3, 0, 1], [L, 0, 2 * L]])
def test_axes_of_a_beam_are_those_of_numbers(y_axis):
    values = {L: 0.4, h: 0.3}
    axes = beam_axes([L, h, 0], y_axis)
    numbers = beam_axes([0.4, 0.3, 0], at(values, y_axis))
    np.testing.assert_allclose(at(values, axes), numbers, atol=1e-15)


@pytest.mark.parametrize(
    ("shape", "sides"),
    [
        (rs.circle, (0.04,)),
        (rs.tube, (0.05, 0.04)),
        (rs.rectangle, (0.02, 0.05)),
        (rs.rectangle, (0.05, 0.02)),
        (rs.box, (0.06, 0.04, 0.003)),
        (rs.i_section, (0.1, 0.2, 0.0056, 0.0085)),
    ],
)
def test_shapes_of_symbols_are_those_of_numbers(shape, sides):
    symbols = sp.symbols("a b c d", positive=True)[: len(sides)]
    nu = sp.Symbol("nu")
    values = {**dict(zip(symbols, sides, strict=True)), nu: 0.3}
    found, wanted = shape(*symbols, poisson_ratio=nu), shape(*sides)
    for name in ("A", "Iy", "Iz", "J", "shear_factor_y", "shear_factor_z"):
        formula = getattr(found, name)
        assert not formula.has(sp.Float)
        assert float(formula.subs(values)) == pytest.approx(getattr(wanted, name), rel=1e-13)


def test_joints_have_symbolic_axes_and_homes():
    assert rs.revolute([0, L, 0], rs.Passive()).freedoms[0].axis.tolist() == [0, 1, 0]
    tilted = rs.prismatic([0, sp.Rational(3, 5), sp.Rational(4, 5)], rs.Actuated(k), home=[h])
    assert tilted.freedoms[0].axis.tolist() == [0, sp.Rational(3, 5), sp.Rational(4, 5)]
    assert rs.Chain((tilted,)).home.tolist() == [h]
    planar = rs.planar([0, h, r], rs.Passive())
    numbers = rs.planar([0, 0.8, 0.3], rs.Passive())
    for found, wanted in zip(planar.freedoms, numbers.freedoms, strict=True):
        np.testing.assert_allclose(at({h: 0.8, r: 0.3}, found.axis), wanted.axis, atol=1e-15)


def test_exact_directions_and_rotations_stay_exact():
    assert unit_vector("axis", [sp.Integer(0), 1, 1])[1] == sp.sqrt(2) / 2
    c, s = sp.cos(sp.pi / 9), sp.sin(sp.pi / 9)
    turn = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    assert rotation_matrix("turn", turn)[0, 0] == c
    few_digits = [[sp.Rational("0.7071068"), sp.Rational("-0.7071068"), 0]]
    few_digits += [[sp.Rational("0.7071068"), sp.Rational("0.7071068"), 0], [0, 0, 1]]
    nearest = rotation_matrix("turn", few_digits).astype(float)
    np.testing.assert_allclose(nearest.T @ nearest, np.eye(3), atol=1e-15)


def test_robot_built_of_symbols_computes_with_values():
    def arm(length, stiffness, angle):
        elements = (
            rs.revolute([0, 0, 1], rs.Actuated(stiffness), home=[angle]),
            rs.beam_link([length, 0, 0], STEEL, rs.circle(0.02)),
        )
        leg = rs.Leg(
            "arm",
            rs.Frame(np.eye(3), np.array([0, length, 0])),
            rs.Chain(elements),
            rs.Frame.identity(),
        )
        return rs.Robot("arm", (leg,), coordinates=(), reference_point=np.array([0, 0, length]))

    symbolic, numbers = arm(L, k, q), arm(0.4, 1e5, 0.3)
    assert [str(symbol) for symbol in symbolic.symbols] == ["L", "k", "q"]
    found = symbolic.substituted({"L": 0.4, k: 1e5, "q": 0.3})
    C, C_numbers = rs.compliance(found), rs.compliance(numbers)
    np.testing.assert_allclose(C, C_numbers, rtol=0, atol=1e-13 * np.abs(C_numbers).max())


a, LENGTH = sp.Symbol("a", real=True), sp.Symbol("L", positive=True)


def random_transform(rng: np.random.Generator) -> RigidTransform:
    return RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))


def same(first: Frame, second: Frame, tolerance: float = 1e-14) -> bool:
    return bool(
        np.abs(first.R - second.R).max() < tolerance
        and np.abs(first.p - second.p).max() < 10 * tolerance
    )


def turned_about_z(angle: sp.Expr, x: sp.Expr) -> Frame:
    c, s = sp.cos(angle), sp.sin(angle)
    return Frame([[c, -s, 0], [s, c, 0], [0, 0, 1]], [x, 0, 0.5])  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("seed", range(3))
def test_composition_is_that_of_rigid_transforms(seed):
    rng = np.random.default_rng(seed)
    S, T = random_transform(rng), random_transform(rng)
    assert same(Frame.of(S) @ Frame.of(T), Frame.of(S * T))
    assert same(Frame.of(S).inverse, Frame.of(S.inv()))
    assert same(Frame.of(S) @ Frame.identity(), Frame.of(S))
    np.testing.assert_allclose(Frame.of(T).rigid_transform.as_matrix(), T.as_matrix(), atol=1e-15)
    assert isinstance(Rigid(T).transform, Frame)  # pyright: ignore[reportArgumentType]


def test_legs_and_robots_take_rigid_transforms():
    rng = np.random.default_rng(5)
    base, attachment, home = (random_transform(rng) for _ in range(3))
    chain = Chain((revolute([0, 0, 1], Actuated(1e5)),))
    leg = Leg("leg", base, chain, attachment)  # pyright: ignore[reportArgumentType]
    robot = Robot("robot", (leg,), home=home)  # pyright: ignore[reportArgumentType]
    assert robot.home is not None
    assert same(leg.base, Frame.of(base))
    assert same(leg.attachment, Frame.of(attachment))
    assert same(robot.home, Frame.of(home))


def test_formulas_compose_exactly():
    quarter = turned_about_z(sp.pi / 2, LENGTH)
    whole = quarter @ quarter @ quarter @ quarter
    assert (whole.R == np.eye(3, dtype=int)).all()
    assert whole.p.tolist() == [0, 0, 2]
    back = turned_about_z(a, LENGTH).inverse @ turned_about_z(a, LENGTH)
    assert all(sp.simplify(entry) == 0 for entry in back.p)


def test_no_float_enters_a_formula():
    moved = Frame.identity() @ Frame(np.eye(3), [LENGTH, 0.25, 0])  # pyright: ignore[reportArgumentType]
    assert moved.p.tolist() == [LENGTH, sp.Rational(1, 4), 0]
    assert not any(sp.sympify(entry).has(sp.Float) for entry in (*moved.R.flat, *moved.p))

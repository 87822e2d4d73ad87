"""The stiffness of a cable robot as a formula of its pose and of the tensions of taut cables."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import sympy as sp

from robostiff.analysis.cable_stiffness import cable_stiffness
from robostiff.analytic.chain import Closed, Steps
from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.definition import Definition, used_definitions
from robostiff.analytic.placement.agreement import AGREED, check_value
from robostiff.analytic.placement.robot_pose import (
    AtHome,
    AtJoints,
    EulerAngles,
    PoseFormula,
    coordinate_expressions,
)
from robostiff.analytic.vectors.forms import Components
from robostiff.analytic.vectors.vector_expressions import (
    Coordinates,
    Cross,
    Dot,
    Equation,
    Norm,
    Over,
    Stacked,
    Sum,
    Turned,
    Turns,
    Vector,
    names_in,
)
from robostiff.cables import GivenTensions
from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.kinematics.pose import requested_pose
from robostiff.model import ALL_COORDINATES
from robostiff.model.cable import CableRobot
from robostiff.spatial import Space, exact_number
from robostiff.spatial.rotation import vector_of_rotation

_POSES = 3  # at which a formula is compared with numbers
_SEED = 5


@frozen
class CableVectors:
    """One generic cable in vectors, a table of what differs, and the sum.

    With the unit vector u of a cable, its arm r, its length L, tension t and stiffness k,

        K = sum of (k - t/L) w w^T + (t/L) V V^T + t N,   w = [u; r x u],   V = [1; (r x)],

    and N = [0, 0; 0, (u r^T + r u^T)/2 - (u . r) 1], which is what turning the platform adds. The
    weight takes such a part away.
    """

    space: Space
    pose: tuple[Equation, ...] = ()  #: place and rotation of the platform
    #: of one generic cable i, in the order in which they can be computed
    cable: tuple[Equation, ...] = ()
    #: dict of names to tuples of SymPy expressions: what differs between the cables, one row a
    #: cable
    columns: dict[str, tuple[Any, ...]] = field(default_factory=dict)
    cables: tuple[str, ...] = ()  #: their names
    weight: tuple[Equation, ...] = ()  #: force and arm of the weight, where it is part of K

    def written(self) -> tuple[sp.ImmutableMatrix, tuple[Definition, ...]]:
        """K (n, n), and components of all vectors as steps, one cable after the other."""
        steps = Components(names_in([self.pose, self.cable, self.columns, self.weight]))
        terms: list[list[list[Any]]] = [[[] for _ in range(6)] for _ in range(6)]
        for e in (*self.pose, *self.weight):
            steps.give(e.name, e.expression)

        def add(factor: Any, rows: Any) -> None:
            for i in range(6):
                for j in range(i, 6):
                    terms[i][j].append(factor * rows[i, j])

        if self.weight:
            force, arm = steps.known["f"], steps.known["m"]
            add(-1, _turning(force, arm))
        pose = dict(steps.known)
        for n in range(len(self.cables)):
            steps.known = dict(pose)
            for name, column in self.columns.items():
                steps.known[name] = steps.value(column[n])
            for e in self.cable:
                steps.give(e.name, e.expression, f"_{n + 1}")
            u, r, w, k, q, t = (steps.known[x] for x in ("u_i", "r_i", "w_i", "k_i", "q_i", "t_i"))
            add(k - q, np.outer(w, w))
            x, y, z = r
            lever = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=object)
            V = np.concatenate([np.eye(3, dtype=int).astype(object), lever])
            add(q, V @ V.T)
            add(t, _turning(u, r))
        rows = list(self.space.rows)

        def entry(i: int, j: int) -> Any:
            i, j = sorted((rows[i], rows[j]))
            return sp.Add(*terms[i][j])

        K = sp.ImmutableMatrix(len(rows), len(rows), entry)
        return K, used_definitions(steps.definitions, [K])


@frozen(repr=False)
class CableFormula(Formula):
    """Stiffness of a cable robot about its reference point, world axes, in its tensions.

    All cables are taut. Tensions are given: `cable_tensions` finds those that balance the weight.

    Attributes
    ----------
    K : sympy.ImmutableMatrix
        (n x n), in symbols given or defined.
    vectors : CableVectors
        The same by one generic cable.
    definitions : tuple of Definition
        Components of all vectors, in the order in which they can be computed.
    where : str
        The pose, in words.
    coordinates : tuple of str
        Names of the symbols of the pose.
    """

    K: sp.ImmutableMatrix
    vectors: CableVectors
    definitions: tuple[Definition, ...] = ()  # pyright: ignore[reportIncompatibleMethodOverride]
    where: str = ""
    coordinates: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<CableFormula of {self.name!r}, {len(self.vectors.cables)} cables, {self.where}>"


def _turning(f: np.ndarray, b: np.ndarray) -> np.ndarray:
    """N (6, 6) of a force f at an arm b: (f b^T + b f^T)/2 - (f . b) 1 in the rotations."""
    outer, found = np.outer(f, b), np.zeros((6, 6), dtype=object)
    found[3:, 3:] = (outer + outer.T) * sp.Rational(1, 2) - np.eye(3, dtype=int) * np.trace(outer)
    return found


def derive_cables(
    robot: CableRobot, pose: PoseFormula | None = None, form: Closed | Steps | None = None
) -> CableFormula:
    """Stiffness of a cable robot as a formula of its pose and of its tensions t_1, t_2, ...

    The formula is compared with the numerical form at random poses and tensions.

    Parameters
    ----------
    robot : CableRobot
    pose : AtHome, AtSymbols or AtCoordinates
        Home when left out.
    form : Steps
        Writes the named steps below the vectors.

    Raises
    ------
    InputError
        When the pose is given by joints or by a quaternion, or the form is closed.
    DisagreementError
        When formula and numerical form differ.
    """
    pose = AtHome() if pose is None else pose
    rotation: Any = getattr(pose, "rotation", None)
    if isinstance(pose, AtJoints) or not isinstance(rotation, EulerAngles | None):
        got = "joints" if isinstance(pose, AtJoints) else "a unit quaternion"
        raise InputError(
            f"pose of a formula of {robot.name!r}",
            got=Words(got),
            expected="AtHome(), AtSymbols() or AtCoordinates({...}), with Euler angles",
        )
    if isinstance(form, Closed):
        expected = "Steps(), or none: a cable robot has vectors and named steps"
        raise InputError(f"form of a formula of {robot.name!r}", got=form, expected=expected)
    given = coordinate_expressions(cast("Any", robot), pose) or {}
    angles = rotation.factors(given) if rotation else ()
    home, r_0 = robot.home, robot.reference_point

    def written(point: Any, *, turned: bool = True) -> Coordinates:
        """A point in numbers, in axes of the world where none are turned."""
        numbers = point if angles or not turned else home.R @ point
        return Coordinates(
            *(sp.nsimplify(exact_number(x), rational=True) for x in numbers.tolist())
        )

    def in_world(name: str) -> Any:
        return Turned("R", Vector(name)) if angles else Vector(name)

    place: list[Any] = [
        given.get(name, sp.nsimplify(exact_number(float(x)), rational=True))
        for name, x in zip("xyz", home.p, strict=True)
    ]
    equations = [Equation("p", Coordinates(*place))]
    equations += [Equation("R", Turns(*angles))] * bool(angles)
    centre: Any = Vector("p")
    if np.any(r_0):
        equations += [Equation("r_0", written(r_0))]
        centre = Vector("o")
        equations += [Equation("o", Sum((1, Vector("p")), (1, in_world("r_0"))))]
    t, L = sp.Symbol("t_i", real=True), sp.Symbol("L_i", real=True)
    tensions = tuple(sp.Symbol(f"t_{n + 1}", real=True) for n in range(len(robot.cables)))
    columns: dict[str, tuple[Any, ...]] = {
        "a_i": tuple(written(cable.exit_point, turned=False) for cable in robot.cables),
        "b_i": tuple(written(cable.attachment - r_0) for cable in robot.cables),
        "t_i": tensions,
    }
    k, others = _axial(robot, t, L)
    columns |= others
    weight: tuple[Equation, ...] = ()
    if robot.weight is not None and np.any(robot.weight.point - r_0):
        force = written(robot.weight.force, turned=False)
        of_weight = Equation("c", written(robot.weight.point - r_0)), Equation("m", in_world("c"))
        weight = Equation("f", force), *of_weight, Equation("s_0", Dot(Vector("f"), Vector("m")))
    cable = (
        Equation("r_i", in_world("b_i")),
        Equation("d_i", Sum((1, centre), (1, Vector("r_i")), (-1, Vector("a_i")))),
        Equation("L_i", Norm(Vector("d_i"))),
        Equation("u_i", Over(Vector("d_i"), L)),
        Equation("s_i", Dot(Vector("u_i"), Vector("r_i"))),
        Equation("w_i", Stacked(Vector("u_i"), Cross(Vector("r_i"), Vector("u_i")))),
        Equation("k_i", k),
        Equation("q_i", t / L),
    )
    names = tuple(str(x) for x in given.values() if x.is_Symbol)
    vectors = CableVectors(
        robot.space, tuple(equations), cable, columns, tuple(robot.cable_names), weight
    )
    K, definitions = vectors.written()
    meanings: dict[str, str] = {}
    for name, value in given.items():
        words = "place of the platform's origin [m]"
        if name not in "xyz":
            words = f"rotation of the platform, {cast('Any', rotation).in_words(given)}"
        if not value.is_Symbol:
            words = f"coordinate of the pose, {name} = {value}"
        meanings |= {symbol.name: words for symbol in value.free_symbols}
    at_home = cable_stiffness(robot)
    for symbol, name, tension in zip(tensions, robot.cable_names, at_home.tensions, strict=True):
        words = f", {tension:.5g} N at home" if at_home.answered else ""
        meanings[symbol.name] = f"tension of {name} [N]{words}"
    formula = CableFormula(
        K,
        vectors,
        definitions,
        name=robot.name,
        where=f"at {', '.join(f'{n} = {x}' if n != str(x) else n for n, x in given.items())}"
        if given
        else "at home",
        coordinates=names,
        meanings=meanings,
        steps_asked=isinstance(form, Steps),
    )
    _check(formula, robot, given, rotation)
    return formula


def _axial(robot: CableRobot, t: Any, L: Any) -> tuple[Any, dict[str, tuple[Any, ...]]]:
    """Stiffness of a cable with its winch (see `axial_stiffness`), and what differs in it."""

    def number(value: float) -> Any:
        return sp.nsimplify(exact_number(value), rational=True)

    given = {
        "g_i": [number(cable.guide_length) for cable in robot.cables],
        "e_i": [0 if c.EA is None else 1 / number(c.EA) for c in robot.cables],
        "c_i": [
            0 if c.winch_stiffness is None else 1 / number(c.winch_stiffness) for c in robot.cables
        ],
    }
    columns: dict[str, tuple[Any, ...]] = {}
    values = dict[str, Any]()
    for name, column in given.items():
        one = len(set(column)) == 1
        values[name] = column[0] if one else sp.Symbol(name, real=True)
        if not one:
            columns[name] = tuple(map(sp.sympify, column))
    g, e, c = values.values()
    EA = 1 / e if e != 0 else sp.oo
    if all(x != 0 for x in given["e_i"]) and "e_i" in columns:
        EA, columns["EA_i"] = sp.Symbol("EA_i", real=True), tuple(1 / x for x in columns.pop("e_i"))
    if all(x != 0 for x in given["c_i"]) and "c_i" in columns:
        c = 1 / sp.Symbol("k_w_i", real=True)
        columns["k_w_i"] = tuple(1 / x for x in columns.pop("c_i"))
    unstrained = L + g - c * t
    stretch = unstrained * e / (1 + e * t) if "e_i" in columns or e == 0 else unstrained / (EA + t)
    return 1 / (stretch + c), columns


def _check(formula: CableFormula, robot: CableRobot, given: dict[str, Any], rotation: Any) -> None:
    """Compare with the numerical form at random tensions, and poses near home."""
    random, home = np.random.default_rng(_SEED), requested_pose(cast("Any", robot), None)
    length = float(cable_stiffness(robot).characteristic_length)
    symbols = sorted({s for x in given.values() for s in x.free_symbols}, key=str)
    for _ in range(_POSES):
        values: dict[Any, float] = {}
        for symbol in symbols:
            at = "xyz".find(symbol.name)
            centre = float(robot.home.p[at]) if len(symbol.name) == 1 and at >= 0 else 0.0
            scale = 0.1 * length if centre or at >= 0 else 0.3
            values[symbol] = centre + scale * float(random.uniform(-1, 1))
        tensions = random.uniform(10.0, 500.0, len(robot.cables))
        numbers = {name: float(x.xreplace(values)) for name, x in given.items()}
        six = home.coordinates.reshape(6).copy()
        six[:3] = [numbers.get(name, own) for name, own in zip("xyz", six, strict=False)]
        if rotation is not None and any(name in numbers for name in rotation.names):
            R = rotation.matrix({n: x for n, x in numbers.items() if n not in ("x", "y", "z")})
            six[3:] = vector_of_rotation(np.array(R, dtype=float))
        places = [ALL_COORDINATES.index(c) for c in robot.coordinates]
        found = cable_stiffness(robot, six[places], tensions=GivenTensions(tensions))
        own = {sp.Symbol(f"t_{n + 1}", real=True): float(t) for n, t in enumerate(tensions)}
        where = f"cable robot {robot.name!r}"
        everything = {**values, **own}
        check_value(formula.K, formula.definitions, everything, found.matrix, AGREED, where, length)

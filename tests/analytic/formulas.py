"""Formulas of the paper and of other robots, for several tests."""

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

import robostiff as rs
from robostiff.analytic import sum_of_legs
from robostiff.elasticity import Elasticity, cantilever_compliance
from robostiff.model import Actuated, Passive, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.spatial import rotate_stiffness

R, r, h, K11 = sp.symbols("R r h K11", positive=True)
DEGREE = sp.pi / 180
CASE_A = ([0, 60, 120, 180, 240, 300], [0, 60, 120, 180, 240, 300])
CASE_B = ([0, 120, 120, 240, 240, 360], [60, 60, 180, 180, 300, 300])
L_A = sp.sqrt((R - r) ** 2 + h**2)
L_B = sp.sqrt(R**2 - R * r + r**2 + h**2)

DATA = Path(__file__).parent / "data"


def derived(name: str, pose: Any = None) -> Any:
    """A shipped robot, or one of `DATA`, in all of its symbols; derived once for all tests."""
    return _derived(name, pose or rs.AtHome())


@cache
def _derived(name, pose):
    file = DATA / f"{name}.yaml"
    return rs.derive(file if file.exists() else name, pose=pose)


def in_numbers(formula: Any, values: Any) -> np.ndarray:
    """The matrix of a formula, at any of its levels, at values of its symbols.

    Computed in floats, one step after the other: `substituted`, which has tests of its own, takes
    seconds for that.
    """
    known: dict[Any, float] = {}
    given = {str(symbol): float(value) for symbol, value in values.items()}

    def number(x: Any) -> float:
        if x not in known:
            if x.is_Symbol:
                known[x] = given[x.name]
            elif not x.args:
                known[x] = float(x)
            else:
                known[x] = _FUNCTIONS.get(x.func, x.func)(*map(number, x.args))
        return known[x]

    for definition in formula.definitions:
        known[definition.symbol] = number(definition.expression)
    return np.array([[float(number(x)) for x in row] for row in formula.K.tolist()])


_FUNCTIONS: dict[Any, Any] = {
    **{sp.Add: lambda *terms: sum(terms), sp.Mul: lambda *factors: math.prod(factors)},
    **{sp.Pow: pow, sp.sin: math.sin, sp.cos: math.cos, sp.tan: math.tan, sp.Abs: abs},
    **{sp.atan2: math.atan2, sp.atan: math.atan, sp.acos: math.acos, sp.asin: math.asin},
}


def stewart(phi, psi, length):
    """Eq. (22)-(25) from (26): each leg turned to global axes, moved, and summed."""
    local = np.array(sp.diag(K11, 0, 0, 0, 0, 0))
    legs, vectors = [], []
    for phi_i, psi_i in zip(phi, psi, strict=True):
        p, s = phi_i * DEGREE, psi_i * DEGREE
        u = sp.Matrix([r * sp.cos(s) - R * sp.cos(p), r * sp.sin(s) - R * sp.sin(p), h]) / length
        # Any rotation whose first column is u will do: only that column enters.
        frame = sp.Matrix.hstack(u, sp.zeros(3, 2))
        legs.append(rotate_stiffness(local, np.array(frame)))
        vectors.append([-r * sp.cos(s), -r * sp.sin(s), 0])
    return sum_of_legs(legs, vectors, extra=[length])


X, Y, Z = np.eye(3, dtype=int).astype(object)


def vector(*entries):
    return np.array([sp.sympify(entry) for entry in entries], dtype=object)


def turning(name, point, axis):
    return PlacedFreedom(axis, point, 0, name, Passive())


def ball(name, point):
    return [turning(f"{name}{i}", point, axis) for i, axis in enumerate((X, Y, Z))]


def sliding(name, point, axis, k):
    return PlacedFreedom(axis, point, None, name, Actuated(k))


def unit(v):
    return v / sp.sqrt(sp.expand(v @ v))


def stewart_leg(name, A, B, k):
    u = unit(B - A)
    return PlacedLeg(name, (*ball("A", A), sliding("k", A, u, k), *ball("B", B)), B)


def cubic_platform(height=0):
    """The six edges of a cube of side 2a that avoid two opposite corners.

    The reference point lies at a height above the centre.
    """
    a, k = sp.symbols("a k", positive=True)
    edges = [
        ((a, -a, -a), (a, a, -a)),
        ((-a, a, a), (-a, -a, a)),
        ((-a, a, -a), (-a, a, a)),
        ((a, -a, a), (a, -a, -a)),
        ((-a, a, -a), (a, a, -a)),
        ((a, -a, a), (-a, -a, a)),
    ]
    legs = tuple(
        stewart_leg(f"leg{i}", vector(*A), vector(*B), k) for i, (A, B) in enumerate(edges)
    )
    return Snapshot("cubic", legs, vector(0, 0, height))


def three_puu():
    """Vertical rails, rods at 45 degrees, at the centre."""
    E, A, I, G, J, L, k_a, r = sp.symbols("E A I G J L k_a r", positive=True)
    C = cantilever_compliance(L, E, G, A, I, I, J)
    legs = []
    root = sp.sqrt(2) / 2
    for i in range(3):
        phi = 2 * sp.pi * i / 3
        radial = vector(sp.cos(phi), sp.sin(phi), 0)
        tangent = vector(-sp.sin(phi), sp.cos(phi), 0)
        along = -root * radial - root * Z  # from the carriage down to the platform
        across = root * radial - root * Z
        end = r * radial
        start = end - L * along
        # The axes of the rod's frame: x along it, y the inner universal axis.
        frame = np.stack([along, across, np.cross(along, across)], axis=-1)
        elements = (
            sliding("rail", start, Z, k_a),
            turning("U1", start, tangent),
            turning("U2", start, across),
            PlacedSpring("rod", end, frame, Elasticity(C)),
            turning("U3", end, across),
            turning("U4", end, tangent),
        )
        legs.append(PlacedLeg(f"leg{i}", elements, end))
    return Snapshot("3-PUU", tuple(legs), vector(0, 0, 0))

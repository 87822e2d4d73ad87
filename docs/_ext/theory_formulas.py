"""The formulas that pages of the documentation ask for by name."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import sympy as sp

import robostiff as rs
from robostiff.analytic import Derivation, derive_chain
from robostiff.elasticity import cantilever_stiffness

_ROTATING_3_RPR = Path(__file__).parent.parent / "symmetric-3-rpr.yaml"


@cache
def planar_link() -> Derivation:
    """Eq. (4)."""
    K = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"K_{min(i, j) + 1}{max(i, j) + 1}"))
    return derive_chain(K, {"tip": [0, 0, 1]})


@cache
def leg_of_section_6() -> Derivation:
    """The symmetric beam with the joints of eq. (21)."""
    L, E, G, A, I, J = sp.symbols("L E G A I J", positive=True)
    joints = {
        "rotation about x at the tip": [0, 0, 0, 1, 0, 0],
        "rotation about y at the tip": [0, 0, 0, 0, 1, 0],
        "rotation about z at the tip": [0, 0, 0, 0, 0, 1],
        "rotation about y at the base": [0, 0, -L, 0, 1, 0],
        "rotation about z at the base": [0, L, 0, 0, 0, 1],
    }
    return derive_chain(cantilever_stiffness(L, E, G, A, I, I, J), joints, name="K")


def case_a() -> Derivation:
    """Eq. (27)."""
    return _matrix_alone(rs.derive("gough-stewart-a", symbols=("R", "r", "h", "k")))


def case_b() -> Derivation:
    """Eq. (28)."""
    return _matrix_alone(rs.derive("gough-stewart-b", symbols=("R", "r", "h", "k")))


def turned_3_rpr() -> Derivation:
    """A symmetric planar 3-RPR whose platform is turned about its centre."""
    pose = rs.AtCoordinates({"gamma": sp.Symbol("gamma", real=True)})
    return _matrix_alone(rs.derive(_ROTATING_3_RPR, pose=pose, form=rs.Closed()))


@cache
def case_b_at_a_pose() -> Derivation:
    """Case B at a general pose: one leg in vectors, a table, and the sum."""
    return rs.derive("gough-stewart-b", pose=rs.AtSymbols())


def _matrix_alone(derivation: Derivation) -> Derivation:
    """The result without its legs, so that names stand for what recurs in it alone."""
    return Derivation("K_C", derivation.K, (), derivation.K)


#: Every name with the function that derives its formula.
FORMULAS: dict[str, Callable[[], Derivation]] = {
    "planar-link": planar_link,
    "leg-of-section-6": leg_of_section_6,
    "case-a": case_a,
    "case-b": case_b,
    "turned-3-rpr": turned_3_rpr,
    "case-b-at-a-pose": case_b_at_a_pose,
}

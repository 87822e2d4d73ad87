"""Compliance as a formula, and chains from their compliance."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Steps, compliance_formula, compliance_steps, derive_chain
from robostiff.analytic.placement.agreement import closed_places
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.elasticity import cantilever_stiffness
from tests.analytic.formulas import CASE_B, L_B, stewart

L, E, G, A, I, J, k = sp.symbols("L E G A I J k", positive=True)
BEAM = sp.Matrix(cantilever_stiffness(L, E, G, A, I, I, J))


def test_deflection_of_a_cantilever():
    C = compliance_formula(BEAM)
    assert C[1, 1] == L**3 / (3 * E * I)
    assert C[5, 1] == L**2 / (2 * E * I)
    assert C[0, 0] == L / (E * A)
    assert C[3, 3] == L / (G * J)


def test_stiffness_and_compliance_are_inverse():
    K = stewart(*CASE_B, L_B)
    assert (K * compliance_formula(K)).applyfunc(sp.simplify) == sp.eye(6)


@pytest.mark.parametrize("form", [None, Steps()])
def test_a_chain_from_the_compliances_of_its_springs(form):
    C = compliance_formula(BEAM) + sp.diag(1 / k, 0, 0, 0, 0, 0)
    joints = {
        "Ry": [0, 0, 0, 0, 1, 0],
        "Rz": [0, 0, 0, 0, 0, 1],
        "Ry at the base": [0, 0, -L, 0, 1, 0],
    }
    options = {} if form is None else {"form": form}
    chain = derive_chain(C=C, joints=joints, **options)
    values = {"L": 0.5, "E": 2e11, "G": 8e10, "A": 1e-4, "I": 1e-9, "J": 2e-9, "k": 1e7}
    found = chain.substituted(values)
    assert float(found[0, 0]) == pytest.approx(1 / (1e-7 + 0.5 / 2e7))
    assert float(found[2, 2]) == 0
    stages = [stage.rule.split(":")[0] for stage in chain.stages]
    assert stages[0] == "rotation about y at the reference point"


@pytest.mark.parametrize(
    ("name", "pose"), [("3-rpr", rs.AtSymbols()), ("3-rrr", rs.AtHome()), ("3-prs", rs.AtSymbols())]
)
def test_compliance_in_steps_is_the_inverse_at_random_parameters_and_poses(name, pose):
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    found = compliance_steps(rs.derive(robot, pose=pose))
    function = found.lambdify()
    for values, result, _ in closed_places(place_robot(robot, pose), sets=2, poses=2):
        C = function(**{s.name: values[s.name] for s in found.symbols})
        inverse = np.linalg.inv(result.K)
        sizes = np.sqrt(np.outer(np.diag(inverse), np.diag(inverse)))
        assert np.max(np.abs(C - inverse) / sizes) < 1e-9


def test_compliance_in_steps_is_refused_where_the_platform_moves_freely():
    g = sp.Symbol("g", real=True)
    turned = rs.derive("gough-stewart-b", symbols=("k",), pose=rs.AtCoordinates({"gamma": g}))
    function = compliance_steps(turned).lambdify("g", "k")
    assert np.all(np.isfinite(function(0.3, 1e8)))
    with pytest.raises(rs.NoAnswerError, match="does not hold"):
        function(np.pi / 2, 1e8)


def test_the_deflection_of_a_chain_in_steps_is_that_of_its_closed_form():
    F = sp.Symbol("F")
    K = sp.Matrix(BEAM)
    steps = compliance_steps(derive_chain(K, {}, Steps()))
    exact = compliance_formula(BEAM) * sp.Matrix([0, F, 0, 0, 0, 0])
    written = steps.deflection([0, F, 0, 0, 0, 0])
    for d in reversed(steps.definitions):
        written = written.xreplace({d.symbol: d.expression})
    assert (written - exact).applyfunc(sp.simplify) == sp.zeros(6, 1)

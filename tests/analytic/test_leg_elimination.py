"""K^0 to K^n of a leg of a robot, against the paper's Section VI and the numerical form."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import AtSymbols, Steps, derive_leg
from robostiff.analytic.exact.exact_points import matrix_value
from robostiff.analytic.export.entries import EntryNames
from robostiff.analytic.placement.agreement import numbers_of
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.analytic.placement.robot_pose import AtHome
from robostiff.errors import DisagreementError


def value_of(derivation, robot):
    given = {s: robot.nominal[s.name] for s in derivation.symbols}
    return matrix_value(derivation.K, given, derivation.definitions)


def test_of_a_symmetric_beam_traction_alone_is_left():
    leg = rs.derive("gough-stewart-b-beams", leg="leg1")
    defined = {d.symbol.name: d.symbol for d in leg.definitions}
    L, EA, EI = (defined[name] for name in ("L_a", "EA_1", "EI_1"))
    assert leg.K0[0, 0] == EA / L
    assert leg.K0[1, 1] == 12 * EI / L**3
    assert leg.K0[1, 5] == -6 * EI / L**2
    rules = [stage.rule.partition(": ")[2].partition(",")[0] for stage in leg.stages]
    trivial = "trivial joint (19)"
    assert rules == [trivial, trivial, trivial, "quasi-trivial joint (18)", "recursion (15)"]
    assert leg.stages[2].K == sp.diag(EA / L, 3 * EI / L**3, 3 * EI / L**3, 0, 0, 0)
    assert leg.stages[-1].K == sp.diag(EA / L, 0, 0, 0, 0, 0)


def test_a_compliance_is_named_as_a_sum_of_springs():
    leg = rs.derive("hexapod", leg="leg1")
    named = {d.symbol.name: d.expression for d in leg.definitions}
    k_screw, k_joint, cylinder = (
        next(s for s in leg.symbols if s.name == name)
        for name in ("k_screw", "k_joint", "cylinder")
    )
    L_b, EA_1, EA_2 = (
        next(d.symbol for d in leg.definitions if d.symbol.name == name)
        for name in ("L_b", "EA_1", "EA_2")
    )
    assert named["C_11"] == 1 / k_screw + 2 / k_joint + cylinder / EA_1 + L_b / EA_2
    assert leg.C[1, 1] == leg.C[2, 2]
    assert leg.stages[-1].K == sp.diag(1 / leg.C[0, 0], 0, 0, 0, 0, 0)


@pytest.mark.parametrize("name", ["3-rps", "3-rpr-beams"])
def test_the_legs_add_up_to_the_robot(name):
    robot = rs.load(name, symbols=("r",) if name == "3-rps" else ())
    legs = [value_of(derive_leg(robot, leg.name), robot) for leg in robot.legs]
    K = rs.stiffness(rs.load(name)).K
    assert np.max(np.abs(sum(legs) - K)) < 1e-8 * np.max(np.abs(K))


def test_a_leg_at_a_general_pose_and_in_steps_is_the_same():
    robot = rs.load("3-rpr-beams", symbols=())
    name = robot.legs[0].name
    general = derive_leg(robot, name, AtSymbols())
    steps = derive_leg(robot, name, AtSymbols(), Steps())
    values = {"x": 0.01, "y": 0.02, "gamma": 0.1}
    K = np.array(general.substituted(values), dtype=float)
    assert np.allclose(np.array(steps.substituted(values), dtype=float), K, rtol=1e-9)
    assert np.linalg.matrix_rank(K, tol=1e-6 * np.max(K)) == 4  # six less two passive turns


@pytest.mark.parametrize(("symbols", "budget"), [((), 20.0), (rs.ALL_PARAMETERS, 0.05)])
def test_a_leg_coupled_in_all_directions_is_inverted_in_steps(symbols, budget):
    """Also of steps that are found when others have been read."""
    robot = rs.load("six-joint-arm", symbols=symbols)
    leg = derive_leg(robot, robot.legs[0].name, budget=budget)
    assert not leg.stages
    assert any(d.symbol.name.startswith("K_0_") for d in leg.definitions)
    K = rs.stiffness(robot.numeric).K
    assert np.max(np.abs(value_of(leg, robot) - K)) < 1e-8 * np.max(np.abs(K))


def test_a_wrong_stage_is_found():
    robot = rs.load("gough-stewart-a-beams", symbols=("h",))
    leg = derive_leg(robot, "leg1")
    numbers = numbers_of(place_robot(robot, AtHome()))
    numbers.check(leg.K, leg.definitions, 0)
    for wrong in (leg.K * sp.Rational(1001, 1000), leg.K + leg.K0 / 1000):
        with pytest.raises(DisagreementError, match="leg 1"):
            numbers.check(wrong, leg.definitions, 0)


def test_a_leg_with_beams_at_a_general_pose_is_read_in_steps():
    """Its contributions are simplified after the steps were named; numbers are compared."""
    robot = rs.load("3-rrr", symbols=rs.ALL_PARAMETERS)
    leg = rs.derive(robot, pose=rs.AtSymbols(), leg=robot.legs[0].name)
    assert len(leg.stages) == 2
    values = {s.name: robot.nominal.get(s.name, 0.05) for s in leg.symbols}
    K = np.array(leg.substituted(values).tolist(), dtype=float)
    assert np.linalg.matrix_rank(K, tol=1e-9 * np.linalg.norm(K, 2)) == 1


def test_values_put_in_leave_no_name_without_its_definition():
    """Steps that are numbers, such as EI of a beam, are put in everywhere."""
    leg = rs.derive("3-prs", leg="leg1")
    values = {"R": 0.55, "k": 9e6, "l": 0.8, "r": 0.25}
    put = leg.subs({"R": 0.55})
    assert {*EntryNames(put).given} <= values.keys() - {"R"}
    others = {s.name: values[s.name] for s in put.symbols}
    assert put.lambdify()(**others) == pytest.approx(leg.lambdify()(**values), rel=1e-12)

"""Machines of modules at home: a formula of each module, and C = sum of J C J^T.

Compared with the same machine in numbers, and with compliances of the modules alone.
"""

import copy
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.analytic import Steps, compliance_steps, differentiate, rank_formula
from robostiff.analytic.export import (
    c_function,
    derivation_data,
    derivation_html,
    derivation_latex,
    derivation_markdown,
    derivation_text,
    derivation_typst,
    python_function,
)
from robostiff.analytic.export.program import program
from robostiff.model import Chain, Link, prismatic, revolute
from tests.cases.metric import apart

EXAMPLES = Path(__file__).parents[2] / "examples"
FEET = np.diag([2e-9, 3e-9, 1e-9, 1e-9, 1e-9, 2e-9])
TILT = rs.Frame(Rotation.from_rotvec([0, 0.3, 0]).as_matrix(), np.array([0.1, 0, 0.05]))


def module(name, robot, at, mount=None):
    """A robot in symbols, or at values of these."""
    part = rs.load(robot, symbols=rs.ALL_PARAMETERS)
    return rs.Module(
        name, part.substituted({x: at[x] for x in part.nominal}) if at else part, mount
    )


def chain(name, *elements):
    return rs.Module(name, Chain(elements))


def tool(z=0.2):
    return rs.Rigid(rs.Frame(np.eye(3), np.array([0, 0, z])), "tool")


def turn():
    return revolute([0, 0, 1], rs.Actuated(1e4), name="turn")


def head():
    return chain("head", turn(), revolute([1, 0, 0], rs.Actuated(2e5), name="tilt"), tool())


FRAME = chain("frame", Link(np.zeros(3), rs.Elasticity(FEET), np.eye(3), "feet"))
RAIL = chain("rail", prismatic([1, 0, 0], rs.Actuated(3e8), name="slide"))
#: Modules, and the most operations of their program.
MACHINES = {
    "hexapod on a rail": (lambda at: [FRAME, RAIL, module("hexapod", "hexapod", at)], 125),
    "two alike": (
        lambda at: [
            module("lower", "gough-stewart-b", at),
            module("upper", "gough-stewart-b", at),
            head(),
        ],
        190,
    ),
    "tilted": (
        lambda at: [
            module("lower", "gough-stewart-b", at),
            module("upper", "gough-stewart-b", at, TILT),
        ],
        230,
    ),
    "tripod with a head": (lambda at: [module("tripod", "3-prs", at), head()], 125),
    "delta with a tool": (lambda at: [module("delta", "delta", at), chain("tool", tool())], 120),
    "in vectors": (lambda at: [module("exechon", EXAMPLES / "exechon.yaml", at), head()], 260),
    "in steps": (lambda at: [module("pus", "hexapod-pus", at), chain("tool", tool())], 270),
    "arm on a platform": (
        lambda at: [module("base", "gough-stewart-b", at), module("arm", "scara", at)],
        740,
    ),
    "planar": (lambda at: [module("base", "3-rrr", at), chain("arm", turn(), tool(0.0))], 60),
}


def machine_of(name, at=None):
    return rs.hybrid_machine(MACHINES[name][0](at), name=name)


@pytest.fixture(scope="module")
def tricept():
    robot = rs.load(EXAMPLES / "tricept-with-head.yaml", symbols=rs.ALL_PARAMETERS)
    return robot, rs.derive(robot)


@pytest.mark.filterwarnings("ignore::robostiff.PlausibilityWarning")
@pytest.mark.parametrize("name", MACHINES)
def test_formulas_of_machines_are_those_of_numbers(name):
    """Most were in hundreds to thousands of operations, with up to 72 unknown coordinates."""
    robot = machine_of(name)
    derivation = rs.derive(robot)
    assert not derivation.following
    assert derivation.in_series.modules
    random = np.random.default_rng(5)
    for spread in (0.0, 0.02):
        values = {k: x * (1 + spread * random.uniform(-1, 1)) for k, x in robot.nominal.items()}
        expected = rs.stiffness(machine_of(name, values)).K
        given = {s.name: values[s.name] for s in derivation.symbols}
        assert apart(derivation.lambdify()(**given), expected) < 1e-12
        own = {s.name: values[s.name] for s in derivation.in_series.symbols}
        assert apart(np.array(derivation.in_series.substituted(own), float), expected) < 1e-12
    assert program(derivation).operations <= MACHINES[name][1]
    for language in (derivation_latex, derivation_markdown, derivation_html, derivation_typst):
        assert language(derivation)


def test_a_machine_adds_the_compliances_of_its_modules():
    """Written out by hand: a turn about x moves what lies above its axis against y."""
    robot, alone = machine_of("two alike"), rs.load("gough-stewart-b")
    derivation = rs.derive(robot)
    given = {s.name: robot.nominal[s.name] for s in derivation.symbols}
    C, h = np.linalg.inv(rs.stiffness(alone).K), robot.nominal["h"]
    total = np.zeros((6, 6))
    for below in (h + 0.2, 0.2):
        J = np.eye(6)
        J[:3, 3:] = [[0, below, 0], [-below, 0, 0], [0, 0, 0]]
        total += J @ C @ J.T
    for twist, k in (([0, 0, 0, 0, 0, 1], 1e4), ([0, -0.2, 0, 1, 0, 0], 2e5)):
        total += np.outer(twist, twist) / k
    assert apart(np.linalg.inv(total), derivation.lambdify()(**given)) < 1e-12


def test_a_machine_prints_each_module_and_the_sum(tricept):
    _, derivation = tricept
    lines = derivation_text(derivation, width=88).splitlines()
    for line in (
        "Module 1: tricept",
        "K_1 = K_1_1 + K_1_2",
        "K_1_11 = 3*EI_1/h**3 + 363/(2*L_a**2*c_a)",
        "C_1 = K_1^-1",
        "v_1 = (0, 0, -h) - p_C",
        "head/a-axis  t_2  1/ka",
        "C = J_1 C_1 J_1^T + sum of c t t^T",
        "J_1 = [1, (v_1 x); 0, 1]",
        "K_C = C^-1",
        "c: compliance of the leg under this wrench; compliance of a drive",
    ):
        assert line in lines, line
    assert not any("q_" in line for line in lines)
    assert lines == derivation_text(copy.deepcopy(derivation), width=88).splitlines()
    level = derivation_text(derivation.in_series, width=88).splitlines()
    assert {"Module 1: tricept", "K_C = C^-1"} <= {*level}


def test_equal_modules_and_links_with_a_matrix_are_printed_once():
    text = derivation_text(rs.derive(machine_of("two alike")), width=88)
    assert "\nModule 2: upper\n---------------\n\nK_2 = K_1\n\nC_2 = K_2^-1\n" in text
    text = derivation_text(rs.derive(machine_of("hexapod on a rail")), width=88)
    assert "\nLink 1: frame/feet\n" in text
    assert "\nC = J_1 C_1 J_1^T + J_2 C_2 J_2^T + sum of c t t^T\n" in text
    assert "each of 'hexapod/leg1', 'hexapod/leg2'" in " ".join(text.split())


def test_values_rates_questions_and_programs_of_machines(tricept):
    robot, derivation = tricept
    K, at = rs.stiffness(robot.numeric).K, dict(robot.nominal)
    one = derivation.subs({"h": at["h"], "kc": at["kc"]})
    rest = {s.name: at[s.name] for s in one.symbols}
    for form in (one, one.in_series, copy.deepcopy(one)):
        assert apart(np.array(form.substituted(rest), float), K) < 1e-12
    assert "K_1_33 = " in derivation_text(derivation.subs({"arm": 0.2}))
    names: dict = {}
    exec(python_function(derivation, name="stiffness"), names)  # noqa: S102
    given = {s.name: at[s.name] for s in derivation.symbols}
    assert apart(names["stiffness"](**given), K) < 1e-12
    assert "double h" in c_function(derivation)
    assert derivation_data(derivation)["symbols"] == [s.name for s in derivation.symbols]
    _, rate = differentiate(derivation, "h").lambdify()(**given)
    step = 1e-5
    ends = [derivation.lambdify()(**given | {"h": at["h"] + s}) for s in (step, -step)]
    assert np.allclose((ends[0] - ends[1]) / 2 / step, rate, rtol=1e-6, atol=1e-6 * abs(rate).max())
    found = rank_formula(derivation)
    assert found.rank == 6
    assert "that of a module does" in found.remark
    C = compliance_steps(derivation)
    assert apart(np.array(C.substituted(given), float), np.linalg.inv(K)) < 1e-10
    snippet = derivation.latex()
    for part in (r"\mathbf{K}_{1} = \begin", r"\mathbf{C}_{1} = \mathbf{K}_{1}^{-1}", "t}^{"):
        assert part in snippet
    assert r"\mathbf{w}" not in snippet


def test_modules_in_numbers_are_those_of_the_model():
    """A coordinate that closes at one value in all samples was a symbol without a meaning."""
    robot = rs.load(EXAMPLES / "tricept-with-head.yaml", symbols=("tool",))
    derivation = rs.derive(robot)
    assert [s.name for s in derivation.symbols] == ["tool"]
    assert apart(derivation.lambdify("tool")(0.2), rs.stiffness(robot.numeric).K) < 1e-12
    alone = rs.derive(EXAMPLES / "tricept.yaml", symbols=("k",))
    assert [s.name for s in alone.symbols] == ["k"]
    expected = rs.stiffness(rs.load(EXAMPLES / "tricept.yaml")).K
    assert apart(alone.lambdify("k")(8e7), expected) < 1e-12


def test_steps_and_modules_that_move_freely_are_derived_as_before():
    robot = rs.load(EXAMPLES / "tricept-with-head.yaml", symbols=("h",))
    steps = rs.derive(robot, form=Steps())
    assert steps.in_series is None
    free = rs.hybrid_machine([module("free", "gough-stewart-a", None), chain("tool", tool())])
    derivation = rs.derive(free)
    assert derivation.general_rank == 3
    assert derivation.in_series is None

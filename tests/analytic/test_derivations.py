"""The paper's formulas as they are derived, in series form and as compliances."""

import runpy
import subprocess
import sys
from itertools import permutations

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Steps, compliance_formula, compliance_steps, derive_chain
from robostiff.analytic.placement.agreement import closed_places
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.analytic.placement.robot_pose import AtHome, AtSymbols
from robostiff.analytic.series_form import series_form
from robostiff.analytic.vectors.forms import VectorForm
from robostiff.analytic.vectors.vector_expressions import names_in
from robostiff.elasticity import cantilever_stiffness
from robostiff.elastostatics import eliminate_joint, matrix_distance
from robostiff.robots import robot_file
from tests.analytic.formulas import CASE_B, L_B, in_numbers, stewart
from tests.project.shown_output import ROOT

L = sp.Symbol("L", positive=True)
FIVE = {  # eq. (21)
    "Rx": [0, 0, 0, 1, 0, 0],
    "Ry": [0, 0, 0, 0, 1, 0],
    "Rz": [0, 0, 0, 0, 0, 1],
    "Ry+": [0, 0, -L, 0, 1, 0],
    "Rz+": [0, L, 0, 0, 0, 1],
}
FULL = sp.Matrix(6, 6, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))


def numbers(expression, values):
    return np.array(sp.Matrix(expression).evalf(30, subs=values), dtype=float)


@pytest.mark.parametrize("order", list(permutations(range(5)))[::17])
def test_proposition_any_order_gives_the_same_matrix(order):
    names = list(FIVE)
    shuffled = {names[i]: FIVE[names[i]] for i in order}
    assert derive_chain(FULL, shuffled).K == derive_chain(FULL, FIVE).K


def test_steps_equal_the_closed_form_and_the_numerical_form():
    generator = np.random.default_rng(1)
    M = generator.normal(size=(6, 6))
    K0 = M @ M.T + 6 * np.eye(6)
    general = {f"j{i}": sp.symbols(f"d{i}x d{i}y d{i}z e{i}x e{i}y e{i}z") for i in range(4)}
    values = {FULL[i, j]: K0[i, j] for i in range(6) for j in range(i, 6)}
    expected = K0
    for column in general.values():
        twist = generator.normal(size=6)
        values |= dict(zip(column, twist, strict=True))
        expected = eliminate_joint(expected, twist)
    stepped = derive_chain(FULL, general, Steps())
    found = np.array(stepped.substituted(values), dtype=float)
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(K0).max())
    closed = derive_chain(FULL, dict(list(general.items())[:1]))
    short = derive_chain(FULL, dict(list(general.items())[:1]), Steps())
    np.testing.assert_allclose(
        numbers(closed.K, values), np.array(short.substituted(values), dtype=float), rtol=1e-10
    )


@pytest.mark.parametrize("pose", [AtHome(), AtSymbols()])
def test_an_arm_of_six_joints_is_its_rotations_points_and_springs(pose):
    robot = rs.load("six-joint-arm", symbols=("upper", "fore", "flange"))
    placed = place_robot(robot, pose)
    arm = series_form(placed)
    assert isinstance(arm, VectorForm)
    assert [name for name, _, _ in arm.drives] == [f"joint{i}" for i in range(1, 7)]
    assert [name for name, *_ in arm.beams] == ["column", "upper arm", "forearm", "wrist"]
    assert len(arm.leg) <= 30
    # The last joint turns neither a spring nor the reference point.
    rotations = [e.name for e in arm.leg if e.name.startswith("R_")]
    for name in rotations:
        assert any(name in names_in(e.expression) for e in arm.leg), name
    random = np.random.default_rng(5)
    for _ in range(3):
        values = {k: v * random.uniform(0.8, 1.2) for k, v in robot.nominal.items()}
        joints = {name: float(random.uniform(-1.5, 1.5)) for name in placed.coordinates}
        numeric = robot.substituted(values)
        at = rs.JointCoordinates(np.array(list(joints.values()))) if joints else None
        wanted = rs.stiffness(numeric, at).K
        assert matrix_distance(in_numbers(arm, values | joints), wanted, 0.5) < 1e-10


def test_an_arm_in_numbers_alone_is_inverted_in_steps():
    """Sines of its angles are no fractions: entries of an inverse would grow without end."""
    form = rs.derive(rs.load("six-joint-arm")).in_series
    assert not form.K.free_symbols - {d.symbol for d in form.definitions}
    assert max(sp.count_ops(d.expression) for d in form.definitions) < 500
    found = np.array(form.evalf().tolist(), dtype=float)
    assert matrix_distance(found, rs.stiffness(rs.load("six-joint-arm")).K, 0.5) < 1e-12


def test_rigid_drives_add_nothing_and_axes_may_be_inclined(tmp_path):
    text = robot_file("six-joint-arm").read_text(encoding="utf-8")
    for old, new in (
        (
            "name: joint2, axis: y, role: actuated, stiffness: 5e5 N m/rad,",
            "name: joint2, axis: y, role: actuated,",
        ),
        ("name: joint4, axis: x,", "name: joint4, axis: [3, 0, 4],"),
    ):
        assert old in text
        text = text.replace(old, new)
    page = tmp_path / "arm.yaml"
    page.write_text(text, encoding="utf-8")
    robot = rs.load(page, symbols=rs.ALL_PARAMETERS)
    placed = place_robot(robot, AtSymbols())
    arm = series_form(placed)
    assert isinstance(arm, VectorForm)
    assert [name for name, *_ in arm.drives] == [f"joint{i}" for i in (1, 3, 4, 5, 6)]
    assert arm.passive == ()
    joints = dict(zip(placed.coordinates, (0.4, 0.3, -0.6, 0.8, 0.5, -0.2), strict=True))
    wanted = rs.stiffness(robot.numeric, rs.JointCoordinates(np.array([*joints.values()]))).K
    assert matrix_distance(in_numbers(arm, {**robot.nominal, **joints}), wanted, 0.5) < 1e-10


E, G, A, I, J, k = sp.symbols("E G A I J k", positive=True)
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


def test_all_routes_agree_on_one_joint():
    script = ROOT / "benchmarks/derivations.py"
    run = subprocess.run(
        [sys.executable, script, "--quick", "--joints", "1", "--limit", "60"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "robostiff.analytic" in run.stdout
    assert run.stdout.count("canonical") >= 9
    assert "WRONG" not in run.stdout
    assert "no answer" not in run.stdout


@pytest.mark.parametrize("problems", [["gsb", "3-rrr", "planar"], ["platform", "3-p", "hexapod"]])
def test_the_expert_derives_the_same_matrix(problems, monkeypatch, capsys):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    monkeypatch.setattr(sys, "argv", ["expert.py", "--compare", *problems])
    runpy.run_path(str(ROOT / "benchmarks/expert.py"), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) >= len(problems)
    assert max(float(line.rpartition(":")[2]) for line in lines) < 1e-12

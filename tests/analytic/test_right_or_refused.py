"""Every formula and every exported function is right, or refused."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.analytic import (
    compliance_steps,
    derive_chain,
    differentiate,
    free_motion_formulas,
    rank_formula,
    robot_formula,
    snapshot_formula,
)
from robostiff.analytic.chain import check_chain
from robostiff.analytic.export import derivation_text
from robostiff.analytic.placement.agreement import numbers_of
from robostiff.analytic.placement.robot_placement import place_robot
from tests.analytic.export.programs import in_python
from tests.analytic.export.test_functions import POSED
from tests.analytic.formulas import DATA, cubic_platform, derived, in_numbers
from tests.cases.metric import apart
from tests.files import FILES, text_of


def values_for(derivation, known):
    return {symbol.name: known[symbol.name] for symbol in derivation.symbols}


@pytest.mark.parametrize("name", ["mini", "tricept", "fb3", "gsb-drive"])
def test_legs_are_derived_where_they_close_and_not_where_the_file_puts_their_joints(name):
    robot = rs.load(DATA / f"{name}.yaml", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot)
    assert derivation.following == ()
    function = in_python(derivation)
    random = np.random.default_rng(1)
    for _ in range(2):
        values = {k: v * random.uniform(0.95, 1.05) for k, v in robot.nominal.items()}
        K = function(**values_for(derivation, values))
        assert apart(K, rs.stiffness(robot.substituted(values)).K) < 1e-10


def test_coordinates_without_a_formula_are_symbols_and_others_than_the_closed_ones_refused():
    robot = rs.load(FILES / "bent-ram.yaml", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot)
    assert derivation.following
    assert "the legs determine" in derivation.where
    names = [f"q_ram_{i + 1}" for i in range(3)]
    q = dict(zip(names, rs.find_posture(robot.numeric).coordinates[0][0], strict=True))
    known = {**robot.nominal, **q}
    function = in_python(derivation)
    K = function(**values_for(derivation, known))
    assert apart(K, rs.stiffness(robot.numeric).K) < 1e-9
    with pytest.raises(ValueError, match="does not hold"):
        function(**values_for(derivation, known | {derivation.following[0]: 1.234}))
    with pytest.raises(rs.InputError, match="change with it as the legs close"):
        differentiate(derivation, derivation.symbols[0])


def test_without_symbols_of_the_dimensions_closed_coordinates_are_numbers():
    robot = rs.load(FILES / "bent-ram.yaml", symbols=())
    derivation = rs.derive(robot)
    assert derivation.symbols == ()
    K = np.array(derivation.K.evalf(), dtype=float)
    assert apart(K, rs.stiffness(robot.numeric).K) < 1e-10


@pytest.mark.parametrize("name", ["3-rps", "3-prs"])
def test_parasitic_motion_is_part_of_the_pose(name):
    robot = rs.load(name, symbols=())
    derivation = rs.derive(robot, pose=rs.AtSymbols())
    assert derivation.coordinates == ("x", "y", "z", "alpha", "beta", "gamma")
    assert set(derivation.following) == {"x", "y", "gamma"}
    function = in_python(derivation)
    numeric = robot.numeric
    for turn in ([0.3, 0.0], [0.2, -0.25]):
        six = rs.find_posture(numeric, [numeric.home.p[2], *turn]).pose[0]
        angles = Rotation.from_rotvec(six[3:]).as_euler("xyz")
        known = dict(zip(derivation.coordinates, (*six[:3], *angles), strict=True))
        K = function(**values_for(derivation, known))
        assert apart(K, rs.stiffness(numeric, six).K) < 1e-10
        with pytest.raises(ValueError, match="does not hold"):
            function(**values_for(derivation, known | {"x": 0.0, "y": 0.0, "gamma": 0.0}))


def test_a_component_of_a_wrench_may_vanish_at_a_regular_pose():
    robot = rs.load(DATA / "fb3.yaml", symbols=())
    derivation = rs.derive(robot, pose=rs.AtSymbols())
    function = in_python(derivation)
    for x, y in [(-0.4, 0.4), (0.4, 0.4), (0.1, 0.45)]:
        K = function(**values_for(derivation, {"x": x, "y": y, "gamma": 0.0}))
        assert apart(K, rs.stiffness(robot.numeric, [x, y, 0]).K) < 1e-12


def drive_as_stiff_as_its_beam():
    robot = rs.load(DATA / "gsb-drive.yaml", symbols=rs.ALL_PARAMETERS)
    R, r, h, D, d = (robot.nominal[name] for name in ("R", "r", "h", "D", "d"))
    L = np.sqrt(R**2 - R * r + r**2 + h**2)
    return robot, 210e9 * np.pi * (D**2 - d**2) / 4 / L


def test_a_rank_has_no_false_exception():
    found = rank_formula(derived("gsb-drive").K)
    assert found.rank == 6
    assert {str(x) for x in found.exceptions} == {"R", "h", "k", "r", "D - d", "D + d"}
    E, A, L, k, b = sp.symbols("E A L k b", positive=True)
    series = 1 / (1 / k + sp.sqrt(L**2 + b**2) / (E * A))
    assert set(rank_formula(sp.diag(series, series * (E - b), 0)).exceptions) == {A, E, k, E - b}
    assert len(free_motion_formulas(sp.diag(series, 0, 0))) == 2


FULL = sp.Matrix(6, 6, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))


@pytest.mark.parametrize("form", [rs.Closed(), rs.Steps()])
def test_a_dependent_joint_takes_nothing_away(form):
    L = sp.Symbol("L", positive=True)
    joints = {"a": [0, 0, -L, 0, 1, 0], "b": [0, 0, 0, 0, 1, 0], "c": [0, 0, 1, 0, 0, 0]}
    derivation = derive_chain(FULL, joints, form)
    assert [stage.is_redundant for stage in derivation.stages] == [False, False, True]
    M = np.diag([4.0, 4, 4, 2, 2, 2])
    M[2, 4] = M[4, 2] = 1.0
    known = {f"K{i + 1}{j + 1}": M[i, j] for i in range(6) for j in range(i, 6)} | {"L": 1.0}
    K = in_python(derivation)(**values_for(derivation, known))
    np.testing.assert_allclose(np.diag(K), [4, 4, 0, 2, 0, 2], atol=1e-12)


@pytest.mark.parametrize("name", sorted({*rs.shipped_robots()} - {*POSED}))
def test_steps_of_shipped_robots_at_their_own_values(name):
    """Other values are compared by `derive` itself, others of `POSED` at symbolic poses."""
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, form=rs.Steps())
    values = values_for(derivation, robot.nominal) if not derivation.following else None
    if values is not None:
        K = in_python(derivation)(**values)
        assert apart(K, rs.stiffness(robot.numeric).K) < 1e-9


def test_a_derivation_that_differs_from_numbers_is_not_returned(monkeypatch):
    wrong = robot_formula.sum_of_springs

    def off(*arguments, **options):
        found = wrong(*arguments, **options)
        assert found is not None
        return replace(found, K=found.K * sp.Rational(1001, 1000))

    monkeypatch.setattr(robot_formula, "sum_of_springs", off)
    with pytest.raises(rs.DisagreementError, match=r"disagree by 1\.0e-03 .*report"):
        rs.derive("gough-stewart-b")


def test_checks_of_robots_chains_and_snapshots_see_a_difference(monkeypatch):
    robot = rs.load("3-rpr", symbols=())
    derivation = rs.derive(robot, pose=rs.AtSymbols())
    numbers = numbers_of(place_robot(robot, rs.AtSymbols()))
    numbers.check(derivation.K, derivation.definitions)
    with pytest.raises(rs.DisagreementError):
        numbers.check(derivation.K * sp.Rational(100001, 100000), derivation.definitions)
    joints = {"tip": sp.ImmutableMatrix([0, 0, 0, 0, 1, 0])}
    chain = derive_chain(FULL, joints, rs.Steps())
    with pytest.raises(rs.DisagreementError):
        check_chain(replace(chain, K=chain.K + sp.eye(6) / 1000), FULL.flat(), joints)
    module = sys.modules["robostiff.analytic.robot_formula"]
    whole = module.closed_sum
    monkeypatch.setattr(
        module, "closed_sum", lambda *own: replace(whole(*own), K=whole(*own).K * 2)
    )
    with pytest.raises(rs.DisagreementError):
        snapshot_formula(cubic_platform())


@pytest.mark.parametrize("form", [rs.Closed(), rs.Steps()], ids=["closed", "steps"])
@pytest.mark.parametrize("pose", [rs.AtHome(), rs.AtSymbols()], ids=["home", "symbols"])
def test_numbers_of_hundreds_of_digits_are_exported_as_numbers_of_the_machine(form, pose):
    robot = rs.load(DATA / "arm-of-long-decimals.yaml")
    derivation = rs.derive(robot, pose=pose, form=form)
    home = robot.legs[0].chain.home
    q = {s.name: float(home[int(s.name[1:]) - 1]) for s in derivation.symbols}
    expected = rs.stiffness(robot).K
    np.testing.assert_allclose(in_python(derivation)(**q), expected, atol=1e-11 * expected.max())


def test_numbers_of_hundreds_of_digits_are_a_sum_of_springs():
    # Floats have no quotient of two numbers above 1e308.
    robot = rs.load(DATA / "arm-of-long-decimals.yaml")
    series = rs.derive(robot).in_series
    assert series is not None
    np.testing.assert_allclose(in_numbers(series, {}), rs.stiffness(robot).K, rtol=1e-9)


@pytest.mark.parametrize("symbol", ["k", "h"])
def test_a_derivative_in_names_has_no_false_pole_and_is_short(symbol):
    robot, k = drive_as_stiff_as_its_beam()
    found = differentiate(rs.derive(robot), symbol)
    values = {**robot.nominal, "k": k}
    _, dK = in_python(found)(**values_for(found, values))
    step = 1e-5 * values[symbol]
    ends = [{**values, symbol: values[symbol] + s * step} for s in (1, -1)]
    after, before = (rs.stiffness(robot.substituted(at)).K for at in ends)
    assert apart(dK, (after - before) / (2 * step)) < 1e-8
    assert apart(found.lambdify()(**values_for(found, values))[1], dK) < 1e-13
    assert len(derivation_text(found).split("Where the formula holds")[0].splitlines()) < 32


def test_a_stretched_leg_transmits_more_and_is_refused():
    """Three parallel joints in a plane are redundant: K was 60 times too small at d = 2 l."""
    robot = rs.load("tripteron", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot)
    usual = {s.name: robot.nominal[s.name] for s in derivation.symbols}
    bent, stretched = ({**usual, "d": f * usual["l"]} for f in (1.99, 2.0))
    expected = rs.stiffness(robot.substituted(bent)).K
    assert apart(in_python(derivation)(**bent), expected) < 1e-9
    compliance = compliance_steps(derivation)
    for own in (derivation, compliance, differentiate(derivation, "e")):
        with pytest.raises(rs.InputError, match="leg 'leg x' is neither stretched nor folded"):
            own.substituted(stretched)
    for own in (derivation, compliance):
        with pytest.raises(rs.InputError, match="leg 'leg x' is neither stretched nor folded"):
            own.subs({"l": 0.35, "d": 0.7})
    assert not compliance.subs({"l": 0.35}).subs({"d": 0.3}).conditions
    with pytest.raises(rs.NoAnswerError, match="is neither stretched nor folded"):
        derivation.lambdify()(**stretched)
    with pytest.raises(ValueError, match="does not hold"):
        in_python(derivation)(**stretched)


DEPENDENT = text_of("dependent-joints.yaml")
SLIDE = "{type: prismatic, axis: x, role: passive}"
FIRST = "      - {type: revolute, axis: z, role: passive}\n"
ABOUT_A_POINT = DEPENDENT.replace(FIRST, "", 1).replace(
    "      - {type: rigid, turn: [{z: alpha}]}", FIRST + "      - {type: rigid, turn: [{x: alpha}]}"
)
BRANCH = text_of("dependent-branch.yaml")
DEPENDS = {
    "a slide": (DEPENDENT.replace("SECOND", SLIDE), {"alpha": np.arccos(-0.5)}, {"alpha": 2.0}),
    "about a point": (
        ABOUT_A_POINT.replace("SECOND", "{type: revolute, axis: z, role: passive}"),
        {"alpha": 0.0},
        {"alpha": 0.1},
    ),
    "a branch": (BRANCH, {"e": 0.02}, {"e": 0.03}),
}


@pytest.mark.parametrize("form", [rs.Closed(), rs.Steps()], ids=["closed", "steps"])
@pytest.mark.parametrize("case", DEPENDS)
def test_joints_that_depend_on_one_another_transmit_more(case, form, tmp_path):
    """K had a rank of one less than the numbers, where turns alone in a leg were looked at."""
    text, special, usual = DEPENDS[case]
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, form=form)
    near, at = ({**robot.nominal, **x} for x in (usual, special))
    known = derivation.lambdify()
    assert (
        apart(known(**values_for(derivation, near)), rs.stiffness(robot.substituted(near)).K) < 1e-9
    )
    with pytest.raises(rs.NoAnswerError, match=r"is neither stretched nor folded|are independent"):
        known(**values_for(derivation, at))
    with pytest.raises(rs.InputError, match=r"is neither stretched nor folded|are independent"):
        derivation.substituted(values_for(derivation, at))


def model(tmp_path, *, parameters, chain, platform=False):
    """An arm, or a platform on three legs of one chain."""
    legs = "  - name: arm\n" if not platform else "  - repeat: {count: 3, variable: i, name: leg}\n"
    frame = "{at: [R*cos(phi), R*sin(phi), 0], turn: [{z: phi}]}"
    if platform:
        legs += f"    let: {{phi: i*120 deg}}\n    base: {frame}\n    platform: {frame}\n"
    home = "home: {at: [0, 0, h]}\n" if platform else ""
    path = tmp_path / "machine.yaml"
    path.write_text(
        f"robostiff: 1\nname: machine\nsource: own\nparameters: {{{parameters}}}\n{home}"
        f"legs:\n{legs}"
        "    chain:\n" + "".join(f"      - {{{part}}}\n" for part in chain)
    )
    return path


def test_a_high_power_of_a_small_side_is_not_zero(tmp_path):
    """Torsion of a rectangle with a side as a symbol: K was 3e-6 off, and refused as a fault."""
    bar = "section: {rectangle: {width_y: t, height_z: 30 mm}}"
    path = model(
        tmp_path,
        parameters="t: 20 mm",
        chain=[
            f"type: beam, to: [0.2, 0, 0], y_axis: z, material: steel, taper: [{{share: 0.4, "
            f"section: {{circle: {{diameter: 30 mm}}}}}}, {{share: 0.6, {bar}}}]",
            "type: revolute, axis: [1, 2, 0], role: passive",
        ],
    )
    derivation = rs.derive(path)
    for t in (0.02, 0.024, 0.04):
        K = in_python(derivation)(t)
        assert apart(K, rs.stiffness(rs.load(path, {"t": t})).K) < 1e-12


BEAM = "type: beam, to: [0, 0, h], y_axis: x, material: steel, section: {circle: {diameter: 30 mm}}"
BALL = "type: spherical, role: passive"


@pytest.mark.parametrize(
    "chain",
    [
        ["type: prismatic, axis: z, role: actuated, stiffness: 1e6 N/m", BEAM, BALL],
        ["type: revolute, axis: y, role: actuated, stiffness: 2e4 N m/rad", BEAM, BALL],
        [
            "type: revolute, axis: y, role: actuated, stiffness: 2e4 N m/rad",
            "type: revolute, axis: x, role: passive",
            BEAM,
            BALL,
        ],
    ],
)
def test_a_rod_or_crank_without_a_length_has_no_vectors(chain, tmp_path):
    """`vectors` ended in a `TypeError`: a division by the length."""
    path = model(tmp_path, parameters="R: 0.3 m, h: 0.4 m", chain=chain, platform=True)
    derivation = rs.derive(path)
    assert derivation.vectors is None
    K = derivation.lambdify()(
        *(rs.load(path, symbols=rs.ALL_PARAMETERS).nominal[s.name] for s in derivation.symbols)
    )
    assert apart(K, rs.stiffness(rs.load(path)).K) < 1e-12


def test_links_that_are_folded_at_home_are_refused(tmp_path):
    """Where no direction of the links follows from the pose, this was a `LinAlgError`."""
    turn = "type: revolute, axis: z, role: passive, home:"
    path = model(
        tmp_path,
        parameters="R: 0.3 m, h: 0.4 m, c: 0.1 m",
        chain=[
            "type: prismatic, axis: z, role: actuated, stiffness: 1e6 N/m",
            *(f"{turn} 0.5", "type: rigid, to: [c, 0, 0]", f"{turn} -1"),
            *("type: rigid, to: [c, 0, 0]", f"{turn} 0", BEAM),
        ],
        platform=True,
    )
    with pytest.raises(rs.InputError, match="two postures of leg 'leg1' that meet at home"):
        rs.derive(path)

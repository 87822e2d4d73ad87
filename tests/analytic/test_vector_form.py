"""Formulas in vectors: of rods, of links and of planar chains."""

import copy
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.analytic import AtHome, AtSymbols, Steps
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.export import (
    derivation_html,
    derivation_latex,
    derivation_markdown,
    derivation_text,
    derivation_typst,
)
from robostiff.analytic.placement import robot_placement
from robostiff.analytic.placement.agreement import numbers_of
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.analytic.vectors.vector_form import vector_form
from robostiff.elastostatics import matrix_distance
from robostiff.errors import DisagreementError
from robostiff.kinematics import posture_finder
from robostiff.robots import robot_file
from tests.analytic.formulas import derived, in_numbers
from tests.files import FILES

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def placed():
    return place_robot(rs.load("gough-stewart-b", symbols=("R", "r", "k")), AtSymbols())


@pytest.fixture(scope="module")
def platform(placed):
    return vector_form(placed)


def test_a_wrong_form_is_found(placed, platform):
    numbers_of(placed).check(platform.K, platform.definitions)
    psi = platform.columns["psi_i"]
    wrong = replace(
        platform, columns=platform.columns | {"psi_i": (psi[0] + sp.pi / 180, *psi[1:])}
    )
    with pytest.raises(DisagreementError, match="the formula and the numerical form"):
        numbers_of(placed).check(wrong.K, wrong.definitions)


def test_legs_of_two_kinds_have_their_compliances_in_the_table():
    robot = rs.load("us-ups", symbols=rs.ALL_PARAMETERS)
    form = rs.derive(robot).vectors
    assert form is not None
    L, EA, k = (sp.Symbol(name, positive=True) for name in ("L_i", "EA_1", "k"))
    assert "theta_i" not in form.columns, "no leg has a wrench across its joint"
    assert [str(c) for c in form.columns["c_i"]] == [str(L / EA)] * 4 + [str(1 / k)] * 3
    values = {"R": 0.32, "h": 0.3, "Q": 0.4, "r": 0.12, "top": 0.08, "k": 2.2e7}
    found = in_numbers(form, values)
    given = {
        name: f"{value} N/m" if name == "k" else f"{value} m" for name, value in values.items()
    }
    assert np.allclose(found, rs.stiffness(rs.load("us-ups", given)).K, rtol=1e-11, atol=1e-3)


def test_carriages_ahead_and_behind_are_a_sign_in_the_table():
    form = derived("hexaglide", AtSymbols()).vectors
    assert form.columns["sigma_i"] == (-1, -1, 1, 1, -1, 1)
    assert set(form.columns) == {"a_iy", "psi_i", "sigma_i"}


def test_steps_that_are_asked_for_follow_the_vectors():
    derivation = rs.derive("gough-stewart-b", pose=AtSymbols(), form=Steps())
    lines = derivation_text(copy.deepcopy(derivation)).splitlines()
    assert "K_C = sum over i of w_i w_i^T / c_i" in lines
    assert "Leg 6: leg6" in lines
    assert sum(line.startswith("K_C = ") for line in lines) == 3  # both sums, and the matrix
    assert any(line.startswith("t_10 = ") for line in lines)


@pytest.mark.parametrize("name", ["hexa", "hexapod-pus"])
def test_turns_of_one_wrench_are_averaged_in_its_entries(name):
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    form = rs.derive(robot).vectors
    assert form is not None
    average = form.average
    assert average is not None
    random = np.random.default_rng(2)
    values = {k: v * random.uniform(0.98, 1.02) for k, v in robot.nominal.items()}
    own = form.components()
    ((w, c, _),) = next(form.in_each_leg(own))
    known = {s: values[s.name] for s in form.symbols}
    numbers = values_of([*w, c], known, own.definitions)
    names = ("u_x", "u_y", "u_z", "m_x", "m_y", "m_z", "c_1")
    entries = dict(zip(names, numbers, strict=True))
    at = {s: entries[s.name] for s in average.free_symbols}
    found = np.array(average.xreplace(at), dtype=float)
    wanted = rs.stiffness(robot.substituted(values)).K
    assert matrix_distance(found, wanted, 0.5) < 1e-9
    assert max(int(x.count_ops()) for x in average) < 10


EXECHON, TRICEPT = EXAMPLES / "exechon.yaml", EXAMPLES / "tricept.yaml"


@pytest.mark.parametrize(
    ("name", "pose", "lines"),
    [
        (
            "gantry-tau",
            "symbolic",
            (
                "v_ij = [0; r_ij x u_i]",
                "arm2  (a/2, w, d)          (a/2, 0, 0)     -1       f_i**2/k + l/(2*EA_1)",
                "arm3, middle  0      -4*a/3  -2*a/3",
                "K_C = sum over i of (w_i w_i^T / c_i + sum over j of v_ij v_ij^T / c_r)",
            ),
        ),
        (TRICEPT, "home", ("w_i_3 = [0; u_i]", "c_i_1 = L_i**3/(3*EI_1)", "K_C = K_1 + K_2")),
        (
            EXECHON,
            "symbolic",
            ("w_i_2 = [g_i; (a_i - p - R r_0) x g_i] - o_i w_i_3", "t_i = e_i . u_i"),
        ),
    ],
    ids=["gantry-tau", "tricept", "exechon"],
)
def test_rods_in_parallel_and_posts_are_terms_of_their_own(name, pose, lines):
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=AtSymbols() if pose == "symbolic" else None)
    form = derivation.vectors
    assert form is not None
    assert set(lines) <= set(derivation_text(derivation).splitlines())
    for language in (derivation_latex, derivation_markdown, derivation_html, derivation_typst):
        assert language(derivation)
    if pose == "symbolic":
        check_away_from_home(robot, derivation, 8)
    else:
        K = rs.stiffness(robot.numeric).K
        assert matrix_distance(in_numbers(form, robot.nominal), K, 0.5) < 1e-9


@pytest.mark.parametrize("seed", [1, 5])
def test_parallel_rods_do_not_depend_on_samples(seed, monkeypatch):
    # The share of a rod was a quotient of 120 operations, recognised as 1/2 at some samples alone.
    monkeypatch.setattr(robot_placement, "_SEED", seed)
    form = rs.derive("gantry-tau", pose=rs.AtSymbols()).vectors
    assert form is not None
    assert [str(c) for c in form.columns["c_i"]] == [
        "f_i**2/k + l/EA_1",
        "f_i**2/k + l/(2*EA_1)",
        "f_i**2/k + l/(3*EA_1)",
    ]


@pytest.mark.parametrize("pose", [AtHome(), AtSymbols()])
def test_conditions_and_vectors_are_found_when_they_are_first_looked_at(pose, monkeypatch):
    def looked_at(*_, **__):
        raise NotImplementedError

    for name in ("conditions_of", "vector_form"):
        monkeypatch.setattr(f"robostiff.analytic.robot_formula.{name}", looked_at)
    derivation = rs.derive("gough-stewart-b", pose=pose)
    assert derivation.K.shape == (6, 6)
    for name in ("conditions", "vectors"):
        with pytest.raises(NotImplementedError):
            getattr(derivation, name)


@pytest.mark.parametrize("name", ["3-rrr", "3-puu", "delta"])
def test_a_machine_of_a_hundredth_of_the_size_has_the_same_vectors(name, tmp_path):
    text = Path(robot_file(name)).read_text(encoding="utf-8")
    small = tmp_path / "small.yaml"
    small.write_text(re.sub(r"([\d.]+) mm\b", lambda own: f"{float(own[1]) / 100:g} mm", text))
    one, other = (rs.derive(robot, pose=rs.AtSymbols()).vectors for robot in (name, small))
    assert one is not None
    assert other is not None
    assert other.leg == one.leg


# Robots, and a line of their vectors; all lines are among those of all shipped robots.
WRITTEN = {
    "3-rpr-beams": "c_i_2 = L_i**3/(24*EI_y_2) - c_i_4*o_i**2 + 7*L_i**3/(24*EI_y_1)",
    "tripteron": "c_i_3 = 2*l*x_i**2/GJ_1 + 2*l*(1 - x_i**2)/EI_1",
    "orthoglide": "leg-y  (0, -l - r, 0)  (0, -r, 0)  (0, 1, 0)  (1, 0, 0)",
    "agile-eye": "K_i = W_i (W_i^T C_i W_i)^-1 W_i^T",
}


def check_away_from_home(robot, derivation, seed):
    """Compare the vectors with numbers at parameters and poses that no check of theirs has met."""
    form, random = derivation.vectors, np.random.default_rng(seed)
    assert form is not None
    compared = 0
    for _ in range(8):
        values = {k: v * random.uniform(0.98, 1.02) for k, v in robot.nominal.items()}
        numeric = robot.substituted(values)
        finder = posture_finder(numeric)
        places = numeric.coordinate_places
        size = np.where(np.array(places) < 3, finder.length, 1.0)
        away = 0.2 * size * random.uniform(-1, 1, len(places))
        posture = finder.find(finder.home_pose[places] + away)
        if not posture.reached[0]:
            continue
        x, y, z, *turn = posture.pose[0]
        alpha, beta, gamma = Rotation.from_rotvec(turn).as_euler("xyz")
        known = {"x": x, "y": y, "z": z, "alpha": alpha, "beta": beta, "gamma": gamma}
        known |= {f"{name}_P": x for name, x in known.items()}  # beside parameters of the name
        pose = RigidTransform.from_components((x, y, z), Rotation.from_rotvec(turn))
        result = rs.stiffness(numeric, pose)
        at = values | {name: known[name] for name in derivation.coordinates}
        assert matrix_distance(in_numbers(form, at), result.K, finder.length) < 1e-9
        compared += 1
    assert compared >= 3


@pytest.mark.parametrize("name", [*WRITTEN, "hexaglide", "hexa", "3-puu", "delta"])
def test_they_have_the_stiffness_of_the_robot_away_from_home(name):
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    check_away_from_home(robot, derived(name, AtSymbols()), seed=7)


OUTER = "outer link, to: [0, l, 0], material: "
TUBE = "section: {tube: {outer_diameter: 16 mm, inner_diameter: 12 mm}}"
FLAT = "section: {rectangle: {width_y: 10 mm, height_z: 20 mm}}"
HALVES = "        - {share: 0.5, material: steel, section: near}\n"
HALVES += "        - {share: 0.5, material: steel, section: far}\n"
JOINT = "    - {type: revolute, name: platform joint"
TWIST = "    - {type: spring, name: twist, compliance: [0, 0, 0, 500/kt, 0, 0]}\n"
#: Files with something else in them, lines of their vectors, and a seed.
CHANGED: dict[str, tuple[str, dict[str, str], tuple[str, ...], int]] = {
    "links of two materials have a matrix of compliances": (
        "tripteron",
        {f"{OUTER}aluminium": f"{OUTER}steel"},
        (
            "c_i_11 = 1/k + l**3/(3*EI_2) + l**3/(3*EI_1)",
            "c_i_12 = -h_i*l**2/(2*EI_1)",
            "c_i_22 = l/GJ_2 + f_i**2*l/GJ_1 + h_i**2*l/EI_1",
            "w_i_1 = [e_i; (b_i - l u_i) x e_i]",
            "C_i = [c_i_11, c_i_12, c_i_13; c_i_12, c_i_22, c_i_23; c_i_13, c_i_23, c_i_33]",
        ),
        11,
    ),
    # There a force and a couple share no energy, as in textbooks: L^3/(12 EI) and L/(EI).
    "a strut of one beam holds across at its middle": (
        "3-rpr-beams",
        {HALVES: "        - {share: 1, material: steel, section: near}\n"},
        (
            "w_i_2 = [e_i; (R b_i - L_i/2 u_i) x e_i]",
            "c_i_2 = L_i**3/(12*EI_y_1)",
            "c_i_4 = L_i/EI_y_1",
        ),
        3,
    ),
    # Only one of the springs is the column k_i; the other is in the column of its compliance.
    "springs of two wrenches differ between the legs": (
        "3-rpr-beams",
        {f"k: {k} N/m}}": f"k: {k} N/m, kt: {k} N m/rad}}" for k in ("1e6", "1.5e6", "8e5")}
        | {JOINT: TWIST + JOINT},
        (),
        4,
    ),
    "cranks in space hold out of their plane as well": (
        "3-rrr",
        {"planar: true\n": ""},
        ("w_i_2 = [e_i; (Q b_i - l2 u_i) x e_i]", "c_i_22 = l1**3/(3*EI_y_1) + l2**3/(3*EI_y_1)"),
        5,
    ),
    **{
        f"sheared bars bend about the axis across their pins, {axis}": (
            "orthoglide",
            {TUBE: f"y_axis: {axis}\n          {FLAT}"},
            (f"1/(6*{EI}*w**2/l**3",),
            2,
        )
        for axis, EI in (("y", "EI_z_1"), ("z", "EI_y_1"))
    },
}


@pytest.mark.parametrize("case", CHANGED)
def test_vectors_of_robots_with_other_parts(case, tmp_path: Path):
    name, changes, lines, seed = CHANGED[case]
    text = robot_file(name).read_text(encoding="utf-8")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=AtSymbols())
    written, form = derivation_text(derivation), derivation.vectors
    assert form is not None
    assert [line for line in lines if line not in written] == []
    if "springs of two" in case:
        assert set(form.columns) == {"a_ix", "a_iy", "b_ix", "b_iy", "k_i", "c_i_3"}
        assert all(x.is_number or x.is_Symbol for x in form.columns["k_i"])
        assert len(set(form.columns["k_i"])) == 3
    if "in space" in case:
        assert form.coupled[0] == ("c_i_11", "", "", "")
    check_away_from_home(robot, derivation, seed)


@pytest.mark.parametrize("name", ["tripteron", "agile-eye"])
def test_at_home_their_entries_are_shorter(name):
    assert rs.derive(name, symbols=rs.ALL_PARAMETERS).vectors is None


def test_a_planar_chain_is_a_sum_of_springs_at_any_joint_coordinates():
    robot = rs.load(FILES / "planar-chain.yaml", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=AtSymbols())
    assert derivation.named is not None
    (leg,) = derivation.named.legs
    (c,), (w,) = leg.compliances, leg.wrenches
    q1, q2 = sp.symbols("q1 q2", real=True)
    k, l_1, l_2, EA, EI = sp.symbols("k l_1 l_2 EA_1 EI_z_1", positive=True)
    named = {d.symbol: d.expression for d in derivation.named.definitions}
    assert w == sp.Matrix([sp.cos(q1 + q2), sp.sin(q1 + q2), 0])
    met = named[c]
    across = sp.sin(q2) ** 2 * (l_1**2 / k + l_1**3 / (3 * EI))
    assert sp.expand(met - across - l_1 * sp.cos(q2) ** 2 / EA - l_2 / EA) == 0
    at = rs.JointCoordinates([0.3, 0.9, 0.2])
    values = {"q1": 0.3, "q2": 0.9, **{k: float(v) for k, v in robot.nominal.items()}}
    wanted = rs.stiffness(robot.numeric, at).K
    found = np.array(derivation.K.subs({s: values[s.name] for s in derivation.symbols}), float)
    assert np.allclose(found, wanted, rtol=1e-9, atol=1e-3)


def test_the_link_of_the_paper_is_the_same_at_all_joint_coordinates():
    robot = rs.load("planar-link", symbols=rs.ALL_PARAMETERS)
    at_home, anywhere = rs.derive(robot), rs.derive(robot, pose=AtSymbols())
    assert at_home.named is not None
    assert anywhere.named == at_home.named

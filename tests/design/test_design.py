"""Optima, gradients and spreads: laws, several poses, and what is refused."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.io.document import read_document
from robostiff.kinematics import with_masses
from robostiff.robots import robot_file
from tests.identification.campaigns import hexapod_campaign, hexapod_frames

POSES = np.array([[0, 0, 0.8, 0, 0, 0], [0.1, 0, 0.8, 0, 0.1, 0], [0, 0.1, 0.75, 0.1, 0, 0.2]])
RANGES = {"R": (0.2, 2.0), "r": (0.1, 1.0)}


@pytest.fixture(scope="module")
def platform() -> rs.Robot:
    return rs.load("gough-stewart-b", symbols=("R", "r", "k"))


@pytest.mark.parametrize("combine", [rs.Worst(), rs.Mean(), rs.PNorm(8)])
def test_no_design_nearby_is_better(platform, combine):
    """Also at the symmetric pose, where the largest two eigenvalues meet."""

    def objective(R: float, r: float) -> float:
        robot = platform.substituted({"R": R, "r": r}).numeric
        C = rs.compliance(robot, POSES)[:, :3, :3]
        worst = np.linalg.eigvalsh(C)[:, -1]
        if isinstance(combine, rs.PNorm):
            return float(np.mean(worst**combine.p) ** (1 / combine.p))
        return float(np.max(worst) if isinstance(combine, rs.Worst) else np.mean(worst))

    found = rs.optimise(platform, rs.WorstDeflection(), RANGES, poses=POSES, combine=combine)
    assert found.ending is rs.Ending.OPTIMUM
    R, r = found.values["R"], found.values["r"]
    best = objective(R, r)
    assert best == pytest.approx(found.objective, rel=1e-9)
    assert found.objective < 0.5 * found.at_start
    for dR, dr in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1)):
        assert objective(R * (1 + 0.02 * dR), r * (1 + 0.02 * dr)) > best


@pytest.mark.parametrize("name", ["delta", "3-rrr"])
def test_legs_that_close_exactly_have_room(name):
    """Twice the stiffness of the drives is at an end of its range, and no limit of the legs."""
    robot = rs.load(name, symbols=("k",))
    k = robot.nominal["k"]
    found = rs.optimise(robot, rs.WorstDeflection(), {"k": (0.5 * k, 2 * k)})
    assert (found.ending, found.at_limits) == (rs.Ending.OPTIMUM, ("k",))
    assert found.values["k"] == pytest.approx(2 * k)


def test_legs_keep_closing_on_the_way_to_an_optimum():
    """The wider the base of a crank robot, the stiffer, until its rods no longer reach."""
    robot = rs.load("delta", symbols=("R",))
    home = robot.nominal["R"]
    found = rs.optimise(
        robot, rs.EntryOf(rs.ComplianceMatrix(), (0, 0)), {"R": (0.5 * home, 20 * home)}
    )
    assert rs.stiffness(found.robot).answered


@pytest.mark.parametrize("name", ["hexapod", "six-joint-arm", "3-prs"])
def test_total_mass_is_that_of_the_posture(name):
    robot = rs.load(name)
    posture = rs.find_posture(robot)
    snapshot = with_masses(posture)
    parts = [*snapshot.masses, *(mass for leg in snapshot.legs for mass in leg.all_masses)]
    total = sum(float(np.ravel(mass.value)[0]) for mass in parts)
    fast = rs.compile(robot, [rs.StiffnessMatrix(), rs.TotalMass()], backend=rs.Backend.ARRAYS)
    pose = posture.pose[:, robot.coordinate_places]
    if robot.is_posed_by_joints:
        pose = rs.JointCoordinates(posture.coordinates[0])
    assert fast.evaluate(pose).values["mass"][0] == pytest.approx(total, rel=1e-12)
    assert total > 0


def test_mass_of_a_flexible_platform_and_of_a_linkage():
    """Parts of the platform count; what has no masses is not taken for light."""
    robot = rs.load(Path(__file__).parents[2] / "docs" / "star-platform.yaml")
    snapshot = with_masses(rs.find_posture(robot)).one(0)
    assert snapshot.platform is not None
    parts = [mass for several in snapshot.platform.masses.values() for mass in several]
    parts += [mass for leg in snapshot.legs for mass in leg.all_masses] + list(snapshot.masses)
    total = sum(float(np.ravel(mass.value)[0]) for mass in parts)
    fast = rs.compile(robot, [rs.TotalMass()], backend=rs.Backend.ARRAYS)
    home = rs.find_posture(robot).pose[:, robot.coordinate_places]
    assert fast.evaluate(home).values["mass"][0] == pytest.approx(total, rel=1e-12)
    with pytest.raises(rs.NoAnswerError, match="its record has none"):
        rs.compile(rs.load_linkage("double-pantograph"), [rs.TotalMass()])
    with pytest.raises(rs.NoAnswerError, match="no mass of 'gough-stewart-b': its parts have none"):
        rs.compile(rs.load("gough-stewart-b"), [rs.TotalMass()])


@pytest.mark.parametrize("name", ["gough-stewart-b", "3-prs", "six-joint-arm"])
def test_a_gradient_has_the_derivatives_of_each_input(name):
    """One sweep back, and one forward an input: also where legs are closed by steps."""
    robot = rs.load(name)
    entry = rs.EntryOf(rs.StiffnessMatrix(), (2, 2))
    by = [c.value for c in robot.coordinates] or [f"q{i}" for i in range(6)]
    if robot.is_posed_by_joints:
        by = [f"q{i}" for i in range(6)]
    outputs = [rs.Gradient(entry, by), *(rs.Derivative(entry, each) for each in by)]
    fast = rs.compile(robot, outputs, backend=rs.Backend.ARRAYS)
    posture = rs.find_posture(robot)
    pose = posture.pose[:, robot.coordinate_places] + 0.01
    if robot.is_posed_by_joints:
        pose = rs.JointCoordinates(posture.coordinates[0] + 0.3)
    values = fast.evaluate(pose).values
    each = np.array([values[output.name][0] for output in outputs[1:]])
    np.testing.assert_allclose(values["dK[2, 2]"][0], each, rtol=1e-9, atol=1e-9 * np.max(each))


def test_outputs_that_are_computed_again_at_guarded_poses():
    robot = replace(rs.load("gough-stewart-a"), platform_masses=(rs.Mass(9.0),))
    wrench = [1.0, 2.0, 3.0, 0, 0, 0]
    outputs = [rs.EntryOf(rs.StiffnessMatrix(), (1, 1)), rs.TotalMass()]
    answer = rs.compile(robot, outputs).evaluate([[0, 0, 0.8, 0, 1e-6, 0]])
    assert answer.guarded.all()
    K = rs.stiffness(robot, [0, 0, 0.8, 0, 1e-6, 0]).K
    assert answer.values["K[1, 1]"][0] == pytest.approx(K[1, 1], rel=1e-9)
    assert answer.values["mass"][0] == 9.0
    bent = rs.compile(rs.load("gough-stewart-b"), [rs.DisplacementUnder(wrench)])
    t = rs.deflection(rs.load("gough-stewart-b"), POSES[1], wrench=wrench).twist
    assert bent.evaluate(POSES[1:2]).values["displacement"][0] == pytest.approx(
        float(np.linalg.norm(t[:3])), rel=1e-9
    )


def test_the_same_seed_gives_the_same_robots(platform):
    spread = {"k": rs.Uniform(0.1)}
    one, two, other = (rs.tolerances(platform, spread, samples=64, seed=s) for s in (1, 1, 2))
    assert np.array_equal(one.samples["worst_deflection"], two.samples["worst_deflection"])
    assert not np.array_equal(one.samples["worst_deflection"], other.samples["worst_deflection"])


def test_a_spread_stiffness_spreads_the_deflection_by_its_reciprocal(platform):
    found = rs.tolerances(platform, {"k": rs.Uniform(0.2)}, samples=2**12)
    nominal = found.nominal["worst_deflection"][0]
    for q in (0.05, 0.5, 0.95):
        value, error = found.quantile("worst_deflection", q)
        exact = nominal / (0.8 + 0.4 * (1 - q))
        assert abs(value[0] - exact) < 1e-3 * exact + 5 * error[0]


WIDE = [
    ("gough-stewart-b", "R", (-0.5, 900.0)),
    pytest.param("six-joint-arm", "height", (-0.45, 1.0), marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("name", "variable", "ends"), WIDE)
def test_poses_without_an_answer_on_the_way_do_not_stop_a_search(name, variable, ends):
    """Near singular ones, and values of no robot."""
    robot = rs.load(name, symbols=(variable,))
    found = rs.optimise(robot, rs.WorstDeflection(), {variable: ends}, combine=rs.PNorm())
    assert found.ending is not rs.Ending.INFEASIBLE
    assert found.objective <= found.at_start
    assert rs.stiffness(found.robot).answered


def test_an_output_of_the_record_alone_is_no_number_at_guarded_poses():
    """Nothing confirms it there, and the status says so."""

    @dataclass(frozen=True)
    class Stiffest:
        name = "stiffest"

        def shape(self, space):
            return ()

        def entries(self, robot):
            return [robot.K[0, 0]]

    poses = [[0, 0, 0.8, 0, 1e-6, 0], [0.1, 0, 0.8, 0, 0.1, 0.5]]
    answer = rs.compile(rs.load("gough-stewart-a"), [Stiffest()]).evaluate(poses)
    assert answer.guarded.tolist() == [True, False]
    assert np.isnan(answer.values["stiffest"]).tolist() == [True, False]
    assert rs.Status.ILL_CONDITIONED in rs.Status(int(answer.status_codes[0]))


def test_limits_that_cannot_be_kept_are_said(platform):
    tight = [rs.Within(rs.WorstDeflection(), most=1e-12)]
    found = rs.optimise(platform, rs.WorstDeflection(), RANGES, constraints=tight)
    assert found.ending is rs.Ending.INFEASIBLE
    assert "widen the ranges" in found.ending.advice
    assert (found.status, found.advice) == (rs.Ending.INFEASIBLE, (found.ending.advice,))
    with pytest.raises(rs.NoAnswerError, match="no best values"):
        found.write("best.yaml", "gough-stewart-b.yaml")


def test_an_objective_and_a_limit_under_two_wrenches(platform):
    """Both are called displacement; one stood for the other."""
    down, across = np.eye(6)[2] * 1000, np.eye(6)[0] * 1000
    most = 6e-6
    found = rs.optimise(
        platform,
        rs.DisplacementUnder(down),
        RANGES,
        poses=POSES,
        constraints=[rs.Within(rs.DisplacementUnder(across), most=most)],
    )
    sink, shift = (
        np.linalg.norm(rs.deflection(found.robot.numeric, POSES, F).twist[:, :3], axis=1).max()
        for F in (down, across)
    )
    assert found.ending is rs.Ending.OPTIMUM
    assert found.objective == pytest.approx(sink, rel=1e-9)
    assert shift == pytest.approx(most, rel=1e-5)
    free = rs.optimise(platform, rs.DisplacementUnder(down), RANGES, poses=POSES)
    assert free.objective < 0.9 * found.objective


@pytest.mark.filterwarnings("ignore:.*best.yaml.*nothing in the file uses 'w'")
def test_best_values_are_written_into_a_copy_of_the_model_file(tmp_path):
    """In the units of the file, also where a sum or a bare number stood; all else stays."""
    lines = robot_file("gough-stewart-b").read_text().splitlines()
    changed = {"  R: 500 mm ": "  R: 300 mm + w ", "  r: 300 mm ": "  w: 20 cm\n  r: 300 mm ",
               "  k: 1e8 N/m ": "  k: '0.1 kN/um' "}  # fmt: skip
    text = "\n".join(lines) + "\n"
    for old, new in changed.items():
        assert old in text
        text = text.replace(old, new)
    source, best = tmp_path / "my.yaml", tmp_path / "best.yaml"
    source.write_text(text)
    robot = rs.load(source, symbols=("R", "r", "k"))
    ranges = {**RANGES, "k": (9e7, 1.25e8)}
    found = rs.optimise(robot, rs.WorstDeflection(), ranges, poses=POSES)
    found.write(best, source)
    values = rs.load(best, symbols=("R", "r", "k")).nominal
    assert values == pytest.approx(found.values, rel=1e-11)
    assert source.read_text() == text
    pairs = zip(text.splitlines(), best.read_text().splitlines(), strict=True)
    old, new = map(list, zip(*(pair for pair in pairs if pair[0] != pair[1]), strict=True))
    assert [line.split(":")[0].strip() for line in old] == ["R", "r", "k"]
    assert [line.partition("#")[2] for line in old] == [line.partition("#")[2] for line in new]
    assert [line.split("#")[0].split(maxsplit=2)[2].strip() for line in new] == [
        "m",
        "mm",
        "kN/um'",
    ]
    assert new[2].startswith("  k: '0.125 kN/um'")
    K = rs.stiffness(rs.load(best)).K
    np.testing.assert_allclose(K, rs.stiffness(found.robot).K, rtol=1e-9, atol=1e-9 * K.max())


def test_best_values_are_written_into_json(tmp_path, platform):
    source, best = tmp_path / "my.json", tmp_path / "best.json"
    data = read_document(robot_file("gough-stewart-b")).data
    source.write_text(json.dumps(data, indent=1))
    found = rs.optimise(platform, rs.WorstDeflection(), {"R": (0.3, 2.0)})
    found.write(best, source)
    again = json.loads(best.read_text())
    assert {**again["parameters"], "R": 0} == {**data["parameters"], "R": 0}
    assert rs.load(best, symbols=("R",)).nominal["R"] == pytest.approx(found.values["R"])


def test_where_best_values_are_not_written(tmp_path, platform):
    source = tmp_path / "my.yaml"
    source.write_text(text := robot_file("gough-stewart-b").read_text())
    found = rs.optimise(platform, rs.WorstDeflection(), {"R": (0.3, 2.0)})
    with pytest.raises(rs.InputError, match=r"file to write: .* expected a new file"):
        found.write(source, source)
    with pytest.raises(rs.InputError, match="parameter R"):
        found.write(tmp_path / "best.yaml", robot_file("agile-eye"))
    assert source.read_text() == text
    assert [own.name for own in tmp_path.iterdir()] == ["my.yaml"]


def test_sobol_indices_are_those_of_the_closed_form():
    """C_zz = (R^2 - R r + h^2 + r^2) / (6 h^2 k), eq. (28): a function of R times one of k."""
    robot = rs.load("gough-stewart-b", symbols=("R", "k"))
    spreads = {"k": rs.Uniform(0.2), "R": rs.Uniform(0.6)}
    output = rs.EntryOf(rs.ComplianceMatrix(), (2, 2))
    found = rs.sobol_indices(robot, spreads, output, samples=2**13)
    s, w = np.polynomial.legendre.leggauss(60)
    R, k = 0.5 * (1 + 0.6 * s), 1 + 0.2 * s
    parts = {"R": R**2 - R * 0.3 + 0.8**2 + 0.3**2, "k": 1 / k}
    mean = {name: np.sum(w * y) / 2 for name, y in parts.items()}
    var = {name: np.sum(w * (y - mean[name]) ** 2) / 2 for name, y in parts.items()}
    whole = var["R"] * var["k"] + var["R"] * mean["k"] ** 2 + var["k"] * mean["R"] ** 2
    for name, other in (("R", "k"), ("k", "R")):
        alone = var[name] * mean[other] ** 2 / whole
        with_all = var[name] * (mean[other] ** 2 + var[other]) / whole
        assert found[name] == pytest.approx((alone, with_all), abs=0.01)
        assert with_all - alone > 3e-4


def test_errors_of_an_identification_go_together():
    """Six struts whose compliances are known together: first order, and many robots, agree."""
    found = rs.identify(
        rs.load("hexapod"), hexapod_campaign(), ["leg*/strut"], frames=hexapod_frames()
    )
    spread = rs.tolerances(found.robot, found, samples=2**11)
    name = "worst_deflection"
    assert list(spread.deviations) == list(found.names)
    np.testing.assert_allclose(list(spread.deviations.values()), list(found.std.values()))
    expected = float(rs.compliance(found.robot)[2, 2])
    assert expected > 0
    np.testing.assert_allclose(np.cov(spread.drawn.T), found.covariance,
                               atol=0.1 * np.diag(found.covariance).max())  # fmt: skip
    assert spread.first_order(name)[0] == pytest.approx(spread.deviation(name)[0], rel=0.05)
    g = spread.rates[name][0]
    assert spread.first_order(name)[0] == pytest.approx((g @ found.covariance @ g) ** 0.5)
    alone = np.sqrt(np.sum((g * np.array(list(found.std.values()))) ** 2))
    assert not np.isclose(alone, spread.first_order(name)[0], rtol=0.01, atol=0)
    assert sum(spread.shares(name).values()) == pytest.approx(1.0)


def test_histograms_and_ranks(platform):
    """A stiffness has all of the variance that a radius beside it hardly has; ranks say so, too."""
    spread = {"k": rs.Uniform(0.3), "R": rs.Normal("0.5 mm")}
    found = rs.tolerances(platform, spread, samples=2**12)
    counts, edges = found.histogram("worst_deflection", 16)
    assert counts.sum() == 2**12
    assert edges[0] == found.samples["worst_deflection"].min()
    ranks = found.rank_correlations("worst_deflection")
    assert ranks["k"] < -0.99
    assert abs(ranks["R"]) < 0.15
    for asked in (lambda: found.histogram("mass"), lambda: found.histogram("worst_deflection", 0),
                  lambda: found.rank_correlations("worst_deflection", 1)):  # fmt: skip
        with pytest.raises(rs.InputError):
            asked()


def test_a_length_below_a_root_may_stand_in_a_denominator():
    """The base of the rods of a US/UPS is turned by an angle whose cosine is one of its height."""
    robot = rs.load("us-ups", symbols=("h",))
    values = {"h": 1.01 * robot.nominal["h"]}
    pose = rs.find_posture(robot.numeric).pose[0, robot.coordinate_places]
    value, _ = rs.value_and_gradient(robot, rs.WorstDeflection(), ["h"], pose)([values["h"]])
    exact = rs.indices(rs.load("us-ups", values), pose).worst_deflection.translational
    assert value[0] == pytest.approx(exact, rel=1e-9)


def test_a_spread_in_a_text_is_in_any_unit_of_its_parameter() -> None:
    robot = rs.load("gough-stewart-b", symbols=("R", "k"))
    assert robot.units == {"R": "m", "k": "N/m"}
    for text, size in ("1 mm", 1e-3), ("0.001 m", 1e-3), ("1000 um", 1e-3):
        found = rs.tolerances(robot, {"R": rs.Normal(text)}, samples=8)
        assert found.deviations["R"] == pytest.approx(size, rel=1e-12)
    with pytest.raises(rs.InputError, match=r"the same dimension as 0\.5 m"):
        rs.tolerances(robot, {"R": rs.Normal("0.1")}, samples=8)
    part = rs.tolerances(robot, {"R": rs.Normal(0.1)}, samples=8)
    assert part.deviations["R"] == pytest.approx(0.05, rel=1e-12)


def test_a_hybrid_machine_has_the_units_of_its_modules() -> None:
    tripod = rs.load("3-prs", symbols=("R",))
    machine = rs.hybrid_machine([rs.Module("tripod", tripod)])
    assert machine.units == tripod.units == {"R": "m"}
    assert machine.meanings == tripod.meanings


@pytest.mark.parametrize("p", [3, 40, 300])
def test_norms_of_small_numbers_are_no_zeros(platform, p: float):
    """Powers of 1e-8 are below all floats."""
    found = rs.optimise(platform, rs.WorstDeflection(), RANGES, poses=POSES, combine=rs.PNorm(p))
    each = np.linalg.eigvalsh(rs.compliance(found.robot.numeric, POSES)[:, :3, :3])[:, -1]
    largest = each.max()
    expected = largest * np.mean((each / largest) ** p) ** (1 / p)
    assert found.objective == pytest.approx(expected, rel=1e-9)
    assert found.ending is rs.Ending.OPTIMUM


def test_norms_of_numbers_of_both_signs_are_of_their_sizes(platform):
    """The cube of a negative number is no part of a mean: 0 is the least that a norm can be."""
    entry = rs.EntryOf(rs.ComplianceMatrix(), (0, 2))
    found = rs.optimise(platform, entry, RANGES, poses=POSES[1:], combine=rs.PNorm(3))
    each = np.abs(rs.compliance(found.robot.numeric, POSES[1:])[:, 0, 2])
    assert found.objective == pytest.approx(np.mean(each**3) ** (1 / 3), rel=1e-6, abs=1e-18)


def test_a_limit_of_zero_is_beside_the_numbers(platform):
    """No compliance is zero, be it as small as 1e-9 m/N."""
    limit = rs.Within(rs.EntryOf(rs.ComplianceMatrix(), (2, 2)), most=0.0)
    found = rs.optimise(
        platform, rs.WorstDeflection(), RANGES, poses=POSES[1:2], constraints=[limit]
    )
    assert found.ending is rs.Ending.INFEASIBLE
    assert not any("compliance" in words for words in found.at_limits)


def test_what_no_parameter_changes_has_no_shares():
    robot = rs.load("examples/exechon.yaml", symbols=("k",))
    outputs = rs.TotalMass(), rs.WorstDeflection()
    found = rs.tolerances(robot, {"k": rs.Uniform(0.1)}, outputs, samples=64)
    for shares in found.shares, found.rank_correlations:
        with pytest.raises(rs.NoAnswerError, match="no shares of 'mass': none of these parameters"):
            shares("mass")
    assert "share of the variance" in found._repr_html_()

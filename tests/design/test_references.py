"""Rates, spreads and an optimum of hexapods against references of 40 digits."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs

DATA = Path(__file__).parent / "data" / "gradient_and_optimum.json"
CASES = json.loads(DATA.read_text("utf-8"))
RATES, OPTIMUM = CASES["gradient"], CASES["optimise"]
COORDINATES = ("x", "y", "z")
PARAMETERS = [name for name in RATES["rates"] if name not in COORDINATES]
AREAS = [f"A{i}" for i in range(1, 7)]


@pytest.fixture(scope="module")
def hexapod(tmp_path_factory) -> rs.Robot:
    file = tmp_path_factory.mktemp("models") / "hexapod.yaml"
    file.write_text(RATES["model_yaml"])
    return rs.load(file, symbols=PARAMETERS)


class Work:
    """Work of the wrench of the case on its deflection, an output of one number."""

    name = "work"
    wrench = tuple(OPTIMUM["wrench_about_reference"])

    def shape(self, space: Any) -> tuple[int, ...]:
        return ()

    def entries(self, robot: Any) -> list[Any]:
        moved = rs.DeflectionUnder(self.wrench).entries(robot)
        return [sum(F * t for F, t in zip(self.wrench, moved, strict=True))]


@cache
def struts(folder: Path) -> rs.Robot:
    """Six struts whose stiffness and mass follow from the areas of their sections."""
    legs = []
    for i, (base, at) in enumerate(zip(OPTIMUM["base"], OPTIMUM["platform"], strict=True), 1):
        length = f"{OPTIMUM['lengths'][i - 1][:18]} m"
        places = ["[" + ", ".join(f"{x} m" for x in p) + "]" for p in (base, at)]
        legs.append(
            f"""
  - name: leg{i}
    base: {{at: {places[0]}}}
    chain:
      - {{type: universal, axes: [y, x], role: passive}}
      - {{type: prismatic, axis: z, role: actuated, stiffness: "210 GPa * A{i} / ({length})"}}
      - {{type: rigid, name: body, to: [0, 0, 0], mass: "7850 kg/m^3 * A{i} * {length}"}}
      - {{type: spherical, role: passive}}
    platform: {{at: {places[1]}}}"""
        )
    parameters = "".join(f"\n  {name}: 600 mm^2" for name in AREAS)
    file = folder / "struts.yaml"
    file.write_text(
        f"robostiff: 1\nname: struts\nsource: chosen numbers\nparameters:{parameters}\n"
        f"home: {{at: [0, 0, 900 mm]}}\nlegs:{''.join(legs)}\n"
    )
    return rs.load(file, symbols=AREAS)


@pytest.fixture(scope="module")
def six_struts(tmp_path_factory) -> rs.Robot:
    return struts(tmp_path_factory.mktemp("models"))


def test_gradients_by_42_parameters_and_the_pose(hexapod):
    outputs = [rs.WorstDeflection(), rs.DisplacementUnder(RATES["wrench"])]
    by = list(RATES["rates"])
    fast = rs.compile(
        hexapod, [*outputs, *(rs.Gradient(x, by) for x in outputs)], parameters=PARAMETERS
    )
    found = fast.evaluate([RATES["pose"]]).values
    assert found["worst_deflection"][0] == pytest.approx(float(RATES["worst"]), rel=1e-13)
    assert found["displacement"][0] == pytest.approx(float(RATES["under_load"]), rel=1e-13)
    expected = np.array([RATES["rates"][name] for name in by], dtype=float).T
    np.testing.assert_allclose(found["dworst_deflection"][0], expected[0], rtol=1e-10)
    np.testing.assert_allclose(found["ddisplacement"][0], expected[1], rtol=1e-10)


def test_a_gradient_takes_some_three_times_the_operations(six_struts):
    def operations(*outputs: rs.WorstDeflection | rs.Gradient) -> int:
        return rs.compile(
            six_struts, outputs, parameters=AREAS, backend=rs.Backend.ARRAYS
        ).kernel.operations

    worst = rs.WorstDeflection()
    by = [*AREAS, "x", "y", "z", "rx", "ry", "rz"]
    assert operations(worst, rs.Gradient(worst, by)) < 3.2 * operations(worst)


def test_spreads_of_a_hexapod(hexapod):
    """Quantiles, of which the reference has errors of its own; shares to first order."""
    spreads = {"k*": rs.Uniform(0.2), "b*": rs.Normal("0.2 mm"), "p*": rs.Normal("0.2 mm")}
    found = rs.tolerances(hexapod, spreads, poses=[RATES["pose"]], samples=2**15)
    expected = RATES["tolerances"]
    for q, reference in expected["quantiles_of_worst"].items():
        value, error = found.quantile("worst_deflection", float(q))
        apart = abs(value[0] - reference["value"])
        assert apart < 4 * np.hypot(error[0], reference["standard_error"])
    assert found.mean("worst_deflection")[0] == pytest.approx(expected["mean"], rel=1e-4)
    assert found.deviation("worst_deflection")[0] == pytest.approx(expected["std"], rel=5e-3)
    first = found.first_order("worst_deflection")[0]
    assert first == pytest.approx(expected["first_order_std"], rel=1e-12)
    shares = found.shares("worst_deflection")
    for name, share in expected["first_order_shares"].items():
        assert shares[name] == pytest.approx(share, rel=1e-10)
    assert sum(shares.values()) == pytest.approx(1.0)
    # pz1, 0.6 mm, changes its sign beyond three standard deviations.
    assert 0.998 < found.answered < 0.9995


def test_struts_of_least_work_for_their_mass(six_struts):
    """Areas in proportion to the forces of the struts."""
    found = rs.optimise(
        six_struts,
        Work(),
        dict.fromkeys(AREAS, (1e-5, 5e-3)),
        poses=[OPTIMUM["pose"]],
        constraints=[rs.mass_below(OPTIMUM["mass"])],
    )
    assert found.ending is rs.Ending.OPTIMUM
    assert found.at_limits == ("mass at most 30",)
    assert found.objective == pytest.approx(float(OPTIMUM["least_work"]), rel=1e-12)
    areas = np.array([found.values[name] for name in AREAS])
    np.testing.assert_allclose(areas, np.array(OPTIMUM["optimal_areas"], dtype=float), rtol=1e-6)
    bent = rs.deflection(found.robot, OPTIMUM["pose"], wrench=Work.wrench)
    assert float(np.dot(Work.wrench, bent.twist)) == pytest.approx(found.objective, rel=1e-9)


def test_work_and_its_gradient_with_equal_areas(six_struts):
    number = rs.value_and_gradient(six_struts, Work(), AREAS, [OPTIMUM["pose"]])
    lengths = np.array(OPTIMUM["lengths"], dtype=float)
    area = OPTIMUM["mass"] / (OPTIMUM["density"] * np.sum(lengths))
    value, rates = number([area] * 6)
    assert value[0] == pytest.approx(float(OPTIMUM["work_with_equal_areas"]), rel=1e-12)
    expected = np.array(OPTIMUM["gradient_of_work_at_equal_areas"], dtype=float)
    np.testing.assert_allclose(rates[0], expected, rtol=1e-10)

"""Many poses, those without an answer among good ones: every question answers as for each alone.

The good poses give the numbers that they give alone; the others a status, and no number.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.analysis.measures import values_of
from robostiff.cli.main import app
from robostiff.errors import NoAnswerError
from tests.analysis.kernels.cases import every_output, row
from tests.generators.kernel_robots import drives_only_arm, flat_struts, rigid_cranks
from tests.generators.planted_poses import PoseSpace

# Planted poses reach far beyond what a user would ask for.
pytestmark = pytest.mark.filterwarnings("ignore::robostiff.errors.PlausibilityWarning")

ARRAYS = rs.Backend.ARRAYS
#: K has full rank there by its geometry, and no digit of its inverse holds.
LOST = [0.05, 0.02, 0.8, 0, 0, np.pi / 2 - 1e-8]
HALF = np.pi / 2
ILL = int(rs.Status.ILL_CONDITIONED)


def batch(name: str) -> tuple[rs.Robot, Any]:
    """A robot at good and bad poses: singular, so nearly that no digit holds, out of reach."""
    rng = np.random.default_rng(5)
    if name == "hexapod of beams":
        robot = rs.load("gough-stewart-b-beams")
        rows = [LOST, [*LOST[:5], 0.1], [*LOST[:5], HALF], [*LOST[:5], HALF - 1e-3]]
        return robot, np.array([*rows, [0, 0, 0, 0, 0, 0], [0.1, 0.1, 0.7, 0.1, 0, 0.2]])
    if name == "meeting legs":
        robot = rs.load("gough-stewart-a")
        home = PoseSpace(robot).home
        steps = [0, 1e-12, 1e-9, 1e-7, 1e-4, 1e-2]
        return robot, np.array([home + size * np.arange(1, 7) for size in steps])
    if name == "flat struts":
        robot = flat_struts()
        home = PoseSpace(robot).home
        rows = [home + size * rng.uniform(-1, 1, 3) for size in (0, 1e-10, 1e-7, 1e-4, 0.1, 0.2)]
        return robot, np.array(rows)
    if name == "rigid cranks":
        robot = rigid_cranks()
        rows = PoseSpace(robot).drawn(rng, 5, 0.2)
        return robot, np.array([*rows, [0, 0, 0], [5.0, 0, 0], [0.1, 0, 0]])
    if name == "drives only":
        robot = drives_only_arm()
        space = PoseSpace(robot)
        return robot, space.pose(np.array([space.home, 0 * space.home, *space.drawn(rng, 4)]))
    robot = rs.load(name)
    space = PoseSpace(robot)
    rows = [space.home, *space.drawn(rng, 3, 0.05), space.home + 40.0 * space.step]
    return robot, space.pose(np.array(rows))


NAMES = (
    "hexapod of beams", "meeting legs", "flat struts", "rigid cranks", "drives only",
    "3-rrr", "3-rps", "planar-link", "3-rpr", "six-joint-arm", "delta",
)  # fmt: skip


def count_of(pose: Any) -> int:
    return len(np.asarray(pose.values if isinstance(pose, rs.JointCoordinates) else pose))


def same(found: np.ndarray, expected: np.ndarray, rtol: float) -> bool:
    return bool(np.abs(found - expected).max() <= rtol * np.abs(expected).max())


@pytest.mark.parametrize("name", NAMES)
def test_compliance(name: str):
    robot, pose = batch(name)
    at = np.array([0.1, -0.2, 0.1 * (robot.space.size == 6)])
    result, found = rs.stiffness(robot, pose), rs.compliance(robot, pose, at=at)
    known = result.has_compliance
    missing = np.ma.getmaskarray(found).any((-1, -2))
    assert np.array_equal(missing, ~known)
    assert np.isfinite(np.ma.getdata(found)[known]).all()
    assert np.isnan(np.ma.getdata(found)[~known]).all()
    assert (result.status_codes[~known] != 0).all()
    for i in range(count_of(pose)):
        if not known[i]:
            with pytest.raises(NoAnswerError, match=r"no (stiffness|compliance) matrix"):
                rs.compliance(robot, row(pose, i), at=at)
        elif not result.status_codes[i] & ILL:
            assert same(np.ma.getdata(found)[i], rs.compliance(robot, row(pose, i), at=at), 1e-9)


@pytest.mark.parametrize("one_load", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_deflections(name: str, one_load: bool):
    """Under one load and a load a pose, about a point each."""
    robot, pose = batch(name)
    random, count, n = np.random.default_rng(2), count_of(pose), robot.space.size
    loads = 100 * random.uniform(-1, 1, (count, n))
    loads[-1] = np.eye(n)[min(n - 1, 2)]  # along z, and in the plane a moment
    loads = np.tile(loads[-1], (count, 1)) if one_load else loads
    at = random.uniform(-0.2, 0.2, (count, 3)) * [1, 1, n == 6]
    found = rs.deflection(robot, pose, loads[0] if one_load else loads, at=at)
    for i, F in enumerate(loads):
        alone = rs.deflection(robot, row(pose, i), F, at=at[i])
        assert found.status_codes[i] == int(alone.status)
        assert found.answered[i] == alone.has_answer
        assert bool(found.twist.mask[i].any()) == (not alone.has_answer)
        assert found[i].advice == alone.advice
        if not alone.has_answer or alone.status & rs.Status.ILL_CONDITIONED:
            continue
        assert same(found.twist[i], alone.twist, 1e-9)
        assert np.isclose(found.energy[i], alone.energy, rtol=1e-9, atol=0)
        for own, expected in zip(found.leg_wrenches, alone.leg_wrenches, strict=True):
            np.testing.assert_allclose(own[i], expected, rtol=1e-8, atol=1e-7)
        energies = {(one.leg, one.part): one.energy for one in alone.parts}
        size = max(energies.values(), default=0.0)
        assert {(one.leg, one.part): one.energy for one in found[i].parts} == pytest.approx(
            energies, rel=1e-9, abs=1e-9 * size
        )
    assert found.status == rs.Status(int(np.bitwise_or.reduce(found.status_codes)))
    # Numbers are missing where a status says why, and nowhere else.
    bad = rs.Status.UNREACHABLE | rs.Status.UNBALANCED
    np.testing.assert_array_equal(found.answered, (found.status_codes & int(bad)) == 0)
    some = found[found.answered]
    assert len(some) == np.count_nonzero(found.answered) == len(list(some))
    assert not np.ma.getmaskarray(some.twist).any()


def test_deflections_over_a_grid_have_its_shape():
    robot: Any = rs.load("gough-stewart-b")
    poses = np.tile([0, 0, 0.8, 0, 0, 0], (2, 3, 1)) + np.linspace(0, 0.05, 6).reshape(2, 3, 1)
    found = rs.deflection(robot, poses, [0, 0, -100, 0, 0, 0])
    assert (found.twist.shape, found.energy.shape) == ((2, 3, 6), (2, 3))
    assert (found.status_codes.shape, found[1].twist.shape) == ((2, 3), (3, 6))
    assert np.array_equal(found[1, 2].twist, found.twist[1, 2])


@pytest.mark.parametrize("name", NAMES)
def test_outputs_of_kernels(name: str):
    robot, pose = batch(name)
    result = rs.stiffness(robot, pose)
    for output in every_output(np.arange(1.0, robot.space.size + 1)):
        try:
            compiled = rs.compile(robot, [output], backend=ARRAYS)
        except NoAnswerError:
            assert not result.has_compliance.any()
            continue
        answer = compiled.evaluate(pose)
        values = answer.values[output.name].reshape(count_of(pose), -1)
        known = np.isfinite(values).all(-1)
        assert np.isnan(values[~known]).all()
        assert (answer.status_codes[~known] != 0).all()
        if isinstance(output, rs.StiffnessMatrix | rs.PrincipalStiffness):
            assert np.array_equal(known, result.answered)
        batched = values_of(output, result)[0].reshape(values.shape)
        assert np.array_equal(np.isfinite(batched).all(-1), known)
        plain = known & ((result.status_codes & ILL) == 0)
        for i in np.flatnonzero(plain):
            assert same(values[i], batched[i], 1e-7), (output.name, i)


@pytest.mark.parametrize("method", [rs.Batched(), rs.Compiled(ARRAYS)], ids=["batched", "compiled"])
@pytest.mark.parametrize("name", ["hexapod of beams", "meeting legs", "rigid cranks", "3-rrr"])
def test_quantities_of_maps(name: str, method):
    robot, rows = batch(name)
    names = [c.value for c in robot.coordinates]
    space = robot.space
    names = [n for n in names if n in np.array(["x", "y", "z", "rx", "ry", "rz"])[list(space.rows)]]
    poses = rs.PoseList(names, rows)
    result = rs.stiffness(robot, rows)
    for quantity in rs.Quantity:
        by_kernel = isinstance(method, rs.Compiled)
        if quantity is rs.Quantity.TENSIONS or (
            quantity is rs.Quantity.ACTUATOR_FORCES and by_kernel
        ):
            continue
        wrench = np.arange(1.0, space.size + 1) if quantity.needs_wrench else None
        try:
            found = rs.stiffness_map(robot, poses, [quantity], wrench=wrench, method=method)
        except NoAnswerError:
            assert not result.has_compliance.any()
            continue
        for variable in found.data_vars:
            if found[variable].dtype.kind != "f" or variable in names:
                continue
            values = found[variable].values.reshape(len(rows), -1)
            assert not np.isinf(values).any(), variable
            assert (found["status"].values[np.isnan(values).any(-1)] != 0).all(), variable


def floats_of(value) -> Iterator[np.ndarray]:
    """Every float inside an object."""
    if isinstance(value, float | np.ndarray):
        yield np.asarray(value)
    elif isinstance(value, tuple):
        for entry in value:
            yield from floats_of(entry)
    elif dataclasses.is_dataclass(value) and not isinstance(value, rs.Stiffness):
        for field in dataclasses.fields(value):
            yield from floats_of(getattr(value, field.name))


@pytest.mark.parametrize("name", rs.shipped_robots())
def test_every_shipped_robot_has_indices_without_nan(name: str):
    found = rs.indices(rs.stiffness(rs.load(name)))
    assert all(np.isfinite(number).all() for number in floats_of(found))
    assert found.status == found.result.status


@pytest.mark.parametrize("name", NAMES)
def test_indices(name: str):
    robot, pose = batch(name)
    result, found = rs.stiffness(robot, pose), rs.indices(robot, pose, length=0.2)
    assert len(found[found.answered]) == np.count_nonzero(found.answered)
    smallest = found.each(lambda one: one.collinear.smallest)
    worst = found.each(lambda one: one.worst_deflection.translational)
    for i, one in enumerate(found):
        assert (one is not None) == result.answered[i]
        if one is None:
            assert found.status_codes[i] & int(rs.Status.UNREACHABLE | rs.Status.RIGID_DIRECTION)
            assert smallest.mask[i]
            for ask in (lambda i=i: found[i], lambda i=i: rs.indices(robot, row(pose, i))):
                with pytest.raises(NoAnswerError, match="no stiffness matrix"):
                    ask()
            continue
        assert all(np.isfinite(number).all() for number in floats_of(one))
        C = one.worst_deflection.translational
        assert C is not None or result[i].status is not rs.Status.OK
        alone = rs.indices(robot, row(pose, i), length=0.2)
        assert (one.status, one.length) == (alone.status, 0.2)
        if not one.status & rs.Status.ILL_CONDITIONED:
            assert np.isclose(smallest[i], alone.collinear.smallest, rtol=1e-9)
            missing = alone.worst_deflection.translational is None
            assert bool(np.ma.getmaskarray(worst)[i]) == missing


def test_indices_need_no_inverse_of_k(monkeypatch):
    """Where the wrenches of the legs give the compliance."""
    result = rs.stiffness(rs.load("gough-stewart-b"))
    expected = np.linalg.inv(result.K)
    monkeypatch.setattr(np.linalg, "inv", lambda *_: pytest.fail("K is inverted"))
    worst = np.linalg.eigvalsh(expected[:3, :3])[-1]
    assert np.isclose(rs.indices(result).worst_deflection.translational, worst, rtol=1e-9, atol=0)


def test_indices_where_no_digit_of_the_compliance_holds():
    found = rs.indices(rs.stiffness(rs.load("gough-stewart-b-beams"), LOST))
    assert rs.Status.ILL_CONDITIONED in found.status
    for one in (found.worst_deflection, found.virtual_work, found.centre_of_compliance):
        assert rs.Status.ILL_CONDITIONED in one.status
        assert rs.Status.UNBALANCED not in one.status


def test_a_stiffness_is_invertible_where_its_digits_allow():
    lost = rs.stiffness(rs.load("gough-stewart-b-beams"), [LOST, [*LOST[:5], 0.1]])
    assert lost.details().invertible.tolist() == [False, True]


def test_a_report_and_the_command_line_say_that_no_digit_holds(tmp_path):
    robot = rs.load("gough-stewart-b-beams")
    file = tmp_path / "report.html"
    rs.write_report(robot, file, pose=LOST, wrench=[1, 0, 0, 0, 0, 0])
    assert "ill-conditioned" in file.read_text(encoding="utf-8")
    written = " ".join(map(str, LOST))
    for command in (["stiffness"], ["indices"], ["deflection", "--wrench", "1 0 0 0 0 0"]):
        outcome = CliRunner().invoke(app, [command[0], robot.name, *command[1:], "--pose", written])
        assert outcome.exit_code == 1, outcome.output
        assert "ill-conditioned" in outcome.stdout
        assert "infinite" not in outcome.stdout

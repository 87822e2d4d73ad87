"""Outputs of kernels against their definitions, and ranks near singular poses."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.model import Robot
from tests.analysis.kernels.cases import BACKENDS, around_home, every_output, model, of_fourth_order

FULL_RANK = ["hexapod", "3-puu", "3-rpr-beams", "3-rrr", "two-link-arm"]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", FULL_RANK)
def test_every_output_is_what_it_is_by_definition(name, backend):
    robot = model(name)
    d, F = robot.space.translations, 10 * np.arange(1.0, robot.space.size + 1)
    compiled = rs.compile(robot, every_output(F), backend=backend)
    pose = around_home(robot, 20)
    found = compiled.evaluate(pose).values
    K = direct_stiffness(robot, pose).K
    C = np.linalg.inv(K)
    scale = np.sqrt(np.einsum("nii->ni", K))
    own = scale[:, :, None] * scale[:, None, :]
    assert np.all(np.abs(found["K"] - K) <= 1e-11 * own)
    assert np.all(np.abs(found["compliance"] - C) <= 1e-8 * np.abs(C).max((1, 2))[:, None, None])
    np.testing.assert_allclose(found["deflection"], C @ F, rtol=1e-6, atol=1e-14)
    principal = found["principal_stiffness"]
    for part, block in ((principal[:, :d], K[:, :d, :d]), (principal[:, d:], K[:, d:, d:])):
        expected = np.linalg.eigvalsh(block)
        assert np.all(np.abs(part - expected) <= 1e-11 * expected[:, -1:])
    np.testing.assert_allclose(
        found["worst_deflection"], np.linalg.eigvalsh(C[:, :d, :d])[:, -1], rtol=1e-9
    )


def differences(robot, pose, column, step, quantity):
    up, down = np.array(pose), np.array(pose)
    up[:, column] += step
    down[:, column] -= step
    return (quantity(direct_stiffness(robot, up).K) - quantity(direct_stiffness(robot, down).K)) / (
        2 * step
    )


def principal(K):
    d = 3 if K.shape[-1] == 6 else 2
    parts = [np.linalg.eigvalsh(K[:, :d, :d]), np.linalg.eigvalsh(K[:, d:, d:])]
    return np.concatenate(parts, axis=-1)


QUANTITIES = {
    rs.StiffnessMatrix(): (lambda K: K),
    rs.ComplianceMatrix(): np.linalg.inv,
    rs.DeflectionUnder([10, 20, 30, 4, 5, 6]): (
        lambda K: np.linalg.inv(K) @ np.array([10.0, 20, 30, 4, 5, 6])
    ),
    rs.PrincipalStiffness(): principal,
    rs.WorstDeflection(): (lambda K: np.linalg.eigvalsh(np.linalg.inv(K)[:, :3, :3])[:, -1]),
}


@pytest.mark.parametrize(
    ("name", "by"), [pytest.param("hexapod", ("y", "rx"), marks=pytest.mark.slow), ("3-puu", "x")]
)
def test_derivatives_are_limits_of_differences(name, by):
    robot = model(name)
    names = [coordinate.value for coordinate in robot.coordinates]
    rates = [rs.Derivative(output, each) for output in QUANTITIES for each in by]
    compiled = rs.compile(robot, rates, backend=rs.Backend.ARRAYS)
    pose = np.asarray(around_home(robot, 8, seed=3))
    values, K = compiled.evaluate(pose).values, direct_stiffness(robot, pose).K
    for output, quantity in QUANTITIES.items():
        for each in by:
            found = values[rs.Derivative(output, each).name]
            expected = differences(robot, pose, names.index(each), 2e-5, quantity)
            allowed = 1e-6 * np.abs(expected) + 1e-6 * np.abs(quantity(K)).max()
            assert np.all(np.abs(found - expected) <= allowed)


@pytest.mark.parametrize(("name", "by", "h"), [("3-rps", "ry", 1e-4), ("t3r1", "x", 3e-5)])
def test_derivatives_of_a_robot_closed_by_iteration_follow_its_closure(name, by, h):
    """Coordinates of the legs, and those of the platform that they decide, move along."""
    robot = model(name)
    names = [coordinate.value for coordinate in robot.coordinates]
    pose = np.asarray(around_home(robot, 4, seed=5))

    rate = rs.Derivative(rs.StiffnessMatrix(), by)
    compiled = rs.compile(robot, [rate], backend=rs.Backend.ARRAYS)
    step = np.eye(len(names))[names.index(by)]
    answer = compiled.evaluate(pose)
    assert not answer.guarded.any()
    expected = of_fourth_order(lambda d: direct_stiffness(robot, pose + d * step).K, h)
    sizes = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(answer.values[rate.name] - expected) <= 1e-9 * sizes)


def test_second_derivatives_are_derivatives_of_derivatives():
    robot = model("3-rpr")
    first = rs.Derivative(rs.StiffnessMatrix(), "x")
    second = rs.Derivative(first, "rz")
    assert second.name == "ddK/dx/drz"
    compiled = rs.compile(robot, [first, second], backend=rs.Backend.ARRAYS)
    pose = np.asarray(around_home(robot, 5))
    turn = np.array([0, 0, 1e-5])
    up, down = (compiled.evaluate(pose + s * turn).values[first.name] for s in (1, -1))
    expected = (up - down) / 2e-5
    found = compiled.evaluate(pose).values[second.name]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("backend", BACKENDS)
def test_derivatives_that_are_none_are_reported_by_the_status(backend):
    rate = rs.Derivative(rs.PrincipalStiffness(), "x")
    compiled = rs.compile(model("hexapod"), [rate], backend=backend)
    # At home two pairs of eigenvalues meet; then a general pose, and one out of reach.
    poses = np.array([[0, 0, 0.9, 0, 0, 0], [0.05, 0.02, 0.9, 0.1, 0.05, 0], [0, 0, 0.1, 0, 0, 0]])
    answer = compiled.evaluate(poses)
    assert list(map(rs.Status, answer.status_codes.tolist())) == [
        rs.Status.ILL_CONDITIONED,
        rs.Status.OK,
        rs.Status.UNREACHABLE,
    ]
    finite = np.isfinite(answer.values[rate.name]).all(axis=1)
    np.testing.assert_array_equal(finite, [False, True, False])


def test_derivatives_of_K_are_none_where_the_rank_changes():
    rate = rs.Derivative(rs.StiffnessMatrix(), "x")
    robot = model("gough-stewart-a")
    compiled = rs.compile(robot, [rate, rs.StiffnessMatrix()], backend=rs.Backend.ARRAYS)
    poses = np.array([[0, 0, 0.8, 0, 0, 0], [0.05, 0.02, 0.8, 0.1, 0.05, 0]])
    answer = compiled.evaluate(poses)
    assert rs.Status.ILL_CONDITIONED in rs.Status(int(answer.status_codes[0]))
    assert np.isnan(answer.values[rate.name][0]).all()
    assert np.isfinite(answer.values["K"][0]).all()
    assert np.isfinite(answer.values[rate.name][1]).all()


SPREADS = (0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2, 1e-1)
EACH = 20


def poses(robot: Robot) -> np.ndarray:
    """Around the singular home of case A of the paper, nearer and farther."""
    assert robot.home is not None
    home = np.array([*robot.home.p, 0.0, 0.0, 0.0])
    random = np.random.default_rng(1)
    return np.concatenate([home + size * random.uniform(-1, 1, (EACH, 6)) for size in SPREADS])


@pytest.mark.parametrize("name", ["gough-stewart-a", "gough-stewart-a-beams"])
def test_rank_and_status_are_those_of_the_wrench_basis_form(name: str):
    robot = rs.load(name)
    at = poses(robot)
    compiled = rs.compile(robot, backend=rs.Backend.ARRAYS)
    answer, careful = compiled.evaluate(at, again=False), direct_stiffness(robot, at)
    own = ~answer.guarded
    assert np.all(careful.rank[:EACH] == 3)
    np.testing.assert_array_equal(np.unique(answer.rank[own]), [3, 5])
    np.testing.assert_array_equal(answer.rank[own], careful.rank[own])
    np.testing.assert_array_equal(answer.status_codes[own], careful.status_codes[own])
    K, expected = answer.values["K"], careful.details().matrix
    np.testing.assert_allclose(K[own], expected[own], atol=1e-14 * np.max(expected))
    share = answer.guarded.reshape(len(SPREADS), EACH).mean(axis=1)
    assert np.all(share[[6, 7]] == 0)
    assert share[5] < 0.5
    # At home all is clear; so near to it that wrenches differ by 1e-9, rounding would show.
    assert np.all(share[:4] == [0, 1, 1, 1])
    # What the tolerances leave in doubt is left to the wrench basis form.
    ill = (careful.status_codes & int(rs.Status.ILL_CONDITIONED)) != 0
    assert ill.sum() > EACH
    assert np.all(answer.guarded[ill])


def test_kernels_of_more_than_K_leave_these_poses_to_the_wrench_basis_form():
    """Some outputs divide by the pivots of K, and lose the digits that these have lost."""
    robot = rs.load("gough-stewart-a")
    outputs = [rs.StiffnessMatrix(), rs.PrincipalStiffness()]
    assert rs.compile(robot, outputs, backend=rs.Backend.ARRAYS).ranks is None
    again = pickle.loads(pickle.dumps(rs.compile(robot, backend=rs.Backend.ARRAYS)))  # noqa: S301
    at = poses(robot)[-EACH:]
    assert not np.any(again.evaluate(at, again=False).guarded)


def test_a_far_reference_point_is_left_to_the_wrench_basis_form():
    """It decides ranks amid the legs, where levers are short."""
    robot = rs.load("gough-stewart-a")
    far = rs.compile(replace(robot, reference_point=(50.0, 0, 0)), backend=rs.Backend.ARRAYS)
    assert far.ranks is None

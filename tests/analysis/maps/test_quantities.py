"""What a map says of a pose is what `stiffness` and `deflection` say of it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff import Quantity
from robostiff.analysis.maps.evaluator import MapEvaluator
from robostiff.analysis.maps.pose_columns import pose_columns
from robostiff.analysis.measures import stiffness_indices, symmetric_eigenvalues
from tests.analysis.maps.robots import loaded, values_at

# Robot, coordinates, spread about home: regular, free motions, plane, arms, lower mobility.
ROBOTS = [
    ("hexapod", "x", 0.05),
    ("gough-stewart-a", "x", 0.1),
    ("3-rpr-beams", "x", 0.03),
    ("two-link-arm", "elbow", 0.5),
    ("planar-link", "tip", 0.1),
    ("3-puu", "x", 0.3),
    ("capaman", "x", 0.02),  # drives in parallel blocks
    ("h4", "x", 0.05),
]


def evaluated(name, coordinate, spread, count=6):
    robot = loaded(name)
    columns = pose_columns(robot, [coordinate])
    random = np.random.default_rng(5)
    poses = np.array(columns.home) + random.uniform(-spread, spread, (count, len(columns.home)))
    # Loads that do no work on free motions are distinguished at home alone.
    poses[0] = columns.home
    wrench = tuple([0.0] * (robot.space.translations - 1) + [100.0])
    wrench += tuple([0.0] * (robot.space.size - len(wrench)))
    without = {Quantity.TENSIONS} | ({Quantity.ACTUATOR_FORCES} if name == "planar-link" else set())
    quantities = [q for q in Quantity if q not in without]
    evaluator = MapEvaluator(robot, columns, tuple(quantities), wrench, 0.5)
    return robot, columns, poses, np.array(wrench), values_at(evaluator, poses)


@pytest.mark.parametrize(("name", "coordinate", "spread"), ROBOTS)
def test_every_quantity_is_that_of_the_single_pose(name, coordinate, spread):
    robot, columns, poses, wrench, found = evaluated(name, coordinate, spread)
    d = robot.space.translations
    for i, pose in enumerate(poses):
        one = rs.stiffness(robot, columns.as_pose(pose))
        bent = rs.deflection(robot, columns.as_pose(pose), wrench)
        assert int(bent.status) == found["status"][i]
        assert found["rank"][i] == one.rank
        if not one.status.has_stiffness:
            assert np.all(np.isnan(found["K"][i]))
            assert np.all(np.isnan(found["translational_stiffness"][i]))
            continue
        np.testing.assert_allclose(found["K"][i], one.K, rtol=1e-9, atol=1e-9 * np.abs(one.K).max())
        for variable, block in (
            ("translational_stiffness", one.K[:d, :d]),
            ("rotational_stiffness", one.K[d:, d:]),
        ):
            expected = np.linalg.eigvalsh(block)
            np.testing.assert_allclose(
                found[variable][i], expected, rtol=1e-6, atol=1e-7 * expected[-1]
            )
        if one.compliance is None:
            assert np.isnan(found["worst_deflection"][i])
        else:
            worst = np.linalg.norm(one.compliance[:d, :d], 2)
            np.testing.assert_allclose(found["worst_deflection"][i], worst, rtol=1e-5)
        twist = np.concatenate([found["displacement"][i], found["rotation"][i]])
        if bent.has_answer:
            size = np.abs(bent.twist).max()
            np.testing.assert_allclose(twist, bent.twist, rtol=1e-6, atol=1e-7 * size)
        else:
            assert np.all(np.isnan(twist))
        if bent.has_answer and "actuator_force" in found:
            loads = [actuator.load for actuator in bent.actuators]
            np.testing.assert_allclose(found["actuator_force"][i], loads, rtol=1e-5, atol=1e-4)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.floats(-12, 12))
def test_eigenvalues_are_those_of_lapack(seed, n, exponent):
    random = np.random.default_rng(seed)
    B = random.normal(size=(20, n, n)) * 10.0 ** random.uniform(-3, 3, (20, 1, n))
    A = 10.0**exponent * (B @ np.swapaxes(B, 1, 2))
    expected = np.linalg.eigvalsh(A)
    found = symmetric_eigenvalues(A)
    assert np.all(np.abs(found - expected) <= 1e-14 * expected[:, -1:])


@pytest.mark.parametrize(
    ("matrix", "values"),
    [
        (np.zeros((3, 3)), [0, 0, 0]),
        (np.ones((3, 3)), [0, 0, 3]),
        (np.diag([2.0, 1.0, 2.0]), [1, 2, 2]),
        (np.full((3, 3), np.nan), [np.nan] * 3),
    ],
)
def test_eigenvalues_of_special_matrices(matrix, values):
    np.testing.assert_allclose(symmetric_eigenvalues(matrix[None])[0], values, atol=1e-15)


def test_indices_do_not_depend_on_the_unit_of_length():
    K = rs.stiffness(loaded("hexapod"), [0.05, 0.02, 0.9, 0, 0.1, 0]).K[None]
    to_mm = np.diag([1e3, 1e3, 1e3, 1, 1, 1])
    K_mm = 1e3 * np.linalg.inv(to_mm) @ K @ np.linalg.inv(to_mm)  # works in N mm, not in J
    metres = stiffness_indices(K, np.array([6]), 0.4)
    millimetres = stiffness_indices(K_mm, np.array([6]), 400.0)
    np.testing.assert_allclose(metres["isotropy"], millimetres["isotropy"], rtol=1e-12)
    # N/m against N/mm, six times over
    np.testing.assert_allclose(
        metres["log10_determinant"] - millimetres["log10_determinant"], 18, rtol=1e-9
    )
    np.testing.assert_allclose(
        metres["log10_determinant"],
        np.linalg.slogdet(K / np.outer(s := [1, 1, 1, 0.4, 0.4, 0.4], s))[1] / np.log(10),
    )


def test_a_singular_matrix_has_isotropy_zero_and_no_logarithm():
    K = np.diag([1.0, 1, 1, 1, 1, 0])[None]
    found = stiffness_indices(K, np.array([5]), 1.0)
    assert found["smallest_eigenvalue"] == 0
    assert found["isotropy"] == 0
    assert np.isnan(found["log10_determinant"])

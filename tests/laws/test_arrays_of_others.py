"""Answers are worked out when they are asked for: of what was given, not of what its array became.

In a loop that fills one array again, all answers would otherwise be those of the last pose.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import robostiff as rs

POSE = np.array([0.06, 0.02, 0.9, 0.0, 0.1, 0.0])
LOAD = np.array([300.0, 100.0, -200.0, 1.0, 2.0, 3.0])
PATH = POSE + np.arange(3)[:, None] * 0.001
JOINTS = np.array([0.1, 0.2, 0.3, 0.1, 0.5, 0.2])
POINT = np.array([1.0, 2.0, 3.0])

_hexapod, _arm, _cables = rs.load("hexapod"), rs.load("six-joint-arm"), rs.load("cable-8")


def _stiffness(pose: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.stiffness(_hexapod, pose)
    return lambda: (found.K, found.pose, found.reference_point)


def _deflection(pose: np.ndarray, load: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.deflection(_hexapod, pose, wrench=load)
    return lambda: (found.wrench, found.twist, found.energy, found.leg_wrenches)


def _equilibrium(pose: np.ndarray, load: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.equilibrium(_hexapod, pose, load)
    return lambda: (found.wrench, found.displacement, found.margin)


def _of_a_kernel(pose: np.ndarray, load: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.compile_loaded(rs.load("3-rpr")).evaluate(pose, load)
    return lambda: (found.wrench, found.pose, found.margin)


def _of_an_arm(joints: np.ndarray, load: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.equilibrium(_arm, rs.JointCoordinates(joints), load)
    return lambda: (found.wrench, found.displacement, rs.stiffness(_arm, found.pose).K)


def _indices(pose: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.indices(_hexapod, pose)
    return lambda: (found.condition_number,)


def _compensation(pose: np.ndarray, load: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.compensate(_hexapod, pose, load)
    return lambda: (found.target, found.commanded, found.residual)


def _cable_response(pose: np.ndarray, load: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.cable_response(_cables, pose, wrench=load)
    return lambda: (found.load, found.before.pose)


def _measurements(pose: np.ndarray, load: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.Measurements(pose, np.ones((3, 3)), load, sigma=1e-6)
    return lambda: (found.postures, found.wrenches)


def _mass(point: np.ndarray) -> Callable[[], tuple[Any, ...]]:
    found = rs.Mass(3.0, point)
    return lambda: (found.centre,)


@pytest.mark.parametrize(
    ("ask", "given"),
    [
        (_stiffness, (POSE,)),
        (_stiffness, (PATH,)),
        (_deflection, (POSE, LOAD)),
        (_deflection, (PATH, LOAD)),
        (_equilibrium, (POSE, LOAD)),
        (_equilibrium, (PATH, LOAD)),
        (_of_a_kernel, (np.array([[0.45, 0.35, 0.0], [0.46, 0.36, 0.1]]), LOAD[:3])),
        (_of_an_arm, (JOINTS, LOAD)),
        (_indices, (PATH,)),
        (_compensation, (PATH, LOAD)),
        (_cable_response, (np.zeros(6), 0.01 * LOAD)),
        (_measurements, (PATH, LOAD)),
        (_mass, (POINT,)),
    ],
)
def test_what_becomes_of_an_array_changes_no_answer(
    ask: Callable[..., Callable[[], tuple[Any, ...]]], given: tuple[np.ndarray, ...]
) -> None:
    kept = [array.copy() for array in given]
    found = ask(*kept)
    for array in kept:
        array[...] = 0.4
    for own, right in zip(found(), ask(*given)(), strict=True):
        assert np.allclose(own, right, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("to_table", ["pandas", "xarray"])
def test_tables_with_names_in_another_order_are_refused(to_table: str):
    """Numbers are read by their places: z y x would be taken for x y z."""

    def table(values: np.ndarray, names: str) -> Any:
        library = pytest.importorskip(to_table)
        if to_table == "pandas":
            return library.DataFrame([values], columns=names.split())
        return library.DataArray([values], coords={"name": names.split()}, dims=("row", "name"))

    usual, other = "x y z rx ry rz", "z y x rx ry rz"
    K = rs.stiffness(_hexapod, table(POSE, usual)).K
    np.testing.assert_array_equal(K, rs.stiffness(_hexapod, [POSE]).K)
    np.testing.assert_array_equal(K, rs.stiffness(_hexapod, table(POSE, "a b c d e f")).K)
    with pytest.raises(rs.InputError, match="'z y x rx ry rz', expected x y z rx ry rz"):
        rs.stiffness(_hexapod, table(POSE, other))
    for job in (rs.deflection, rs.equilibrium):
        with pytest.raises(rs.InputError, match="order of wrench: got 'Fx Fy Fz Mz My Mx'"):
            job(_hexapod, [POSE], table(LOAD, "Fx Fy Fz Mz My Mx"))
    with pytest.raises(rs.InputError, match="order of wrenches: got 'Fx Fy Fz Mz My Mx'"):
        rs.compensate(_hexapod, [POSE], table(LOAD, "Fx Fy Fz Mz My Mx"))
    with pytest.raises(rs.InputError, match="order of list of poses: got 'z y x rx ry rz'"):
        rs.PoseList(usual.split(), table(POSE, other))
    with pytest.raises(rs.InputError, match="order of poses of 'hexapod': got 'z y x rx ry rz'"):
        rs.compile(_hexapod).evaluate(table(POSE, other))
    arm, joints = rs.load("six-joint-arm"), "joint1 joint2 joint3 joint4 joint6 joint5"
    with pytest.raises(rs.InputError, match="joint6 joint5', expected joint1 joint2 joint3"):
        rs.stiffness(arm, rs.JointCoordinates(table(POSE, joints)))

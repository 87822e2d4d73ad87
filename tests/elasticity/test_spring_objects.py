"""Springs: what an Elasticity holds, springs along one axis, and their messages."""

import dataclasses

import numpy as np
import pytest
import sympy as sp

from robostiff.elasticity import Elasticity, rotational_spring, translational_spring
from robostiff.errors import InputError


def test_arrays_are_copied_and_read_only():
    C, N = np.eye(6), np.eye(6)[:, :2]
    spring = Elasticity(C, N)
    C[0, 0] = N[0, 0] = 7
    assert spring.compliance[0, 0] == spring.freedoms[0, 0] == 1
    with pytest.raises(ValueError, match="read-only"):
        spring.compliance[0, 0] = 2
    with pytest.raises(ValueError, match="read-only"):
        spring.freedoms[0, 0] = 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        spring.compliance = C  # type: ignore[misc]


def test_no_freedoms_unless_given():
    a, b = Elasticity(np.eye(6)), Elasticity(np.eye(6))
    assert a.freedoms.shape == (6, 0)
    assert a.freedoms is not b.freedoms


def test_batches_and_integers():
    spring = Elasticity(np.zeros((4, 2, 6, 6), dtype=int))
    assert spring.compliance.shape == (4, 2, 6, 6)
    assert spring.compliance.dtype == np.float64


def test_symbolic_entries_stay():
    k = sp.Symbol("k")
    compliance = np.full((6, 6), 0, dtype=object)
    compliance[0, 0] = 1 / k
    assert Elasticity(compliance).compliance[0, 0] == 1 / k


@pytest.mark.parametrize(
    ("compliance", "freedoms", "message"),
    [
        (
            np.eye(3),
            np.zeros((6, 0)),
            "shape of the compliance of the spring: got (3, 3), expected (..., 6, 6)",
        ),
        (
            [[1], [2, 3]],
            np.zeros((6, 0)),
            "shape of the compliance of the spring: got (2,), expected (..., 6, 6)",
        ),
        (
            np.eye(6),
            np.zeros((1, 6)),
            "shape of the freedoms of the spring: got (1, 6), expected (6, k), one twist "
            "(dx, dy, dz, rx, ry, rz) in each column",
        ),
        (
            np.eye(6),
            np.zeros(6),
            "shape of the freedoms of the spring: got (6,), expected (6, k), one twist "
            "(dx, dy, dz, rx, ry, rz) in each column",
        ),
    ],
)
def test_shapes_are_checked(compliance, freedoms, message):
    with pytest.raises(InputError) as error:
        Elasticity(compliance, freedoms)
    assert str(error.value) == message


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_entries_must_be_finite(bad):
    with pytest.raises(InputError, match=r"compliance of the spring: .*expected finite numbers"):
        Elasticity(np.full((6, 6), bad))
    with pytest.raises(InputError, match=r"freedoms of the spring: .*expected finite numbers"):
        Elasticity(np.eye(6), np.full((6, 1), bad))
    with pytest.raises(InputError, match="compliance of the spring"):
        Elasticity(np.full((6, 6), "1"))


@pytest.mark.parametrize(
    ("make", "block"), [(translational_spring, slice(0, 3)), (rotational_spring, slice(3, 6))]
)
def test_springs_along_one_axis(make, block):
    axis = np.array([1.0, -2.0, 2.0])
    spring = make(4e3, axis)
    assert spring.freedoms.shape == (6, 0)
    compliance = spring.compliance[block, block]
    np.testing.assert_allclose(compliance @ axis, axis / 4e3, rtol=1e-14)
    np.testing.assert_allclose(compliance @ [0, 1, 1], 0, atol=1e-19)
    rest = spring.compliance.copy()
    rest[block, block] = 0
    assert (rest == 0).all()
    np.testing.assert_allclose(make(4e3, -3 * axis).compliance, spring.compliance, rtol=1e-14)


@pytest.mark.parametrize(
    ("make", "words", "unit"),
    [(translational_spring, "translational", "N/m"), (rotational_spring, "rotational", "N m/rad")],
)
def test_messages_of_springs_along_one_axis(make, words, unit):
    with pytest.raises(InputError) as error:
        make(0.0, [1, 0, 0])
    assert str(error.value) == (
        f"stiffness of the {words} spring: got 0.0, expected a positive finite number [{unit}]"
    )
    for axis in ([0.0, 0.0, 0.0], [1, 0], "x", [[1, 0, 0]], [1, [2, 3]]):
        with pytest.raises(InputError) as error:
            make(1.0, axis)
        assert str(error.value) == (
            f"axis of the spring: got {axis!r}, expected three numbers, not all zero"
        )
    with pytest.raises(InputError) as error:
        make(1.0, [0, np.nan, 0])
    assert str(error.value) == (
        "axis of the spring, entry [1]: got nan, expected a finite number up to 1e30"
    )

"""Rotations about fixed axes, of numbers and of recorded entries."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from robostiff.record import arc_tangent, cosine, is_number, is_one, is_zero, sine, square_root
from robostiff.spatial import skew
from robostiff.spatial.batch import Shaped
from robostiff.spatial.rotation import matrix_of_rotation, vector_of_quaternion

#: Keeps the root of a vanishing angle regular.
_TINY = 1e-300
_EYE = np.eye(3)


def turn_by_cosine(axis: np.ndarray, c: Any, s: Any) -> np.ndarray:
    """Rotation matrix c I + s (e x) + (1 - c) e e^T about a unit vector e, entries or numbers.

    c and s are cosine and sine of the angle.
    """
    R = np.empty((3, 3), dtype=object)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        square = axis[i] * axis[i]
        R[i, i] = 1 if is_one(square) else c if is_zero(square) else c + (1 - c) * square
        shared, turned = axis[i] * axis[j], s * axis[k]
        even = 0 if is_zero(shared) else (1 - c) * shared
        R[i, j], R[j, i] = even - turned, even + turned
    return R


def turn_by_vector_of_entries(r: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector r of entries, by the unit quaternion (c, s r/a).

    With c and s of half the angle a = |r| it is regular at r = 0. A vector along one coordinate
    axis gives one cosine and one sine.
    """
    turning = [i for i in range(3) if not is_zero(r[i])]
    if len(turning) <= 1:
        k = turning[0] if turning else 2
        return turn_by_cosine(np.eye(3, dtype=int)[k], cosine(r[k]), sine(r[k]))
    a = square_root(r @ r + (0 if all(map(is_number, r)) else _TINY))
    c, s = cosine(a * 0.5), sine(a * 0.5)
    # u u^T = 2 v v^T and w u = 2 c v for the quaternion (c, v)
    u = r * (s / a * math.sqrt(2.0))
    w = c * math.sqrt(2.0)
    squares = u * u
    R = np.empty((3, 3), dtype=object)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        R[i, i] = 1 - (squares[j] + squares[k])
        even, odd = u[i] * u[j], w * u[k]
        R[i, j], R[j, i] = even - odd, even + odd
    return R


def turn_about(
    axis: Shaped[np.ndarray, 3], angle: Shaped[np.ndarray, "*batch"]
) -> Shaped[np.ndarray, "*batch 3 3"]:
    """Rotation matrix I + sin(a) (e x) + (1 - cos(a)) (e x)^2 about a fixed unit vector e.

    Angles (...) [rad]; one, without batch axes, where it or the axis has recorded entries.
    """
    if object in (angle.dtype, axis.dtype):
        x = angle.item()
        return turn_by_cosine(axis, cosine(x), sine(x))
    x, y, z = axis.tolist()
    E = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    entries = (3, 3, *(1,) * angle.ndim)
    s, versine = np.sin(angle), 2.0 * np.sin(0.5 * angle) ** 2
    R = _EYE.reshape(entries) + s * E.reshape(entries) + versine * (E @ E).reshape(entries)
    return R.transpose(*range(2, R.ndim), 0, 1)


def turn_by_vector(r: Shaped[np.ndarray, "*batch 3"]) -> Shaped[np.ndarray, "*batch 3 3"]:
    """Rotation matrix of rotation vectors [rad]."""
    if r.dtype == object:
        return turn_by_vector_of_entries(r)
    return matrix_of_rotation(np.asarray(r, dtype=float))


def vector_of_turn_near(R: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Rotation vector of a rotation matrix of entries, less than half a turn from another [rad].

    Four times the products of the quaternion with itself, times that of the other: these are
    multiples of the quaternion.
    """
    a = float(np.linalg.norm(near))
    w = np.array([math.cos(0.5 * a), *(near * (0.5 * np.sinc(0.5 * a / math.pi)))])
    products = np.empty((4, 4), dtype=object)
    products[0, 0] = 1 + R[0, 0] + R[1, 1] + R[2, 2]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        products[1 + i, 1 + i] = 1 + R[i, i] - R[j, j] - R[k, k]
        products[0, 1 + k] = products[1 + k, 0] = R[j, i] - R[i, j]
        products[1 + i, 1 + j] = products[1 + j, 1 + i] = R[i, j] + R[j, i]
    c, *v = products @ w.astype(object)
    v = np.array(v, dtype=object)
    half_sine = square_root(v @ v + _TINY)
    return v * (2 * arc_tangent(half_sine, c) / half_sine)


def rotvec_rate(r: Shaped[np.ndarray, "*batch 3"]) -> Shaped[np.ndarray, "*batch 3 3"]:
    """Matrix that turns the rate of a rotation vector into angular velocity, w = J_l(r) dr/dt.

    J_l = I + 2 sin(a/2)^2/a^2 (r x) + (1 - sin(a)/a)/a^2 (r x)^2, a = |r|. What rounding leaves of
    the last quotient is multiplied by a^2, so that no digits are lost at small angles. One vector,
    without batch axes, where it has recorded entries.
    """
    square = r @ r if r.dtype == object else np.sum(r * r, axis=-1)[..., None, None]
    a = square_root(square + _TINY)
    s, c, X = sine(a * 0.5), cosine(a * 0.5), skew(r)
    # Two divisions: the derivative of 1/a^2 would overflow at r = 0.
    return np.eye(3, dtype=int) + X * (2 * s * s / a / a) + X @ X * ((1 - 2 * s * c / a) / a / a)


def turned_point(pose: np.ndarray, point: np.ndarray) -> np.ndarray:
    """From the origins of platforms at poses (..., 6) to points of them (..., 3), world axes."""
    if not point.any():
        return np.zeros(3)
    return (turn_by_vector(pose[..., 3:]) @ point[..., None])[..., 0]


def pose_after(pose: np.ndarray, moved: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Poses (..., 6) after shifts of points of the platforms and rotations (..., 6), world axes."""
    turned = turn_after(moved[..., 3:], pose[..., 3:])
    found = np.concatenate([pose[..., :3] + moved[..., :3], turned], axis=-1)
    found[..., :3] += turned_point(pose, point) - turned_point(found, point)
    return found


def turn_after(second: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) of turns after others, by products of their quaternions."""
    each = []
    for r in (second.T, first.T):
        angle = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
        each.append((r * (0.5 * np.sinc(angle / (2 * np.pi))), np.cos(0.5 * angle)))
    ((a, b, c), d), ((e, f, g), h) = each
    q = [d * e + h * a + b * g - c * f, d * f + h * b + c * e - a * g]
    q += [d * g + h * c + a * f - b * e, d * h - a * e - b * f - c * g]
    return vector_of_quaternion(np.array(q).T)

"""Descriptions of free motions: translations, rotations about lines, screws."""

from __future__ import annotations

import numpy as np

from robostiff.frozen import frozen
from robostiff.spatial import Screw, Space, cross, screw_of_twist, skew

_SMALL = 1e-7
_ROUNDING = 1e-12  # part of the largest entry


def direction_in_words(direction: np.ndarray) -> str:
    """A unit vector (2,) or (3,) as text, to four decimals: x, y or z, or its components.

    The axis of a turn in a plane (1,) is z.
    """
    if len(direction) == 1:
        return "z"
    e = np.round(np.append(direction, np.zeros(3 - len(direction))), 4) + 0.0
    if np.count_nonzero(e) == 1:
        return "xyz"[np.flatnonzero(e)[0]]
    return f"({numbers_in_words(e)})"


def numbers_in_words(values: np.ndarray) -> str:
    """Numbers of one unit in four digits; what is rounding beside the largest is 0."""
    scale = max(1e-3, float(np.max(np.abs(values))))
    return ", ".join(f"{0.0 if abs(v) < _SMALL * scale else v:.4g}" for v in values)


@frozen
class FreeMotion:
    """A motion of the platform without stiffness.

    Attributes
    ----------
    twist : (n,) array
        Twist of the reference point, in the coordinates of the stiffness matrix; per metre for a
        translation, per radian for a rotation.
    screw : Screw
        Its direction, a point of its line and its pitch, in the world.
    """

    twist: np.ndarray
    screw: Screw

    def __str__(self) -> str:
        direction = direction_in_words(self.screw.axis)
        if self.screw.point is None:
            return f"translation along {direction}"
        place = f"{direction} through ({numbers_in_words(self.screw.point)}) m"
        if self.screw.is_rotation:
            return f"rotation about {place}"
        return f"screw motion about {place}, {1e3 * (self.screw.pitch or 0.0):.4g} mm per radian"


def free_motions_in_words(
    basis: np.ndarray, reference_point: np.ndarray, length: float
) -> tuple[FreeMotion, ...]:
    """A readable basis of a space of free motions.

    Translations are taken apart first. The rotations that remain are given about one common point
    where there is one (the apex of a Stewart platform of case A), else each about its own line or
    as a screw. Directions are chosen along the world axes as far as the space allows.

    Parameters
    ----------
    basis : (f, n) array
        Independent twists about the reference point, n = 6 or 3 (planar).
    reference_point : (3,) array
        In the world [m].
    length : float
        Characteristic length [m].

    Returns
    -------
    tuple of FreeMotion
        f of them, spanning the same space.
    """
    f, n = basis.shape
    if f == 0:
        return ()
    space = Space.of_size(n)
    scaled = space.spatial(basis)
    scaled[:, 3:] *= length
    scaled = np.linalg.svd(scaled, full_matrices=False)[2]
    # Unit translations of the space, and twists whose rotations are independent.
    U, values, _ = np.linalg.svd(scaled[:, 3:])
    turning = np.concatenate([values, np.zeros(len(U) - len(values))]) > _SMALL
    translations, rotations = (U.T @ scaled)[~turning, :3], (U.T @ scaled)[turning]
    if len(translations):  # as near to the world axes as the span allows
        translations = _echelon(translations, range(3))
        translations /= np.linalg.norm(translations, axis=-1, keepdims=True)
        T = np.linalg.qr(translations.T)[0]
        rotations[:, :3] -= rotations[:, :3] @ T @ T.T
    rotations[:, 3:] /= length
    rotations = _echelon(rotations, range(3, 6))
    rotations, common = _about_common_point(rotations, translations, length)
    motions = [np.concatenate([v, np.zeros(3)]) for v in translations]
    readable = []
    for twist in [*motions, *rotations]:
        screw = screw_of_twist(twist, reference_point, length, _SMALL)
        if screw.is_rotation and common is not None:
            screw = Screw(screw.axis, reference_point + common, screw.pitch)
        size = 1.0 if screw.is_translation else np.linalg.norm(twist[3:])
        own = twist[list(space.rows)] / size
        own[np.abs(own) < _ROUNDING * np.max(np.abs(own))] = 0.0
        readable.append(FreeMotion(own, screw))
    return tuple(readable)


def _echelon(rows: np.ndarray, columns: range) -> np.ndarray:
    """Reduced row echelon form over the given columns, with pivots by size."""
    rows = rows.copy()
    open_columns = list(columns)
    for i in range(len(rows)):
        part = np.abs(rows[i:, open_columns])
        # The first column that is nearly as large as the largest keeps x before y before z.
        best = int(np.argmax(part.max(axis=0) > 0.9 * part.max()))
        k = i + int(np.argmax(part[:, best]))
        rows[[i, k]] = rows[[k, i]]
        pivot = open_columns.pop(best)
        rows[i] /= rows[i, pivot]
        others = [j for j in range(len(rows)) if j != i]
        rows[others] -= np.outer(rows[others, pivot], rows[i])
        pivots_done = [c for c in columns if c not in open_columns]
        order = np.argsort([np.argmax(np.abs(row[pivots_done])) for row in rows[: i + 1]])
        rows[: i + 1] = rows[: i + 1][order]
    return rows


def _about_common_point(
    rotations: np.ndarray, translations: np.ndarray, length: float
) -> tuple[np.ndarray, np.ndarray | None]:
    """Rotations shifted by free translations to pass through one point, and that point."""
    if len(rotations) < 2:
        return rotations, None
    free = np.linalg.qr(translations.T)[0] if len(translations) else np.zeros((3, 0))
    held = np.eye(3) - free @ free.T
    system = np.concatenate([held @ skew(twist[3:]) for twist in rotations])
    wanted = -np.concatenate([held @ twist[:3] for twist in rotations])
    r = np.linalg.lstsq(system, wanted, rcond=_SMALL)[0]
    if np.linalg.norm(system @ r - wanted) > _SMALL * length * len(rotations):
        return rotations, None
    shared = rotations.copy()
    for twist in shared:
        twist[:3] = -cross(twist[3:], r)
    return shared, r

"""Where instrument and markers are, and the frames that fit best to a known robot."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.identification.measurement_kinds import Reading
from robostiff.identification.measurements import Measurements
from robostiff.kinematics.turn import turn_by_vector
from robostiff.spatial import as_floats

_ROUNDS = 20


@dataclass(frozen=True)
class UnknownFrames:
    """Neither the place of the instrument nor those of the markers are known."""


@dataclass(frozen=True, eq=False)
class KnownFrames:
    """Places that are known; None where they are to be found, too.

    Attributes
    ----------
    markers : mapping of str to (3,) array, or None
        In the platform frame [m].
    instrument : (6,) array or None
        Its place in the world [m], and the rotation vector from world to instrument axes [rad].
    turns : mapping of str to (3,) array, or None
        Of markers whose poses are read: rotation vectors from their axes to those of the platform.
    """

    markers: Mapping[str, ArrayLike] | None = None
    instrument: ArrayLike | None = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    turns: Mapping[str, ArrayLike] | None = None


def known_frames(
    measured: Measurements, frames: UnknownFrames | KnownFrames
) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray, tuple[int, ...]]:
    """Place of the instrument (6,), markers (K, 3), their turns (K, 3, 3), and unknown turns.

    None is what is to be found. Readings of drives alone need no frames.

    Raises
    ------
    InputError
        When a marker has no place, or readings do not tell where it is.
    """
    known = frames if isinstance(frames, KnownFrames) else KnownFrames(None, None)
    if all(kind.of_drive for kind in measured.kinds):
        known = KnownFrames({})
    names, instrument, markers = measured.marker_names, None, None
    if known.instrument is not None:
        instrument = as_floats("place of the instrument", known.instrument, "six", None, (6,))
    if known.markers is not None:
        for name in names:
            if name not in known.markers:
                expected = ", ".join(map(str, known.markers))
                raise InputError("marker", got=name, expected=f"a place for it, beside {expected}")
        rows = [known.markers[name] for name in names] or np.zeros((0, 3))
        markers = as_floats("places of the markers", rows, "three numbers each [m]")
        markers = markers.reshape(len(names), 3)
    kinds: dict[str, list[Reading]] = {name: [] for name in names}
    for name, kind in zip(measured.markers, measured.kinds, strict=True):
        kinds.setdefault(name, []).append(kind)
    if (instrument is None or markers is None) and not {Reading.POINT, Reading.POSE} & {
        *measured.kinds
    }:
        raise InputError(
            "frames of displacements and distances",
            got="unknown ones",
            expected="known ones: only points tell where instrument and markers are",
            hint='write frames=rs.KnownFrames({"marker": [0, 0, 0.05]})',
        )
    for name in names if markers is None else ():
        if len(kinds[name]) == 1:
            raise InputError(
                f"marker {name!r} of {measured.place(measured.markers.index(name))}",
                got="one reading",
                expected="several readings of a marker whose place is not known",
            )
    turned: tuple[int, ...] = ()
    if known.turns is None:
        turned = tuple(k for k, name in enumerate(names) if Reading.POSE in kinds[name])
    given = known.turns or {}
    vectors = [
        as_floats(f"turn of {name!r}", given.get(name, np.zeros(3)), "[rad]", "rad", (3,))
        for name in names
    ]
    return instrument, markers, turn_by_vector(np.reshape(vectors, (-1, 3))), turned


def nearest_frames(
    y: np.ndarray,
    P: np.ndarray,
    A: np.ndarray,
    which: np.ndarray,
    instrument: np.ndarray | None,
    markers: np.ndarray | None,
    count: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotation to instrument axes, its place and the markers (count, 3), found where None.

    By whole points y (N, 3) of markers `which` (N,), instrument axes, and the origins P (N, 3) and
    axes A (N, 3, 3) in the world of the platforms that carry them, as far as they are known. With
    ``Q = R^T`` as nine numbers ``Q y + b - A m = P`` is linear; Q is made a rotation, and what is
    unknown beside it follows again and again. Another start has all markers at the origin of the
    platform; the better one counts.

    Raises InputError when there are less than three points.

    References
    ----------
    Kabsch: A solution for the best rotation to relate two sets of vectors, Acta Crystallographica
    A 32, 1976.
    """
    if len(y) < 3:
        raise InputError("points of markers", got=f"{len(y)} whole ones", expected="three or more")
    b = np.zeros(3) if instrument is None else instrument[:3]
    m = np.zeros((count, 3)) if markers is None else markers

    def in_world(m: np.ndarray) -> np.ndarray:
        return P + np.einsum("nij,nj->ni", A, m[which])

    def settled(Q: np.ndarray, b: np.ndarray, m: np.ndarray) -> tuple[float, Any, Any, Any]:
        for _ in range(_ROUNDS):
            if markers is None:
                each = np.einsum("nji,nj->ni", A, y @ Q.T + b - P)
                sums = [np.bincount(which, each[:, i], count) for i in range(3)]
                m = np.array(sums).T / np.maximum(np.bincount(which, minlength=count), 1)[:, None]
            if instrument is None:
                Q, b = _absolute_orientation(y, in_world(m))
        return float(np.sum((y @ Q.T + b - in_world(m)) ** 2)), Q, b, m

    if instrument is not None:
        _, Q, b, m = settled(turn_by_vector(instrument[3:]).T, b, m)
        return Q.T, b, m
    starts = [settled(*_absolute_orientation(y, P), m)]
    M = np.zeros((len(y), 3, 12 + 3 * count * (markers is None)))
    for i in range(3):
        M[:, i, 3 * i : 3 * i + 3], M[:, i, 9 + i] = y, 1.0
        if markers is None:
            M[np.arange(len(y))[:, None], i, 12 + 3 * which[:, None] + np.arange(3)] = -A[:, i]
    found = np.linalg.lstsq(M.reshape(-1, M.shape[2]), in_world(m).ravel(), rcond=1e-9)[0]
    Q = nearest_turn(found[:9].reshape(3, 3))
    m = found[12:].reshape(-1, 3) if markers is None else m
    starts.append(settled(Q, np.mean(in_world(m) - y @ Q.T, axis=0), m))
    _, Q, b, m = min(starts, key=lambda own: own[0])
    return Q.T, b, m


def nearest_turn(M: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) nearest to a matrix (3, 3), never a reflection."""
    U, _, Vt = np.linalg.svd(M)
    return U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt


def _absolute_orientation(y: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation Q and shift b by which ``Q y + b`` is nearest to w, both (N, 3) (Kabsch)."""
    from scipy.spatial.transform import Rotation

    middle, other = y.mean(axis=0), w.mean(axis=0)
    with warnings.catch_warnings():  # points on one line leave a turn open, which others decide
        warnings.simplefilter("ignore")
        Q = Rotation.align_vectors(w - other, y - middle)[0].as_matrix()
    return Q, other - Q @ middle

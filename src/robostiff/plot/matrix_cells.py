"""A stiffness or compliance matrix as a heat map with its numbers."""

from __future__ import annotations

from enum import Enum

import numpy as np

from robostiff.elastostatics import scaling
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.ellipsoid import Stiffness, length_of
from robostiff.plot.picture import ColourScale, Matrix, QuarterUnit, Ramp
from robostiff.plot.posture import single_stiffness
from robostiff.plot.prefix import prefixed, short

_ZERO = 1e-12  # of the largest entry, rotations multiplied by the length: rounding
_DECADES = 4  # below the largest entry, at which the shade fades out


class Kind(Enum):
    """The matrix to draw."""

    STIFFNESS = "stiffness"
    COMPLIANCE = "compliance"


class Shade(Enum):
    """Meaning of the colours of a matrix.

    ``SIZE``
        Signed logarithm of the entries with rotations given as lengths (times the characteristic
        length), which have one unit, over four decades.
    ``COUPLING``
        Each entry over the root of the two entries of the diagonal in its row and column: 1 on
        the diagonal, -1 to 1 elsewhere.
    """

    SIZE = "size"
    COUPLING = "coupling"


def matrix(
    result: Stiffness,
    kind: Kind = Kind.STIFFNESS,
    *,
    shade: Shade = Shade.SIZE,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw the stiffness or compliance matrix with its numbers, a unit for each block.

    Entries that are zero up to rounding have no colour.

    Parameters
    ----------
    result : RobotStiffness or CableStiffness
        At a single pose.
    kind : Kind
    shade : Shade
    backend : Matplotlib

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        When the result is of several poses.
    NoAnswerError
        When there is no such matrix.

    Examples
    --------
    >>> import robostiff as rs
    >>> axes = rs.plot.matrix(rs.stiffness(rs.load("hexapod")))
    >>> [tick.get_text() for tick in axes.get_xticklabels()]
    ['dx', 'dy', 'dz', 'rx', 'ry', 'rz']
    """
    single_stiffness(result, "a matrix")
    return drawn_by(backend, matrix_picture(result, kind, shade))


def matrix_picture(
    result: Stiffness, kind: Kind = Kind.STIFFNESS, shade: Shade = Shade.SIZE
) -> Matrix:
    """The picture of `matrix`, as data."""
    space = result.space
    d, n = space.translations, space.size
    is_stiffness = kind is Kind.STIFFNESS
    A = result.K if is_stiffness else result.required_compliance()
    s = scaling(np.asarray(length_of(result)), space)
    scaled = A / np.outer(s, s) if is_stiffness else A * np.outer(s, s)
    is_zero = np.abs(scaled) <= _ZERO * np.abs(scaled).max()
    quarters = (
        (("N/m", "N/rad"), ("N m/m", "N m/rad"))
        if is_stiffness
        else (("m/N", "m/(N m)"), ("rad/N", "rad/(N m)"))
    )
    texts = [[""] * n for _ in range(n)]
    units = []
    for i, rows in enumerate(((0, d), (d, n))):
        for j, columns in enumerate(((0, d), (d, n))):
            block = np.ix_(range(*rows), range(*columns))
            values = np.where(is_zero[block], 0.0, A[block])
            times, unit = prefixed(float(np.abs(values).max()), quarters[i][j])
            units.append(QuarterUnit(unit, rows, columns))
            for (r, c), value in np.ndenumerate(values):
                texts[rows[0] + r][columns[0] + c] = short(times * value)
    shades, scale = _shades(scaled, is_zero, shade)
    named = (space.wrench_order, space.twist_order)
    rows, columns = named if is_stiffness else named[::-1]
    return Matrix(
        f"{result.name}: {kind.value}",
        rows,
        columns,
        tuple(tuple(row) for row in texts),
        shades,
        tuple(units),
        scale,
    )


def _shades(
    scaled: np.ndarray, is_zero: np.ndarray, shade: Shade
) -> tuple[np.ndarray, ColourScale]:
    if shade is Shade.COUPLING:
        size = np.sqrt(np.where(np.diag(is_zero), 1.0, np.diag(scaled)))
        label = "entry over root of the diagonal's"
        shades = scaled / np.outer(size, size)
        return np.where(is_zero, np.nan, shades), ColourScale(label, -1, 1, Ramp.SIGNED)
    part = np.abs(scaled) / np.abs(scaled).max()
    height = 1 + np.log10(np.where(is_zero, 1.0, part)) / _DECADES
    # Small is not zero: the last step of the shade is kept for it.
    shades = np.sign(scaled) * np.maximum(height, 0.05)
    ticks = tuple(
        (sign * (1 - k / _DECADES), f"{'−' if sign < 0 else ''}{name}")
        for sign in (-1, 1)
        for k, name in ((0, "1"), (2, "1/100"))
    )
    label = "relative size, rotations as lengths"
    scale = ColourScale(label, -1, 1, Ramp.SIGNED, tuple(sorted(ticks)))
    return np.where(is_zero, np.nan, shades), scale

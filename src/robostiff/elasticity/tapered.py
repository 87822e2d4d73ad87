"""Stepped and tapered beams: uniform segments one behind the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robostiff.elasticity._checks import positive_numbers
from robostiff.elasticity.beam import DEFAULT_THEORY, beam_compliance
from robostiff.elasticity.beam_theory import BeamTheory
from robostiff.elasticity.material import Material
from robostiff.elasticity.section import CrossSection
from robostiff.errors import InputError
from robostiff.spatial import exact_number, move_compliance
from robostiff.spatial.formula import exact_arrays


class BeamSegment(NamedTuple):
    """A uniform piece of a beam.

    Attributes
    ----------
    length : float or (...) array
        Length [m].
    material : Material
        What it is made of.
    section : CrossSection
        Its cross-section, with the axes of all the others.
    """

    length: ArrayLike
    material: Material
    section: CrossSection


def tapered_compliance(
    segments: Sequence[BeamSegment | tuple[ArrayLike, Material, CrossSection]],
    theory: BeamTheory = DEFAULT_THEORY,
) -> NDArray[np.float64]:
    """Tip compliance of a beam made of uniform segments, base clamped, centroids on one line.

    ``C = sum over segments of J C_segment J^T``, ``J = [[I, -(v x)], [0, I]]``, v from the tip of
    the segment to the tip of the beam.

    Parameters
    ----------
    segments : sequence of (length, material, section)
        From base to tip. A smooth taper is met with an error that falls with the square of the
        number of segments, each given the cross-section at its middle.
    theory : BeamTheory
        `EulerBernoulli()`, the default, or `Timoshenko()`.

    Returns
    -------
    (..., 6, 6) array
        Compliance [m/N, rad/N, rad/(N m)] of the tip, in the axes of the beam.

    Raises
    ------
    InputError
        No segment; something that is not a segment; or as for `beam_compliance`.

    Examples
    --------
    Two halves make the whole:

    >>> from robostiff.elasticity import beam_compliance, circle, material
    >>> half = BeamSegment(0.5, material("steel"), circle(0.020))
    >>> whole = beam_compliance(1.0, half.material, half.section)
    >>> bool(np.allclose(tapered_compliance([half, half]), whole, rtol=1e-14, atol=0))
    True
    """
    if len(segments) == 0:
        raise InputError("segments of the beam", got=segments, expected="at least one segment")
    pieces = [_segment(index, segment) for index, segment in enumerate(segments)]
    compliances = exact_arrays(*(beam_compliance(*piece, theory) for piece in pieces))
    total: NDArray | None = None
    to_tip: Any = np.zeros((), dtype=compliances[0].dtype)
    for own, (length, _, _) in zip(reversed(compliances), reversed(pieces), strict=True):
        moved = move_compliance(own, np.stack([to_tip, 0 * to_tip, 0 * to_tip], axis=-1))
        total = moved if total is None else total + moved
        to_tip = to_tip + (exact_number(length) if own.dtype == object else np.asarray(length))
    return np.asarray(total)


def _segment(index: int, segment: object) -> BeamSegment:
    if not (isinstance(segment, tuple) and len(segment) == 3):
        raise InputError(
            f"segment {index} of the beam",
            got=segment,
            expected="(length, material, section)",
        )
    length = positive_numbers(f"length of segment {index} of the beam", segment[0], "m")
    return BeamSegment(length, *segment[1:])

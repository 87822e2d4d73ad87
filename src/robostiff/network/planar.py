"""Networks in the x-y plane: what they may not contain."""

from __future__ import annotations

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial import Space

_IN_PLANE = list(Space.PLANAR.rows)
_OUT_OF_PLANE = [row for row in Space.SPATIAL.rows if row not in _IN_PLANE]
_ROUNDING = 1e-9


def check_in_plane(name: str, C: np.ndarray, J: np.ndarray) -> None:
    """Raise unless an element moves and bends in the x-y plane.

    Parameters
    ----------
    name : str
        Of the element.
    C : (6, 6) array
        Its compliance, or stiffness: the rule is the same.
    J : (6, q) array
        Twists of its passive freedoms.

    Raises
    ------
    InputError
        When a freedom leads out of the plane, or a load in the plane bends the element out of it.
    """
    if np.any(np.linalg.norm(J[_OUT_OF_PLANE], axis=0) > _ROUNDING * np.linalg.norm(J, axis=0)):
        raise InputError(
            f"passive joint {name!r} of a planar network",
            got="an axis that leads out of the x-y plane",
            expected="a rotation about z or a slide across z",
            hint="leave out 'planar: true' to compute in space",
        )
    size = np.sqrt(np.maximum(np.diagonal(C), 0.0))
    allowed = _ROUNDING * np.outer(size[_IN_PLANE], size[_OUT_OF_PLANE])
    if np.any(np.abs(C[np.ix_(_IN_PLANE, _OUT_OF_PLANE)]) > allowed):
        raise InputError(
            f"part {name!r} of a planar network",
            got="an elasticity that couples motions in the plane with motions out of it",
            expected="principal axes along and across the plane",
            hint="leave out 'planar: true' to compute in space",
        )

"""Whether matrices of six rows stay in the x-y plane, as those of planar robots must."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial import Space

_IN = list(Space.PLANAR.rows)
_OUT = [row for row in Space.SPATIAL.rows if row not in _IN]
_ROUNDING = 1e-9
_HINT = "leave out 'planar: true' to compute in space"


def check_joints_in_plane(J_q: np.ndarray, names: Sequence[str], of: str = "robot") -> None:
    """Raise unless every passive joint turns about z or slides across it."""
    out = np.linalg.norm(J_q[..., _OUT, :], axis=-2) > _ROUNDING * np.linalg.norm(J_q, axis=-2)
    if np.any(out):
        raise InputError(
            f"passive joint {names[int(np.argwhere(out)[0][-1])]!r} of a planar {of}",
            got="an axis that leads out of the x-y plane",
            expected="a rotation about z or a slide across z",
            hint=_HINT,
        )


def check_compliance_in_plane(C: np.ndarray, subject: str) -> None:
    """Raise unless loads in the plane deflect the part in the plane alone."""
    coupling, allowed = coupling_out_of_plane(C)
    if np.any(coupling > allowed):
        raise InputError(
            subject,
            got="an elasticity that couples motions in the plane with motions out of it",
            expected="principal axes along and across the plane",
            hint=_HINT,
        )


def coupling_out_of_plane(C: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sizes (..., 3, 3) of what a compliance (..., 6, 6) couples, and what rounding leaves of them.

    Rows are x, y and rz; columns are z, rx and ry.
    """
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", C), 0.0))
    allowed = _ROUNDING * size[..., _IN, None] * size[..., None, _OUT]
    return np.abs(C[..., _IN, :][..., _OUT]), allowed

"""Robots in the x-y plane: what they may not contain."""

from __future__ import annotations

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial import Space

_IN, _OUT = list(Space.PLANAR.rows), [2, 3, 4]


def check_passive_in_plane(J_q: np.ndarray, names: tuple[str, ...]) -> None:
    """Raise unless every passive joint turns about z or slides across it.

    Raises
    ------
    InputError
        Naming the joint.
    """
    out = np.linalg.norm(J_q[..., _OUT, :], axis=-2) > 1e-9 * np.linalg.norm(J_q, axis=-2)
    if np.any(out):
        name = names[int(np.argwhere(out)[0][-1])]
        raise InputError(
            f"passive joint {name!r} of a planar robot",
            got="an axis that leads out of the x-y plane",
            expected="a rotation about z or a slide across z",
            hint="leave out 'planar: true' to compute in space",
        )


def check_compliance_in_plane(C: np.ndarray, leg: str) -> None:
    """Raise unless loads in the plane deflect the leg in the plane alone.

    Raises
    ------
    InputError
        Naming the leg.
    """
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", C), 0.0))
    coupling = np.abs(C[..., _IN, :][..., :, _OUT])
    allowed = 1e-9 * size[..., _IN, None] * size[..., None, _OUT]
    if np.any(coupling > allowed):
        raise InputError(
            f"leg {leg!r} of a planar robot",
            got="a compliance that couples motions in the plane with motions out of it",
            expected="elastic parts whose principal axes lie along and across the plane",
            hint="leave out 'planar: true' to compute in space",
        )

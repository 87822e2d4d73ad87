"""Stiffness as a file of MATLAB."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.analysis import Stiffness
from robostiff.errors import InputError
from robostiff.io.whole_file import whole_file
from robostiff.page.data import page_data
from robostiff.page.stiffness import stiffness_page

_LONGEST = 63  # letters of a name of MATLAB
_LEFT_OUT = ("equation", "decided_by")


def write_matlab(path: Path, result: Stiffness) -> None:
    """Write the stiffness of a robot at a single pose as a .mat file.

    Its variables are those of ``robostiff stiffness --json`` (`stiffness`, `compliance`, `pose`,
    `rank`, ...), and ``transform``, the platform as a 4 x 4 matrix. Twists have translations first.
    What there is none of is an empty array; names of legs become names of MATLAB.

    Parameters
    ----------
    path : Path
        Replaced if it is there.
    result : Stiffness

    Raises
    ------
    InputError
        When the name does not end in .mat.
    """
    from scipy.io import savemat

    if path.suffix.lower() != ".mat":
        raise InputError("file for MATLAB", got=str(path), expected="a name that ends in .mat")
    data = {
        key: value
        for key, value in page_data(stiffness_page(result)).items()
        if key not in _LEFT_OUT
    }
    if result.pose is not None:
        data["transform"] = result.transform.as_matrix()
    with whole_file(path) as begun:
        savemat(begun, _for_matlab(data), long_field_names=True, oned_as="row")


def _for_matlab(value: Any) -> Any:
    if value is None:
        return np.zeros((0, 0))
    if isinstance(value, dict):
        names: dict[str, Any] = {}
        for key, own in value.items():
            names[_name(key, names)] = _for_matlab(own)
        return names
    if isinstance(value, list) and any(isinstance(own, str | dict) for own in value):
        cells = np.empty(len(value), dtype=object)
        cells[:] = [_for_matlab(own) for own in value]
        return cells
    return value if isinstance(value, str) else np.asarray(value, dtype=float)


def _name(key: str, taken: dict[str, Any]) -> str:
    """A name of MATLAB: letters, digits and underscores, and none twice."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", key)
    plain = (plain if plain[:1].isalpha() else f"x{plain}")[:_LONGEST]
    name, number = plain, 2
    while name in taken:
        name = f"{plain[: _LONGEST - 4]}_{number}"
        number += 1
    return name

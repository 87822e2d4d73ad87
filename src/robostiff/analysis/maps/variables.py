"""The arrays of a map: names, dimensions, units and fill values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics import Status

EXCLUDED = 256
NOT_COMPUTED = 512
NO_RANK = -1
# Flags of equilibria from 256 on, and by how many bits a map has them further on.
_UNDER_LOAD = ("unstable", "no-equilibrium", "beyond-critical-load")
_MOVED = 2


@dataclass(frozen=True)
class Variable:
    """An array of a map.

    Attributes
    ----------
    name : str
    dims : tuple of str
        After those of the poses.
    shape : tuple of int
    units : str
        Empty where the entries of a pose have several: the coordinate ``NAME_units`` has them.
    long_name : str
    dtype : str
        Of NumPy.
    labels : tuple of str
        Of its last dimension, where the places have names (of both dimensions for K).
    note : str
        What a reader must know.
    """

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    units: str
    long_name: str
    dtype: str = "float32"
    labels: tuple[tuple[str, ...], ...] = ()
    note: str = ""

    @property
    def units_of_entries(self) -> np.ndarray:
        """Units of the entries of a stiffness matrix, as UDUNITS reads them.

        Examples
        --------
        >>> order = (("Fx", "Mx"), ("dx", "rx"))
        >>> Variable("K", ("row", "column"), (2, 2), "", "", labels=order).units_of_entries.tolist()
        [['N m-1', 'N'], ['N', 'N m rad-1']]
        """
        rows, columns = self.labels
        moments = [name.startswith("M") for name in rows]
        rotations = [name.startswith("r") for name in columns]
        named = ("N m-1", "N", "N m rad-1")  # a radian is 1, and so is a metre per metre
        return np.array(
            [[named[of_row + of_column] for of_column in rotations] for of_row in moments]
        )

    @property
    def is_float(self) -> bool:
        """Whether the fill value is NaN."""
        return np.dtype(self.dtype).kind == "f"

    @property
    def missing(self) -> float | int:
        """Fill value of poses without an answer."""
        if self.is_float:
            return float("nan")
        return NO_RANK if self.name == "rank" else NOT_COMPUTED

    @property
    def bytes_a_pose(self) -> int:
        """Memory for one pose."""
        return int(np.prod(self.shape, dtype=int)) * np.dtype(self.dtype).itemsize


RANK = Variable(
    "rank",
    (),
    (),
    "1",
    "number of independent wrenches that hold the platform",
    dtype="int8",
    note=f"{NO_RANK} where the pose is out of reach or was not computed",
)
STATUS = Variable(
    "status",
    (),
    (),
    "1",
    "status of the pose",
    dtype="uint16",
    note="0: nothing to report; several flags may hold at once",
)


def status_flags() -> dict[int, str]:
    """Every flag of the variable ``status``: of `Status`, two of the map, those under load.

    Examples
    --------
    >>> status_flags()[64], status_flags()[256]
    ('unreachable', 'excluded')
    """
    flags = {int(member): str(member) for member in Status if member}
    flags |= {EXCLUDED: "excluded", NOT_COMPUTED: "not-computed"}
    return flags | {256 << _MOVED + k: name for k, name in enumerate(_UNDER_LOAD)}


def status_under_load(codes: np.ndarray) -> np.ndarray:
    """Codes of equilibria as those of a map, whose own flags have the places of their next three.

    Examples
    --------
    >>> [status_words(int(code)) for code in status_under_load(np.array([64, 256, 1024]))]
    ['unreachable', 'unstable', 'beyond-critical-load']
    """
    own = codes.astype(np.uint16)
    return (own & np.uint16(255)) | ((own & np.uint16(0x700)) << np.uint16(_MOVED))


def status_words(code: int) -> str:
    """A status code in words.

    Examples
    --------
    >>> status_words(0), status_words(9)
    ('ok', 'free-motions+beyond-limits')
    """
    return "+".join(name for flag, name in status_flags().items() if code & flag) or "ok"

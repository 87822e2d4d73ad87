"""Maps as CSV files, a line for each pose."""

from __future__ import annotations

import math
import os
from collections.abc import Hashable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from robostiff.analysis.maps.variables import status_words
from robostiff.errors import printable
from robostiff.io.whole_file import whole_file

if TYPE_CHECKING:
    import xarray

_ROWS = 50_000
_UNITS_OF_K = {("F", "d"): "N/m", ("F", "r"): "N/rad", ("M", "d"): "N m/m", ("M", "r"): "N m/rad"}


def write_map_csv(found: xarray.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a map as CSV, whole or not at all; see `map_csv_lines`.

    Parameters
    ----------
    found : xarray.Dataset
        From `stiffness_map`.
    path : path
        Overwritten.

    Raises
    ------
    OSError
    """
    with whole_file(path) as begun, begun.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in map_csv_lines(found))


def map_csv_lines(found: xarray.Dataset) -> Iterator[str]:
    """A map as lines of CSV: headings with units, then a line a pose.

    Coordinates, quantities, rank, and the status in words. A field is empty where there is no
    answer. All digits are written.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = rs.stiffness_map(rs.load("3-puu"), rs.Grid(x=rs.Axis(0, 5, 2)), [])
    >>> list(map_csv_lines(found))
    ['x [m],rank,status', '0.0,6,ok', '5.0,-1,unreachable']
    """
    dims = found["status"].dims
    shape = tuple(found.sizes[dim] for dim in dims)
    columns = list(_columns(found, dims))
    yield ",".join(heading for heading, _, _ in columns)
    count = int(np.prod(shape))
    for start in range(0, count, _ROWS):
        rows = np.arange(start, min(start + _ROWS, count))
        place = dict(zip(dims, np.unravel_index(rows, shape), strict=True))
        texts = [
            _texts(heading, values[tuple(place[dim] for dim in own)])
            for heading, own, values in columns
        ]
        yield from (",".join(row) for row in zip(*texts, strict=True))


def _columns(
    found: xarray.Dataset, dims: tuple[Hashable, ...]
) -> Iterator[tuple[str, tuple[Hashable, ...], np.ndarray]]:
    """Heading, dimensions of the poses and values of each column."""
    for name in [*found.coords, *found.data_vars]:
        array = found[name]
        along = tuple(dim for dim in array.dims if dim in dims)
        if not along:
            continue  # names of rows and columns go into the headings
        values = array.values
        own = tuple(dim for dim in array.dims if dim not in dims)
        labels = [
            [str(v) for v in found[dim].values]
            if dim in found.coords
            else [str(k + 1) for k in range(found.sizes[dim])]
            for dim in own
        ]
        for index in np.ndindex(*(len(words) for words in labels)):
            words = [labels[k][i] for k, i in enumerate(index)]
            unit = array.attrs.get("units", "1")
            if len(words) == 2:
                unit = _UNITS_OF_K[words[0][0], words[1][0]]
            elif f"{name}_units" in found.coords:
                unit = str(found[f"{name}_units"].values[index])
            heading = "_".join([str(name), *words])
            heading += "" if unit == "1" else f" [{unit}]"
            yield _field(heading), along, values[(..., *index)]


def _field(heading: str) -> str:
    """A heading as a single field that spreadsheets do not interpret as a formula.

    Examples
    --------
    >>> _field("=1+1 [m]"), _field('the "slide", long')
    ("'=1+1 [m]", '"the ""slide""; long"')
    """
    shown = printable(heading).replace(",", ";")
    if heading[:1] in tuple("=+-@\t\r"):
        shown = f"'{shown}"
    return '"' + shown.replace('"', '""') + '"' if '"' in shown else shown


def _texts(heading: str, values: np.ndarray) -> list[str]:
    if heading == "status":
        words = {int(code): status_words(int(code)) for code in np.unique(values)}
        return [words[code] for code in values.tolist()]
    if values.dtype.kind != "f":
        return [str(value) for value in values.tolist()]
    # As few digits as reproduce the number exactly; nine suffice for single precision.
    written = repr if values.dtype.itemsize == 8 else "{:.9g}".format
    return ["" if math.isnan(value) else written(value) for value in values.tolist()]

"""Maps, and what reductions keep of them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.elastostatics import Status
from robostiff.markup import Block, Cell, Facts, Number, Page, Table, number

if TYPE_CHECKING:
    import xarray

_LARGEST = 2**28  # bytes of a variable that is looked through for its extremes


def map_page(found: xarray.Dataset) -> Page:
    """How many poses are reachable, their statuses, and where quantities are least and greatest.

    Parameters
    ----------
    found : Dataset
        Of `stiffness_map`.
    """
    counts = ("poses", "poses_computed", "poses_reachable", "poses_guarded")
    facts: dict[str, Any] = {name: int(found.attrs[name]) for name in counts}
    facts["statuses"] = json.loads(found.attrs["statuses"])
    poses, computed, reachable, guarded = (facts[name] for name in counts)
    rows = [("reachable", f"{reachable} ({_percent(reachable, computed)})")]
    if computed != poses:
        rows.insert(0, ("computed", str(computed)))
    rows.append(("status", ", ".join(f"{name} {n}" for name, n in facts["statuses"].items())))
    if guarded:
        rows.append(("recomputed by the batched form", _percent(guarded, computed)))
    blocks: list[Block] = [Facts(tuple(rows))]
    place = f": {poses} poses"
    if "status" not in found:
        facts["reductions"] = {str(name): _reduction(own) for name, own in found.data_vars.items()}
        blocks += [_table(name, own) for name, own in facts["reductions"].items()]
    else:
        facts["dimensions"] = {str(dim): int(found.sizes[dim]) for dim in found["status"].dims}
        shape = (f"{name} {size}" for name, size in facts["dimensions"].items())
        place += f" ({' x '.join(shape)})"
        ranged = [name for name, own in found.data_vars.items() if "actual_range" in own.attrs]
        facts["ranges"] = {
            str(name): [*map(float, own.attrs["actual_range"]), own.attrs["units"]]
            for name, own in found[ranged].data_vars.items()
        }
        facts["extremes"] = {
            str(name): _extremes(found, own)
            for name, own in found[ranged].data_vars.items()
            if own.nbytes <= _LARGEST
        }
        blocks += [_ranges(facts["ranges"], facts["extremes"])] if ranged else []
    return Page(found.attrs["robot"], place, None, blocks, data=facts)


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole if whole else 0:.4g} %"


def _reduction(own: xarray.DataArray) -> dict[str, Any]:
    values = own.to_numpy()
    return {
        "units": own.attrs.get("units", "1"),
        "dimensions": list(map(str, own.dims)),
        "labels": [own[d].values.tolist() if d in own.coords else None for d in own.dims],
        "values": np.where(np.isnan(values), np.array(None), values.astype(object)).tolist(),
    }


def _table(name: str, own: dict[str, Any]) -> Table:
    """A row for each label of the first dimension, all entries of the variable side by side."""
    values = np.array(own["values"], dtype=float)
    rows: list[list[Cell]] = [
        [label if isinstance(label, str) else number(label), *map(Number, entries)]
        for label, entries in zip(own["labels"][0], values.reshape(len(values), -1), strict=True)
    ]
    unit = "" if own["units"] == "1" else f" [{own['units']}]"
    return Table((own["dimensions"][0], *[""] * (len(rows[0]) - 1)), rows, f"{name}{unit}")


def _extremes(found: xarray.Dataset, array: xarray.DataArray) -> dict[str, Any]:
    """Poses of the least and the greatest value of a variable, and their statuses."""
    dims, own = found["status"].dims, {}
    values = array.to_numpy()
    for end, index_of in (("least", np.nanargmin), ("greatest", np.nanargmax)):
        index = np.unravel_index(index_of(values), values.shape)
        place = dict(zip(array.dims, index, strict=True))
        here = found.isel({dim: place[dim] for dim in dims})
        units = {str(n): c.attrs.get("units") for n, c in here.coords.items()}
        pose = {n: float(here[n]) for n, unit in units.items() if unit in {"m", "rad", "1"}}
        own[end] = {"pose": pose, "status": str(Status(int(here["status"])))}
        for dim in array.dims:
            if dim in found.coords and found[dim].dtype.kind == "U":  # such as an actuator
                own[end]["of"] = str(found[dim].values[place[dim]])
    return own


def _ranges(ranges: dict[str, Any], extremes: dict[str, Any]) -> Table:
    rows: list[list[Cell]] = []
    for name, (low, high, unit) in ranges.items():
        for end, value in (("least", low), ("greatest", high)):
            own = extremes.get(name, {}).get(end, {"pose": {}, "status": ""})
            at = ", ".join(f"{n} {number(x)}" for n, x in own["pose"].items())
            words = f"{end} {name.replace('_', ' ')}" + (f" of {own['of']}" if "of" in own else "")
            rows.append([words, Number(value, "" if unit == "1" else unit), at, own["status"]])
    return Table(("quantity", "value", "at [m, rad]", "status"), rows)

"""Maps, and what reductions keep of them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.elastostatics import Status
from robostiff.markup import Block, Facts, Number, Page, Table, number, percent

if TYPE_CHECKING:
    import xarray

_LARGEST = 2**28  # bytes of a variable that is looked through for its extremes


def map_page(dataset: xarray.Dataset) -> Page:
    """How many poses are reachable, their statuses, and where quantities are least and greatest."""
    counts = ("poses", "poses_computed", "poses_reachable", "poses_guarded")
    facts: dict[str, Any] = {name: int(dataset.attrs[name]) for name in counts}
    facts["statuses"] = json.loads(dataset.attrs["statuses"])
    poses, computed, reachable, guarded = (facts[name] for name in counts)
    whole = max(computed, 1)
    rows: list[Any] = [("reachable", f"{reachable} ({percent(reachable / whole)})")]
    if computed != poses:
        rows.insert(0, ("computed", str(computed)))
    rows.append(("status", ", ".join(f"{name} {n}" for name, n in facts["statuses"].items())))
    if guarded:
        rows.append(("recomputed by the batched form", percent(guarded / whole)))
    blocks: list[Block] = [Facts(tuple(rows))]
    place = f": {poses} pose{'s' * (poses != 1)}"
    if "status" not in dataset:
        facts["reductions"] = {}
        for name, array in dataset.data_vars.items():
            unit = "m, rad" if "coordinate" in array.dims else array.attrs.get("units", "1")
            values = array.to_numpy()
            labels = [array[d].values.tolist() if d in array.coords else None for d in array.dims]
            facts["reductions"][str(name)] = {
                "units": unit,
                "dimensions": list(map(str, array.dims)),
                "labels": labels,
                "values": values,
            }
            # a row for each label of the first dimension, all entries of the array beside it
            rows = [
                [label if isinstance(label, str) else number(label), *map(Number, entries)]
                for label, entries in zip(
                    labels[0] or (), values.reshape(len(values), -1), strict=True
                )
            ]
            head = (str(array.dims[0]), *[""] * (len(rows[0]) - 1))
            blocks.append(Table(head, rows, str(name) + ("" if unit == "1" else f" [{unit}]")))
    else:
        facts["dimensions"] = {str(dim): int(dataset.sizes[dim]) for dim in dataset["status"].dims}
        shape = (f"{name} {size}" for name, size in facts["dimensions"].items())
        place += f" ({' x '.join(shape)})"
        ranged = [name for name, x in dataset.data_vars.items() if "actual_range" in x.attrs]
        facts["ranges"] = {
            str(name): [*map(float, x.attrs["actual_range"]), x.attrs["units"]]
            for name, x in dataset[ranged].data_vars.items()
        }
        facts["extremes"] = {
            str(name): _extremes(dataset, x)
            for name, x in dataset[ranged].data_vars.items()
            if x.nbytes <= _LARGEST
        }
        rows = []
        for name, (low, high, unit) in facts["ranges"].items():
            for end, value in (("least", low), ("greatest", high)):
                spot = facts["extremes"].get(name, {}).get(end, {"pose": {}, "status": ""})
                at = ", ".join(f"{n} {number(x)}" for n, x in spot["pose"].items())
                words = f"{end} {name.replace('_', ' ')}"
                words += f" of {spot['of']}" if "of" in spot else ""
                rows.append([words, Number(value, "" if unit == "1" else unit), at, spot["status"]])
        if rows:
            blocks.append(Table(("quantity", "value", "at [m, rad]", "status"), rows))
    return Page(dataset.attrs["robot"], place, None, blocks, data=facts)


def _extremes(dataset: xarray.Dataset, array: xarray.DataArray) -> dict[str, Any]:
    """Poses of the least and the greatest value of a variable, and their statuses."""
    values, extremes = array.to_numpy(), {}
    for end, index_of in (("least", np.nanargmin), ("greatest", np.nanargmax)):
        index = np.unravel_index(index_of(values), values.shape)
        place = dict(zip(array.dims, index, strict=True))
        cell = dataset.isel({dim: place[dim] for dim in dataset["status"].dims})
        units = {str(n): c.attrs.get("units") for n, c in cell.coords.items()}
        pose = {n: float(cell[n]) for n, unit in units.items() if unit in {"m", "rad", "1"}}
        extremes[end] = {"pose": pose, "status": str(Status(int(cell["status"])))}
        for dim in array.dims:
            if dim in dataset.coords and dataset[dim].dtype.kind == "U":  # such as an actuator
                extremes[end]["of"] = str(dataset[dim].values[place[dim]])
    return extremes

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
    whole = max(computed, 1)
    rows: list[Any] = [("reachable", f"{reachable} ({percent(reachable / whole)})")]
    if computed != poses:
        rows.insert(0, ("computed", str(computed)))
    rows.append(("status", ", ".join(f"{name} {n}" for name, n in facts["statuses"].items())))
    if guarded:
        rows.append(("recomputed by the batched form", percent(guarded / whole)))
    blocks: list[Block] = [Facts(tuple(rows))]
    place = f": {poses} poses"
    if "status" not in found:
        facts["reductions"] = {}
        for name, own in found.data_vars.items():
            values, unit = own.to_numpy(), own.attrs.get("units", "1")
            labels = [own[d].values.tolist() if d in own.coords else None for d in own.dims]
            facts["reductions"][str(name)] = {
                "units": unit,
                "dimensions": list(map(str, own.dims)),
                "labels": labels,
                "values": np.where(np.isnan(values), np.array(None), values.astype(object)),
            }
            # a row for each label of the first dimension, all entries of the variable beside it
            rows = [
                [label if isinstance(label, str) else number(label), *map(Number, entries)]
                for label, entries in zip(
                    labels[0] or (), values.reshape(len(values), -1), strict=True
                )
            ]
            head = (str(own.dims[0]), *[""] * (len(rows[0]) - 1))
            blocks.append(Table(head, rows, str(name) + ("" if unit == "1" else f" [{unit}]")))
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
        rows = []
        for name, (low, high, unit) in facts["ranges"].items():
            for end, value in (("least", low), ("greatest", high)):
                own = facts["extremes"].get(name, {}).get(end, {"pose": {}, "status": ""})
                at = ", ".join(f"{n} {number(x)}" for n, x in own["pose"].items())
                words = f"{end} {name.replace('_', ' ')}"
                words += f" of {own['of']}" if "of" in own else ""
                rows.append([words, Number(value, "" if unit == "1" else unit), at, own["status"]])
        if rows:
            blocks.append(Table(("quantity", "value", "at [m, rad]", "status"), rows))
    return Page(found.attrs["robot"], place, None, blocks, data=facts)


def _extremes(found: xarray.Dataset, array: xarray.DataArray) -> dict[str, Any]:
    """Poses of the least and the greatest value of a variable, and their statuses."""
    values, own = array.to_numpy(), {}
    for end, index_of in (("least", np.nanargmin), ("greatest", np.nanargmax)):
        index = np.unravel_index(index_of(values), values.shape)
        place = dict(zip(array.dims, index, strict=True))
        here = found.isel({dim: place[dim] for dim in found["status"].dims})
        units = {str(n): c.attrs.get("units") for n, c in here.coords.items()}
        pose = {n: float(here[n]) for n, unit in units.items() if unit in {"m", "rad", "1"}}
        own[end] = {"pose": pose, "status": str(Status(int(here["status"])))}
        for dim in array.dims:
            if dim in found.coords and found[dim].dtype.kind == "U":  # such as an actuator
                own[end]["of"] = str(found[dim].values[place[dim]])
    return own

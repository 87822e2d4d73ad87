"""A map as an `xarray.Dataset`: coordinates and attributes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.maps.job import MapJob, MapSummary
from robostiff.analysis.maps.pose_columns import FACTOR
from robostiff.analysis.maps.variables import Variable, status_flags, status_words
from robostiff.errors import InputError
from robostiff.version import __version__

if TYPE_CHECKING:
    import xarray


_CONVENTIONS = (
    "F = K t; twist: displacement of the reference point, then rotation; wrench: force, then "
    "moment about the reference point; world axes; SI units; rx ry rz: rotation vector. "
    "NaN: no answer at this pose; 'status' gives the reason."
)


def coordinate_arrays(job: MapJob) -> dict[str, tuple[tuple[str, ...], Any, dict[str, Any]]]:
    """Axes of a grid, time along a list, names of rows and columns: dimensions, values, attributes.

    Coordinates that each pose has of its own are variables of the job instead.
    """
    source = job.source
    found: dict[str, tuple[tuple[str, ...], Any, dict[str, Any]]] = {}
    for name, values in source.axis_values().items():
        attributes = {"units": job.columns.unit_of(name), "long_name": _meaning(job, name)}
        found[name] = (name,), values, attributes
    parameter = source.parameter()
    if parameter is not None:
        name, unit, values = parameter
        long_name = "time" if unit == "s" else "length along the path"
        attributes = {"units": unit, "long_name": long_name}
        found[name] = source.dims, values, attributes
    for variable in job.answers:
        for dim, labels in zip(variable.dims, variable.labels, strict=False):
            found[dim] = (dim,), np.array(labels), {"long_name": dim}
        if not isinstance(variable.units, str):
            about = {"long_name": f"unit of each entry of {variable.name}"}
            found[f"{variable.name}_units"] = variable.dims, np.array(variable.units), about
    taken = {v.name for v in job.answers} | {d for v in job.variables for d in v.dims}
    taken |= {"entry", "progress"}  # of a store
    for name in source.names:
        if name in taken or "/" in name:
            raise InputError(
                "name of a joint in a map",
                got=name,
                expected=f"none of {', '.join(sorted(taken))}, and without /",
                hint="rename the joint in its file",
            )
    return found


def own_coordinates(job: MapJob) -> list[str]:
    """Names of the coordinates that are no dimension: of single poses, time, units of entries."""
    found = [v.name for v in job.coordinates]
    found += [name for name, (dims, *_) in coordinate_arrays(job).items() if dims != (name,)]
    return found


def variable_attributes(job: MapJob, variable: Variable) -> dict[str, Any]:
    """Units and words of a variable, and the flags of the status (CF conventions, 3.5)."""
    is_coordinate = variable in job.coordinates
    attributes: dict[str, Any] = {
        "units": variable.units if isinstance(variable.units, str) else "",
        "long_name": _meaning(job, variable.name) if is_coordinate else variable.long_name,
        "comment": variable.note,
    }
    if variable.name == "status":
        flags = status_flags()
        attributes |= {key: list(flags) for key in ("flag_masks", "flag_values")}
        attributes["flag_meanings"] = " ".join(flags.values())
    return {name: own for name, own in attributes.items() if own}


def map_attributes(job: MapJob) -> dict[str, Any]:
    """Attributes that are known before the first pose is computed."""
    asked, columns = job.evaluator, job.columns
    robot = asked.robot
    attributes: dict[str, Any] = {
        "Conventions": "CF-1.11",
        "title": f"stiffness map of {robot.name}",
        "robot": robot.name,
        "robot_title": robot.title,
        "source": robot.source.strip(),
        "robostiff_version": __version__,
        "method": asked.method,
        "conventions": _CONVENTIONS,
        "reference_point": [float(x) for x in robot.reference_point],
        "reference_point_comment": "in the platform frame [m]",
        "pose_coordinates": " ".join(columns.names),
        "home_pose": list(columns.home),
        "wrench_order": " ".join(robot.space.wrench_order),
        "characteristic_length": asked.length,
    }
    if asked.wrench:
        attributes["wrench"] = list(asked.wrench)
    if asked.near:
        attributes["near"] = list(asked.near)
    return attributes


def summary_attributes(summary: MapSummary) -> dict[str, Any]:
    """Attributes that are known when all poses are computed."""
    words = {status_words(code): count for code, count in summary.statuses.items()}
    return {
        "poses": summary.poses,
        "poses_computed": summary.computed,
        "poses_reachable": summary.reachable,
        "poses_guarded": summary.guarded,
        "statuses": json.dumps(words),
    }


def _meaning(job: MapJob, name: str) -> str:
    columns = job.columns
    if name in columns.names[len(columns.names) - columns.loads :]:
        return "factor of the wrench" if name == FACTOR else f"{name} of the wrench"
    if job.columns.of_joints:
        return f"joint coordinate {name}"
    axis = name[-1]
    return f"rotation vector, {axis}" if name.startswith("r") else f"platform position, {axis}"


class MapArrays:
    """A map in memory; blocks may be filled by several threads."""

    def __init__(self, job: MapJob) -> None:
        self.job = job
        poses = job.partition.poses
        # Equal entries of all poses side by side: a block is a run in each of them.
        self._rows = {v.name: np.empty((*v.shape, poses), v.dtype) for v in job.variables}

    def compute(self, index: int) -> MapSummary:
        """Compute a block in its place."""
        run = slice(*self.job.partition.run(index))
        places = {name: rows[..., run] for name, rows in self._rows.items()}
        return self.job.compute(index, places)

    def dataset(self, summary: MapSummary) -> xarray.Dataset:
        """The map, once all blocks are there."""
        import xarray

        job, arrays = self.job, {}
        for v in job.variables:
            whole, n = self._rows[v.name].reshape(*v.shape, *job.partition.shape), len(v.shape)
            values = np.moveaxis(whole, range(n), range(-n, 0))
            about = variable_attributes(job, v)
            if v.name in summary.ranges:
                about["actual_range"] = list(summary.ranges[v.name])
            arrays[v.name] = (*job.source.dims, *v.dims), values, about
        attributes = {**map_attributes(job), **summary_attributes(summary)}
        made = xarray.Dataset({**arrays, **coordinate_arrays(job)}, attrs=attributes)
        return made.set_coords(own_coordinates(job))

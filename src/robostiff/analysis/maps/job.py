"""The work of a map, cut into blocks, and what is known of it: coordinates, attributes, summary."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.analysis.maps.evaluator import MOST_BY_KERNEL, MapEvaluator, poses_at
from robostiff.analysis.maps.pose_columns import FACTOR, PoseColumns
from robostiff.analysis.maps.pose_source import PoseSource
from robostiff.analysis.maps.variables import EXCLUDED, Variable, status_flags, status_words
from robostiff.analysis.record_file import plain
from robostiff.elastostatics import Status
from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.version import __version__


@frozen
class MapSummary:
    """Counts and ranges of some poses, of one block or of a whole map."""

    statuses: Mapping[int, int] = field(default_factory=dict)  # how many poses have each status
    guarded: int = 0  # poses that a kernel gave to the direct form
    resumed: int = 0  # poses that were on disk before
    # Smallest and largest value of each variable in one unit; none where no pose has an answer
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def poses(self) -> int:
        """All of them, those excluded as well."""
        return sum(self.statuses.values())

    @property
    def computed(self) -> int:
        """Number of poses to compute: without those that `where` leaves out."""
        return self.poses - self.statuses.get(EXCLUDED, 0)

    @property
    def reachable(self) -> int:
        """Poses asked for that all legs reach, or at which tensions of cables are found."""
        without = int(Status.UNREACHABLE | Status.INFEASIBLE)
        out = sum(n for code, n in self.statuses.items() if code & without)
        return self.computed - out

    def __add__(self, other: MapSummary) -> MapSummary:
        statuses, ranges = Counter(self.statuses), dict(self.ranges)
        statuses.update(other.statuses)
        for name, (low, high) in other.ranges.items():
            least, most = ranges.get(name, (low, high))
            ranges[name] = (min(low, least), max(high, most))
        counts = self.guarded + other.guarded, self.resumed + other.resumed
        return MapSummary(dict(sorted(statuses.items())), *counts, ranges)


def summarize(
    arrays: Mapping[str, np.ndarray], variables: Iterable[Variable], guarded: int
) -> MapSummary:
    """Summary of a block of arrays (..., N)."""
    ranges: dict[str, tuple[float, float]] = {}
    for variable in variables:
        # Of one unit, and no mixed components: least and greatest entry mean something.
        if variable.is_float and isinstance(variable.units, str) and variable.magnitude is None:
            values = arrays[variable.name]
            low, high = np.fmin.reduce(values, axis=None), np.fmax.reduce(values, axis=None)
            if np.isfinite(low):
                ranges[variable.name] = (float(low), float(high))
    return MapSummary(count_of_each(arrays["status"]), guarded, 0, ranges)


def count_of_each(status: np.ndarray) -> dict[int, int]:
    """How many poses have each status."""
    if status.size and np.all(status == status[0]):  # faster
        return {int(status[0]): status.size}
    counts = np.bincount(status)
    return {int(code): int(counts[code]) for code in np.flatnonzero(counts)}


MOST_POSES = 10**12
_SAMPLED_BLOCKS = 16  # of a selection
# Small enough for the cache, large enough to hide the cost of a block.
_BLOCK_BYTES = 4 * 2**20


@frozen
class Partition:
    """Blocks of a map.

    Whole trailing axes, a piece of one axis, single values of those before: such a block is one
    run of poses in memory and one chunk of every array of a store.
    """

    shape: tuple[int, ...]  # of the map
    block: tuple[int, ...]  # of a block; the last one along an axis may be shorter

    @classmethod
    def of(cls, shape: tuple[int, ...], most: int) -> Partition:
        """The fewest blocks of at most so many poses."""
        block = [1] * len(shape)
        room = max(most, 1)
        for k in reversed(range(len(shape))):
            if shape[k] > room:
                pieces = -(-shape[k] // room)
                block[k] = -(-shape[k] // pieces)
                break
            block[k] = shape[k]
            room //= shape[k]
        return cls(shape, tuple(block))

    @property
    def pieces(self) -> tuple[int, ...]:
        """How many blocks lie along each axis."""
        return tuple(-(-n // b) for n, b in zip(self.shape, self.block, strict=True))

    @property
    def poses(self) -> int:
        """How many poses there are."""
        return math.prod(self.shape)

    def __len__(self) -> int:
        return math.prod(self.pieces)

    def place(self, index: int) -> tuple[int, ...]:
        """Which block along each axis."""
        return tuple(int(i) for i in np.unravel_index(index, self.pieces))

    def slices(self, index: int) -> tuple[slice, ...]:
        """Where a block lies."""
        axes = zip(self.place(index), self.block, self.shape, strict=True)
        return tuple(slice(i * b, min(i * b + b, n)) for i, b, n in axes)

    def run(self, index: int) -> tuple[int, int]:
        """First pose of a block in memory order, and the first after it."""
        part = self.slices(index)
        start = int(np.ravel_multi_index([s.start for s in part], self.shape))
        return start, start + math.prod(s.stop - s.start for s in part)


Selection = Callable[[Mapping[str, np.ndarray]], np.ndarray]
"""Takes arrays of coordinates by name, one entry a pose; returns which poses to compute."""


@frozen
class MapJob:
    """Everything that a worker needs; picklable."""

    evaluator: MapEvaluator
    source: PoseSource
    where: Selection | None = None

    @property
    def columns(self) -> PoseColumns:
        """What the numbers of a pose are."""
        return self.evaluator.columns

    @cached_property
    def coordinates(self) -> tuple[Variable, ...]:
        """Coordinates that each pose has of its own, as variables; none of a grid."""
        along = self.source.axis_values()
        return tuple(
            Variable(name, (), (), self.columns.unit_of(name), "pose coordinate", dtype="float64")
            for name in self.source.names
            if name not in along
        )

    @cached_property
    def answers(self) -> tuple[Variable, ...]:
        """What is computed at each pose; the magnitude of a vector follows it."""
        computed = self.evaluator.variables
        return tuple(x for v in computed for x in (v, v.magnitude) if x is not None)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """What a block holds: coordinates of its poses, then the answers."""
        return (*self.coordinates, *self.answers)

    @cached_property
    def partition(self) -> Partition:
        """The blocks, which depend on the poses only, not on the processors."""
        most, e = _BLOCK_BYTES // sum(v.bytes_a_pose for v in self.variables), self.evaluator
        at_once = e.direct.at_once if e.kernel is None else MOST_BY_KERNEL  # about half a second
        return Partition.of(self.source.shape, min(most, at_once))

    def poses(self, part: tuple[slice, ...]) -> np.ndarray:
        """Poses of a block (N, n_coordinates), equal coordinates side by side in memory."""
        values = self.source.values(part)
        count = math.prod(values.shape[1:])
        if self.source.names == self.columns.names:
            return values.reshape(-1, count).T
        columns = np.empty((len(self.columns.names), count))
        for k, (name, home) in enumerate(zip(self.columns.names, self.columns.home, strict=True)):
            own = name in self.source.names
            columns[k] = values[self.source.names.index(name)].reshape(count) if own else home
        return columns.T

    def selection(self, poses: np.ndarray) -> np.ndarray | None:
        """Which poses to compute (N,); None for all of them."""
        if self.where is None:
            return None
        answer = np.asarray(self.where(dict(zip(self.columns.names, poses.T, strict=True))))
        if answer.dtype != bool or answer.shape not in {(), (len(poses),)}:
            raise InputError(
                "answer of 'where'",
                got=Words(f"an array of {answer.dtype}, shape {answer.shape}"),
                expected=f"an array of bool, shape ({len(poses)},)",
                hint='write where=lambda pose: pose["x"]**2 + pose["y"]**2 < 0.01',
            )
        return np.broadcast_to(answer, (len(poses),))

    def compute(self, index: int, out: Mapping[str, np.ndarray]) -> MapSummary:
        """Fill arrays (..., N), one a variable, at the poses of a block, and sum them up."""
        poses = self.poses(self.partition.slices(index))
        guarded = int(np.count_nonzero(self.fill(poses, out)))
        return summarize(out, self.answers, guarded)

    def room(self, count: int, variables: Iterable[Variable]) -> dict[str, np.ndarray]:
        """Arrays (..., N) for so many poses."""
        return {v.name: np.empty((*v.shape, count), v.dtype) for v in variables}

    def fill(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray], *, again: bool = True
    ) -> np.ndarray:
        """Fill arrays (..., N) at poses, and return where a kernel is not trusted (N,).

        The direct form computes these, if `again`. Coordinates without an array are left out.
        """
        for variable in (v for v in self.coordinates if v.name in out):
            out[variable.name][...] = poses[:, self.columns.names.index(variable.name)]
        evaluator, chosen = self.evaluator, self.selection(poses)
        if chosen is None or bool(np.all(chosen)):
            places = {v.name: np.moveaxis(out[v.name], -1, 0) for v in evaluator.variables}
            guarded = evaluator.evaluate(poses, places, again=again)
        else:
            part = self.room(int(np.count_nonzero(chosen)), evaluator.variables)
            places = {v.name: np.moveaxis(part[v.name], -1, 0) for v in evaluator.variables}
            guarded = np.zeros(len(poses), dtype=bool)
            guarded[chosen] = evaluator.evaluate(poses_at(poses, chosen), places, again=again)
            for v in evaluator.variables:
                out[v.name][...] = EXCLUDED if v.name == "status" else v.missing
                out[v.name][..., chosen] = part[v.name]
        for variable in evaluator.variables:
            if variable.magnitude:
                components = out[variable.name].astype(float)
                out[variable.magnitude.name][...] = np.linalg.norm(components, axis=0)
        return guarded


def identity(job: MapJob) -> dict[str, Any]:
    """Everything on which a map depends, part by part."""
    e, selected = job.evaluator, None
    if job.where is not None:
        # Functions cannot be compared: the poses that it selects in some blocks
        count, selected = len(job.partition), []
        for k in np.unique(np.linspace(0, count - 1, min(count, _SAMPLED_BLOCKS)).astype(int)):
            answer = job.selection(job.poses(job.partition.slices(int(k))))
            selected.append(np.packbits(np.asarray(answer, dtype=bool)))
    names = ("quantities", "wrench", "length", "dtype", "near")
    settings = {**{name: getattr(e, name) for name in names}, "method": e.direct.about}
    return {
        "robot": plain(e.robot),
        "poses": plain([job.source.description(), job.partition.block]),
        "quantities": plain(settings),
        "selection": plain(selected),
        "method": e.method,
        "version of robostiff": __version__,
    }


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
    arrays: dict[str, tuple[tuple[str, ...], Any, dict[str, Any]]] = {}
    for name, values in source.axis_values().items():
        attributes = {"units": job.columns.unit_of(name), "long_name": _meaning(job, name)}
        arrays[name] = (name,), values, attributes
    parameter = source.parameter()
    if parameter is not None:
        name, unit, values = parameter
        long_name = "time" if unit == "s" else "length along the path"
        attributes = {"units": unit, "long_name": long_name}
        arrays[name] = source.dims, values, attributes
    for variable in job.answers:
        for dim, labels in zip(variable.dims, variable.labels, strict=False):
            arrays[dim] = (dim,), np.array(labels), {"long_name": dim}
        if not isinstance(variable.units, str):
            about = {"long_name": f"unit of each entry of {variable.name}"}
            arrays[f"{variable.name}_units"] = variable.dims, np.array(variable.units), about
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
    return arrays


def auxiliary_coordinates(job: MapJob) -> list[str]:
    """Names of the coordinates that are no dimension: of single poses, time, units of entries."""
    names = [v.name for v in job.coordinates]
    names += [name for name, (dims, *_) in coordinate_arrays(job).items() if dims != (name,)]
    return names


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
    return {name: value for name, value in attributes.items() if value}


def map_attributes(job: MapJob) -> dict[str, Any]:
    """Attributes that are known before the first pose is computed."""
    evaluator, columns = job.evaluator, job.columns
    robot = evaluator.robot
    attributes: dict[str, Any] = {
        "Conventions": "CF-1.11",
        "title": f"stiffness map of {robot.name}",
        "robot": robot.name,
        "robot_title": robot.title,
        "source": robot.source.strip(),
        "robostiff_version": __version__,
        "method": evaluator.method,
        "conventions": _CONVENTIONS,
        "reference_point": [float(x) for x in robot.reference_point],
        "reference_point_comment": "in the platform frame [m]",
        "pose_coordinates": " ".join(columns.names),
        "home_pose": list(columns.home),
        "wrench_order": " ".join(robot.space.wrench_order),
        "characteristic_length": evaluator.length,
    }
    if evaluator.wrench:
        attributes["wrench"] = list(evaluator.wrench)
    if evaluator.near:
        attributes["near"] = list(evaluator.near)
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

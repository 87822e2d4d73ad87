"""The request for a map, checked before the first pose is computed."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from robostiff.analysis.cable_tensions import cable_tensions
from robostiff.analysis.identity import plain
from robostiff.analysis.maps.dataset import coordinate_arrays, map_attributes
from robostiff.analysis.maps.evaluator import Evaluator, MapEvaluator
from robostiff.analysis.maps.job import MOST_POSES, MapJob, Selection
from robostiff.analysis.maps.pose_columns import Mapped, columns_under_load, pose_columns
from robostiff.analysis.maps.pose_source import PoseSource
from robostiff.analysis.maps.variables import Quantity
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.result import given_wrenches
from robostiff.compiled import Backend
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near
from robostiff.kinematics.pose import near_coordinates
from robostiff.linkage import Linkage
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.spatial import as_float
from robostiff.version import __version__


@dataclass(frozen=True)
class Compiled:
    """By the robot's kernel, see `robostiff.compile`; unsafe poses by the batched form.

    Parameters
    ----------
    backend : Backend
    """

    backend: Backend = Backend.BEST


@dataclass(frozen=True)
class Batched:
    """By the wrench basis form on batches of poses, see `robostiff.stiffness`."""


class LoadedMethod(Protocol):
    """A method whose poses have loads beside coordinates; see `robostiff.UnderLoad`."""

    def evaluator(self, like: MapEvaluator, count: int) -> Evaluator:
        """What computes a map of so many poses."""
        ...


Method = Compiled | Batched

_MEMORY_SHARE = 0.8
_SHRINKS = 20  # how much smaller a map may become on disk
_SAMPLED_BLOCKS = 16
# A kernel takes as long to make as the batched form takes for so many poses of a hexapod, or
# longer where no record of it is kept.
_WORTH_COMPILING = 10_000
_LINKAGE_PAYS = 40  # as many networks


@dataclass(frozen=True)
class MapRequest:
    """A map that can be made."""

    job: MapJob
    attributes: Mapping[str, Any]  # of the map
    robot: Mapped
    settings: Mapping[str, Any]  # quantities, wrench and characteristic length

    def identity(self) -> dict[str, Any]:
        """Everything on which the map depends, part by part."""
        job = self.job
        return {
            "robot": plain(self.robot),
            "poses": plain([job.source.description(), job.partition.block]),
            "quantities": plain(self.settings),
            "selection": plain(_sampled_selection(job)),
            "method": job.evaluator.method,
            "version of robostiff": __version__,
        }


def checked_request(
    robot: Mapped | Snapshot,
    poses: PoseSource,
    quantities: Iterable[Quantity],
    wrench: ArrayLike | None,
    given_length: float | None,
    where: Selection | None,
    method: Method | LoadedMethod | None = None,
    check_room: Callable[[MapJob], None] | None = None,
    near: Near = None,
    dtype: DTypeLike = "float64",
) -> MapRequest:
    """The checked request for a map; it chooses the method."""
    robot = _checked_robot(robot, poses, where)
    if method is not None and not isinstance(method, Compiled | Batched):
        if not hasattr(method, "evaluator"):
            expected = "Compiled(), Batched() or UnderLoad()"
            raise InputError("method of a map", got=method, expected=expected)
        loaded, unloaded = method, None
    else:
        loaded, unloaded = None, method
    wanted = _quantities(quantities)
    F = _wrench(robot, wanted, wrench, loaded is not None)
    length = _length(robot, given_length)
    if loaded is None:
        columns = pose_columns(robot, poses.names)
    elif not isinstance(robot, Linkage):
        columns = columns_under_load(robot, poses.names, F)
    else:
        raise InputError(
            "map under load",
            got=f"linkage {robot.name!r}",
            expected="a Robot",
            hint="rs.equilibrium(linkage, values) answers at one configuration",
        )
    poses.check_units(dict(zip(columns.names, columns.units, strict=True)))
    own = _near(robot, near, unloaded)
    if own and loaded is not None:
        raise InputError("near of a map under load", got=near, expected="none: postures are home's")
    if own:
        unloaded = Batched()  # a kernel has the posture of home
    batched = MapEvaluator(robot, columns, wanted, F, length, own, _float_type(dtype))
    if check_room is not None:  # before a kernel is made
        check_room(MapJob(batched, columns, poses, where))
    count = math.prod(poses.shape)
    evaluator = (
        _evaluator(batched, unloaded, count) if loaded is None else loaded.evaluator(batched, count)
    )
    job = MapJob(evaluator, columns, poses, where)
    coordinate_arrays(job)
    settings = {
        **{"quantities": wanted, "wrench": F, "length": length, "dtype": batched.dtype},
        **{"method": loaded, "near": own},
    }
    attributes = map_attributes(robot, job, F, length)
    if own:
        attributes["near"] = list(own)
    return MapRequest(job, attributes, robot, settings)


def _checked_robot(robot: Mapped | Snapshot, poses: Any, where: Any) -> Mapped:
    """A robot that can move, with poses and a selection that are such."""
    if not isinstance(robot, Mapped):
        raise InputError(
            "robot of a map",
            got=robot,
            expected="a Robot, a Linkage or a CableRobot, which can move",
            hint='write load("hexapod"), load_linkage("four-bar.xml"); a snapshot is frozen at its '
            "own pose",
        )
    if isinstance(poses, type) or not isinstance(poses, PoseSource):
        raise InputError(
            "poses of a map",
            got=poses,
            expected="a Grid, a PoseList or RandomPoses",
            hint="write Grid(x=Axis(-0.1, 0.1, 21))",
        )
    if where is not None and not callable(where):
        raise InputError(
            "where",
            got=where,
            expected="a function of the coordinates",
            hint='write where=lambda pose: pose["x"]**2 + pose["y"]**2 < 0.01',
        )
    if math.prod(poses.shape) > MOST_POSES:
        raise InputError(
            "poses of a map",
            got=f"{math.prod(poses.shape):.4g}",
            expected=f"at most {MOST_POSES:.0e}, which take weeks",
            hint="take fewer values along each axis, or random poses",
        )
    return robot


def check_room(job: MapJob, path: Path | None) -> None:
    """Raise when a map does not fit into memory, or would fill the disk even nearly empty."""
    subject, hint = "map in memory", 'write it to disk: store="map.zarr" (-o map.zarr)'
    if path is None:
        try:
            room = _MEMORY_SHARE * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        except (AttributeError, ValueError, OSError):  # not available on every system
            return
    elif path.exists() or not path.parent.is_dir():
        return  # nothing is begun here
    else:
        subject, hint = "map on disk", "take fewer poses or quantities, or another disk"
        room = _SHRINKS * shutil.disk_usage(path.parent).free
    needed = job.bytes_a_pose * job.partition.poses
    if needed > room:
        raise InputError(
            subject,
            got=f"{needed / 2**30:.3g} GiB for {job.partition.poses} poses",
            expected=f"at most {room / 2**30:.3g} GiB, for which there is room",
            hint=hint,
        )


def _evaluator(batched: MapEvaluator, method: Method | None, count: int) -> Evaluator:
    """The kernel where it exists and saves time, unless a method is given."""
    if isinstance(batched.robot, CableRobot):
        if isinstance(method, Compiled):
            raise InputError("method of a map of cables", got=method, expected="Batched(), or none")
        return batched
    if isinstance(method, Compiled):
        return batched.with_kernel(method.backend)
    pays = _LINKAGE_PAYS if isinstance(batched.robot, Linkage) else _WORTH_COMPILING
    if method is None and count >= pays:
        try:
            return batched.with_kernel(Compiled().backend)
        except (InputError, NoAnswerError):
            pass  # a rigid robot, free motions everywhere, a quantity that no kernel has
    return batched


def _float_type(dtype: DTypeLike) -> str:
    try:
        name = np.dtype(dtype).name
    except TypeError:
        name = ""
    if name not in ("float64", "float32"):
        raise InputError("dtype of a map", got=dtype, expected="float64 or float32")
    return name


def _quantities(quantities: Iterable[Quantity]) -> tuple[Quantity, ...]:
    given = [quantities] if isinstance(quantities, Quantity | str) else list(quantities)
    for quantity in given:
        if not isinstance(quantity, Quantity):
            raise InputError(
                "quantity of a map",
                got=quantity,
                expected=", ".join(f"Quantity.{member.name}" for member in Quantity),
            )
    return tuple(quantity for quantity in Quantity if quantity in given)


def _wrench(
    robot: Mapped, quantities: tuple[Quantity, ...], wrench: ArrayLike | None, acts: bool
) -> tuple[float, ...]:
    asked = [quantity.value for quantity in quantities if quantity.needs_wrench]
    if wrench is None and (acts or not asked):
        return ()
    if not asked and not acts:
        raise InputError(
            "wrench of a map",
            got=wrench,
            expected="a quantity that needs it",
            hint="add Quantity.DEFLECTION (--quantity deflection), or for K under this wrench "
            "method=UnderLoad() (--under-load)",
        )
    subject = f"wrench of {asked[0]}" if wrench is None else "wrench"
    return tuple(map(float, given_wrenches(wrench, robot.space, subject=subject)))


def _near(robot: Mapped, near: Near, method: Method | None) -> tuple[float, ...]:
    """Joint coordinates of all legs in a row; empty where home chooses the posture."""
    if near is None:
        return ()
    if not isinstance(robot, Robot):
        raise InputError(
            f"near of {robot.name!r}", got=near, expected="none: only robots of legs have postures"
        )
    given = near_coordinates(robot, near)
    if given is None:
        return ()
    if robot.is_posed_by_joints:
        raise InputError(
            f"near of {robot.name!r}",
            got=near,
            expected="none: joint coordinates pose this arm, and determine its posture",
        )
    if isinstance(method, Compiled):
        raise InputError(
            "method of a map near joint coordinates",
            got=method,
            expected="Batched(), or none: kernels have the posture of home",
        )
    return tuple(float(x) for x in np.concatenate(given))


def _length(robot: Mapped, given: float | None) -> float:
    if given is None:
        if isinstance(robot, CableRobot):
            return float(cable_tensions(robot).placed.characteristic_length)
        return float(direct_stiffness(robot).length)
    length = as_float("length", given, "a length above 0 [m]", "m")
    if not length > 0:
        raise InputError("length", got=given, expected="a length above 0 [m]")
    return length


def _sampled_selection(job: MapJob) -> list[np.ndarray] | None:
    """Poses that `where` selects in some blocks, since functions cannot be compared."""
    if job.where is None:
        return None
    count = len(job.partition)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _SAMPLED_BLOCKS)).astype(int))
    found = []
    for index in chosen:
        answer = job.selected(job.poses(job.partition.slices(int(index))))
        found.append(np.packbits(np.asarray(answer, dtype=bool)))
    return found

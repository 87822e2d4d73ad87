"""The request for a map, checked before the first pose is computed."""

from __future__ import annotations

import math
import os
import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from robostiff.analysis.cable_tensions import cable_tensions
from robostiff.analysis.identity import plain
from robostiff.analysis.maps.evaluator import MapEvaluator
from robostiff.analysis.maps.job import MOST_POSES, MapJob, Selection
from robostiff.analysis.maps.pose_columns import Mapped, pose_columns
from robostiff.analysis.maps.pose_source import PoseSource
from robostiff.analysis.maps.variables import Quantity
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.result import given_wrenches
from robostiff.compiled import Backend
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near
from robostiff.kinematics.pose import near_coordinates
from robostiff.linkage import Linkage
from robostiff.model import Joint, Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.model.chain import is_elastic
from robostiff.spatial import as_float
from robostiff.version import __version__


class MapMethod(ABC):
    """How the poses of a map are computed."""

    has_loads: ClassVar = False  # whether poses have loads beside coordinates

    @abstractmethod
    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """What computes a map of so many poses; `like` has the direct form.

        Raises InputError when it does not fit the map.
        """


@dataclass(frozen=True)
class Compiled(MapMethod):
    """By the robot's kernel, see `robostiff.compile`; unsafe poses by the batched form.

    Parameters
    ----------
    backend : Backend
    """

    backend: Backend = Backend.BEST

    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """By a kernel.

        Raises InputError when there is none for the robot, its coordinates or the quantities.
        """
        return like.with_kernel(self.backend)


@dataclass(frozen=True)
class Batched(MapMethod):
    """By the wrench basis form on batches of poses, see `robostiff.stiffness`."""

    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """By the direct form."""
        return like


_MEMORY_SHARE = 0.8
_SHRINKS = 20  # how much smaller a map may become on disk
_SAMPLED_BLOCKS = 16
# A kernel of which no record is kept takes as long to make as the batched form takes for so many
# poses of a robot with elastic links, of one without, and as many networks of a linkage.
_PAYS, _RIGID_PAYS, _LINKAGE_PAYS = 10_000, 20_000, 40


def identity(job: MapJob) -> dict[str, Any]:
    """Everything on which a map depends, part by part."""
    own = job.evaluator
    names = ("quantities", "wrench", "length", "dtype", "near")
    asked = {**{name: getattr(own, name) for name in names}, "method": own.direct.about}
    return {
        "robot": plain(own.robot),
        "poses": plain([job.source.description(), job.partition.block]),
        "quantities": plain(asked),
        "selection": plain(_sampled_selection(job)),
        "method": own.method,
        "version of robostiff": __version__,
    }


def checked_job(
    robot: Mapped | Snapshot,
    poses: PoseSource,
    quantities: Iterable[Quantity],
    *,
    wrench: ArrayLike | None = None,
    length: float | None = None,
    where: Selection | None = None,
    method: MapMethod | None = None,
    near: Near = None,
    dtype: DTypeLike = "float64",
    check_room: Callable[[MapJob], None] | None = None,
) -> MapJob:
    """The checked work for a map; it chooses the method."""
    robot = _checked_robot(robot, poses, where)
    if not isinstance(method, MapMethod | None):
        expected = "Compiled(), Batched() or UnderLoad()"
        raise InputError("method of a map", got=method, expected=expected)
    has_loads = method is not None and method.has_loads
    wanted = _quantities(quantities)
    F = _wrench(robot, wanted, wrench, has_loads)
    if has_loads and isinstance(robot, Linkage):
        raise InputError(
            "map under load",
            got=f"linkage {robot.name!r}",
            expected="a Robot",
            hint="rs.equilibrium(linkage, values) answers at one configuration",
        )
    own = _near(robot, near, method)
    if own:
        method = Batched()  # a kernel has the posture of home
    columns = pose_columns(robot, poses.names, F if has_loads else None)
    poses.check_units(dict(zip(columns.names, columns.units, strict=True)))
    numbers = F, _length(robot, length), own, _float_type(dtype)
    evaluator = MapEvaluator(robot, columns, wanted, *numbers)
    if check_room is not None:  # before a kernel is made
        check_room(MapJob(evaluator, poses, where))
    count = math.prod(poses.shape)
    if method is not None:
        evaluator = method.evaluator(evaluator, count)
    elif count >= _pays_from(robot):
        # without a kernel: a rigid robot, cables, free motions everywhere, other quantities
        with suppress(InputError, NoAnswerError):
            evaluator = evaluator.with_kernel(Backend.BEST)
    return MapJob(evaluator, poses, where)


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
    needed = sum(v.bytes_a_pose for v in job.variables) * job.partition.poses
    if needed > room:
        raise InputError(
            subject,
            got=f"{needed / 2**30:.3g} GiB for {job.partition.poses} poses",
            expected=f"at most {room / 2**30:.3g} GiB, for which there is room",
            hint=hint,
        )


def _pays_from(robot: Mapped) -> int:
    """Poses from which a kernel saves time; the same in every run, whose last digits stay so."""
    if isinstance(robot, Linkage):
        return _LINKAGE_PAYS
    elements = [own for leg in getattr(robot, "legs", ()) for own in leg.chain.elements]
    bends = any(is_elastic(own) for own in elements if not isinstance(own, Joint))
    return _PAYS if bends else _RIGID_PAYS


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


def _near(robot: Mapped, near: Near, method: MapMethod | None) -> tuple[float, ...]:
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
    if not isinstance(method, Batched | None):
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

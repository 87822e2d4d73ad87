"""Stiffness over a workspace."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from robostiff.analysis.cable_tensions import cable_tensions
from robostiff.analysis.maps.evaluator import Batched, MapEvaluator, MapMethod
from robostiff.analysis.maps.job import (
    MOST_POSES,
    MapJob,
    MapSummary,
    Selection,
    auxiliary_coordinates,
    coordinate_arrays,
    map_attributes,
    summary_attributes,
    variable_attributes,
)
from robostiff.analysis.maps.pose_columns import Mapped, pose_columns
from robostiff.analysis.maps.pose_source import PoseSource
from robostiff.analysis.maps.reduced_map import ReducedMap
from robostiff.analysis.maps.reduction import Reduction, check_reductions
from robostiff.analysis.maps.run import Progress, Run, Threads, run_with_progress, workforce
from robostiff.analysis.maps.store import (
    PROGRESS,
    MapStore,
    already_there,
    create_store,
    is_complete,
    lock,
    open_map,
)
from robostiff.analysis.maps.variables import Quantity
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.result import given_wrenches
from robostiff.compiled import Backend
from robostiff.errors import InputError, NoAnswerError, Words, needs_extra
from robostiff.kinematics import Near
from robostiff.kinematics.pose import near_coordinates
from robostiff.linkage import Linkage
from robostiff.model import Joint, Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.model.chain import is_elastic
from robostiff.spatial import as_float

if TYPE_CHECKING:
    import xarray
    from distributed import Client

_DEFAULT_QUANTITIES = (Quantity.PRINCIPAL_STIFFNESS,)
_MEMORY_SHARE = 0.8
_SHRINKS = 20  # how much smaller a map may become on disk
# A kernel of which no record is kept takes as long to make as the batched form takes for so many
# poses of a robot with elastic links, of one without, and as many networks of a linkage.
_PAYS, _RIGID_PAYS, _LINKAGE_PAYS = 10_000, 20_000, 40


def stiffness_map(
    robot: Mapped | Snapshot,
    poses: PoseSource,
    quantities: Quantity | Iterable[Quantity] = _DEFAULT_QUANTITIES,
    *,
    wrench: ArrayLike | None = None,
    length: float | None = None,
    where: Selection | None = None,
    method: MapMethod | None = None,
    near: Near = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    workers: int | None = None,
    scheduler: str | Client | Threads | None = None,
    progress: Callable[[Progress], None] | None = None,
    reduce: Reduction | Iterable[Reduction] = (),
    dtype: DTypeLike = "float64",
) -> xarray.Dataset:
    """Stiffness of a robot at many poses, as arrays with named dimensions.

    Parameters
    ----------
    robot : Robot, Linkage or CableRobot
        A snapshot is refused: it cannot move.
    poses : Grid, PoseList or RandomPoses
        Of a linkage coordinates of joints, which keep them; the others follow.
    quantities : Quantity or several
        Besides rank and status, which are always there.
    wrench : (6,) array, or (3,) for a planar robot, optional
        Load about the reference point, world axes [N, N m], for quantities that need one.
    length : float, optional
        Of the indices [m]; that of the robot at home when left out.
    where : callable, optional
        Takes a mapping of coordinates to arrays, one entry a pose, and returns which poses to
        compute (array of bool); the others get the status ``excluded``.
    method : Compiled, Batched or UnderLoad, optional
        ``Compiled()`` records the robot once as a kernel and runs that at all poses, millions a
        second; ``Batched()`` computes everything as `stiffness` does. By default,
        large maps are compiled where a kernel has what they ask for. ``UnderLoad()`` computes the
        equilibrium under the wrench at each pose, and everything there; of a cable robot the
        tensions balance the wrench.
    near : joint coordinates, optional
        Of all legs, in a row or leg by leg [m, rad]: the posture nearest to them is chosen at each
        pose, by the batched form. When left out, it is the assembly mode of home.
    store : path, optional
        Where to write the map as Zarr, block by block; it may be larger than memory. Without it the
        map is made in memory.
    resume : bool
        Go on with the map in `store` where it was interrupted.
    workers : int, optional
        How many processes of this machine Dask shall start for this map.
    scheduler : str, dask.distributed.Client or Threads, optional
        The address of a Dask scheduler, whose workers see `store` under the same path; or how many
        threads of this process to use, as many as processors when left out.
    progress : callable, optional
        Called with a `Progress` after each block.
    reduce : Reduction or several, optional
        ``Extremes``, ``Quantiles``, ``Histogram``, ``ShareAbove``: what becomes of the quantities,
        which are not kept themselves. So much memory serves for any number of poses; with `store`,
        a file such as ``map.npz``, an interrupted map goes on.
    dtype : float64 or float32
        Of the stiffness matrix; all other quantities are float32.

    Returns
    -------
    xarray.Dataset
        Dimensions of `poses`, then those of the quantity. Floats hold NaN where there is no answer,
        and ``status`` gives the reason. Of reductions, what each of them has of each quantity.

    Raises
    ------
    InputError
        When something does not fit, or `store` exists and holds another map.

    Examples
    --------
    >>> import robostiff as rs
    >>> grid = rs.Grid(x=rs.Axis(-0.1, 0.1, 3), rz=rs.Axis(0, 0.2, 2))
    >>> found = rs.stiffness_map(rs.load("gough-stewart-b"), grid)
    >>> found.translational_stiffness.dims
    ('x', 'rz', 'principal_translation')
    >>> int(found["rank"].sel(x=0.1, rz=0.2))
    6
    """
    with needs_extra("maps", "maps"):
        import xarray  # noqa: F401
    reductions = (reduce,) if isinstance(reduce, Reduction) else tuple(reduce)
    path = None if store is None else Path(store).absolute()
    ending = ".npz" if reductions else ".zarr"
    if path is not None and path.suffix not in ("", ending):
        what = "reductions" if reductions else "a map"
        raise InputError(
            f"store of {what}", got=path.name, expected=f"a name that ends in {ending}"
        )
    job = checked_job(
        robot,
        poses,
        quantities,
        wrench=wrench,
        length=length,
        where=where,
        method=method,
        near=near,
        dtype=dtype,
        # reductions take as much memory for any number of poses
        check_room=None if reductions else partial(check_room, path=path),
    )
    coordinate_arrays(job)  # raises for a name that a map cannot have
    if path is None and resume:
        raise InputError("store to resume", got=Words("none"), expected='such as store="map.zarr"')
    running, count = workforce(workers, scheduler), job.partition.poses
    if reductions:
        check_reductions(reductions, job)
        with running as run:
            made = ReducedMap.start(job, reductions, path, resume)
            run_with_progress(made.run_blocks(run), made.summary, count, progress)
        return made.dataset()
    if path is not None:
        _fill(path, job, resume, running, progress)
        return open_map(path)
    if workers is None and (scheduler is None or isinstance(scheduler, Threads)):
        arrays = MapArrays(job)
        with running as run:
            blocks = run(arrays.compute, range(len(job.partition)))
            return arrays.dataset(run_with_progress(blocks, MapSummary(), count, progress))
    if workers is None:
        raise InputError(
            "store of a map", got=Words("none"), expected="a path that all workers see"
        )
    with TemporaryDirectory(prefix="robostiff-map-") as folder:
        path = Path(folder) / "map.zarr"
        _fill(path, job, False, running, progress)
        return open_map(path).load()


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
        return made.set_coords(auxiliary_coordinates(job))


def _fill(
    path: Path,
    job: MapJob,
    resume: bool,
    running: AbstractContextManager[Run[MapSummary]],
    progress: Callable[[Progress], None] | None,
) -> None:
    """Begin a store, or take that of the same map, and compute what is not there yet."""
    with needs_extra("maps", "maps"):
        import dask.array  # noqa: F401
        import zarr  # noqa: F401
    if path.exists() and not resume:
        raise already_there(path)
    if path.exists() and is_complete(path, job):
        return
    with running as run:
        if not path.exists():
            create_store(path, job)
        with lock(path):
            store, partition = MapStore(path, job), job.partition
            blocks = run(store.compute, range(len(partition)))
            store.finish(run_with_progress(blocks, MapSummary(), partition.poses, progress))
    # its marks, and its lock, which must be open no more
    shutil.rmtree(path / PROGRESS, ignore_errors=True)


def checked_job(
    robot: Mapped | Snapshot,
    poses: PoseSource,
    quantities: Quantity | Iterable[Quantity],
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
    chosen = [quantities] if isinstance(quantities, Quantity | str) else list(quantities)
    if strange := [q for q in chosen if not isinstance(q, Quantity)]:
        expected = ", ".join(f"Quantity.{member.name}" for member in Quantity)
        raise InputError("quantity of a map", got=strange[0], expected=expected)
    wanted = tuple(quantity for quantity in Quantity if quantity in chosen)
    F = _wrench(robot, wanted, wrench, has_loads)
    if has_loads and isinstance(robot, Linkage):
        raise InputError(
            "map under load",
            got=Words(f"linkage {robot.name!r}"),
            expected="a Robot",
            hint="rs.equilibrium(linkage, values) answers at one configuration",
        )
    q_near = _near(robot, near, method)
    if q_near:
        method = Batched()  # a kernel has the posture of home
    columns = pose_columns(robot, poses.names, F if has_loads else None)
    poses.check_units(dict(zip(columns.names, columns.units, strict=True)))
    if length is not None:
        expected = "a length above 0 [m]"
        size = as_float("length", length, expected, "m")
        if not size > 0:
            raise InputError("length", got=length, expected=expected)
    elif isinstance(robot, CableRobot):
        size = float(cable_tensions(robot).placed.characteristic_length)
    else:
        size = float(direct_stiffness(robot).length)
    float_type = ""
    with suppress(TypeError):
        float_type = np.dtype(dtype).name
    if float_type not in ("float64", "float32"):
        raise InputError("dtype of a map", got=dtype, expected="float64 or float32")
    evaluator = MapEvaluator(robot, columns, wanted, F, size, q_near, float_type)
    if check_room is not None:  # before a kernel is made
        check_room(MapJob(evaluator, poses, where))
    count = math.prod(poses.shape)
    elements = [element for leg in getattr(robot, "legs", ()) for element in leg.chain.elements]
    bends = any(is_elastic(element) for element in elements if not isinstance(element, Joint))
    pays = _LINKAGE_PAYS if isinstance(robot, Linkage) else _PAYS if bends else _RIGID_PAYS
    if method is not None:
        evaluator = method.evaluator(evaluator, count)
    elif count >= pays:  # the same in every run, whose last digits stay so
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
            hint="write Grid(x=Axis(-0.1, 0.1, 21)), or PoseList(names, poses) of an array (N, n)",
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
            got=Words(f"{needed / 2**30:.3g} GiB for {job.partition.poses} poses"),
            expected=f"at most {room / 2**30:.3g} GiB, for which there is room",
            hint=hint,
        )


def _wrench(
    robot: Mapped, quantities: tuple[Quantity, ...], wrench: ArrayLike | None, acts: bool
) -> tuple[float, ...]:
    names = [quantity.value for quantity in quantities if quantity.needs_wrench]
    if wrench is None and (acts or not names):
        return ()
    if not names and not acts:
        raise InputError(
            "wrench of a map",
            got=wrench,
            expected="a quantity that needs it",
            hint="add Quantity.DEFLECTION (--quantity deflection), or for K under this wrench "
            "method=UnderLoad() (--under-load)",
        )
    subject = f"wrench of {names[0]}" if wrench is None else "wrench"
    hint = 'write wrench=[...], or --wrench "Fx=100 N" on the command line'
    return tuple(map(float, given_wrenches(wrench, robot.space, subject=subject, hint=hint)))


def _near(robot: Mapped, near: Near, method: MapMethod | None) -> tuple[float, ...]:
    """Joint coordinates of all legs in a row; empty where home chooses the posture."""
    if near is None:
        return ()
    if not isinstance(robot, Robot):
        raise InputError(
            f"near of {robot.name!r}", got=near, expected="none: only robots of legs have postures"
        )
    q = near_coordinates(robot, near)
    if q is None:
        return ()
    if robot.is_posed_by_joints:
        expected = "none: joint coordinates pose this arm, and determine its posture"
        raise InputError(f"near of {robot.name!r}", got=near, expected=expected)
    if not isinstance(method, Batched | None):
        expected = "Batched(), or none: kernels have the posture of home"
        raise InputError("method of a map near joint coordinates", got=method, expected=expected)
    return tuple(float(x) for x in np.concatenate(q))

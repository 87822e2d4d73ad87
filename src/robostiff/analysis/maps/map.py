"""Stiffness over a workspace."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike, DTypeLike

from robostiff.analysis.maps.dataset import MapArrays, coordinate_arrays
from robostiff.analysis.maps.job import MapJob, MapSummary, Selection
from robostiff.analysis.maps.pose_columns import Mapped
from robostiff.analysis.maps.pose_source import PoseSource
from robostiff.analysis.maps.reduced_map import ReducedMap
from robostiff.analysis.maps.reduction import Reduction, check_reductions
from robostiff.analysis.maps.request import MapMethod, check_room, checked_job
from robostiff.analysis.maps.run import Progress, Run, Threads, followed, workforce
from robostiff.analysis.maps.store import (
    MapStore,
    already_there,
    create_store,
    is_complete,
    locked,
    open_map,
)
from robostiff.analysis.maps.variables import Quantity
from robostiff.errors import InputError, needs_extra
from robostiff.kinematics import Near
from robostiff.model import Snapshot

if TYPE_CHECKING:
    import xarray
    from distributed import Client

_DEFAULT_QUANTITIES = (Quantity.PRINCIPAL_STIFFNESS,)


def stiffness_map(
    robot: Mapped | Snapshot,
    poses: PoseSource,
    quantities: Iterable[Quantity] = _DEFAULT_QUANTITIES,
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
    quantities : iterable of Quantity
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
        raise InputError("store to resume", got="none", expected='such as store="map.zarr"')
    running, count = workforce(workers, scheduler), job.partition.poses
    if reductions:
        check_reductions(reductions, job)
        with running as run:
            made = ReducedMap.begun(job, reductions, path, resume)
            followed(made.gathered(run), made.summary, count, progress)
        return made.dataset()
    if path is not None:
        _fill(path, job, resume, running, progress)
        return open_map(path)
    if workers is None and (scheduler is None or isinstance(scheduler, Threads)):
        arrays = MapArrays(job)
        with running as run:
            blocks = run(arrays.compute, range(len(job.partition)))
            return arrays.dataset(followed(blocks, MapSummary(), count, progress))
    if workers is None:
        raise InputError("store of a map", got="none", expected="a path that all workers see")
    with TemporaryDirectory(prefix="robostiff-map-") as folder:
        path = Path(folder) / "map.zarr"
        _fill(path, job, False, running, progress)
        return open_map(path).load()


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
        with locked(path):
            store, partition = MapStore(path, job), job.partition
            blocks = run(store.compute, range(len(partition)))
            store.finish(followed(blocks, MapSummary(), partition.poses, progress))
    store.remove_progress()

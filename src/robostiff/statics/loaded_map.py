"""Maps under load: equilibria at the poses, wrenches and load factors of a map."""

from __future__ import annotations

from functools import partial
from typing import ClassVar, cast

import numpy as np

from robostiff.analysis.maps import Batched, Compiled, Quantity
from robostiff.analysis.maps.evaluator import DirectForm, MapEvaluator, MapMethod
from robostiff.analysis.maps.variables import NO_RANK
from robostiff.compiled import Backend
from robostiff.elastostatics.status import WITHOUT_STIFFNESS, Status
from robostiff.errors import InputError, NoAnswerError
from robostiff.frozen import frozen, replace
from robostiff.model import Robot
from robostiff.model.cable import CableRobot
from robostiff.statics.equilibrium import WORTH_COMPILING, WORTH_MACHINE_CODE, equilibrium
from robostiff.statics.kernels.compile import compile_loaded
from robostiff.statics.kernels.compiled_loading import CompiledLoading
from robostiff.statics.loading.given_loads import StandingLoads

# Poses at once: a second of equilibria, or enough for a kernel.
_FEW, _MANY = 64, 2**15
# Of the largest eigenvalue of K, rotations by lengths: none.
_FREE = 1e-9


@frozen
class UnderLoad(StandingLoads, MapMethod):
    """As method of `stiffness_map`: everything in the equilibrium under the loads of each pose.

    K is the rate of the wrench; principal stiffnesses and indices are those of its symmetric part,
    below zero where the robot is unstable; the worst deflection is that under a little more force.
    The wrench of the map acts at every pose, times ``factor``. Poses may have coordinates ``Fx`` to
    ``Mz`` [N, N m] and ``factor`` of their own beside those of the platform.

    Parameters
    ----------
    loads, gravity, preload, beams
        As for `equilibrium`; they act at every pose in full, whatever the factor.
    by : Compiled, Batched or None
        ``Compiled()`` records the robot once, see `compile_loaded`; ``Batched()`` computes each
        `equilibrium`. By default large maps are compiled where there is a kernel.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot, grid = rs.load("gough-stewart-b"), rs.Grid(factor=rs.Axis(0, 2, 3))
    >>> down, moved = [0, 0, -4e7, 0, 0, 0], [rs.Quantity.DEFLECTION]
    >>> found = rs.stiffness_map(robot, grid, moved, wrench=down, method=rs.UnderLoad())
    >>> (1e3 * found.displacement.sel(displacement_axis="dz")).astype(int).values.tolist()
    [0, -90, -193]
    >>> found.attrs["statuses"]
    '{"ok": 2, "unstable+beyond-critical-load": 1}'
    """

    has_loads: ClassVar[bool] = True
    by: Compiled | Batched | None = None

    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """What computes a map of so many poses; `like` has its robot, columns and quantities.

        Raises
        ------
        InputError
            When a quantity is none under load, or a kernel is required that there is not.
        """
        quantities = like.quantities
        if Quantity.ACTUATOR_FORCES in quantities:
            raise InputError(
                "quantity of a map under load",
                got=Quantity.ACTUATOR_FORCES.value,
                expected="another",
                hint="rs.equilibrium(robot, pose, wrench).parts has the loads on drives",
            )
        if isinstance(like.robot, CableRobot):
            standing = [key for key in ("loads", "gravity", "preload", "by") if getattr(self, key)]
            refused = [*standing, *(q.value for q in quantities if q.needs_wrench)]
            if refused:
                raise InputError(
                    f"map of cable robot {like.robot.name!r} under load",
                    got=", ".join(refused),
                    expected="UnderLoad() alone, whose wrench the tensions balance",
                )
            return like
        kernel = self._kernel(like, count)
        name, most = "equilibria under load", _FEW
        if kernel is not None:
            name, most = "compiled record under load, equilibria where it is unsafe", _MANY
        return replace(like, form=DirectForm(partial(_variables, self, kernel), name, most, self))

    def _kernel(self, like: MapEvaluator, count: int) -> CompiledLoading | None:
        required = isinstance(self.by, Compiled)
        if isinstance(self.by, Batched) or (count < WORTH_COMPILING and not required):
            return None
        robot, columns = cast("Robot", like.robot), like.columns
        free = tuple(c.value for c in robot.coordinates)
        fits = columns.of_joints or columns.names[: -columns.loads] == free
        try:
            if columns.of_joints != robot.is_posed_by_joints or not fits:
                raise InputError(
                    f"map of {robot.name!r} under load by a kernel",
                    got=" ".join(columns.names),
                    expected="the free coordinates of the robot",
                    hint="leave by out, or write UnderLoad(by=Batched())",
                )
            backend = Backend.BEST if count >= WORTH_MACHINE_CODE else Backend.ARRAYS
            if isinstance(self.by, Compiled):
                backend = self.by.backend
            return compile_loaded(robot, **self.given, backend=backend)
        except (InputError, NoAnswerError):
            if required:
                raise
            return None


def _variables(
    load: UnderLoad, kernel: CompiledLoading | None, like: MapEvaluator, poses: np.ndarray
) -> dict[str, np.ndarray]:
    """Variables (N, ...) of a map at equilibria; no numbers where there is none."""
    pose, F = like.columns.as_pose(poses), like.columns.wrenches(poses)
    found = (
        equilibrium(like.robot, pose, F, **load.given)
        if kernel is None
        else kernel.evaluate(pose, F)
    )
    space, codes = like.robot.space, found.status_codes
    K, K_total, moved = map(np.ma.getdata, (found.K, found.K_total, found.displacement))
    symmetric, d = 0.5 * (K + np.swapaxes(K, -1, -2)), space.translations
    rank = np.full(len(K), NO_RANK, dtype=np.int8)
    known, scale = np.isfinite(symmetric).all(axis=(1, 2)), np.ones(space.size)
    scale[d:] = 1.0 / like.length
    sizes = np.abs(np.linalg.eigvalsh(symmetric[known] * np.outer(scale, scale)))
    rank[known] = np.sum(sizes > _FREE * sizes.max(axis=-1, keepdims=True), axis=-1)

    values = {"K": symmetric}
    if Quantity.WORST_DEFLECTION in like.quantities:
        worst = values["worst_deflection"] = np.full(len(rank), np.nan)
        whole = (rank == space.size) & ((codes & int(_NO_COMPLIANCE)) == 0)
        C = np.linalg.inv(K_total[whole])
        worst[whole] = np.linalg.norm(C[:, :d, :d], 2, axis=(1, 2))  # not symmetric
    out = like.of_outputs(values, rank)
    out |= {"K": K, "status": codes, "displacement": moved[:, :d], "rotation": moved[:, d:]}
    return out | {"guarded": found.guarded}


_NO_COMPLIANCE = WITHOUT_STIFFNESS | Status.FREE_MOTIONS

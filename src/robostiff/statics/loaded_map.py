"""Maps under load: equilibria at the poses, wrenches and load factors of a map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.analysis.maps import Batched, Compiled, Quantity
from robostiff.analysis.maps.evaluator import Evaluator, MapEvaluator, room_for
from robostiff.analysis.maps.request import Method
from robostiff.analysis.maps.variables import NO_RANK, Variable
from robostiff.analysis.measures import principal_stiffnesses, stiffness_indices
from robostiff.compiled import Backend
from robostiff.elastostatics.status import WITHOUT_STIFFNESS, Status
from robostiff.errors import InputError, NoAnswerError
from robostiff.model import Robot
from robostiff.model.cable import CableRobot
from robostiff.statics.kernels.compile import compile_loaded
from robostiff.statics.kernels.compiled_loading import CompiledLoading, LoadedAnswer
from robostiff.statics.kernels.forces_on_bodies import StandingLoads
from robostiff.statics.result import Equilibria

# Equilibria take some 20 ms each, a kernel some seconds to make.
_WORTH_COMPILING = 2000
# Poses from which machine code is worth the time that it takes to compile.
_WORTH_MACHINE_CODE = 100_000
# Poses at once: a second of equilibria, or enough for a kernel.
_FEW, _MANY = 64, 2**15
# Of the largest eigenvalue of K, rotations by lengths: none.
_FREE = 1e-9


@dataclass(frozen=True)
class UnderLoad(StandingLoads):
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

    by: Method | None = None

    def evaluator(self, like: MapEvaluator, count: int) -> Evaluator:
        """What computes a map of so many poses; `like` has its robot, columns and quantities.

        Raises
        ------
        InputError
            When a quantity is none under load, or a kernel is required that there is not.
        """
        if Quantity.ACTUATOR_FORCES in like.quantities:
            raise InputError(
                "quantity of a map under load",
                got=Quantity.ACTUATOR_FORCES.value,
                expected="another",
                hint="rs.equilibrium(robot, pose, wrench).parts has the loads on drives",
            )
        if self.by is not None and not isinstance(self.by, Compiled | Batched):
            raise InputError("by of UnderLoad", got=self.by, expected="Compiled() or Batched()")
        if not isinstance(like.robot, CableRobot):
            return LoadedEvaluator(like, self, self._kernel(like, count))
        standing = [name for name in ("loads", "gravity", "preload", "by") if getattr(self, name)]
        if standing or like.of_wrench:
            raise InputError(
                f"map of cable robot {like.robot.name!r} under load",
                got=", ".join([*standing, *(quantity.value for quantity in like.of_wrench)]),
                expected="UnderLoad() alone, whose wrench the tensions balance",
            )
        return like

    def _kernel(self, like: MapEvaluator, count: int) -> CompiledLoading | None:
        required = isinstance(self.by, Compiled)
        if isinstance(self.by, Batched) or (count < _WORTH_COMPILING and not required):
            return None
        robot, columns = like.robot, like.columns
        if not isinstance(robot, Robot):
            return None
        free = tuple(c.value for c in robot.coordinates)
        fits = columns.of_joints or columns.names[: -columns.loads] == free
        if columns.of_joints != robot.is_posed_by_joints or not fits:
            if required:
                raise InputError(
                    f"map of {robot.name!r} under load by a kernel",
                    got=" ".join(columns.names),
                    expected="the free coordinates of the robot",
                    hint="leave by out, or write UnderLoad(by=Batched())",
                )
            return None
        try:
            backend = Backend.BEST if count >= _WORTH_MACHINE_CODE else Backend.ARRAYS
            if isinstance(self.by, Compiled):
                backend = self.by.backend
            return compile_loaded(robot, **self.given, backend=backend)
        except (InputError, NoAnswerError):
            if required:
                raise
            return None


@dataclass(frozen=True)
class LoadedEvaluator:
    """Equilibria at poses; see `Evaluator`.

    Attributes
    ----------
    like : MapEvaluator
        Robot, columns, quantities, length.
    load : UnderLoad
    kernel : CompiledLoading or None
    """

    like: MapEvaluator
    load: UnderLoad
    kernel: CompiledLoading | None

    @property
    def method(self) -> str:
        """Name of the method."""
        if self.kernel is None:
            return "equilibria under load"
        return "compiled record under load, equilibria where it is unsafe"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables that `evaluate` returns."""
        return self.like.variables

    @property
    def most_poses(self) -> int:
        """So many that progress is seen."""
        return _FEW if self.kernel is None else _MANY

    def evaluate(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray] | None = None
    ) -> Mapping[str, np.ndarray]:
        """The variables at poses (N, n_coordinates), and which were ``guarded``."""
        out = room_for(self.variables, len(poses)) if out is None else out
        columns = self.like.columns
        pose = columns.as_pose(poses)
        F = columns.wrenches(poses)
        found: LoadedAnswer | Equilibria
        if self.kernel is None:
            found = self.load.equilibria(self.like.robot, pose, F)
            guarded = np.zeros(len(poses), dtype=bool)
        else:
            found = self.kernel.evaluate(pose, F)
            guarded = found.guarded
        for name, values in self._quantities(found).items():
            out[name][...] = values
        return {**out, "guarded": guarded}

    def _quantities(self, found: LoadedAnswer | Equilibria) -> dict[str, np.ndarray]:
        quantities, space = self.like.quantities, self.like.robot.space
        d = space.translations
        # no numbers where there is no equilibrium
        K, K_total, moved = map(np.ma.getdata, (found.K, found.K_total, found.displacement))
        codes = found.status_codes
        symmetric = 0.5 * (K + np.swapaxes(K, -1, -2))
        rank = _ranks(symmetric, space.rows, self.like.length)
        out: dict[str, np.ndarray] = {"rank": rank, "status": codes}
        if Quantity.STIFFNESS in quantities:
            out["K"] = K
        if Quantity.PRINCIPAL_STIFFNESS in quantities:
            out |= principal_stiffnesses(symmetric, definite=False)
        if Quantity.INDICES in quantities:
            out |= stiffness_indices(symmetric, rank, self.like.length)
        if Quantity.WORST_DEFLECTION in quantities:
            worst = np.full(len(rank), np.nan)
            whole = (rank == space.size) & ((codes & int(_NO_COMPLIANCE)) == 0)
            C = np.linalg.inv(K_total[whole])
            worst[whole] = np.linalg.norm(C[:, :d, :d], 2, axis=(1, 2))  # not symmetric
            out["worst_deflection"] = worst
        if Quantity.DEFLECTION in quantities:
            out |= {"displacement": moved[:, :d], "rotation": moved[:, d:]}
        return out


_NO_COMPLIANCE = WITHOUT_STIFFNESS | Status.FREE_MOTIONS


def _ranks(K: np.ndarray, rows: Any, length: float) -> np.ndarray:
    """Of symmetric matrices (N, r, r), rotations by a length; -1 where there is none."""
    ranks = np.full(len(K), NO_RANK, dtype=np.int8)
    known = np.isfinite(K).all(axis=(1, 2))
    scale = np.where(np.array(rows) < 3, 1.0, 1.0 / length)
    sizes = np.abs(np.linalg.eigvalsh(K[known] * np.outer(scale, scale)))
    ranks[known] = np.sum(sizes > _FREE * sizes.max(axis=-1, keepdims=True), axis=-1)
    return ranks

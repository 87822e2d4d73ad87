"""A robot under load: its legs, its platform, and what acts on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from robostiff.frozen import field, frozen, replace
from robostiff.spatial.rotation import vector_of_rotation
from robostiff.statics.chains.elements import NOBODY, Spot
from robostiff.statics.chains.equilibrated import Closure, HeldPlatform
from robostiff.statics.chains.legs import LegEquations, Legs, State
from robostiff.statics.chains.moving_chain import sum_of_crosses
from robostiff.statics.chains.numbers import ComponentBlock

# Of the largest stiffness of the platform, shifts and turns alike: rounding.
LOST = 1e-14
# Of the largest component of a load: what is below it is rounding.
_PULLS = 1e-9


@frozen
class LoadCase:
    """What acts on a robot at load factor s.

    ``s wrench`` acts on the platform about its point, world axes [N, N m], and ``share + s
    share_rate`` of all preloads and of all forces on legs and platform.
    """

    wrench: np.ndarray  # (r,)
    share: float = 0.0
    share_rate: float = 1.0

    def share_at(self, factor: float) -> float:
        """Of preloads and forces on bodies."""
        return self.share + factor * self.share_rate


@frozen
class DeadForces:
    """Forces f on the platform that keep their directions, at arms b from its point.

    Of numbers or of entries, at the unloaded posture.
    """

    force: np.ndarray  # (3,): their sum [N]
    levers: np.ndarray  # (3, 3): sum of ``b f^T`` [N m]

    @cached_property
    def act(self) -> bool:
        """Whether there are any."""
        return bool(np.any(self.force) or np.any(self.levers))

    def acting(self, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Their wrench (6,) about that point, and its rate (6, 6) by the twist of the platform.

        With ``f x (b x w) = b (f . w) - (f . b) w``.
        """
        S, turning = R @ self.levers, np.zeros((6, 6), dtype=int).astype(self.levers.dtype)
        turning[3:, 3:] = S - np.trace(S) * np.eye(3, dtype=int)
        return np.concatenate([self.force, sum_of_crosses(S)]), turning

    def potential(self, R: np.ndarray, shift: np.ndarray) -> float:
        """Of the platform turned by R, and its point shifted [J]."""
        return -float(self.force @ shift + np.trace((R - np.eye(3)) @ self.levers))


@frozen
class Linearised:
    """The equations of a robot at a state, legs eliminated.

    Where rigid parts hold the platform, its matrices and what has to be carried are those among
    its free motions, and steps of the legs include what rigid parts carry. Of P robots side by side
    those of all platforms (P, ...).
    """

    problem: EquilibriumProblem
    K: np.ndarray  # (r, r): rate of what all legs carry by the twist of the platform
    K_total: np.ndarray  # (r, r): less that of the forces that act on the platform
    missing: np.ndarray  # (r,): to be carried more, all legs in closure and equilibrium
    by_factor: np.ndarray  # (r,): how that grows with the load factor
    # of the unknowns of legs, and of axial forces behind: by themselves (T + B,), by the twist (T +
    # B, r), by the factor (T + B,)
    steps: np.ndarray
    by_twist: np.ndarray
    factor_steps: np.ndarray
    equations: LegEquations
    held_platform: HeldPlatform | None  # what rigid parts hold of the platform, where they do
    regular: bool  # the coordinates of all legs follow from the pose of the platform

    @property
    def rigid(self) -> bool:
        """Whether some leg cannot follow the platform."""
        return self.held_platform is not None

    @cached_property
    def lacks_digits(self) -> bool:
        """Whether some leg is singular by rounding: what Newton's method finds is no answer."""
        blocks, each = self.equations.A, self.problem.closures_of
        return not self.regular and any(
            closure.lacks_digits(A) for closure, A in zip(each(blocks), blocks, strict=True)
        )


@frozen
class EquilibriumProblem:
    """A robot, unloaded at a posture, and the forces on its platform."""

    legs: Legs
    rows: tuple[int, ...]  # coordinates of the platform: six in space, three in the plane
    # (3,): of the platform, about which wrenches are; (P, 3) of robots side by side [m]
    point: np.ndarray
    length: float  # characteristic [m]
    dead: DeadForces
    # where bodies are that results list by name; None of the platform
    nodes: Mapping[str, Spot | None] = field(default_factory=dict)
    # at any load, and a moment as a wrench (r,): in balance with cables at the unloaded posture
    steady: DeadForces | None = None
    moment: np.ndarray | float = 0.0

    @property
    def unloaded(self) -> State:
        """The posture from which it is loaded."""
        return self.legs.unloaded

    @property
    def blocks(self) -> tuple[ComponentBlock, ...]:
        """Components of the legs, those of one kind side by side."""
        return self.legs.numbers.blocks

    @property
    def size(self) -> int:
        """Coordinates of the platform."""
        return len(self.rows)

    @cached_property
    def scale(self) -> np.ndarray:
        """Length that makes shifts and turns alike: 1 for shifts (r,), `length` for turns."""
        return np.array([1.0 if row < 3 else self.length for row in self.rows])

    @cached_property
    def units(self) -> np.ndarray:
        """What makes numbers of the unknowns of the legs (T,), see `Legs.units`."""
        return self.legs.units(self.length)

    @cached_property
    def free(self) -> np.ndarray:
        """Coordinates and twists of bodies among the unknowns."""
        coordinates = [block.coordinates.ravel() for block in self.blocks]
        return np.concatenate([np.zeros(0, dtype=int), *coordinates])

    @cached_property
    def _unloaded(self) -> LegEquations:
        """Those of the legs at the unloaded posture without load."""
        return self.legs.equations(self.unloaded, 0.0)

    @cached_property
    def at_rest(self) -> Linearised:
        """The equations at the unloaded posture without load."""
        no_load = LoadCase(np.zeros(self.size), share_rate=0.0)
        return self._linearised(self._unloaded, no_load, 0.0, 2 if any(self.missing) else 0, None)

    @cached_property
    def closures(self) -> tuple[Closure, ...]:
        """Those of the legs at the unloaded posture."""
        return self.closures_of(self._unloaded.A)

    def closures_of(self, tangents: Sequence[np.ndarray]) -> tuple[Closure, ...]:
        """Those of the blocks of legs, by their tangents."""
        return tuple(
            Closure.of(A, self.units[block.at[0, block.free :]], self.units[block.coordinates])
            for block, A in zip(self.blocks, tangents, strict=True)
        )

    @property
    def missing(self) -> list[int]:
        """Directions at most that closures of the legs of each block lack, of rigid parts."""
        return [closure.deficit for closure in self.closures]

    def linear_equations(
        self, state: State, loading: LoadCase, factor: float, refinements: int = 0
    ) -> Linearised:
        """The equations at a state."""
        rest = self.at_rest
        if state is self.unloaded and self.loads_platform_alone and not (refinements or rest.rigid):
            acting, rate, turning = self._on_platform(state, loading, factor)
            return replace(
                rest,
                K_total=rest.K - turning,
                missing=rest.missing + acting,
                by_factor=rest.by_factor + rate,
            )
        rank = 0 if rest.held_platform is None else rest.held_platform.rank
        eq = self.legs.equations(state, loading.share_at(factor))
        return self._linearised(eq, loading, factor, refinements, rank)

    def _linearised(
        self, eq: LegEquations, loading: LoadCase, factor: float, refinements: int, rank: int | None
    ) -> Linearised:
        by_factor, state = eq.r_share * loading.share_rate, eq.state
        wanted = -np.column_stack([eq.r, self.legs.numbers.by_twist, by_factor])
        solution, regular = np.zeros(wanted.shape), True
        lacking: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        each = zip(self.blocks, eq.A, self.closures, strict=True)
        for g, (block, A, closure) in enumerate(each):
            solution[block.at], lost, open_ = closure.solve(A, wanted[block.at], refinements)
            if open_ is not None:
                lacking[g] = open_
            regular = regular and not np.any(lost)
        # what only the base holds has no end on the platform
        ends = self.legs.numbers.on_platform
        twist = np.eye(self.size, self.size + 2, 1)
        solution = self.legs.steps(eq, solution, twist)
        carried, W = (
            each[ends].reshape(self.legs.robots, -1, *each.shape[1:]).sum(axis=1)
            for each in (solution[self.legs.numbers.W], state.W)
        )
        if self.legs.robots == 1:
            carried, W = carried[0], W[0]
        K = carried[..., 1:-1]
        acting, rate, turning = self._on_platform(state, loading, factor)
        missing = acting - W - carried[..., 0]
        by_factor, K_total = rate - carried[..., -1], K - turning
        platform = None
        if lacking:
            platform = HeldPlatform.of(
                [gaps for gaps, _ in lacking.values()], self.scale, self.length, rank
            )
            across = np.column_stack([missing, -K_total, by_factor]) / self.scale[:, None]
            z, at = platform.inverse.T @ across, 0
            for g, (gaps, wrenches) in lacking.items():
                N, d = gaps.shape[:2]
                more = wrenches @ z[at : at + N * d].reshape(N, d, -1)
                solution[self.blocks[g].at] += more
                at += N * d
            s = np.outer(self.scale, self.scale)
            missing = platform.missing(K_total / s, missing / self.scale) * self.scale
            by_factor = platform.free @ (platform.free.T @ (by_factor / self.scale)) * self.scale
            K, K_total = platform.within(K / s) * s, platform.within(K_total / s) * s
            platform = platform if platform.rank else None
        return Linearised(
            problem=self,
            K=K,
            K_total=K_total,
            missing=missing,
            by_factor=by_factor,
            steps=solution[:, 0],
            by_twist=solution[:, 1:-1],
            factor_steps=solution[:, -1],
            equations=eq,
            held_platform=platform,
            regular=regular,
        )

    @property
    def bears_loads(self) -> bool:
        """Whether anything acts beside the wrench, as springs between bodies do."""
        return self.dead.act or not self.loads_platform_alone

    @cached_property
    def loads_platform_alone(self) -> bool:
        """Whether neither preloads, forces nor springs between bodies act on the legs."""
        legs, loads = self.legs, any(chain.loads for chain in self.legs.chains)
        pushed = np.any(legs.arrays.preload) or any(c.drive.preload for c in legs.couplings)
        return not (legs.springs or pushed or loads)

    @property
    def has_laws(self) -> bool:
        """Whether some joint follows a law of its own, which may change with its coordinate."""
        legs = self.legs
        return bool(legs.arrays.laws) or any(c.drive.law is not None for c in legs.couplings)

    @property
    def has_corners(self) -> bool:
        """Whether paths may have corners: laws of joints, and cables that become slack."""
        return self.has_laws or any(spring.is_cable for spring in self.legs.springs)

    def after_step(
        self, state: State, known: Linearised, twist: np.ndarray, more: float, cap: float
    ) -> tuple[State, float, float]:
        """A step of the platform and of all that follows, cut to at most `cap` [rad].

        The platform moves by a twist (r,), the load factor grows by `more`. Returns the state, the
        size of the whole step [rad], and the part of it that was made.
        """
        step = known.steps + known.by_twist @ twist + known.factor_steps * more
        size = max(self.size_of(twist), self.size_of_legs(step))
        part = 1.0 if size <= cap else cap / size
        return self.legs.after_step(state, part * twist, part * step), size, part

    def displacement(self, state: State) -> np.ndarray:
        """Of the point of the platform, and its rotation vector, from the unloaded posture (r,)."""
        moved = np.concatenate([state.p - self.point, vector_of_rotation(state.R)])
        return moved[list(self.rows)]

    @cached_property
    def leg_names(self) -> dict[int, str]:
        """Names of the legs by their numbers."""
        owners = {chain.owner for chain in self.legs.chains} - {NOBODY}
        return {owner.leg: owner.name for owner in sorted(owners)}

    def size_of(self, twist: np.ndarray) -> float:
        """How much a twist turns or shifts, shifts by the robot's length [rad]."""
        return float(np.max(np.abs(twist * self.scale))) / self.length

    def size_of_legs(self, step: np.ndarray) -> float:
        """How much a step of the unknowns of legs moves or stretches them [rad], as `size_of`."""
        moved, axial = step[self.free] * self.units[self.free], self.legs.arrays.axial
        stretched = step[self.legs.numbers.total :] / (axial * self.length)
        return float(max(np.abs(part).max(initial=0.0) for part in (moved, stretched)))

    def _on_platform(
        self, state: State, loading: LoadCase, factor: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What acts on the platform, how that grows, and its rate by the twist."""
        rows = list(self.rows)
        share, grows = loading.share_at(factor), loading.share_rate
        acting, rate = factor * loading.wrench, loading.wrench
        turning = np.zeros((6, 6))
        if self.dead.act:
            total, turning = self.dead.acting(state.R)
            turning = share * turning
            acting, rate = acting + share * total[rows], rate + grows * total[rows]
        if self.steady is not None:
            total, more = self.steady.acting(state.R)
            acting, turning = acting + self.moment + total[rows], turning + more
        return acting, rate, turning[np.ix_(rows, rows)]


def solve_least(
    K: np.ndarray, b: np.ndarray, scale: np.ndarray, furthest: float, load: float = 0.0
) -> np.ndarray:
    """The x with ``K x = b``; where K has lost a direction, no motion, or a whole step to rest.

    A direction without stiffness in which nothing pulls stays as it is. One in which something
    does pull has its first step cut to `furthest`, in coordinates times their lengths `scale`;
    stiffness of the load meets it there. Rounding of `load`, the largest component of the whole
    load over `scale`, does not pull.
    """
    U, values, Vt = np.linalg.svd(K / np.outer(scale, scale))
    along = U.T @ (b / scale)
    lost = values <= LOST * values[0]
    x = Vt.T @ np.where(lost, 0.0, along / np.where(lost, 1.0, values))
    # Vectors of a singular value of zero are any: the pull along all of them is one direction.
    pull = Vt[lost].T @ (Vt[lost] @ (b / scale))
    size = np.linalg.norm(pull)
    if size > _PULLS * np.max(np.abs(along), initial=load):
        x = x + furthest * pull / size
    return x / scale

"""Stiffness of a robot frozen at a pose: its legs one by one, and their sum."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, partial

import numpy as np

from robostiff.elastostatics import (
    BlockCompliance,
    CartesianStiffness,
    Details,
    Form,
    LegWrenches,
    Status,
    Tolerance,
    WrenchBasis,
    aggregate,
    leg_wrenches,
    matrix_length,
    scaling,
    solve_chain,
    solved_leg,
)
from robostiff.elastostatics.conjugate_wrenches import conjugate_wrenches
from robostiff.elastostatics.leg import loads_of_modes, wrenches_of_leg
from robostiff.elastostatics.parallel_block import block_of
from robostiff.elastostatics.tolerance import (
    check_compliance_in_plane,
    check_joints_in_plane,
    last_moved,
)
from robostiff.errors import InputError
from robostiff.frozen import frozen, replace
from robostiff.kinematics import leg_compliance, passive_jacobian, spring_loads
from robostiff.kinematics.jacobians import LegsTogether, in_order, legs_alone, legs_together
from robostiff.kinematics.spanning_tree import branches
from robostiff.model import PlacedBlock, PlacedLeg, PlacedSpring, Snapshot
from robostiff.spatial import Space
from robostiff.spatial.batch import empty_batch


@frozen
class LegMatrices:
    """Matrices of a leg for the forms of K_C, about one point in world axes."""

    placed: PlacedLeg
    at: np.ndarray  # (..., 3): the point [m]
    space: Space
    length: np.ndarray  # (...): characteristic length [m]
    # (..., n, q): twists of the passive joints, then of the freedoms of parallel blocks
    J_q: np.ndarray
    names: tuple[str, ...]  # of the columns of J_q
    # (..., q) of bool or None: which columns are there; None for all
    present: np.ndarray | None = None
    blocks: tuple[SolvedBlock, ...] = ()  # its parallel blocks

    @cached_property
    def C(self) -> np.ndarray:
        """Compliance with the passive joints held (..., n, n)."""
        C = leg_compliance(self.placed.without_blocks, self.at)
        if self.space is Space.PLANAR:
            rows = list(self.space.rows)
            C = C[..., rows, :][..., :, rows]
        return C + np.sum([block.whole.C for block in self.blocks], axis=0)

    def wrenches(self, length: np.ndarray, tolerance: Tolerance) -> LegWrenches:
        """Transmitted wrenches and their energy, in coordinates scaled by a length [m]."""
        loads = partial(self.spring_loads, length=length)
        return leg_wrenches(self.J_q, loads, length, tolerance, self.present)

    def spring_loads(self, W: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Loads of its springs and blocks under scaled wrenches W, as `kinematics.spring_loads`."""
        wrenches = empty_batch(W.shape[:-2], (6, W.shape[-1]))
        wrenches[...] = 0.0
        wrenches[..., list(self.space.rows), :] = W * scaling(length, self.space)[..., None]
        rows, sizes = spring_loads(self.placed.without_blocks, self.at, wrenches, length)
        if not self.blocks:
            return rows, sizes
        of_blocks = [loads_of_modes(block.whole.modes)(W) for block in self.blocks]
        return (
            np.concatenate([rows, *(own for own, _ in of_blocks)], axis=-2),
            np.concatenate([sizes, *(size for _, size in of_blocks)], axis=-1),
        )

    def possible_redundancy(self, redundant: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
        """What may be redundant, joints, blocks and what is inside those, and what is (..., r).

        From the columns (..., q) of J_q that are. A block is where any of its freedoms is: how many
        it has may change from pose to pose.
        """
        freedoms = [block.whole.J_q.shape[-1] for block in self.blocks]
        joints = len(self.names) - sum(freedoms)
        *of_blocks, _ = np.split(redundant, np.cumsum([joints, *freedoms]), axis=-1)
        names, parts = self.names[:joints], [of_blocks.pop(0)]
        names += tuple(block.placed.name for block in self.blocks)
        parts += [np.any(own, axis=-1, keepdims=True) for own in of_blocks]
        for block in self.blocks:
            ends = np.cumsum([branch.J_q.shape[-1] for branch in block.branches])
            *of_branches, _ = np.split(block.whole.redundant, ends, axis=-1)
            for branch, own in zip(block.branches, of_branches, strict=True):
                inner, flags = branch.possible_redundancy(own)
                names, parts = names + inner, [*parts, flags]
        return names, np.concatenate(parts, axis=-1)

    @property
    def doubtful(self) -> np.ndarray:
        """Where rounding blurs which motions a block leaves free (...), or one further inside."""
        none = np.zeros(self.J_q.shape[:-2], dtype=bool)
        inside = (x.doubtful for block in self.blocks for x in (block.whole, *block.branches))
        return np.logical_or.reduce([none, *inside])


@frozen
class SolvedBlock:
    """A parallel block with the matrices of its branches."""

    placed: PlacedBlock
    whole: BlockCompliance
    branches: tuple[LegMatrices, ...]


def leg_matrices(
    leg: PlacedLeg, at: np.ndarray, space: Space, length: np.ndarray, tolerance: Tolerance
) -> LegMatrices:
    """Compliance and passive twists of a leg about a point (..., 3), in the rows of a space.

    By the characteristic length (...) [m] blocks decide what is free. A leg of a planar robot that
    leaves the plane is an `InputError`.
    """
    J_q, names = passive_jacobian(leg.without_blocks, at)
    if space is Space.PLANAR:
        check_joints_in_plane(J_q, names)
        C = leg_compliance(leg.without_blocks, at)
        check_compliance_in_plane(C, f"leg {leg.name!r} of a planar robot")
        J_q = J_q[..., list(space.rows), :]
    if not leg.blocks:
        return LegMatrices(leg, at, space, length, J_q, names)
    blocks = []
    for block in leg.blocks:
        if space is Space.PLANAR or any(branch.blocks for branch in block.branches):
            together = legs_alone(block.branches)
        else:
            together = legs_together(block.branches, at.shape[:-1])
        solved = [
            leg_matrices(own.leg, own.each(at), space, own.each(length), tolerance)
            for own in together
        ]
        wrenches = in_order(together, [one.wrenches(one.length, tolerance) for one in solved])
        matrices: dict[int, LegMatrices] = {}
        for own, one in zip(together, solved, strict=True):
            several = len(own.places) > 1  # those have no blocks inside
            for k, i in enumerate(own.places):
                matrices[i] = one
                if several:
                    part = block.branches[i], at, space, length, one.J_q[k], one.names
                    matrices[i] = LegMatrices(*part)
        branches = tuple(matrices[i] for i in range(len(matrices)))
        inner = tuple(tuple(own.whole for own in one.blocks) for one in branches)
        whole = replace(block_of(wrenches, length, tolerance), inner=inner)
        blocks.append(SolvedBlock(block, whole, branches))
    columns, there = [J_q], [np.ones((*J_q.shape[:-2], len(names)), dtype=bool)]
    for block in blocks:
        columns.append(block.whole.J_q)
        there.append(block.whole.present)
        names += tuple(f"{block.placed.name}.free[{i}]" for i in range(there[-1].shape[-1]))
    present = np.concatenate(there, axis=-1)
    J_q = np.concatenate(columns, axis=-1)
    there_all = None if np.all(present) else present
    return LegMatrices(leg, at, space, length, J_q, names, there_all, tuple(blocks))


DEFAULT_METHOD = WrenchBasis()
# Part of a coordinate that is lost when points are computed in several ways.
_ROUNDING = 1e-12
# A reference point further from the robot than this many of its lengths is moved to at the end.
_FAR = 10.0


_TOOL = "platform"


def branches_of(snapshot: Snapshot) -> tuple[tuple[PlacedLeg, ...], list[tuple[int, int]] | None]:
    """Series paths of legs and parts of a flexible platform, and the bodies between which they are.

    Those with the legs come first; 0 is the ground, 1 the tool. Without the bodies, which are then
    left out, each leads from the one to the other.
    """
    placed = snapshot.platform
    if placed is None:
        return snapshot.legs, None
    platform, chains = placed.platform, list(snapshot.legs)
    for part in platform.parts:
        point, axes = placed.in_world(part.point), placed.rotation @ part.axes
        spring = PlacedSpring(f"{_TOOL}/{part.name}", point, axes, part.elasticity)
        chains.append(PlacedLeg(_TOOL, (spring,), point))
    pairs = [*(("", node) for node in placed.holds), *((own.a, own.b) for own in platform.parts)]
    paths = []
    for a, b, path in branches(pairs, ("", platform.tool)):
        first, *others = sorted(number for number, _ in path)
        more = [e for i in others for e in chains[i].elements]
        joined = replace(chains[first], elements=(*chains[first].elements, *more))
        paths.append((first, joined, (a, b)))
    paths.sort(key=lambda path: path[0])
    number, ends = {"": 0, platform.tool: 1}, []
    for *_, pair in paths:
        a, b = (number.setdefault(body, len(number)) for body in pair)
        ends.append((a, b))
    are_legs = all(pair == (0, 1) for pair in ends)
    return tuple(path for _, path, _ in paths), None if are_legs else ends


def name_of_part(leg: PlacedLeg, part: str) -> tuple[str, str]:
    """The names of a leg, or of the platform, and of its part."""
    own = part.removeprefix(f"{_TOOL}/")
    return (_TOOL if own != part else leg.name, own)


def solve_snapshot(
    snapshot: Snapshot,
    method: Form,
    tolerance: Tolerance,
    ends: Sequence[tuple[int, int]] | None = None,
) -> Details:
    """Stiffness of the legs of a snapshot and of the whole.

    Its legs may be series paths between any bodies, the `ends` of each: 0 is at rest, 1 the
    platform.
    """
    paths, between = branches_of(snapshot)
    ends = between if ends is None else ends
    together = legs_alone(paths)
    if method == DEFAULT_METHOD:
        together = legs_together(paths, snapshot.reference_point.shape[:-1])
        if len(together) < len(paths):
            try:
                return _solved_together(snapshot, paths, together, ends, method, tolerance)
            except InputError:  # of one of the legs: which, they say one by one
                together = legs_alone(paths)
    return _solved_together(snapshot, paths, together, ends, method, tolerance)


def _solved_together(
    snapshot: Snapshot,
    paths: Sequence[PlacedLeg],
    together: Sequence[LegsTogether],
    ends: Sequence[tuple[int, int]] | None,
    method: Form,
    tolerance: Tolerance,
) -> Details:
    # Lever arms that are small beside the lengths of the parts are rounding: all is in one point.
    length = snapshot.characteristic_length
    of_parts = [_longest_spring(own.leg, own.each(length).shape) for own in together]
    of_parts = in_order(together, of_parts)
    length = np.where(length > tolerance.independence * np.max(of_parts, axis=0), length, 0.0)
    # About the reference point, or amid the legs where that is far away; from a robot that is all
    # in one point every other is far away.
    origin, centre = snapshot.reference_point, snapshot.centre
    far = np.linalg.norm(origin - centre, axis=-1) > _FAR * length
    if np.any(far):
        origin = np.where(far[..., None], centre, origin)

    def matrices(scale: np.ndarray) -> list[LegMatrices]:
        return [
            leg_matrices(own.leg, own.each(origin), snapshot.space, own.each(scale), tolerance)
            for own in together
        ]

    problems = matrices(np.where(length > 0, length, 1.0))
    if not np.all(length > 0):  # all in one point: a length from the springs
        own = [matrix_length(one.C, one.J_q) for one in problems]
        of_springs = np.max(in_order(together, own), axis=0)
        # Lever arms between points that are one are rounding of coordinates, of that and others.
        places = np.abs(snapshot.centre), np.abs(snapshot.reference_point)
        arms = _ROUNDING * np.max(np.maximum(*places), axis=-1)
        of_springs = np.where(of_springs > arms, of_springs, 1.0)
        length = np.where(length > 0, length, of_springs)
        problems = matrices(length)
    of_legs = range(len(snapshot.legs))  # parts between nodes of a platform have one form alone
    solved = [
        _solved(one, method if own.places[0] in of_legs else DEFAULT_METHOD, tolerance)
        for own, one in zip(together, problems, strict=True)
    ]
    legs, shares = tuple(in_order(together, [own for own, _ in solved])), None
    reported = {
        i: names for own, (_, names) in zip(together, solved, strict=True) for i in own.places
    }
    names = [
        "/".join(name_of_part(leg, name)) for i, leg in enumerate(paths) for name in reported[i]
    ]
    if ends is None:
        whole = aggregate(legs)
    else:
        columns = in_order(together, [one.J_q for one in problems])
        whole, shares = _between_bodies(legs, ends, columns, tolerance)
        K = whole.matrix[..., None, :, :]
        legs = tuple(
            replace(leg, matrix=own, status_codes=whole.status_codes)
            for leg, own in zip(legs, np.moveaxis(shares @ K, -3, 0), strict=True)
        )
    leg_blocks = {
        i: tuple(b.whole[k] if len(own.places) > 1 else b.whole for b in one.blocks)
        for own, one in zip(together, problems, strict=True)
        for k, i in enumerate(own.places)
    }
    return Details.of(
        whole,
        origin=origin,
        reference_point=snapshot.reference_point,
        passive_joint_names=tuple(names),
        legs=legs[: len(snapshot.legs)],
        leg_blocks=tuple(leg_blocks[i] for i in range(len(snapshot.legs))),
        shares=shares,
    )


def _longest_spring(leg: PlacedLeg, shape: tuple[int, ...]) -> np.ndarray:
    """Largest length of a spring by itself, ``sqrt(tr C_tt / tr C_rr)``, of that shape [m]."""
    longest = np.zeros(shape)
    for spring in leg.springs:
        d = np.einsum("...ii->...i", spring.elasticity.compliance)
        shift, turn = np.sum(d[..., :3], axis=-1), np.sum(d[..., 3:], axis=-1)
        both = (shift > 0) & (turn > 0)
        own = np.sqrt(np.where(both, shift, 0.0) / np.where(both, turn, 1.0))
        longest = np.maximum(longest, own)
    return longest


def _between_bodies(
    branches: Sequence[CartesianStiffness],
    ends: Sequence[tuple[int, int]],
    J_q: Sequence[np.ndarray],
    tolerance: Tolerance,
) -> tuple[CartesianStiffness, np.ndarray]:
    """Stiffness of a body that branches between bodies hold, and what each carries of its load.

    They have twists (..., n, q) of passive joints, and all are about one point.
    """
    first = branches[0]
    together = block_of([wrenches_of_leg(own) for own in branches], first.length, tolerance, ends)
    wrenches = LegWrenches(
        together.W,
        np.zeros((*first.batch_shape, 0)),
        conjugate_wrenches(together.W, *loads_of_modes(together.modes)(together.W), tolerance),
    )
    solved = solved_leg(wrenches, first.length, tolerance)
    whole = aggregate((replace(solved, held=together.held),))
    redundant = np.concatenate([own.redundant for own in branches], axis=-1)
    moving = _idle_freedoms(together.mechanisms, ends, J_q, redundant, first.length, tolerance)
    redundant = redundant | moving
    status = np.bitwise_or.reduce([own.status_codes for own in branches])
    status = (
        whole.status_codes
        | (status & ~np.uint16(Status.FREE_MOTIONS | Status.RIGID_DIRECTION))
        | together.doubtful * np.uint16(Status.ILL_CONDITIONED)
        | np.any(moving, axis=-1) * np.uint16(Status.REDUNDANT_JOINTS)
    )
    whole = replace(
        whole,
        redundant=redundant,
        status_codes=np.asarray(status, dtype=np.uint16),
        reason="; ".join(dict.fromkeys(own.reason for own in branches if own.reason)),
    )
    return whole, together.shares


def _idle_freedoms(
    mechanisms: np.ndarray,
    ends: Sequence[tuple[int, int]],
    J_q: Sequence[np.ndarray],
    redundant: np.ndarray,
    length: np.ndarray,
    tolerance: Tolerance,
) -> np.ndarray:
    """Freedoms that nothing holds while the loaded body is at rest, among all columns (..., q).

    A freedom is one where some mechanism moves it, and none after it; those that are `redundant`
    in their branch are none.
    """
    found = np.zeros(redundant.shape, dtype=bool)
    n = J_q[0].shape[-2]
    for place in map(tuple, np.argwhere(np.any(mechanisms != 0, axis=(-1, -2)))):
        Y = mechanisms[place][:, np.any(mechanisms[place] != 0, axis=0)]
        _, values, Zt = np.linalg.svd(Y[:n])
        still = Y @ Zt[np.count_nonzero(values > tolerance.independence) :].T
        if not still.shape[1]:
            continue
        s, moved = scaling(length[place], Space.of_size(n)), np.vstack([0.0 * still[:n], still])
        rates, start = [np.zeros((0, still.shape[1]))], 0
        for (a, b), own in zip(ends, J_q, strict=True):
            moving = ~redundant[(*place, slice(start, start := start + own.shape[-1]))]
            apart = moved[n * b : n * (b + 1)] - moved[n * a : n * (a + 1)]
            rate = np.zeros((own.shape[-1], still.shape[1]))
            rate[moving] = np.linalg.pinv(own[place][:, moving] * s[:, None]) @ apart
            rates.append(rate)
        found[place] = last_moved(np.vstack(rates), tolerance)
    return found


def _solved(
    leg: LegMatrices, method: Form, tolerance: Tolerance
) -> tuple[CartesianStiffness, tuple[str, ...]]:
    """Stiffness of a leg with the status of its blocks, and names of what may be redundant."""
    length = leg.length
    if method == DEFAULT_METHOD:
        solved = solved_leg(leg.wrenches(length, tolerance), length, tolerance)
    else:
        solved = solve_chain(leg.C, leg.J_q, method, length, tolerance, leg.present)
    if not leg.blocks:
        return solved, leg.names
    names, redundant = leg.possible_redundancy(solved.redundant)
    status = (
        solved.status_codes
        | np.any(redundant, axis=-1) * np.uint16(Status.REDUNDANT_JOINTS)
        | leg.doubtful * np.uint16(Status.ILL_CONDITIONED)
    )
    codes = np.asarray(status, dtype=np.uint16)
    return replace(solved, redundant=redundant, status_codes=codes), names

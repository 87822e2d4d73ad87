"""Motion of every body of a robot when its platform is deflected.

The platform moves by the twist t and each leg carries the wrench F = K_leg t. Along the leg, an
elastic part deflects by C F; the remainder of t is motion of the passive joints,

    J_q dq = t - sum of C_i F,

the least motion where they are redundant. The sums up to each element are the twists of the bodies
between them, and the last of them is that of the platform. Under finite loads the bodies are where
an equilibrium has them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from robostiff.analysis import Deflection
from robostiff.elastostatics import BlockCompliance, Tolerance, scaling
from robostiff.kinematics import freedom_twist, spring_compliance
from robostiff.model import (
    CoupledFreedom,
    PlacedFreedom,
    PlacedLeg,
    PlacedPlatform,
    PlacedSpring,
    Snapshot,
)
from robostiff.model.snapshot import PlacedBlock
from robostiff.network import Network, motions_under, network_of_snapshot
from robostiff.network.network import platform_node
from robostiff.spatial import Space, cross, move_twist, move_wrench
from robostiff.statics import BodyPlace, BodyPlaces

Element = PlacedFreedom | PlacedSpring | PlacedBlock


@dataclass(frozen=True)
class BodyMotion:
    """Twist (6,) of a body: translation of the point `about` (3,), rotation [m, rad]."""

    twist: np.ndarray
    about: np.ndarray

    def displacement(self, point: np.ndarray) -> np.ndarray:
        """Displacement of a point (3,) of the body [m]."""
        return self.twist[:3] + self.turned(point - self.about)

    def twist_about(self, point: np.ndarray) -> np.ndarray:
        """Its twist (6,) about another point (3,)."""
        return move_twist(self.twist, point - self.about)

    def turned(self, along: np.ndarray) -> np.ndarray:
        """Change of a vector (3,) that the body carries."""
        return cross(self.twist[3:], along)


@dataclass(frozen=True)
class LegMotion:
    """Motions of the bodies of a leg."""

    # the one before the first element, and the one after each element
    bodies: tuple[BodyMotion, ...]
    # of the elements that are parallel blocks, by their place
    branches: dict[int, tuple[LegMotion, ...]]


@dataclass(frozen=True)
class RobotMotion:
    """Motions of the platform and of all bodies of the legs."""

    platform: BodyMotion  # of a flexible platform, that of its tool
    legs: tuple[LegMotion, ...]
    # of the nodes of a flexible platform
    nodes: Mapping[str, BodyMotion] = field(default_factory=dict)


def motion_under(snapshot: Snapshot, bent: Deflection) -> RobotMotion:
    """Motions of the bodies of a robot, at the single pose that was loaded, of a deflection.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("planar-link")
    >>> bent = rs.deflection(robot, wrench=[0, 10, 0])
    >>> motion = motion_under(rs.find_posture(robot).snapshot.one(0), bent)
    >>> bool(np.allclose(motion.legs[0].bodies[-1].twist, motion.platform.twist))
    True
    """
    answer = bent.stiffness
    rows = list(answer.space.rows)
    to_origin = answer.origin - answer.reference_point
    to_origin = to_origin if answer.space is Space.SPATIAL else to_origin[:2]
    t = move_twist(bent.twist, to_origin)
    held = answer.details().whole
    solver = _LegSolver(answer.origin, answer.space, held.length, held.tolerance)
    platform = BodyMotion(spatial(t, rows), answer.origin)
    ends, nodes = [platform] * len(snapshot.legs), {}
    if snapshot.platform is not None:
        nodes = _nodes_of_platform(snapshot, snapshot.platform, bent)
        ends = [nodes[name] for name in snapshot.platform.holds]
    legs = tuple(
        solver.motion(leg, own, np.zeros(6), end.twist_about(answer.origin), spatial(F, rows))
        for leg, end, own, F in zip(
            snapshot.legs, ends, bent.stiffness.details().leg_blocks, bent.leg_wrenches, strict=True
        )
    )
    return RobotMotion(platform, legs, nodes)


def _nodes_of_platform(
    snapshot: Snapshot, placed: PlacedPlatform, bent: Deflection
) -> dict[str, BodyMotion]:
    """Motions of the nodes of a flexible platform, by their own names."""
    moved = network_motion(network_of_snapshot(snapshot), bent)
    return {node.name: moved[platform_node(placed, node.name)] for node in placed.platform.nodes}


def network_motion(network: Network, bent: Deflection) -> dict[str, BodyMotion]:
    """Motions of the bodies of a network under the load of a deflection, by name.

    Raises NoAnswerError when there is no deflection.
    """
    tolerance = bent.stiffness.details().whole.tolerance
    v = network.reference_point - bent.stiffness.reference_point
    v = v[: network.space.translations]
    F, t = move_wrench(bent.wrench, v), move_twist(bent.twist, v)
    moved = motions_under(network, F, t, tolerance)
    return {name: BodyMotion(*own) for name, own in moved.items()}


def at_rest(snapshot: Snapshot) -> RobotMotion:
    """Zero motion."""
    still = BodyMotion(np.zeros(6), np.zeros(3))
    placed = snapshot.platform
    nodes = {} if placed is None else {node.name: still for node in placed.platform.nodes}
    return RobotMotion(still, tuple(_leg_at_rest(leg, still) for leg in snapshot.legs), nodes)


def _leg_at_rest(leg: PlacedLeg, still: BodyMotion) -> LegMotion:
    branches = {
        i: tuple(_leg_at_rest(branch, still) for branch in element.branches)
        for i, element in enumerate(leg.elements)
        if isinstance(element, PlacedBlock)
    }
    return LegMotion((still,) * (len(leg.elements) + 1), branches)


@dataclass(frozen=True)
class _LegSolver:
    origin: np.ndarray
    space: Space
    length: np.ndarray
    tolerance: Tolerance

    def motion(
        self,
        leg: PlacedLeg,
        known: Sequence[BlockCompliance],
        t_start: np.ndarray,
        t_end: np.ndarray,
        F: np.ndarray,
    ) -> LegMotion:
        """Motion of a leg whose ends move by t_start and t_end (6,) while it carries F (6,).

        Its parallel blocks are `known`, by which they share a wrench among their branches.
        """
        rows = list(self.space.rows)
        blocks = iter(known)
        solved = [next(blocks) if isinstance(e, PlacedBlock) else None for e in leg.elements]
        given = [self._sprung_and_free(*own, F) for own in zip(leg.elements, solved, strict=True)]
        q = self._joint_motion(
            np.concatenate([N for _, N in given], axis=1),
            t_end - t_start - np.sum([moved for moved, _ in given], axis=0),
        )
        motions, start = [], 0
        for moved, N in given:
            motions.append(moved + N @ q[start : start + N.shape[1]])
            start += N.shape[1]
        t, twists, branches = t_start, [t_start], {}
        for i, (block, own) in enumerate(zip(solved, self._shared(leg, motions), strict=True)):
            element = leg.elements[i]
            if block is not None and isinstance(element, PlacedBlock):
                parts = zip(element.branches, block.inner, block.shares, strict=True)
                branches[i] = tuple(
                    self.motion(branch, inner, t, t + own, spatial(share @ F[rows], rows))
                    for branch, inner, share in parts
                )
            t = t + own
            twists.append(t)
        return LegMotion(tuple(BodyMotion(twist, self.origin) for twist in twists), branches)

    def _shared(self, leg: PlacedLeg, motions: list[np.ndarray]) -> list[np.ndarray]:
        """Motions of the elements, those of coupled coordinates at the joints that they move."""
        if not any(isinstance(e, CoupledFreedom) for e in leg.elements):
            return motions
        shared = list(motions)
        places = {
            e.joint if isinstance(e, CoupledFreedom) else e.name: i
            for i, e in enumerate(leg.elements)
        }
        for i, element in enumerate(leg.elements):
            if isinstance(element, CoupledFreedom):
                whole = freedom_twist(element, self.origin)
                amount = float(whole @ motions[i] / (whole @ whole))
                shared[i] = shared[i] - motions[i]
                for name, share, screw in element.moves:
                    shared[places[name]] = shared[places[name]] + (
                        share * amount * screw.twist(self.origin)
                    )
        return shared

    def _sprung_and_free(
        self, element: Element, block: BlockCompliance | None, F: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Deflection (6,) of an element under F (6,), and free twists (6, k), about the origin."""
        if block is not None:
            rows = list(self.space.rows)
            N = np.zeros((6, int(np.count_nonzero(block.present))))
            N[rows] = block.J_q[:, block.present]
            return spatial(block.C @ F[rows], rows), N
        if isinstance(element, PlacedSpring):
            return spring_compliance(element, self.origin) @ F, np.zeros((6, 0))
        freedom = cast("PlacedFreedom", element)
        column = freedom_twist(freedom, self.origin)
        if freedom.is_passive:
            return np.zeros(6), column[:, None]
        C = 0.0 if freedom.stiffness is None else 1 / freedom.stiffness
        return C * (column @ F) * column, np.zeros((6, 0))

    def _joint_motion(self, N: np.ndarray, missing: np.ndarray) -> np.ndarray:
        """Least joint motion with twist N q = missing."""
        rows = list(self.space.rows)
        s = scaling(self.length, self.space)
        columns = N[rows] * s[:, None]
        size = np.linalg.norm(columns, axis=0)
        size = np.where(size > 0, size, 1.0)
        cut = self.tolerance.independence
        return np.linalg.lstsq(columns / size, missing[rows] * s, rcond=cut)[0] / size


def spatial(values: np.ndarray, rows: Sequence[int]) -> np.ndarray:
    """A twist or a wrench (6,) of its values in some rows."""
    whole = np.zeros(6)
    whole[list(rows)] = values
    return whole


@dataclass(frozen=True)
class FiniteMotion(BodyMotion):
    """A body that turns far: X moves by ``D X + t``, and a line along it by ``D`` of it."""

    D: np.ndarray
    t: np.ndarray  # (3,): [m]

    @staticmethod
    def of(place: BodyPlace) -> FiniteMotion:
        """The displacements of a body."""
        return FiniteMotion(np.zeros(6), np.zeros(3), place.R - np.eye(3), place.t)

    def displacement(self, point: np.ndarray) -> np.ndarray:
        """Displacement of a point (3,) of the body [m]."""
        return self.D @ point + self.t

    def turned(self, along: np.ndarray) -> np.ndarray:
        """Change of a vector (3,) that the body carries."""
        return self.D @ along


def finite_motion(snapshot: Snapshot, places: BodyPlaces) -> RobotMotion:
    """Motions of all bodies of a robot from its unloaded posture to their places."""
    platform = FiniteMotion.of(places.platform)
    still = FiniteMotion.of(BodyPlace(np.eye(3), np.zeros(3)))
    known = {name: FiniteMotion.of(own) for name, own in places.behind.items()}
    nodes = {name: FiniteMotion.of(own) for name, own in places.nodes.items()}
    placed, legs = snapshot.platform, []
    for i, leg in enumerate(snapshot.legs):
        end = platform if placed is None else nodes[placed.holds[i]]
        walk = _along(leg, f"{leg.name}/", still, known)
        # nothing moves behind the last part that does
        last = _last_moving(leg, f"{leg.name}/", known)
        bodies = tuple(body if k <= last else end for k, body in enumerate(walk.bodies))
        legs.append(LegMotion(bodies, walk.branches))
    return RobotMotion(platform, tuple(legs), nodes)


def _along(
    leg: PlacedLeg, prefix: str, start: BodyMotion, known: dict[str, FiniteMotion]
) -> LegMotion:
    bodies = [start]
    branches = {}
    for i, element in enumerate(leg.elements):
        if isinstance(element, PlacedBlock):
            own = tuple(_along(branch, prefix, bodies[-1], known) for branch in element.branches)
            branches[i] = own
            bodies.append(own[0].bodies[-1])
        else:
            bodies.append(known.get(prefix + element.name, bodies[-1]))
    return LegMotion(tuple(bodies), branches)


def _last_moving(leg: PlacedLeg, prefix: str, known: dict[str, FiniteMotion]) -> int:
    """Place of the last body before one that is the platform."""
    moving = [
        i
        for i, element in enumerate(leg.elements)
        if isinstance(element, PlacedBlock) or prefix + element.name in known
    ]
    return moving[-1] if moving else -1

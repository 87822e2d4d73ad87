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
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from robostiff.analysis import Deflection
from robostiff.elastostatics import BlockCompliance, Tolerance, scaling
from robostiff.kinematics import freedom_twist, spring_compliance
from robostiff.model import (
    CoupledFreedom,
    PlacedFreedom,
    PlacedLeg,
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


Motions = Mapping[str, BodyMotion]
"""Of bodies by name; of a robot of legs ``leg/element`` is the body behind an element."""

PLATFORM = "platform"
STILL = BodyMotion(np.zeros(6), np.zeros(3))


def node_key(name: str) -> str:
    """The name of a node of a flexible platform among bodies."""
    return f"{PLATFORM}, {name}"


def end_key(snapshot: Snapshot, i: int) -> str:
    """The body that leg i ends on: the platform, or the node that holds the leg."""
    placed = snapshot.platform
    return PLATFORM if placed is None else node_key(placed.holds[i])


def motion_under(snapshot: Snapshot, bent: Deflection) -> Motions:
    """Motions of the bodies of a robot, at the single pose that was loaded, of a deflection.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("planar-link")
    >>> bent = rs.deflection(robot, wrench=[0, 10, 0])
    >>> motions = motion_under(rs.find_posture(robot).snapshot.one(0), bent)
    >>> bool(np.allclose(motions["link/tip"].twist, motions["platform"].twist))
    True
    """
    answer = bent.stiffness
    rows = list(answer.space.rows)
    to_origin = answer.origin - answer.reference_point
    to_origin = to_origin if answer.space is Space.SPATIAL else to_origin[:2]
    t = move_twist(bent.twist, to_origin)
    held = answer.details().whole
    found = {PLATFORM: BodyMotion(spatial(t, rows), answer.origin)}
    if snapshot.platform is not None:
        placed = snapshot.platform
        moved = network_motion(network_of_snapshot(snapshot), bent)
        for node in placed.platform.nodes:
            found[node_key(node.name)] = moved[platform_node(placed, node.name)]
    solver = _LegSolver(answer.origin, answer.space, held.length, held.tolerance, found)
    legs = zip(snapshot.legs, answer.details().leg_blocks, bent.leg_wrenches, strict=True)
    for i, (leg, blocks, F) in enumerate(legs):
        end = found[end_key(snapshot, i)].twist_about(answer.origin)
        solver.solve(leg, f"{leg.name}/", blocks, np.zeros(6), end, spatial(F, rows))
    return found


def network_motion(network: Network, bent: Deflection) -> Motions:
    """Motions of the bodies of a network under the load of a deflection, by name.

    Raises NoAnswerError when there is no deflection.
    """
    tolerance = bent.stiffness.details().whole.tolerance
    v = network.reference_point - bent.stiffness.reference_point
    F = move_wrench(bent.wrench, v[: network.space.translations])
    moved = motions_under(network, F, bent.forces, tolerance)
    return {name: BodyMotion(*own) for name, own in moved.items()}


@dataclass(frozen=True)
class _LegSolver:
    origin: np.ndarray
    space: Space
    length: np.ndarray
    tolerance: Tolerance
    found: dict[str, BodyMotion]

    def solve(
        self,
        leg: PlacedLeg,
        prefix: str,
        known: Sequence[BlockCompliance],
        t_start: np.ndarray,
        t_end: np.ndarray,
        F: np.ndarray,
    ) -> None:
        """Find the bodies of a leg whose ends move by t_start and t_end (6,) under F (6,).

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
        t = t_start
        for element, block, own in zip(
            leg.elements, solved, self._shared(leg, motions), strict=True
        ):
            if block is not None and isinstance(element, PlacedBlock):
                parts = zip(element.branches, block.inner, block.shares, strict=True)
                for branch, inner, share in parts:
                    F_branch = spatial(share @ F[rows], rows)
                    self.solve(branch, prefix, inner, t, t + own, F_branch)
            t = t + own
            self.found[prefix + element.name] = BodyMotion(t, self.origin)

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


def finite_motions(posed: Any, places: BodyPlaces) -> Motions:
    """Motions of all bodies of a machine from its unloaded posture to their places."""
    found: dict[str, BodyMotion] = {PLATFORM: FiniteMotion.of(places.platform)}
    if isinstance(posed, Network):
        still = BodyPlace(np.eye(3), np.zeros(3))
        nodes = {posed.platform: places.platform, **places.nodes}
        return {one.name: FiniteMotion.of(nodes.get(one.name, still)) for one in posed.nodes}
    if not isinstance(posed, Snapshot):
        return found
    known = {name: FiniteMotion.of(own) for name, own in places.behind.items()}
    found |= {node_key(name): FiniteMotion.of(own) for name, own in places.nodes.items()}
    for i, leg in enumerate(posed.legs):
        _along(leg, f"{leg.name}/", STILL, known, found)
        # nothing moves behind the last part that does
        for element in reversed(leg.elements):
            key = f"{leg.name}/{element.name}"
            found[key] = found[end_key(posed, i)]
            if isinstance(element, PlacedBlock) or key in known:
                break
    return found


def _along(
    leg: PlacedLeg,
    prefix: str,
    body: BodyMotion,
    known: Motions,
    found: dict[str, BodyMotion],
) -> BodyMotion:
    """Find the bodies of a leg from its first; the last one."""
    for element in leg.elements:
        if isinstance(element, PlacedBlock):
            ends = [_along(own, prefix, body, known, found) for own in element.branches]
            body = ends[0]
        body = found[prefix + element.name] = known.get(prefix + element.name, body)
    return body

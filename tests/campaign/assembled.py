"""Robots and networks as bodies in the world: every element from the model's own numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

import robostiff as rs
from robostiff.model import Joint, JointKind, ParallelBlock, StiffnessLaw
from tests.campaign.bodies import Bodies, DeadPull, ElasticPart, PointSpring, SingleJoint, Sum
from tests.campaign.reread import placed, turned
from tests.generators.chains import beam_compliance_of, rigidities

_NOTHING, _NEARLY = 1e-13, 1e-9  # of a compliance whose diagonal is one
_OPEN = 1e-7  # m and rad: more is no posture


class NotAssembledError(Exception):
    """The machine has something that is not written here, or is no machine."""


@dataclass
class Assembly:
    """Bodies of a machine, and which of them is behind which part.

    Attributes
    ----------
    beams : int
        Parts into which beams are cut; 0 for linear springs.
    behind : dict of str to (int, (3,) array)
        By ``leg/part``: the body behind it, and the place of the part [m].
    frames : dict of str to (4, 4) array
        By ``leg/part``: behind a joint, and where a link begins.
    drives : dict of str to int
        By ``leg/part``: its place among the joints.
    """

    bodies: Bodies
    beams: int = 0
    behind: dict[str, tuple[int, np.ndarray]] = field(default_factory=dict)
    frames: dict[str, np.ndarray] = field(default_factory=dict)
    drives: dict[str, int] = field(default_factory=dict)
    spread: list[Any] = field(default_factory=list)

    # -- parts ------------------------------------------------------------------------------

    def elastic(self, a: int, start, end, axes, C, freedoms, beam, density_area: float) -> int:
        """An elastic part from body a: the body at its end."""
        if not np.any(C) and not np.any(freedoms):
            return a
        if beam is None or not self.beams:
            b = self.bodies.body(end)
            K, rigid = _stiffness(np.asarray(C, float), freedoms, self.bodies.length)
            self.bodies.elastic.append(ElasticPart(a, b, end, axes, K, rigid=rigid))
            if density_area:
                length = float(np.linalg.norm(end - start))
                self.spread.append((a, b, start, end, density_area * length))
            return b
        n, step = self.beams, (end - start) / self.beams
        L = float(np.linalg.norm(step))
        EA, G = beam[0], _shortening(L)
        for i in range(n):
            own = self.bodies.body(start + (i + 1) * step)
            K = np.linalg.inv(beam_compliance_of(L, *beam))
            point = start + (i + 1) * step
            self.bodies.elastic.append(ElasticPart(a, own, point, axes, K, EA / L, G))
            if density_area:
                self.spread.append((a, own, start + i * step, point, density_area * L))
            a = own
        return a

    def joint(self, a: int, axis, point, pitch, role, x: float, numbered: bool, sums: dict, name):
        """A joint behind body a, and the body that it moves: the same where it is held."""
        stiffness = None if isinstance(role, rs.Passive) else role.stiffness
        if not isinstance(role, rs.Passive) and stiffness is None:
            return a
        energy = (0.0,) if stiffness is None else (0.0, *_energy(stiffness, x))
        b = self.bodies.body(point)
        number = None
        if numbered:
            number = sums[name] = self.bodies.numbers
        own = SingleJoint(
            a, b, axis, point, None if pitch is None else float(pitch), energy, number
        )
        self.bodies.joints.append(own)
        return b

    # -- chains -----------------------------------------------------------------------------

    def along(self, chain: rs.Chain, q: np.ndarray, body: int, T: np.ndarray, prefix: str, place=0):
        """Elements of a chain at coordinates of its joints: the body at its end, and its frame."""
        sums: dict[str, int] = {}
        coupled = {name for own in chain.couplings for name, _ in own.terms}
        for e in chain.elements:
            name = f"{prefix}{getattr(e, 'name', '')}"
            before = T
            if isinstance(e, rs.Rigid):
                T = T @ frame_of(e.transform)
                self.weigh(e.masses, body, before, 0.5 * (before[:3, 3] + T[:3, 3]))
            elif isinstance(e, rs.Link):
                T = T @ _shift(np.asarray(e.to, float))
                own = e.elasticity
                start, end = before[:3, 3], T[:3, 3]
                spread = [m for m in e.masses if m.centre is None]
                if any(m.span is not None for m in spread) or len(spread) < len(e.masses):
                    raise NotAssembledError("masses along an elastic part")
                length = float(np.linalg.norm(end - start))
                area = sum(float(m.value) for m in spread) / length if length else 0.0
                if spread and not length:
                    raise NotAssembledError("a mass of no length")
                axes = before[:3, :3] @ e.axes
                if own.segments is None:  # a matrix
                    body = self.elastic(
                        body, start, end, axes, own.compliance, own.freedoms, None, area
                    )
                for C in () if own.segments is None else own.segments or (own.compliance,):
                    L = 2 * C[1, 5] / C[5, 5]
                    beam = *(L / C[k, k] for k in (0, 4, 5, 3)), *_shear(C, L)
                    end = start + axes[:, 0] * L
                    body = self.elastic(body, start, end, axes, C, own.freedoms, beam, area)
                    start = end
            elif isinstance(e, rs.Telescope):
                body, T = self._telescope(e, float(q[place]), body, T, name)
                place += 1
                if not e.beams:
                    self.behind[name] = body, before[:3, 3]
                continue
            elif isinstance(e, Joint):
                body, T = self._joint(e, q[place : place + e.size], body, T, coupled, sums, name)
                place += e.size
            elif isinstance(e, ParallelBlock):
                ends = []
                for branch in e.branches:
                    at = T @ frame_of(branch.start)
                    own = f"{name}/{branch.name}/"
                    end, frame, place = self.along(branch.chain, q, body, at, own, place)
                    ends.append((end, frame @ np.linalg.inv(frame_of(branch.end))))
                T = ends[0][1]
                for other in ends[1:]:
                    _check_closed(other[1], T)
                body = self._merged([end for end, _ in ends])
            if isinstance(e, rs.Link | Joint):
                self.behind[name] = body, T[:3, 3] if isinstance(e, rs.Link) else before[:3, 3]
                self.frames[name] = before if isinstance(e, rs.Link) else T
        for own in chain.couplings:
            factors = tuple((sums[j], float(f)) for j, f in own.terms if j in sums)
            self.bodies.sums.append(Sum(factors, own.role.stiffness))
        return body, T, place

    def _telescope(self, e: rs.Telescope, x: float, body: int, T: np.ndarray, name: str):
        direction = T[:3, :3] @ e.direction
        body = self.joint(body, direction, T[:3, 3].copy(), None, e.role, x, False, {}, e.name)
        self.behind[name] = body, T[:3, 3]
        if not e.beams:
            return body, T @ _shift(e.direction * x)
        for i, beam in enumerate(e.beams):
            length = float(beam.fixed + beam.share * x)
            start = T[:3, 3]
            T = T @ _shift(e.direction * length)
            own = rigidities(beam.material, beam.section, beam.theory)
            mass = beam.mass_at(np.array(length))
            C = beam_compliance_of(length, *own)
            axes = T[:3, :3] @ e.axes
            spread = 0.0 if mass is None else float(mass) / length
            body = self.elastic(body, start, T[:3, 3], axes, C, np.zeros((6, 0)), own, spread)
            ending = f".beam{i + 1}" if len(e.beams) > 1 else ".beam"
            self.behind[name + ending] = body, T[:3, 3]
        return body, T

    def _joint(self, e: Joint, q, body, T, coupled, sums, name):
        is_ball = e.kind is JointKind.SPHERICAL
        for screw, x in zip(e.freedoms, q, strict=True):
            axis, point = T[:3, :3] @ screw.axis, T[:3, 3].copy()
            numbered, count = e.name in coupled, len(self.bodies.joints)
            body = self.joint(
                body, axis, point, screw.pitch, e.role, float(x), numbered, sums, e.name
            )
            if e.size == 1 and len(self.bodies.joints) > count:
                self.drives[name] = count
            if not is_ball:
                along = np.asarray(screw.axis, float) * float(x)
                if screw.pitch is None:
                    T = T @ _shift(along)
                else:
                    T = T @ _rotation(along) @ _shift(float(screw.pitch) * along)
        return body, T @ _rotation(np.asarray(q, float)) if is_ball else T

    def node(self, platform: Any, leg: rs.Leg, pose: np.ndarray) -> int:
        """The body of the node of a flexible platform that holds a leg; all nodes at first."""
        for own in platform.nodes:
            if (name := f"platform/{own.name}") not in self.behind:
                point = (pose @ np.append(own.at, 1.0))[:3]
                body = 1 if own.name == platform.tool else self.bodies.body(point)
                self.behind[name] = body, point
        return self.behind[f"platform/{platform.node_of(leg.node, leg.attachment.p)}"][0]

    def bend(self, platform: Any, pose: np.ndarray) -> None:
        """Parts between the nodes of a flexible platform."""
        for part in platform.parts:
            body, start = self.behind[f"platform/{part.a}"]
            point, bar = (pose @ np.append(part.point, 1.0))[:3], part.elasticity.beam
            beam = None if bar is None else rigidities(bar, bar)
            axes, own = pose[:3, :3] @ part.axes, part.elasticity
            body = self.elastic(body, start, point, axes, own.compliance, own.freedoms, beam, 0.0)
            self._merged([self.behind[f"platform/{part.b}"][0], body])

    def _merged(self, ends: Sequence[int]) -> int:
        ends = list(ends)
        while len(set(ends)) > 1:
            low, high = sorted(set(ends))[:2]
            if high <= 1:
                raise NotAssembledError("a rigid part from the base to the platform")
            self.bodies.merge(low, high)
            ends = [low if i == high else i - (i > high) for i in ends]
            moved = {
                k: (low if i == high else i - (i > high), p) for k, (i, p) in self.behind.items()
            }
            self.behind = moved
            self.spread = [
                (*(low if i == high else i - (i > high) for i in own[:2]), *own[2:])
                for own in self.spread
            ]
        return ends[0]

    # -- loads ------------------------------------------------------------------------------

    def weigh(self, masses: Sequence[Any], body: int, T: np.ndarray, middle: np.ndarray) -> None:
        """Masses that a body carries, in the frame in which their part begins."""
        for m in masses:
            at = middle if m.centre is None else T[:3, :3] @ np.asarray(m.centre, float) + T[:3, 3]
            inertia = np.zeros((3, 3)) if m.inertia is None else m.inertia
            self.bodies.masses.append((body, float(m.value), at, T[:3, :3] @ inertia @ T[:3, :3].T))

    def fall(self, gravity: np.ndarray) -> None:
        """Weights of all masses; those along parts a sixth of the length before both ends."""
        for body, value, at, _ in self.bodies.masses:
            self.bodies.pulls.append(DeadPull(body, at, value * gravity))
        for a, b, start, end, value in self.spread:
            for body, share in ((a, 1 / 6), (b, 5 / 6)):
                point = start + share * (end - start)
                self.bodies.pulls.append(DeadPull(body, point, 0.5 * value * gravity))

    def lump(self) -> None:
        """Half of the mass of what is spread on the body at either end."""
        for a, b, start, end, value in self.spread:
            L = np.linalg.norm(end - start)
            for body, share in ((a, 0.25), (b, 0.75)):
                x = (end - start) / L
                rod = 0.5 * value * (0.5 * L) ** 2 / 12 * (np.eye(3) - np.outer(x, x))
                self.bodies.masses.append((body, 0.5 * value, start + share * (end - start), rod))


def frame_of(frame: rs.Frame) -> np.ndarray:
    """A frame as a 4 x 4 matrix."""
    return placed(np.asarray(frame.R, float), np.asarray(frame.p, float))


def _shear(C: np.ndarray, L: float) -> list[float]:
    """Shear compliances of a length of a uniform beam; what is rounding is none."""
    found = [C[k, k] / L - C[r, r] * L / 3 for k, r in ((1, 5), (2, 4))]
    return [x if x > 1e-12 * C[1, 1] / L else 0.0 for x in found]


def _shift(v: np.ndarray) -> np.ndarray:
    return placed(np.eye(3), v)


def _rotation(v: np.ndarray) -> np.ndarray:
    return placed(turned(v), np.zeros(3))


def _check_closed(T: np.ndarray, wanted: np.ndarray) -> None:
    if not np.max(np.abs(T - wanted)) <= _OPEN:
        raise NotAssembledError("open")


def _stiffness(C: np.ndarray, freedoms: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Energy by the deflection, and rows whose product with it is zero.

    Wrenches P do no work on the freedoms; ``P^T th = P^T C P w`` with w their components.
    """
    P = np.eye(6)
    if np.size(freedoms):
        P = np.linalg.svd(np.reshape(freedoms, (6, -1)))[0][:, np.shape(freedoms)[-1] :]
    own = P.T @ C @ P
    d = np.sqrt(np.abs(np.diag(own)))
    d[d <= 1e-12 * np.max(d)] = 1.0
    values, vectors = np.linalg.eigh(own / np.outer(d, d))
    elastic = values > _NOTHING
    if np.any(values[elastic] < _NEARLY):
        raise NotAssembledError("an elastic part that is nearly rigid")
    back = (P / d) @ vectors
    K = back[:, elastic] / values[elastic] @ back[:, elastic].T
    rigid = back[:, ~elastic].T
    size = np.linalg.norm(rigid * np.repeat([1.0, 1 / length], 3), axis=1, keepdims=True)
    return K, rigid / np.where(size > 0, size, 1.0) / length


def _energy(stiffness: Any, x: float) -> tuple[float, ...]:
    """Coefficients from q^2 on of ``k q^2 / 2``; of a stiffness by the coordinate its series."""
    if not isinstance(stiffness, StiffnessLaw):
        return (0.5 * float(stiffness),)
    at = Polynomial([x, 1.0])
    a, b = (
        sum((float(c) * at**i for i, c in enumerate(reversed(own))), Polynomial([0.0]))
        for own in (stiffness.numerator, stiffness.denominator)
    )
    top, below = (np.pad(own.coef, (0, 8))[:8] for own in (a, b))
    series: list[float] = []
    for i in range(7):
        series.append((top[i] - sum(series[j] * below[i - j] for j in range(i))) / below[0])
    return tuple(0.5 * c for c in series)


def _shortening(L: float) -> np.ndarray:
    """G of a clamped cubic: ``th^T G th / 2`` is the half of the integral of its slope squared."""
    G = np.zeros((6, 6))
    s = np.polynomial.legendre.leggauss(4)[0] / 2 + 0.5
    w = np.polynomial.legendre.leggauss(4)[1] / 2 * L
    for d, r, sign in ((1, 5, 1.0), (2, 4, -1.0)):
        # slope of the cubic of a unit deflection, and of a unit turn, of its end
        slopes = np.array([6 * s * (1 - s) / L, sign * (3 * s**2 - 2 * s)])
        G[np.ix_((d, r), (d, r))] = (slopes * w) @ slopes.T
    return G


def of_robot(
    robot: rs.Robot,
    coordinates: Sequence[np.ndarray],
    pose: np.ndarray,
    length: float,
    beams: int = 0,
) -> Assembly:
    """A robot at coordinates of its legs, its platform frame at a pose (4, 4).

    Raises
    ------
    NotAssembledError
        When it does not close there, or has parts that are not written here.
    """
    P = (pose @ np.append(robot.reference_point, 1.0))[:3]
    found = Assembly(Bodies([np.zeros(3), P], length, robot.space.rows), beams)
    for leg, q in zip(robot.legs, coordinates, strict=True):
        own = leg.chain.joint_coordinates(np.asarray(q, float))
        body, T, _ = found.along(leg.chain, own, 0, frame_of(leg.base), f"{leg.name}/")
        _check_closed(T, pose @ frame_of(leg.attachment))
        if body <= 1:
            raise NotAssembledError("a leg that does not move")
        end = 1 if robot.platform is None else found.node(robot.platform, leg, pose)
        found._merged([end, body])
    if robot.platform is not None:
        found.bend(robot.platform, pose)
    found.weigh(robot.platform_masses, 1, pose, pose[:3, 3])
    for own in robot.springs:
        ends, bodies = [], []
        for end in own.between:
            if end.body in ("base", "platform"):
                body, frame = (0, np.eye(4)) if end.body == "base" else (1, pose)
            elif end.body in found.frames:
                body, frame = found.behind[end.body][0], found.frames[end.body]
            else:
                raise NotAssembledError("a spring at a telescope")
            bodies.append(body)
            ends.append((frame @ np.append(end.at, 1.0))[:3])
        if own.free_length is None:
            raise NotAssembledError("a preload at home")
        k, (a, b) = float(own.stiffness), bodies
        spring = PointSpring(a, b, (ends[0], ends[1]), k, -k * float(own.free_length))
        found.bodies.springs.append(spring)
    return found


def of_network(network: rs.Network, sections: Mapping[str, Any] | None = None) -> Assembly:
    """A network: its nodes are the bodies; `sections` are rigidities of its beams by name."""
    point = np.asarray(network.reference_point, float)
    length = float(network.characteristic_length) or 1.0
    found = Assembly(Bodies([np.zeros(3), point], length, network.space.rows))
    place = dict.fromkeys(network.fixed, 0) | {network.platform: 1}
    for node in network.nodes:
        if node.name not in place:
            place[node.name] = found.bodies.body(node.point)
    found.behind = {node.name: (place[node.name], node.point) for node in network.nodes}
    merged: list[tuple[str, int]] = []
    for e in network.beams:
        own = (sections or {}).get(e.name)
        masses = sum(float(m.value) for m in e.masses) / e.length
        C = e.tip_compliance if own is None else beam_compliance_of(e.length, *own)
        none, axes = np.zeros((6, 0)), np.asarray(e.rotation)
        end = found.elastic(place[e.a], e.start, e.end, axes, C, none, None, masses)
        merged.append((e.b, end))
    for e in network.springs:
        own = e.elasticity
        none = np.zeros(3)
        end = found.elastic(
            place[e.a], e.point, e.point + none, e.rotation, own.compliance, own.freedoms, None, 0.0
        )
        merged.append((e.b, end))
    for e in network.joints:
        body = place[e.a]
        for own in e.freedoms:
            body = found.joint(
                body, own.axis, np.asarray(own.point), own.pitch, own.role, 0.0, False, {}, own.name
            )
        merged.append((e.b, body))
    if network.couplings:
        raise NotAssembledError("couplings of a network")
    while merged:
        name, end = merged.pop()
        here = found.behind[name][0]
        if {here, end} == {0, 1}:
            raise NotAssembledError("a platform that is fixed")
        low, high = sorted((here, end))
        if low != high:
            found._merged([here, end])
            merged = [(n, low if i == high else i - (i > high)) for n, i in merged]
    for node in network.nodes:
        for m in node.masses:
            at = np.asarray(m.centre, float)
            found.bodies.masses.append(
                (found.behind[node.name][0], float(m.value), at, np.zeros((3, 3)))
            )
    return found

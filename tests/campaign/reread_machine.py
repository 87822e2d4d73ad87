"""Postures and stiffness of model files that are read once more, see `reread.py`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.model import (
    FlexiblePlatform,
    JointKind,
    ParallelBlock,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedPlatform,
    PlacedSpring,
    PlatformNode,
    PlatformPart,
)
from robostiff.spatial import Space
from tests.campaign.reference import Reference, reference
from tests.campaign.reread import (
    Ball,
    Block,
    Branch,
    File,
    Motion,
    Soft,
    Stretching,
    beam_axes,
    cross,
    direction,
    frame,
    moved,
    number,
    placed,
    rotation_vector,
    turned,
    vector,
)
from tests.generators.chains import beam_compliance_of, rigidities

_PLACES = {name: i for i, name in enumerate(("x", "y", "z", "rx", "ry", "rz"))}
# Of a step in rad and m, of the way, and of the least singular value at home.
_LONGEST, _LEAST_STEP, _NEAR = 0.1, 1e-6, 0.02


class NotClosedError(Exception):
    """Newton's method does not arrive."""


class Machine:
    """A model file, or a robot, as one system of coordinates, loops and springs."""

    def __init__(
        self,
        path: Path | str,
        given: dict[str, Any] | None = None,
        *,
        text: str | None = None,
        shipped: Path | None = None,
        robot: rs.Robot | None = None,
    ) -> None:
        self.file = File(Path(path), given or {}, text=text)
        self.shipped = shipped
        data, scope = self.file.data, self.file.scope
        self.rows = [0, 1, 5] if data.get("planar") else list(range(6))
        self.reference = vector(data.get("reference_point", (0, 0, 0)), scope)
        self.home = frame(data.get("home"), scope)
        if robot is not None:
            self.rows, self.reference = list(robot.space.rows), np.asarray(robot.reference_point)
            self.home = np.eye(4) if robot.home is None else _matrix(robot.home)
            self.legs = [_branch(leg.base, leg.chain, leg.attachment) for leg in robot.legs]
        elif "modules" in data:
            self.legs = [Branch(np.eye(4), self._modules(self.file), np.eye(4), [])]
        else:
            self.legs = self.file.legs(data, scope)
        self.motions: list[Motion | Ball] = []
        self.places: dict[int, int] = {}
        self.held: list[tuple[dict[int, float], float | None, Any, str | None]] = []
        self.size = 0
        for leg in self.legs:
            self._count(leg)

    def _modules(self, file: File) -> list[Any]:
        parts: list[Any] = []
        self.home = np.eye(4)
        for own in file.data["modules"]:
            mount = frame(own.get("mount"), file.scope)
            parts.append(mount)
            self.home = self.home @ mount
            if "chain" in own:
                parts += file.chain(own["chain"], file.scope)
                continue
            inner = file
            data = own
            if "robot" in own:
                path = file.path.parent / own["robot"]
                if not path.is_file() and self.shipped is not None:
                    path = self.shipped / f"{own['robot']}.yaml"
                given = {
                    name: number(value, file.scope)
                    for name, value in own.get("parameters", {}).items()
                }
                inner = File(path, given)
                data = inner.data
            if "modules" in data:
                parts += self._modules(inner)
                continue
            legs = inner.legs(data, inner.scope)
            parts.append(Block(legs))
            if "home" in data:
                self.home = self.home @ frame(data["home"], inner.scope)
            self.reference = vector(data.get("reference_point", (0, 0, 0)), inner.scope)
        if "reference_point" in file.data or "chain" in file.data["modules"][-1]:
            self.reference = vector(file.data.get("reference_point", (0, 0, 0)), file.scope)
        return parts

    def _count(self, branch: Branch) -> None:
        """Numbers of coordinates, one branch after the other."""
        copies = []
        names = {}
        for shared in branch.parts:
            part = shared
            if isinstance(part, Block):
                fresh = Block(
                    [Branch(b.start, list(b.parts), b.end, b.couplings) for b in part.branches]
                )
                for own in fresh.branches:
                    self._count(own)
                part = fresh
            elif isinstance(part, Motion | Ball):
                part = type(part)(**vars(part))
                self.places[id(part)] = self.size
                self.motions.append(part)
                names[part.name] = self.size
                self.size += 1 if isinstance(part, Motion) else 3
            copies.append(part)
        branch.parts = copies
        for terms, equals, k, role in branch.couplings:
            self.held.append(({names[name]: f for name, f in terms.items()}, equals, k, role))

    @property
    def homes(self) -> np.ndarray:
        return np.concatenate([np.zeros(0), *(np.atleast_1d(m.home) for m in self.motions)])

    # -- where everything is

    def _walk(
        self, branch: Branch, T: np.ndarray, q: np.ndarray, gaps: list[Any]
    ) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """End of a branch, its motions about the world's origin, and gaps of loops inside."""
        T = T @ branch.start
        columns: dict[int, np.ndarray] = {}
        for part in branch.parts:
            if isinstance(part, np.ndarray):
                T = T @ part
            elif isinstance(part, Stretching):
                T = T @ placed(np.eye(3), sum(rod[0] for rod in part.beams) * part.along)
            elif isinstance(part, Motion | Ball):
                T = self._moved(part, T, q, columns)
            elif isinstance(part, Block):
                ends = [self._walk(own, T, q, gaps) for own in part.branches]
                T = ends[0][0]
                columns |= ends[0][1]
                gaps += [(end, columns_of, *ends[0]) for end, columns_of in ends[1:]]
        return T @ np.linalg.inv(branch.end), columns

    def _moved(
        self, part: Motion | Ball, T: np.ndarray, q: np.ndarray, columns: dict[int, np.ndarray]
    ) -> np.ndarray:
        i = self.places[id(part)]
        R, p = T[:3, :3], T[:3, 3]
        if isinstance(part, Ball):
            own = q[i : i + 3]
            left = _left_jacobian(own)
            for j in range(3):
                w = R @ left[:, j]
                columns[i + j] = np.r_[np.cross(p, w), w]
            return T @ placed(turned(own), np.zeros(3))
        e = R @ part.axis
        if part.advance is None:
            columns[i] = np.r_[e, 0, 0, 0]
            return T @ placed(np.eye(3), q[i] * part.axis)
        columns[i] = np.r_[np.cross(p, e) + part.advance * e, e]
        return T @ placed(turned(q[i] * part.axis), part.advance * q[i] * part.axis)

    def close(
        self, q: np.ndarray, P: np.ndarray, wanted: dict[str, float], most: int = 60
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Coordinates and platform pose near given ones that close all loops.

        And their least singular value beside the largest: what is small is near a singularity.
        """
        fixed = {
            self.places[id(m)] + j
            for m in self.motions
            for j in range(1 if isinstance(m, Motion) else 3)
            if m.role == "locked"
        }
        free = [i for i in range(self.size) if i not in fixed]
        homes = self.homes
        r = np.zeros(0)
        for _ in range(most):
            gaps: list[Any] = []
            rows, residual = [], []
            ends = [(self._walk(leg, np.eye(4), q, gaps)) for leg in self.legs]
            gaps += [(T, columns, P, None) for T, columns in ends]
            for T, columns, other, more in gaps:
                row = np.zeros((6, self.size + 6))
                for i, column in columns.items():
                    row[:, i] += column
                if more is None:
                    row[:, self.size :] -= np.eye(6)
                else:
                    for i, column in more.items():
                        row[:, i] -= column
                D = rotation_vector(T[:3, :3] @ other[:3, :3].T)
                at = T[:3, 3]
                rows.append(moved(at) @ row)
                residual.append(np.r_[at - other[:3, 3], D])
            for terms, equals, _, role in self.held:
                if role == "locked":
                    row = np.zeros((1, self.size + 6))
                    target = (
                        sum(f * homes[i] for i, f in terms.items()) if equals is None else equals
                    )
                    for i, f in terms.items():
                        row[0, i] = f
                    rows.append(row)
                    residual.append(np.array([sum(f * q[i] for i, f in terms.items()) - target]))
            now = np.r_[P[:3, 3], rotation_vector(P[:3, :3])]
            slopes = _pose_slopes(P)
            for name, value in wanted.items():
                row = np.zeros((1, self.size + 6))
                row[0, self.size :] = slopes[_PLACES[name]]
                rows.append(row)
                residual.append(np.array([now[_PLACES[name]] - value]))
            A, r = np.vstack(rows), np.concatenate(residual)
            use = [*free, *range(self.size, self.size + 6)]
            step, _, _, sizes = np.linalg.lstsq(A[:, use], -r, rcond=1e-11)
            q = q.copy()
            q[free] += step[: len(free)]
            t = step[len(free) :]
            P = placed(turned(t[3:]) @ P[:3, :3], turned(t[3:]) @ P[:3, 3] + t[:3])
            if np.abs(r).max() < 1e-11:
                return q, P, float(sizes[sizes > 1e-5 * sizes[0]][-1] / sizes[0])
        raise NotClosedError(np.abs(r).max())

    def posture(
        self,
        seed: np.ndarray,
        wanted: dict[str, float],
        steps: int = 12,
        start: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and platform at a pose, in small steps from home, or from a start.

        Raises NotClosedError where a step is no short one, or leads near a singularity.
        """
        P = self.home if start is None else start
        home = dict(zip(_PLACES, np.r_[P[:3, 3], rotation_vector(P[:3, :3])], strict=True))
        q, P, regular = self.close(seed, P, home)
        s, h = 0.0, 1 / steps
        while s < 1 - 1e-12:
            h = min(h, 1 - s)
            part = {
                name: home[name] + (s + h) * (value - home[name]) for name, value in wanted.items()
            }
            try:
                after, pose, now = self.close(q, P, part, most=9)
            except NotClosedError:
                after, pose, now = np.full(self.size, np.inf), P, 0.0
            if np.abs(after - q).max(initial=0.0) > _LONGEST:
                h /= 2
                if h < _LEAST_STEP:
                    raise NotClosedError(f"at {s:.3f} of the way")
                continue
            if now <= _NEAR * regular:
                raise NotClosedError(f"a singularity at {s:.3f} of the way")
            q, P, s, h = after, pose, s + h, min(2 * h, 1 / steps)
        return q, P

    def at_joints(self, q: np.ndarray) -> np.ndarray:
        """The platform of a serial arm."""
        return self._walk(self.legs[0], np.eye(4), q, [])[0]

    # -- how stiff it is

    def stiffness(self, q: np.ndarray, P: np.ndarray) -> Reference | None:
        """What is true of it about the reference point, all its parts in the world."""
        R, sums = P[:3, :3], []
        for terms, _, k, _ in self.held:
            sums.append(({str(i): float(f) for i, f in terms.items()}, k))
        legs = [
            PlacedLeg(f"leg {i}", tuple(self._placed(leg, np.eye(4), q)), P[:3, 3])
            for i, leg in enumerate(self.legs)
        ]
        origin, space = R @ self.reference + P[:3, 3], Space.of_size(len(self.rows))
        platform = self._platform(R, P[:3, 3])
        return reference(rs.Snapshot("own", tuple(legs), origin, space, platform=platform), sums)

    def _placed(self, branch: Branch, T: np.ndarray, q: np.ndarray) -> Iterator[Any]:
        """Joints, springs and blocks of a branch in the world."""
        T = T @ branch.start
        last = 0.0
        for part in branch.parts:
            if isinstance(part, np.ndarray):
                T = T @ part
            elif isinstance(part, Motion | Ball):
                i, columns = self.places[id(part)], {}
                last = float(q[i])
                point, k = T[:3, 3], part.stiffness
                if k is not None:
                    k = number(k, {**part.scope, "q": last})
                role = {"passive": rs.Passive(), "locked": rs.Locked(k)}.get(str(part.role))
                pitch = part.advance if isinstance(part, Motion) else 0.0
                T = self._moved(part, T, q, columns)
                for j, column in columns.items():
                    axis = column[:3] if pitch is None else column[3:]
                    yield PlacedFreedom(axis, point, pitch, str(j), role or rs.Actuated(k))
            elif isinstance(part, Block):
                inside = [
                    PlacedLeg(str(i), tuple(self._placed(own, T, q)), T[:3, 3])
                    for i, own in enumerate(part.branches)
                ]
                yield PlacedBlock("block", tuple(inside))
                T = self._walk(part.branches[0], T, q, [])[0]
            elif isinstance(part, Stretching):
                reached = -last
                for fixed, share, compliance in part.beams:
                    L = fixed + share * last
                    reached += L
                    none = np.zeros((6, 0))
                    yield _soft(Soft(compliance(L), none, part.axes, reached * part.along), T)
                T = T @ placed(np.eye(3), sum(rod[0] for rod in part.beams) * part.along)
            else:
                yield _soft(part, T)

    def _platform(self, R: np.ndarray, p: np.ndarray) -> PlacedPlatform | None:
        data, scope = self.file.data, self.file.scope
        own = data.get("platform")
        if own is None:
            return None
        at = {name: vector(point, scope) for name, point in own["nodes"].items()}
        nodes = tuple(PlatformNode(name, point) for name, point in at.items())
        holds, parts = [], []
        legs = self.file.copies(data["legs"], scope)
        for leg, (written, _) in zip(self.legs, legs, strict=True):
            end = written.get("platform") or {}
            name = own.get("legs", {}).get(written["name"]) or end.get("node")
            if name is None:
                name = min(at, key=lambda n: float(np.linalg.norm(at[n] - leg.end[:3, 3])))
            holds.append(name)
        for kind in ("beams", "springs", "rigid"):
            for part in own.get(kind, ()):
                a, b = part["between"]
                C, free = np.zeros((6, 6)), np.zeros((6, 0))
                axes, point = np.eye(3), at[b]
                if kind == "beams":
                    y = direction(part["y_axis"], scope) if "y_axis" in part else None
                    C = self.file.beam(float(np.linalg.norm(at[b] - at[a])), part, scope)
                    axes = beam_axes(at[b] - at[a], y)
                elif kind == "springs":
                    C, free = self.file.soft(part, scope)
                    local = frame(part, scope)
                    axes, point = local[:3, :3], local[:3, 3] if "at" in part else at[b]
                name, k = f"part {len(parts)}", rs.Elasticity(C, free)
                parts.append(PlatformPart(name, a, b, point, axes, k))
        platform = FlexiblePlatform(nodes, tuple(parts), own["tool"])
        return PlacedPlatform(platform, tuple(holds), R, p)


def _soft(part: Soft, T: np.ndarray) -> PlacedSpring:
    R = T[:3, :3]
    at, own = R @ part.at + T[:3, 3], rs.Elasticity(part.C, part.free)
    return PlacedSpring("spring", at, R @ part.axes, own)


def _of_length(rigidities: tuple[float, ...]) -> Any:
    return lambda L: beam_compliance_of(L, *rigidities)


def _matrix(frame: rs.Frame) -> np.ndarray:
    return placed(np.asarray(frame.R, dtype=float), np.asarray(frame.p, dtype=float))


def _branch(start: rs.Frame, chain: rs.Chain, end: rs.Frame) -> Branch:
    """A chain of the library in parts of ours."""
    parts: list[Any] = []
    for e in chain.elements:
        own_role = getattr(e, "role", None)
        role, k = type(own_role).__name__.lower(), getattr(own_role, "stiffness", None)
        if isinstance(e, rs.Rigid):
            parts.append(_matrix(e.transform))
        elif isinstance(e, rs.Link):
            own = e.elasticity
            parts += [Soft(own.compliance, own.freedoms, e.axes, e.to), placed(np.eye(3), e.to)]
        elif isinstance(e, rs.Telescope):
            beams = [
                (b.fixed, b.share, _of_length(rigidities(b.material, b.section, b.theory)))
                for b in e.beams
            ]
            parts.append(Motion(e.direction, None, role, k, e.name, float(e.home), {}))
            parts.append(Stretching(e.direction, e.axes, beams))
        elif isinstance(e, ParallelBlock):
            parts.append(Block([_branch(b.start, b.chain, b.end) for b in e.branches]))
        elif e.kind is JointKind.SPHERICAL:
            parts.append(Ball(role, k, e.name, np.array(e.home, dtype=float), {}))
        else:
            for own, home in zip(e.freedoms, e.home, strict=True):
                parts.append(Motion(own.axis, own.pitch, role, k, e.name, float(home), {}))
    return Branch(_matrix(start), parts, _matrix(end), [])


def _left_jacobian(v: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(v)
    K = cross(v)
    if angle < 1e-6:
        return np.eye(3) + K / 2 + K @ K / 6
    return (
        np.eye(3) + (1 - np.cos(angle)) / angle**2 * K + (angle - np.sin(angle)) / angle**3 * K @ K
    )


def _pose_slopes(P: np.ndarray) -> np.ndarray:
    """Rates of the six coordinates of a pose for a twist about the world's origin."""
    S = np.zeros((6, 6))
    S[:3, :3] = np.eye(3)
    S[:3, 3:] = -cross(P[:3, 3])
    S[3:, 3:] = np.linalg.inv(_left_jacobian(rotation_vector(P[:3, :3])))
    return S

"""Postures and stiffness of model files that are read once more, see `reread.py`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.model import JointKind, ParallelBlock
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
_LONGEST, _LEAST_STEP, _NEAR = 0.35, 2e-4, 0.02


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

    def stiffness(self, q: np.ndarray, P: np.ndarray) -> np.ndarray:
        """K about the reference point, by one system of strains, motions and twists of bodies."""
        system = _System(self.rows)
        origin = P[:3, :3] @ self.reference + P[:3, 3]
        ends = [self._equations(leg, np.eye(4), q, system, origin) for leg in self.legs]
        motions = {i: system.free(1) for i in range(self.size)}
        for i, columns in system.columns_of_motions:
            system.add(columns[0], motions[i], columns[1])
        for motion in self.motions:
            i = self.places[id(motion)]
            for j in range(1 if isinstance(motion, Motion) else 3):
                if motion.role == "passive":
                    continue
                row = system.row(1)
                system.add(row, motions[i + j], np.ones((1, 1)))
                if motion.stiffness is not None:
                    k = number(motion.stiffness, {**motion.scope, "q": float(q[i + j])})
                    system.add(row, system.strain(1), np.array([[-1 / np.sqrt(k)]]))
        for terms, _, k, _ in self.held:
            row = system.row(1)
            for i, f in terms.items():
                system.add(row, motions[i], np.array([[f]]))
            if k is not None:
                system.add(row, system.strain(1), np.array([[-1 / np.sqrt(k)]]))
        self._platform(system, ends, P, origin)
        return system.stiffness()

    def _platform(
        self, system: _System, ends: list[int], P: np.ndarray, origin: np.ndarray
    ) -> None:
        data, scope = self.file.data, self.file.scope
        own = data.get("platform")
        if own is None:
            for end in ends:
                system.add_twist(end)
            return
        R = P[:3, :3]
        nodes = {name: vector(at, scope) for name, at in own["nodes"].items()}
        twists = {name: system.free(len(self.rows)) for name in nodes}
        held = own.get("legs", {})
        legs = self.file.copies(data["legs"], scope)
        for end, leg, (written, _) in zip(ends, self.legs, legs, strict=True):
            at = written.get("platform") or {}
            name = held.get(written["name"]) or at.get("node")
            if name is None:
                name = min(nodes, key=lambda n: float(np.linalg.norm(nodes[n] - leg.end[:3, 3])))
            system.add(end, twists[name], -np.eye(len(self.rows)))
        row = system.row(len(self.rows))
        system.add(row, twists[own["tool"]], np.eye(len(self.rows)))
        system.add_twist(row)
        for kind in ("beams", "springs", "rigid"):
            for part in own.get(kind, ()):
                a, b = part["between"]
                row = system.row(len(self.rows))
                system.add(row, twists[a], np.eye(len(self.rows)))
                system.add(row, twists[b], -np.eye(len(self.rows)))
                if kind == "rigid":
                    continue
                if kind == "beams":
                    along = nodes[b] - nodes[a]
                    y = direction(part["y_axis"], scope) if "y_axis" in part else None
                    C, free = (
                        self.file.beam(float(np.linalg.norm(along)), part, scope),
                        np.zeros((6, 0)),
                    )
                    axes, at = beam_axes(along, y), nodes[b]
                else:
                    C, free = self.file.soft(part, scope)
                    local = frame(part, scope)
                    axes, at = local[:3, :3], local[:3, 3] if "at" in part else nodes[b]
                J = moved(origin - (R @ at + P[:3, 3]))
                system.add_soft(row, J @ _both(R @ axes), C, free)

    def _equations(
        self, branch: Branch, T: np.ndarray, q: np.ndarray, system: _System, origin: np.ndarray
    ) -> int:
        row = system.row(len(self.rows))
        T = T @ branch.start
        last = 0.0
        about = moved(origin)
        for part in branch.parts:
            if isinstance(part, np.ndarray):
                T = T @ part
            elif isinstance(part, Motion | Ball):
                columns: dict[int, np.ndarray] = {}
                last = q[self.places[id(part)]]
                T = self._moved(part, T, q, columns)
                for i, column in columns.items():
                    system.columns_of_motions.append((i, (row, (about @ column)[self.rows, None])))
            elif isinstance(part, Block):
                twist = system.free(len(self.rows))
                system.add(row, twist, np.eye(len(self.rows)))
                for own in part.branches:
                    end = self._equations(own, T, q, system, origin)
                    system.add(end, twist, -np.eye(len(self.rows)))
                T = self._walk(part.branches[0], T, q, [])[0]
            elif isinstance(part, Stretching):
                reached = -last
                for fixed, share, compliance in part.beams:
                    L = fixed + share * last
                    reached += L
                    own = Soft(compliance(L), np.zeros((6, 0)), part.axes, reached * part.along)
                    self._add_soft(system, row, T, own, origin)
                T = T @ placed(np.eye(3), sum(rod[0] for rod in part.beams) * part.along)
            else:
                self._add_soft(system, row, T, part, origin)
        return row

    @staticmethod
    def _add_soft(system: _System, row: int, T: np.ndarray, part: Soft, origin: np.ndarray) -> None:
        at = T[:3, :3] @ part.at + T[:3, 3]
        J = moved(origin - at)
        system.add_soft(row, J @ _both(T[:3, :3] @ part.axes), part.C, part.free)


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


class _System:
    """Rows: twists that add up. Columns: strains of unit energy, motions, and the platform."""

    def __init__(self, rows: list[int]) -> None:
        self.rows = rows
        self.counts = [0, 0, 0]  # rows, strains, free
        self.entries: list[tuple[int, tuple[str, int], np.ndarray]] = []
        self.columns_of_motions: list[tuple[int, tuple[int, np.ndarray]]] = []

    def _next(self, i: int, size: int) -> int:
        self.counts[i] += size
        return self.counts[i] - size

    def row(self, size: int) -> int:
        return self._next(0, size)

    def strain(self, size: int) -> tuple[str, int]:
        return "strain", self._next(1, size)

    def free(self, size: int) -> tuple[str, int]:
        return "free", self._next(2, size)

    def add(self, row: int, column: tuple[str, int], block: np.ndarray) -> None:
        self.entries.append((row, column, block))

    def add_twist(self, row: int) -> None:
        self.add(row, ("platform", 0), -np.eye(len(self.rows)))

    def add_soft(self, row: int, J: np.ndarray, C: np.ndarray, free: np.ndarray) -> None:
        d = np.sqrt(np.where(np.diag(C) > 0, np.diag(C), 1))
        w, V = np.linalg.eigh(C / d[:, None] / d)
        keep = w > 1e-14
        root = d[:, None] * V[:, keep] * np.sqrt(w[keep])
        self.add(row, self.strain(root.shape[1]), (J @ root)[self.rows])
        if free.shape[1]:
            self.add(row, self.free(free.shape[1]), (J @ free)[self.rows])

    def stiffness(self) -> np.ndarray:
        m, s, f = self.counts
        A = {
            "strain": np.zeros((m, s)),
            "free": np.zeros((m, f)),
            "platform": np.zeros((m, len(self.rows))),
        }
        for row, (kind, column), block in self.entries:
            A[kind][row : row + block.shape[0], column : column + block.shape[1]] += block
        N = _left_null(A["free"])
        B, D = N.T @ A["strain"], N.T @ A["platform"]
        U, w, _ = np.linalg.svd(B, full_matrices=False)
        keep = w > 1e-11 * w.max(initial=0.0)
        E = U[:, keep].T @ D / w[keep, None]
        return E.T @ E


def _left_null(A: np.ndarray) -> np.ndarray:
    if not A.shape[1]:
        return np.eye(A.shape[0])
    A = A / np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    U, w, _ = np.linalg.svd(A)
    return U[:, int(np.sum(w > 1e-9 * w[0])) :]


def _both(R: np.ndarray) -> np.ndarray:
    D = np.zeros((6, 6))
    D[:3, :3] = D[3:, 3:] = R
    return D


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

"""Where a robot stands, found by walking from home in small steps; apart from the package.

Frames are multiplied element by element, gaps are differentiated numerically, and every loop, of a
leg with the platform and of the branches of a block, is closed by Newton's method at every step.
Where the way is smooth and keeps away from singularities, its end is the posture of home's
assembly mode.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.model import ALL_COORDINATES, Joint, JointKind, ParallelBlock
from robostiff.spatial import Frame

_STEP = 1e-6
_NEARLY_HALF_A_TURN = -0.9  # cosine of an angle of which the sine has few digits


def frame_of(frame: Frame) -> np.ndarray:
    """A frame as a 4 x 4 matrix."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = frame.R, frame.p
    return T


def pose_matrix(six: np.ndarray) -> np.ndarray:
    """A pose (x, y, z, rotation vector) as a 4 x 4 matrix."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = _turn(six[3:]), six[:3]
    return T


def end_of(chain: rs.Chain, q: np.ndarray, base: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """End frames of a chain at rows q (m, size), and gaps of the loops in it (each m x 6)."""
    gaps: list[np.ndarray] = []
    T, used = _along(chain, q, 0, np.broadcast_to(base, (len(q), 4, 4)), gaps)
    if used != q.shape[1]:
        raise ValueError("coordinates do not fit the chain")
    return T, gaps


def _along(
    chain: rs.Chain, q: np.ndarray, place: int, T: np.ndarray, gaps: list[np.ndarray]
) -> tuple[np.ndarray, int]:
    for element in chain.elements:
        match element:
            case rs.Rigid():
                T = T @ frame_of(element.transform)
            case rs.Link():
                T = T @ _shift(element.to[None])
            case rs.Telescope():
                length = q[:, place] + sum(beam.fixed for beam in element.beams)
                T, place = T @ _shift(element.direction * length[:, None]), place + 1
            case Joint(kind=JointKind.SPHERICAL):
                T, place = T @ _rotation(q[:, place : place + 3]), place + 3
            case Joint():
                for freedom in element.freedoms:
                    along = freedom.axis * q[:, place, None]
                    if freedom.pitch is None:
                        T = T @ _shift(along)
                    else:
                        T = T @ _rotation(along) @ _shift(freedom.pitch * along)
                    place += 1
            case ParallelBlock():
                ends = []
                for branch in element.branches:
                    start = T @ frame_of(branch.start)
                    end, place = _along(branch.chain, q, place, start, gaps)
                    ends.append(end @ np.linalg.inv(frame_of(branch.end)))
                gaps += [gap(end, ends[0]) for end in ends[1:]]
                T = ends[0]
    return T, place


def gap(T: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """What frames miss others by, shift and turn in the latter (m, 6)."""
    back = np.swapaxes(wanted[..., :3, :3], -1, -2)
    D = back @ T[..., :3, :3]
    turn = _turn_of(D)
    shift = np.einsum("...ij,...j->...i", back, T[..., :3, 3] - wanted[..., :3, 3])
    return np.concatenate([shift, np.broadcast_to(turn, shift.shape)], axis=-1)


@dataclass(frozen=True)
class Walked:
    """The end of a walk.

    Attributes
    ----------
    q : list of arrays
        Coordinates of every leg [m, rad].
    pose : (6,) array
        With the coordinates that follow.
    is_smooth : bool
        Whether every step was short and away from singularities; otherwise nothing follows.
    """

    q: list[np.ndarray]
    pose: np.ndarray
    is_smooth: bool


class Walker:
    """Walks one robot from coordinates that close at home."""

    def __init__(self, robot: rs.Robot, home_q: list[np.ndarray]) -> None:
        self.robot = robot
        self.bases = [frame_of(leg.base) for leg in robot.legs]
        self.ends = [frame_of(leg.attachment) for leg in robot.legs]
        self.free = [leg.chain.free for leg in robot.legs]
        given = set(robot.coordinate_places)
        rows = robot.space.rows
        self.open = [k for k in rows if k not in given]
        self.rows = list(rows)
        self.home_q = home_q
        self.size = max(
            [float(np.linalg.norm(T[:3, 3])) for T in (*self.bases, *self.ends)] + [0.1]
        )

    def walk(self, home_pose: np.ndarray, pose: np.ndarray, steps: int = 10) -> Walked:
        """From home to a pose whose free coordinates are given; the others start at home's."""
        pose = pose.copy()
        pose[self.open] = home_pose[self.open]
        x, strength, _ = self._close(self._packed(self.home_q, home_pose), home_pose)
        if x is None:
            return Walked(self.home_q, pose, False)
        at, h, last = 0.0, 1.0 / steps, None
        while at < 1 - 1e-12:
            h = min(h, 1 - at)
            target = home_pose + (at + h) * (pose - home_pose)
            guess = x if last is None else x + last * h
            new, now, iterations = self._close(guess, target)
            jump = np.inf if new is None else float(np.abs(new - x).max())
            if new is None or iterations > 6 or jump > 0.35:
                h /= 2
                if h < 2e-4:
                    return Walked(*self._unpacked(x, pose), False)
                continue
            if now <= 0.02 * strength:
                return Walked(*self._unpacked(new, pose), False)
            last, x, at = (new - x) / h, new, at + h
            h = min(2 * h, 1.0 / steps)
        return Walked(*self._unpacked(x, pose), True)

    def _packed(self, q: list[np.ndarray], pose: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [*(own[f] for own, f in zip(q, self.free, strict=True)), pose[self.open]]
        )

    def _unpacked(self, x: np.ndarray, pose: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        q, start = [], 0
        for home, free in zip(self.home_q, self.free, strict=True):
            own = home.copy()
            number = int(np.count_nonzero(free))
            own[free] = x[start : start + number]
            q.append(own)
            start += number
        pose = pose.copy()
        pose[self.open] = x[start:]
        return q, pose

    def _gaps_and_rates(
        self, x: np.ndarray, pose: np.ndarray, rates: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gaps of all loops, and their central differences."""
        q, six = self._unpacked(x, pose)
        platforms = [pose_matrix(six)]
        if rates:
            for k in self.open:
                d = np.eye(6)[k] * _STEP
                platforms += [pose_matrix(six + d), pose_matrix(six - d)]
        parts, blocks = [], []
        for i, (own, free) in enumerate(zip(q, self.free, strict=True)):
            places = np.flatnonzero(free) if rates else []
            shifts = np.zeros((1 + 2 * len(places), len(own)))
            for k, place in enumerate(places):
                shifts[1 + 2 * k, place], shifts[2 + 2 * k, place] = _STEP, -_STEP
            T, gaps = end_of(self.robot.legs[i].chain, own + shifts, self.bases[i])
            end = gap(T, (platforms[0] @ self.ends[i])[None])
            values = np.hstack([end, *gaps])
            parts.append(values[0])
            moved = [gap(T[:1], (P @ self.ends[i])[None])[0] for P in platforms[1:]]
            following = np.zeros((values.shape[1], len(self.open)))
            for k in range(len(moved) // 2):
                following[:6, k] = (moved[2 * k] - moved[2 * k + 1]) / (2 * _STEP)
            blocks.append(((values[1::2] - values[2::2]).T / (2 * _STEP), following))
        if not rates:
            return np.concatenate(parts), np.zeros((0, 0))
        J = np.zeros((sum(map(len, parts)), len(x)))
        row = column = 0
        for own, following in blocks:
            J[row : row + len(own), column : column + own.shape[1]] = own
            if self.open:
                J[row : row + len(own), -len(self.open) :] = following
            row, column = row + len(own), column + own.shape[1]
        return np.concatenate(parts), J

    def _close(self, x: np.ndarray, pose: np.ndarray) -> tuple[np.ndarray | None, float, int]:
        """Closed coordinates near x, how far from singular, and the number of steps."""
        U = V = values = np.zeros(0)
        for iteration in range(9):
            r, J = self._gaps_and_rates(x, pose, iteration in (0, 3))
            if J.size:
                U, values, V = np.linalg.svd(J, full_matrices=False)
                kept = values > 1e-5 * values[0]
                U, V, values = U[:, kept], V[kept].T, values[kept]
            if np.abs(r).max() < 1e-12 * max(self.size, 1.0):
                return x, float(values[-1] / values[0]), iteration
            step = V @ ((U.T @ r) / values)
            if np.abs(step).max() > 1.0:
                break
            x = x - step
        return None, 0.0, 9


def wanted_pose(robot: rs.Robot, home_pose: np.ndarray, free: np.ndarray) -> np.ndarray:
    """All six coordinates, those that are not given as at home."""
    pose = home_pose.copy()
    pose[[ALL_COORDINATES.index(c) for c in robot.coordinates]] = free
    return pose


def _rotation(v: np.ndarray) -> np.ndarray:
    T = np.zeros((len(v), 4, 4))
    T[:, :3, :3], T[:, 3, 3] = _turn(v), 1.0
    return T


def _shift(p: np.ndarray) -> np.ndarray:
    T = np.zeros((len(p), 4, 4))
    T[:, range(4), range(4)] = 1.0
    T[:, :3, 3] = p
    return T


def _turn(v: np.ndarray) -> np.ndarray:
    """Matrices of rotation vectors (..., 3), after Rodrigues."""
    angle = np.sqrt(np.einsum("...i,...i->...", v, v))[..., None, None]
    S = np.zeros((*v.shape, 3))
    S[..., 2, 1], S[..., 0, 2], S[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    S = S - np.swapaxes(S, -1, -2)
    half = np.sinc(angle / (2 * np.pi))
    return np.eye(3) + np.sinc(angle / np.pi) * S + 0.5 * half * half * (S @ S)


def _turn_of(R: np.ndarray) -> np.ndarray:
    """Rotation vectors of matrices (m, 3, 3)."""
    sine = 0.5 * np.stack([R[:, 2, 1], R[:, 0, 2], R[:, 1, 0]], axis=-1)
    sine -= 0.5 * np.stack([R[:, 1, 2], R[:, 2, 0], R[:, 0, 1]], axis=-1)
    size = np.sqrt(np.einsum("...i,...i->...", sine, sine))
    cosine = 0.5 * (R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2] - 1.0)
    if np.any(cosine < _NEARLY_HALF_A_TURN):
        return Rotation.from_matrix(R).as_rotvec()
    angle = np.arctan2(size, cosine)
    return sine * np.where(size > 0, angle / np.where(size > 0, size, 1.0), 1.0)[:, None]

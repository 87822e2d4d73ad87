"""Time a pose takes: `rs.stiffness` over a batch, beside loops over poses of eq. (7) in NumPy.

`rs.stiffness` runs the robot's record, which the first run makes; the direct form, which chooses
pivots at each pose, computes what else a result holds, and the poses that a record leaves to it.

The robot is the Stewart-Gough platform of case B whose legs are flexible tubes with elastic
actuators. Every row begins with platform poses and ends with K_C, inverse kinematics included, in
one thread. The loops are what one would write for this robot alone; they must give the same K_C.

    python benchmarks/batched_stiffness.py [number of poses]
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.model import Actuated, Telescope

K_ACTUATOR = 1e8  # N/m
REPETITIONS = 3


@dataclass(frozen=True)
class Hexapod:
    """The numbers of the robot that the loops work with."""

    base: np.ndarray  # (6, 3) base joints
    first_axis: np.ndarray  # (6, 3) axes of the universal joints that are fixed to the base
    platform: np.ndarray  # (6, 3) platform joints in the platform frame
    E: float
    G: float
    A: float
    I: float
    J: float


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    robot = with_elastic_actuators(rs.load("gough-stewart-b-beams"), K_ACTUATOR)
    numbers = numbers_of(robot)
    poses = random_poses(count)

    rows: list[tuple[str, Callable[[], np.ndarray]]] = [
        ("rs.stiffness, all poses at once", lambda: rs.stiffness(robot, poses).K),
        ("the direct form, all poses at once", lambda: direct_stiffness(robot, poses).K),
        ("NumPy loop over poses, six legs stacked", lambda: loop(numbers, poses, legs_stacked)),
        ("NumPy loop over poses and legs", lambda: loop(numbers, poses, leg_by_leg)),
    ]
    timed = [(name, *best_time(work)) for name, work in rows]

    _, fastest, K = timed[0]
    size = np.sqrt(np.einsum("...ii->...i", K))
    scale = size[..., :, None] * size[..., None, :]
    print(f"Stewart-Gough B, flexible legs and elastic actuators, {count} random poses, 1 thread")
    print(f"{'':42s}{'us a pose':>10s}{'ratio':>8s}{'largest difference of K':>26s}")
    for name, seconds, K_here in timed:
        difference = np.max(np.abs(K_here - K) / scale)
        print(f"{name:42s}{1e6 * seconds / count:10.2f}{seconds / fastest:8.1f}{difference:26.1e}")
        if difference > 1e-9:
            raise SystemExit(f"{name}: K differs from the first row")


def with_elastic_actuators(robot: rs.Robot, stiffness: float) -> rs.Robot:
    """The robot with telescopes with elastic drives."""
    legs = []
    for leg in robot.legs:
        elements = tuple(
            replace(element, role=Actuated(stiffness=stiffness))
            if isinstance(element, Telescope)
            else element
            for element in leg.chain.elements
        )
        legs.append(replace(leg, chain=replace(leg.chain, elements=elements)))
    return replace(robot, legs=tuple(legs))


def numbers_of(robot: rs.Robot) -> Hexapod:
    """Read the model once, before any clock runs."""
    telescope = next(e for e in robot.legs[0].chain.elements if isinstance(e, Telescope))
    (tube,) = telescope.beams
    return Hexapod(
        base=np.array([leg.base.p for leg in robot.legs]),
        first_axis=np.array([leg.base.R[:, 1] for leg in robot.legs]),
        platform=np.array([leg.attachment.p for leg in robot.legs]),
        E=tube.material.E,
        G=tube.material.G,
        A=tube.section.A,
        I=tube.section.Iy,
        J=tube.section.J,
    )


def random_poses(count: int) -> np.ndarray:
    """Poses about home: 50 mm and 0.1 rad to each side."""
    random = np.random.default_rng(0)
    home = np.array([0, 0, 0.8, 0, 0, 0])
    return home + random.uniform(-1, 1, (count, 6)) * [0.05, 0.05, 0.05, 0.1, 0.1, 0.1]


def best_time(work: Callable[[], np.ndarray]) -> tuple[float, np.ndarray]:
    """Seconds of the fastest of a few runs, and the result."""
    best, result = np.inf, np.empty(0)
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - start)
    return best, result


def loop(
    robot: Hexapod, poses: np.ndarray, K_at: Callable[[Hexapod, np.ndarray], np.ndarray]
) -> np.ndarray:
    return np.array([K_at(robot, pose) for pose in poses])


def leg_by_leg(robot: Hexapod, pose: np.ndarray) -> np.ndarray:
    """K_C at one pose, each leg by eq. (7) about the reference point."""
    R, reference = rotation(pose[3:]), pose[:3]
    K = np.zeros((6, 6))
    saddle = np.zeros((11, 11))
    for A, first, b in zip(robot.base, robot.first_axis, robot.platform, strict=True):
        Rb = R @ b
        along = reference + Rb - A
        L = np.sqrt(along @ along)
        x = along / L
        z = cross(x, first)
        z /= np.sqrt(z @ z)
        y = cross(z, x)

        # the columns of J_theta are the axes of the tube, moved from its end to the reference
        J_theta = np.zeros((6, 6))
        for i, axis in enumerate((x, y, z)):
            J_theta[:3, i] = axis
            J_theta[:3, i + 3] = cross(Rb, axis)  # axis x (reference - end)
            J_theta[3:, i + 3] = axis
        saddle[:6, :6] = J_theta @ tube_compliance(robot, L) @ J_theta.T

        to_reference = reference - A
        saddle[:3, 6], saddle[3:6, 6] = cross(first, to_reference), first
        saddle[:3, 7], saddle[3:6, 7] = cross(z, to_reference), z
        for i, axis in enumerate(np.eye(3)):
            saddle[:3, 8 + i], saddle[3:6, 8 + i] = cross(Rb, axis), axis
        saddle[6:, :6] = saddle[:6, 6:].T
        K += np.linalg.inv(saddle)[:6, :6]
    return K


def legs_stacked(robot: Hexapod, pose: np.ndarray) -> np.ndarray:
    """The same, with arrays (6 legs, 11, 11) and one call of the inverse."""
    R, reference = rotation(pose[3:]), pose[:3]
    first = robot.first_axis
    Rb = robot.platform @ R.T
    to_reference = reference - robot.base
    along = to_reference + Rb
    L = np.sqrt(np.einsum("li,li->l", along, along))
    axes = np.empty((6, 3, 3))  # (leg, axis, component)
    axes[:, 0] = along / L[:, None]
    z = cross_rows(axes[:, 0], first)
    axes[:, 2] = z / np.sqrt(np.einsum("li,li->l", z, z))[:, None]
    axes[:, 1] = cross_rows(axes[:, 2], axes[:, 0])

    columns = np.zeros((6, 6, 6))  # (leg, column, component)
    columns[:, :3, :3] = columns[:, 3:, 3:] = axes
    columns[:, 3:, :3] = cross_rows(Rb[:, None, :], axes)
    J_theta = columns.swapaxes(-1, -2)

    J_q = np.zeros((6, 5, 6))
    J_q[:, 0, :3], J_q[:, 0, 3:] = cross_rows(first, to_reference), first
    J_q[:, 1, :3], J_q[:, 1, 3:] = cross_rows(axes[:, 2], to_reference), axes[:, 2]
    J_q[:, 2:, :3], J_q[:, 2:, 3:] = cross_rows(Rb[:, None, :], np.eye(3)), np.eye(3)

    saddle = np.zeros((6, 11, 11))
    saddle[:, :6, :6] = J_theta @ tube_compliance(robot, L) @ columns
    saddle[:, 6:, :6] = J_q
    saddle[:, :6, 6:] = J_q.swapaxes(-1, -2)
    return np.linalg.inv(saddle)[:, :6, :6].sum(axis=0)


def tube_compliance(robot: Hexapod, L: np.ndarray) -> np.ndarray:
    """Compliance of tube and actuator in the axes of the tube, x along it (..., 6, 6)."""
    EA, EI, GJ = robot.E * robot.A, robot.E * robot.I, robot.G * robot.J
    C = np.zeros((*np.shape(L), 6, 6))
    C[..., 0, 0] = L / EA + 1 / K_ACTUATOR
    C[..., 1, 1] = C[..., 2, 2] = L**3 / (3 * EI)
    C[..., 3, 3] = L / GJ
    C[..., 4, 4] = C[..., 5, 5] = L / EI
    C[..., 1, 5] = C[..., 5, 1] = L**2 / (2 * EI)
    C[..., 2, 4] = C[..., 4, 2] = -(L**2) / (2 * EI)
    return C


def rotation(r: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector, by Rodrigues' formula."""
    angle = np.sqrt(r @ r)
    X = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    return np.eye(3) + np.sinc(angle / np.pi) * X + 0.5 * np.sinc(angle / 2 / np.pi) ** 2 * (X @ X)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of two single vectors, without the overhead of np.cross."""
    a1, a2, a3 = a
    b1, b2, b3 = b
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


def cross_rows(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector products of rows, rows (..., 3)."""
    a1, a2, a3 = a[..., 0], a[..., 1], a[..., 2]
    b1, b2, b3 = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], axis=-1)


if __name__ == "__main__":
    main()

"""The hexapod with Jacobians of pinocchio, and eq. (7) in NumPy.

One model, made once, holds all legs: universal joint, slide, six virtual joints at the end of the
tube, ball. Leg coordinates of all poses are found at once; pinocchio then goes pose by pose.
"""

from __future__ import annotations

import numpy as np
from batched_stiffness import K_ACTUATOR, Hexapod
from scipy.spatial.transform import Rotation

from peers.way import PLACES, Way

_PASSIVE, _VIRTUAL = [0, 1, 9, 10, 11], slice(3, 9)  # of the twelve velocities of a leg


def pinocchio_jacobians(robot: Hexapod) -> Way:
    """K_C by eq. (7) with six virtual springs a leg; ImportError where pinocchio is missing."""
    import pinocchio as pin

    model = pin.Model()
    frames = []
    frame_of_leg = _base_frames(robot)
    for A, R, b in zip(robot.base, frame_of_leg, robot.platform, strict=True):
        joint, place = 0, pin.SE3(R, A)
        for kind in (
            pin.JointModelRY(),
            pin.JointModelRX(),
            pin.JointModelPZ(),
            pin.JointModelFreeFlyer(),
            pin.JointModelSpherical(),
        ):
            joint = model.addJoint(joint, kind, place, f"joint{model.njoints}")
            place = pin.SE3.Identity()
        frame = pin.Frame(f"frame{joint}", joint, 0, pin.SE3(np.eye(3), -b), pin.FrameType.OP_FRAME)
        frames.append(model.addFrame(frame))
    data = model.createData()
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def evaluate(rows: np.ndarray) -> np.ndarray:
        coordinates, lengths = _leg_coordinates(robot, frame_of_leg, rows)
        compliance = _tube_compliance(robot, lengths)
        out = np.empty((21, rows.shape[1]))
        J = np.empty((6, 6, 12))
        saddle = np.zeros((6, 11, 11))
        for n, q in enumerate(coordinates):
            pin.computeJointJacobians(model, data, q)
            for leg, frame in enumerate(frames):
                whole = pin.getFrameJacobian(model, data, frame, axes)
                J[leg] = whole[:, 12 * leg : 12 * leg + 12]
            virtual, passive = J[:, :, _VIRTUAL], J[:, :, _PASSIVE]
            saddle[:, :6, :6] = virtual @ compliance[n] @ virtual.swapaxes(-1, -2)
            saddle[:, :6, 6:] = passive
            saddle[:, 6:, :6] = passive.swapaxes(-1, -2)
            out[:, n] = np.linalg.inv(saddle)[:, :6, :6].sum(axis=0)[PLACES]
        return out

    return evaluate


def _base_frames(robot: Hexapod) -> np.ndarray:
    """Axes of the legs' bases (6, 3, 3): y along the first axis of the universal joint, z up."""
    up = np.broadcast_to([0.0, 0.0, 1.0], (6, 3))
    return np.stack([np.cross(robot.first_axis, up), robot.first_axis, up], axis=-1)


def _leg_coordinates(
    robot: Hexapod, frame_of_leg: np.ndarray, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of all legs (N, 6 * 14) and their lengths (N, 6)."""
    turn = Rotation.from_rotvec(rows[3:].T)
    R = turn.as_matrix()
    ends = rows[:3].T[:, None, :] + np.einsum("nij,lj->nli", R, robot.platform)
    along = np.einsum("lji,nlj->nli", frame_of_leg, ends - robot.base)
    lengths = np.linalg.norm(along, axis=-1)
    first = np.arctan2(along[..., 0], along[..., 2])
    second = -np.arcsin(along[..., 1] / lengths)
    q = np.zeros((rows.shape[1], 6, 14))  # 1, 1, 1, three of a place, a quaternion, a quaternion
    q[..., 0], q[..., 1], q[..., 2], q[..., 9] = first, second, lengths, 1.0
    for leg, base in enumerate(frame_of_leg):
        angles = np.stack([first[:, leg], second[:, leg]], axis=-1)
        tube = Rotation.from_matrix(base) * Rotation.from_euler("YX", angles)
        q[:, leg, 10:] = (tube.inv() * turn).as_quat()
    return q.reshape(rows.shape[1], -1), lengths


def _tube_compliance(robot: Hexapod, L: np.ndarray) -> np.ndarray:
    """Compliance of tube and actuator in the axes of the tube, z along it (..., 6, 6)."""
    EA, EI, GJ = robot.E * robot.A, robot.E * robot.I, robot.G * robot.J
    C = np.zeros((*L.shape, 6, 6))
    C[..., 0, 0] = C[..., 1, 1] = L**3 / (3 * EI)
    C[..., 2, 2] = L / EA + 1 / K_ACTUATOR
    C[..., 3, 3] = C[..., 4, 4] = L / EI
    C[..., 5, 5] = L / GJ
    C[..., 0, 4] = C[..., 4, 0] = L**2 / (2 * EI)
    C[..., 1, 3] = C[..., 3, 1] = -(L**2) / (2 * EI)
    return C

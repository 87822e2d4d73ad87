"""The structure matrix: the wrench of a unit tension of each cable, placed at a pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robostiff.model.cable import CableRobot
from robostiff.spatial import Space, cross


@dataclass(frozen=True)
class PlacedCables:
    """Cables and weight in world coordinates.

    Attributes
    ----------
    exit_points : (m, 3) array
        Where the cables leave the base [m].
    attachments : (..., m, 3) array
        Attachment points on the platform [m].
    reference_point : (..., 3) array
        About which moments are taken [m].
    weight_force : (3,) array
        [N].
    weight_point : (..., 3) array
        Where it acts [m].
    space : Space
    """

    exit_points: np.ndarray
    attachments: np.ndarray
    reference_point: np.ndarray
    weight_force: np.ndarray
    weight_point: np.ndarray
    space: Space

    @property
    def lengths(self) -> np.ndarray:
        """From exit point to attachment (..., m) [m]."""
        return np.linalg.norm(self.attachments - self.exit_points, axis=-1)

    @property
    def directions(self) -> np.ndarray:
        """Unit vectors from exit point to attachment (..., m, 3); zero for a cable of no length."""
        lengths = self.lengths[..., None]
        return (self.attachments - self.exit_points) / np.where(lengths > 0, lengths, 1.0)

    @property
    def arms(self) -> np.ndarray:
        """From the reference point to the attachments (..., m, 3) [m]."""
        return self.attachments - self.reference_point[..., None, :]

    @property
    def weight_arm(self) -> np.ndarray:
        """From the reference point to the point at which the weight acts (..., 3) [m]."""
        return self.weight_point - self.reference_point

    @property
    def characteristic_length(self) -> np.ndarray:
        """Root mean square distance of exit points and attachments from their mean (...) [m]."""
        exits = np.broadcast_to(self.exit_points, self.attachments.shape)
        points = np.concatenate([exits, self.attachments], axis=-2)
        offsets = points - points.mean(axis=-2, keepdims=True)
        length = np.sqrt(np.mean(np.sum(offsets**2, axis=-1), axis=-1))
        return np.where(length > 0, length, 1.0)

    def about(self, point: np.ndarray) -> PlacedCables:
        """The same cables with another reference point (..., 3), in the world [m]."""
        return replace(self, reference_point=np.broadcast_to(point, self.reference_point.shape))

    def __getitem__(self, index: object) -> PlacedCables:
        """The cables at one pose, or at some poses, of a batch."""
        return replace(
            self,
            attachments=self.attachments[index],  # pyright: ignore[reportArgumentType, reportCallIssue]
            reference_point=self.reference_point[index],  # pyright: ignore[reportArgumentType, reportCallIssue]
            weight_point=self.weight_point[index],  # pyright: ignore[reportArgumentType, reportCallIssue]
        )


def place_cables(robot: CableRobot, R: np.ndarray, p: np.ndarray) -> PlacedCables:
    """The cables of a robot with its platform at rotation R (..., 3, 3) and origin p (..., 3).

    Examples
    --------
    >>> from robostiff.model.cable import Cable
    >>> from robostiff.spatial import Frame
    >>> rope = Cable("rope", [0, 0, 3], [0, 0, 1], EA=1e5)
    >>> robot = CableRobot("pendulum", (rope,), Frame.identity())
    >>> place_cables(robot, np.eye(3), np.zeros(3)).lengths
    array([2.])
    """

    def in_world(points: np.ndarray) -> np.ndarray:
        return np.einsum("...ij,mj->...mi", R, points) + p[..., None, :]

    weight = robot.weight
    point = np.zeros(3) if weight is None else weight.point
    carried = in_world(np.stack([robot.reference_point, point]))
    return PlacedCables(
        exit_points=np.stack([cable.exit_point for cable in robot.cables]),
        attachments=in_world(np.stack([cable.attachment for cable in robot.cables])),
        reference_point=carried[..., 0, :],
        weight_force=np.zeros(3) if weight is None else weight.force,
        weight_point=carried[..., 1, :],
        space=robot.space,
    )


def structure_matrix(placed: PlacedCables) -> np.ndarray:
    """Structure matrix A^T (..., n, m) [1, m], one column [u_i; b_i x u_i] a cable.

    The direction u_i points from the platform to the exit point, b_i from the reference point to
    the attachment. Equilibrium under an applied wrench F is ``A^T t + F = 0`` with tensions t, and
    the cables lengthen by ``-A x`` under a small twist x. (Pott 2018, chapter 3; there and in most
    of the literature t is called f and F is called w.)

    Parameters
    ----------
    placed : PlacedCables

    Examples
    --------
    >>> from robostiff.spatial import Space
    >>> placed = PlacedCables(np.array([[0, 0, 2.0]]), np.array([[1.0, 0, 2]]), np.zeros(3),
    ...     np.zeros(3), np.zeros(3), Space.SPATIAL)
    >>> structure_matrix(placed)[:, 0].tolist()
    [-1.0, 0.0, 0.0, 0.0, -2.0, 0.0]
    """
    u, b = -placed.directions, placed.arms
    columns = np.concatenate([u, cross(b, u)], axis=-1) + 0.0
    return np.swapaxes(columns[..., list(placed.space.rows)], -1, -2)


def weight_wrench(placed: PlacedCables) -> np.ndarray:
    """Wrench of the weight about the reference point (..., n) [N, N m], in world axes.

    Parameters
    ----------
    placed : PlacedCables
    """
    force = np.broadcast_to(placed.weight_force, placed.reference_point.shape)
    wrench = np.concatenate([force, cross(placed.weight_arm, force)], axis=-1)
    return wrench[..., list(placed.space.rows)]

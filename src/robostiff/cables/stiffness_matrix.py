"""Structure and stiffness matrix of cables: how they pull, stretch and turn, and stability."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robostiff.elastostatics import Tolerance
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.model.cable import CableRobot
from robostiff.spatial import Space, cross, skew


@frozen
class PlacedCables:
    """Cables and weight in world coordinates."""

    exit_points: np.ndarray  #: (m, 3): where the cables leave the base [m]
    attachments: np.ndarray  #: (..., m, 3): attachment points on the platform [m]
    reference_point: np.ndarray  #: (..., 3): about which moments are taken [m]
    weight_force: np.ndarray  #: (3,): [N]
    weight_point: np.ndarray  #: (..., 3): where it acts [m]
    space: Space

    @cached_property
    def lengths(self) -> np.ndarray:
        """From exit point to attachment (..., m) [m]."""
        return np.linalg.norm(self.attachments - self.exit_points, axis=-1)

    @cached_property
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

    @cached_property
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
    carried = in_world(np.array([robot.reference_point, point]))
    return PlacedCables(
        exit_points=np.array([cable.exit_point for cable in robot.cables]),
        attachments=in_world(np.array([cable.attachment for cable in robot.cables])),
        reference_point=carried[..., 0, :],
        weight_force=np.zeros(3) if weight is None else weight.force,
        weight_point=carried[..., 1, :],
        space=robot.space,
    )


@kept
def structure_matrix(placed: PlacedCables) -> np.ndarray:
    """Structure matrix A^T (..., n, m) [1, m], one column [u_i; b_i x u_i] a cable.

    The direction u_i points from the platform to the exit point, b_i from the reference point to
    the attachment. Equilibrium under an applied wrench F is ``A^T t + F = 0`` with tensions t, and
    the cables lengthen by ``-A x`` under a small twist x. (Pott 2018, chapter 3; there and in most
    of the literature t is called f and F is called w.)

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
    """Wrench of the weight about the reference point (..., n) [N, N m], in world axes."""
    force = np.broadcast_to(placed.weight_force, placed.reference_point.shape)
    wrench = np.concatenate([force, cross(placed.weight_arm, force)], axis=-1)
    return wrench[..., list(placed.space.rows)]


def axial_stiffness(robot: CableRobot, lengths: np.ndarray, tensions: np.ndarray) -> np.ndarray:
    """Stiffness of every cable in series with its winch, 1/k = l0/EA + 1/k_w (..., m) [N/m].

    A cable of unstrained length l0 between winch and platform carries t = EA (l - l0)/l0. With the
    winch locked, ``l0 = (l + g - t/k_w) / (1 + t/EA)`` of present length, guide and tension. The
    tension is then linear in the length, t = k (l - l_slack), however far the platform moves. It is
    not a number where a winch would deflect by more than the length of its cable.

    Parameters
    ----------
    robot : CableRobot
    lengths, tensions : (..., m) arrays
        From exit point to attachment [m], and [N].

    Examples
    --------
    >>> from robostiff.model.cable import Cable
    >>> from robostiff.spatial import Frame
    >>> rope = Cable("rope", [0, 0, 3], [0, 0, 0], EA=1e5, guide_length=1.0)
    >>> robot = CableRobot("pendulum", (rope,), Frame.identity())
    >>> axial_stiffness(robot, np.array([3.0]), np.array([0.0]))
    array([25000.])
    """
    cables = robot.cables
    stretch = np.array([0.0 if cable.EA is None else 1.0 / cable.EA for cable in cables])
    winches = [cable.winch_stiffness for cable in cables]
    give = np.array([0.0 if k is None else 1.0 / k for k in winches])
    guide = np.array([cable.guide_length for cable in cables])
    unstrained = (lengths + guide - tensions * give) / (1.0 + tensions * stretch)
    lost = (unstrained <= 0) & (stretch > 0) & (lengths > 0)
    # A cable of zero length has no matrix; its stiffness must only be finite.
    compliance = np.where(unstrained > 0, unstrained, 1.0) * stretch + give
    return np.where(lost, np.nan, 1.0 / compliance)


def elastic_stiffness(placed: PlacedCables, stiffness: np.ndarray) -> np.ndarray:
    """Stiffness of stretching cables, A^T diag(k) A (..., n, n).

    Parameters
    ----------
    placed : PlacedCables
    stiffness : (..., m) array
        Of each cable with its winch, k [N/m].

    Examples
    --------
    >>> placed = PlacedCables(np.array([[0, 0, 2.0]]), np.zeros((1, 3)), np.zeros(3),
    ...     np.zeros(3), np.zeros(3), Space.SPATIAL)
    >>> np.diag(elastic_stiffness(placed, np.array([4e4]))).tolist()
    [0.0, 0.0, 40000.0, 0.0, 0.0, 0.0]
    """
    W = structure_matrix(placed)
    return (W * stiffness[..., None, :]) @ np.swapaxes(W, -1, -2)


def geometric_stiffness(placed: PlacedCables, tensions: np.ndarray) -> np.ndarray:
    """Stiffness of turning cables under tension, sum of t_i times the second derivative of l_i.

    With e the unit vector from exit point to attachment, l the length and b the arm,

        [[P, -P (b x)], [(b x) P, -(b x) P (b x) + S(e, b)]],   P = (I - e e^T)/l,
        S(e, b) = (e b^T + b e^T)/2 - (e . b) I.

    The term S is what rotation adds: turning the platform moves the attachment along the cable in
    second order. (Behzadipour and Khajepour 2006 derive the same from the wrench.)

    Parameters
    ----------
    placed : PlacedCables
    tensions : (..., m) array
        t [N].

    Returns
    -------
    (..., n, n) array
        Symmetric, and positive or negative.

    Examples
    --------
    A pendulum: sideways it is as stiff as tension over length.

    >>> placed = PlacedCables(np.array([[0, 0, 2.0]]), np.zeros((1, 3)), np.zeros(3),
    ...     np.zeros(3), np.zeros(3), Space.SPATIAL)
    >>> np.diag(geometric_stiffness(placed, np.array([100.0]))).tolist()
    [50.0, 50.0, 0.0, 0.0, 0.0, 0.0]
    """
    e, b = placed.directions, placed.arms
    per_length = tensions / np.where(placed.lengths > 0, placed.lengths, 1.0)
    K = np.zeros((*tensions.shape[:-1], 6, 6))
    # P = I/l - e e^T/l: of the second part, columns [e; b x e] of the structure matrix.
    K[..., :3, :3] = per_length.sum(axis=-1)[..., None, None] * np.eye(3)
    K[..., 3:, :3] = skew(np.einsum("...m,...mi->...i", per_length, b))
    K[..., :3, 3:] = -K[..., 3:, :3]
    K[..., 3:, 3:] = second_order_arm(tensions[..., None] * e - per_length[..., None] * b, b)
    W = structure_matrix(placed)
    return _in_space(K, placed.space) - (W * per_length[..., None, :]) @ np.swapaxes(W, -1, -2)


def weight_stiffness(placed: PlacedCables) -> np.ndarray:
    """Stiffness of a weight at a point of the platform, -S(f, d) in the rotations (..., n, n).

    A weight below the reference point turns back like a pendulum; one above it topples.
    """
    arm = placed.weight_arm
    return force_stiffness(np.broadcast_to(placed.weight_force, arm.shape), arm, placed.space)


def force_stiffness(force: np.ndarray, arm: np.ndarray, space: Space) -> np.ndarray:
    """Stiffness of a force of constant direction, -S(f, d) in the rotations (..., n, n).

    Parameters
    ----------
    force, arm : (..., 3) arrays
        On the platform [N], at a point given relative to the reference point [m].
    space : Space

    Examples
    --------
    >>> down = np.array([0.0, 0, -100])
    >>> force_stiffness(down, np.array([0, 0, -0.5]), Space.SPATIAL)[3, 3]
    np.float64(50.0)
    """
    K = np.zeros((*arm.shape[:-1], 6, 6))
    K[..., 3:, 3:] = -second_order_arm(force[..., None, :], arm[..., None, :])
    return _in_space(K, space)


def wrench_derivative(K: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Derivative of the holding wrench, K - (M x)/2 in the rotations (..., n, n): not symmetric.

    The moment is taken about the moving reference point in world axes. Its derivative differs from
    the second derivative of the energy where a moment M is held.

    Parameters
    ----------
    K : (..., n, n) array
        Second derivative of the energy.
    wrench : (..., n) array
        First derivative of the energy: the wrench that holds the platform [N, N m].
    """
    derivative = np.array(K)
    if K.shape[-1] == Space.SPATIAL.size:  # turns in one plane commute
        derivative[..., 3:, 3:] -= 0.5 * skew(wrench[..., 3:])
    return derivative


def second_order_arm(forces: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """Sum over m of S(f, b) = (f b^T + b f^T)/2 - (f . b) I (..., 3, 3): work on r x (r x b)/2.

    Parameters
    ----------
    forces, arms : (..., m, 3) arrays
    """
    outer = np.swapaxes(forces, -1, -2) @ arms
    trace = np.einsum("...ii->...", outer)
    return 0.5 * (outer + np.swapaxes(outer, -1, -2)) - trace[..., None, None] * np.eye(3)


def _in_space(K: np.ndarray, space: Space) -> np.ndarray:
    if space is Space.SPATIAL:
        return K
    rows = list(space.rows)
    return K[..., rows, :][..., :, rows]


_ROUNDING = 1e-12  # of the largest stiffness


@frozen
class Stability:
    """Rank and stability at N poses.

    Attributes
    ----------
    held : (N,) array of int
        Directions in which cables stretch: the rank of the structure matrix.
    rank : (N,) array of int
        Of the stiffness matrix.
    motions : (N, n, n) array
        Columns are displacements in scaled coordinates that do not work on each other's forces.
    free, unstable : (N, n) arrays of bool
        Which of the motions meet no stiffness, and which grow by themselves.
    doubtful : (N,) array of bool
        Whether a decision was close.
    """

    held: np.ndarray
    rank: np.ndarray
    motions: np.ndarray
    free: np.ndarray
    unstable: np.ndarray
    doubtful: np.ndarray


def stability(W: np.ndarray, K: np.ndarray, size: np.ndarray, tolerance: Tolerance) -> Stability:
    """Rank and stability of K at N poses.

    Tension is a thousandth or less of what stretching resists, so a single scale would take its
    part for rounding. The displacements are split: those in which cables stretch are decided by the
    geometry of unit wrenches, as everywhere; in the others the stiffness left after the first have
    condensed, ``K_nn - K_nh K_hh^-1 K_hn``, is compared with that of the tensions.

    Parameters
    ----------
    W : (N, n, m) array
        Structure matrix, moments divided by a characteristic length; zero for slack cables.
    K : (N, n, n) array
        Stiffness matrix, scaled alike [N/m].
    size : (N,) array
        Of the stiffness that tension and weight give [N/m].
    tolerance : Tolerance

    Examples
    --------
    >>> W, K = np.array([[[0.0], [1.0]]]), np.diag([50.0, 1e6])[None]
    >>> pendulum = stability(W, K, np.array([50.0]), Tolerance())
    >>> pendulum.held, pendulum.rank
    (array([1]), array([2]))
    """
    U, values, _ = np.linalg.svd(W)
    stretching = np.count_nonzero(values > tolerance.independence, axis=-1)
    doubtful = np.any(tolerance.leaves_in_doubt(values), axis=-1)
    free, unstable = np.zeros((2, *K.shape[:-1]), dtype=bool)
    motions = np.empty_like(K)
    for r in np.unique(stretching):
        rows = stretching == r
        H, N, K_r = U[rows, :, :r], U[rows, :, r:], K[rows]
        H_T = np.swapaxes(H, -1, -2)
        eigenvalues, directions = np.linalg.eigh(H_T @ K_r @ H)
        largest = np.abs(eigenvalues).max(axis=-1, initial=0.0)[:, None]
        doubtful[rows] |= np.any(np.abs(eigenvalues) <= tolerance.near_rigidity * largest, axis=-1)
        H = H @ directions
        motions[rows, :, :r], unstable[rows, :r] = H, eigenvalues < -_ROUNDING * largest
        regular = np.all(eigenvalues != 0, axis=-1)[:, None]
        pushed = np.swapaxes(H, -1, -2) @ K_r @ N
        divisor = np.where(regular, eigenvalues, 1.0)[:, :, None]
        M = N - H @ np.where(regular[:, :, None], pushed / divisor, 0.0)
        schur = np.swapaxes(N, -1, -2) @ K_r @ M
        eigenvalues, turned = np.linalg.eigh(0.5 * (schur + np.swapaxes(schur, -1, -2)))
        # Rounding of the large elastic entries reaches the small ones.
        near = np.maximum(tolerance.near_independence * size[rows, None], 1e-13 * largest)
        floor = np.maximum(tolerance.independence * size[rows, None], 1e-15 * largest)
        lost = np.abs(eigenvalues) <= floor
        motions[rows, :, r:] = M @ turned
        free[rows, r:], unstable[rows, r:] = lost, (eigenvalues < 0) & ~lost
        doubtful[rows] |= np.any(~lost & (np.abs(eigenvalues) <= near), axis=-1)
    rank = K.shape[-1] - np.count_nonzero(free, axis=-1)
    return Stability(stretching, rank, motions, free, unstable, doubtful)

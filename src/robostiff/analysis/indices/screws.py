"""Eigenscrews, compliant axes and centres: the structure of K that no point can change."""

from __future__ import annotations

from itertools import product
from typing import ClassVar

import numpy as np

from robostiff.analysis.indices.stiffness_parts import StiffnessParts, stiffness_parts
from robostiff.analysis.result import Stiffness
from robostiff.elastostatics import Status
from robostiff.frozen import frozen
from robostiff.spatial import Screw, move_compliance, move_stiffness, screw_of_twist

_SMALL = 1e-7


@frozen
class Eigenwrench:
    """A wrench that displaces the platform parallel to its force, without turning it.

    Attributes
    ----------
    stiffness : float
        Force per displacement [N/m]; zero along a free translation.
    direction : (3,) array
        Unit vector of force and displacement.
    screw : Screw or None
        Line and pitch [m] of the wrench; a pitch of zero is a pure force. None where the
        translation is free.
    """

    stiffness: float
    direction: np.ndarray
    screw: Screw | None


@frozen
class Eigentwist:
    """A twist whose rotation is parallel to the pure couple that causes it.

    Attributes
    ----------
    stiffness : float
        Couple per rotation [N m/rad]; zero where the platform turns freely.
    direction : (3,) array
        Unit vector of couple and rotation.
    screw : Screw
        Line and pitch [m/rad] of the twist; a pitch of zero is a pure rotation. With free
        translations it is the one that has no part of them.
    """

    stiffness: float
    direction: np.ndarray
    screw: Screw


@frozen
class CompliantAxis:
    """A line along which a force only displaces, and about which a couple only turns.

    Attributes
    ----------
    direction, point : (3,) array
    translational : float
        [N/m].
    rotational : float
        [N m/rad].
    """

    direction: np.ndarray
    point: np.ndarray
    translational: float
    rotational: float


@frozen
class Eigenscrews:
    """Eigenwrenches and eigentwists, those of least stiffness first, and compliant axes.

    Attributes
    ----------
    wrenches : tuple of Eigenwrench
        Three, or two in the plane.
    twists : tuple of Eigentwist
        Three, or one in the plane.
    compliant_axes : tuple of CompliantAxis
        Lines that are both the axis of an eigenwrench and of an eigentwist, both without pitch.
    status : Status
    """

    about: ClassVar[str] = "independent of the reference point, and of any characteristic length"
    units: ClassVar[tuple[str, str]] = ("N/m", "N m/rad")
    wrenches: tuple[Eigenwrench, ...]
    twists: tuple[Eigentwist, ...]
    compliant_axes: tuple[CompliantAxis, ...]
    status: Status


def eigenscrews(result: Stiffness) -> Eigenscrews:
    """Eigenwrenches ``K (u, 0) = k_f (u, m)`` and eigentwists ``K (d, w) = k_r (0, w)``.

    The stiffnesses k_f are the eigenvalues of K_tt, the k_r the reciprocals of those of C_rr. Lines
    and pitches belong to the machine: no choice of point or length enters. Together they are all of
    K: ``K = sum k_f (u, m)(u, m)^T + sum k_r (0, w)(0, w)^T``. Where K is singular, what is left is
    given: k_r are then the eigenvalues of ``K_rr - K_rt K_tt^-1 K_tr`` over the held directions.

    Where two stiffnesses are equal, their screws are one choice of many.

    References
    ----------
    T. Patterson, H. Lipkin: Structure of robot compliance. Journal of Mechanical Design 115(3),
    576-580, 1993. The same: A classification of robot compliance. Ibid., 581-584.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = eigenscrews(rs.stiffness(rs.load("gough-stewart-b")))
    >>> [round(float(twist.stiffness)) for twist in found.twists]
    [12198795, 20545339, 20545339]
    """
    parts = stiffness_parts(result).at_origin
    space, origin, length = parts.space, parts.result.reference_point, float(result.length)
    forces, moments = parts.forces_rotations_held, parts.moments_translations_free
    d, wrenches, twists = space.translations, [], []
    for k, u in zip(forces.values, forces.directions, strict=True):
        wrench = space.spatial(np.concatenate([u, parts.K[d:, :d] @ u / (k or 1.0)]))
        # A wrench is a twist with its halves exchanged: moment for displacement.
        screw = screw_of_twist(np.roll(wrench, 3), origin, length, _SMALL) if k > 0 else None
        wrenches.append(Eigenwrench(float(k), wrench[:3], screw))
    for k, w in zip(moments.values, moments.directions, strict=True):
        shift = -forces.solve((parts.K[:d, d:] @ w)[:, None])[:, 0]
        twist = space.spatial(np.concatenate([shift, w]))
        screw = screw_of_twist(twist, origin, length, _SMALL)
        twists.append(Eigentwist(float(k), twist[3:], screw))
    axes = []
    for wrench, twist in product(wrenches, twists):
        f, t = wrench.screw, twist.screw
        if f is None or f.point is None or t.point is None or not twist.stiffness > 0:
            continue
        parallel = np.linalg.norm(np.cross(f.axis, t.axis)) < _SMALL
        apart = np.linalg.norm(np.cross(t.point - f.point, f.axis)) >= _SMALL * length
        if f.is_rotation and t.is_rotation and parallel and not apart:  # on the same line
            stiffness = wrench.stiffness, twist.stiffness
            axes.append(CompliantAxis(twist.direction, t.point, *stiffness))
    return Eigenscrews(tuple(wrenches), tuple(twists), tuple(axes), parts.status)


_ROUNDING = 1e-10  # of coupling: what moving to the point may leave of nothing
_LOST = 1e-14  # of the largest eigenvalue: smaller ones are rounding


@frozen
class Centre:
    """A point about which the coupling block of K, or of C, is symmetric.

    Attributes
    ----------
    point : (3,) array or None
        In the world [m]; of a line the point nearest to the robot's own. None where there is none.
    line : (3,) array or None
        Direction of the line of such points, where one is as good as another.
    matrix : (n, n) array or None
        K, or C, about the point.
    coupling : float or None
        What couples forces with rotations there, ``|K_tr| / sqrt(|K_tt| |K_rr|)``, or the same of
        C: 0 where a force only displaces and a couple only turns, below 1 always. No unit.
    status : Status
    """

    about: ClassVar[str] = "independent of the reference point it is computed from"
    unit: ClassVar[str] = "m"
    point: np.ndarray | None
    line: np.ndarray | None
    matrix: np.ndarray | None
    coupling: float | None
    status: Status

    @property
    def is_decoupled(self) -> bool:
        """Whether a force through the point only displaces it, and a couple only turns about it."""
        return self.coupling == 0.0


def centre_of_stiffness(result: Stiffness) -> Centre:
    """The point about which K_tr is symmetric, ``(tr(K_tt) I - K_tt) v = -axial(K_tr - K_tr^T)``.

    It is also the point from which the vectors to the axes of the eigenwrenches, weighed by their
    stiffness, add to nothing; a rotation of Loncaric's makes K_tr diagonal there. In the plane K_tr
    vanishes: a force through the point does not turn the platform. In space that is so for some
    robots only; see `coupling`.

    Returns
    -------
    Centre
        Along a line where only forces of one direction are resisted, nowhere where none are.

    References
    ----------
    J. Loncaric: Normal forms of stiffness and compliance matrices. IEEE Journal of Robotics and
    Automation 3(6), 567-572, 1987.

    Examples
    --------
    >>> import robostiff as rs
    >>> centre = centre_of_stiffness(rs.stiffness(rs.load("gough-stewart-b")))
    >>> centre.point.round(4) + 0.0
    array([0.    , 0.    , 0.7368])
    """
    parts = stiffness_parts(result).at_origin
    d = parts.space.translations
    forces = parts.forces_rotations_held
    if forces.rank == 0:
        return Centre(None, None, None, None, parts.status)
    v, line = _symmetric_point(parts.K[:d, :d], -_axial(parts.K[:d, d:])[:d], forces.rank == 1)
    return _centre(parts, v, line, move_stiffness(parts.K, v), parts.K[:d, :d])


def centre_of_compliance(result: Stiffness) -> Centre:
    """The point about which C_tr is symmetric, ``(tr(C_rr) I - C_rr) v = axial(C_tr - C_tr^T)``.

    From it the vectors to the axes of the eigentwists, weighed by their compliance, add to
    nothing. In the plane, and wherever K decouples, it is the centre of stiffness; in space the two
    are different points.

    Returns
    -------
    Centre
        Without a point where K is singular and there is no C (status ``FREE_MOTIONS``), or where no
        digit of C holds (``ILL_CONDITIONED``).

    References
    ----------
    J. Loncaric: Normal forms of stiffness and compliance matrices. IEEE Journal of Robotics and
    Automation 3(6), 567-572, 1987.

    Examples
    --------
    >>> import robostiff as rs
    >>> centre = centre_of_compliance(rs.stiffness(rs.load("gough-stewart-b")))
    >>> centre.point.round(4) + 0.0
    array([0.    , 0.    , 0.7368])
    """
    parts = stiffness_parts(result).at_origin
    C = parts.C
    if C is None:
        return Centre(None, None, None, None, parts.status)
    d, line = parts.space.translations, None
    if d == 2:
        v = np.array([-C[1, 2], C[0, 2]]) / C[2, 2]
    else:
        v, line = _symmetric_point(C[d:, d:], _axial(C[:d, d:]), False)
    return _centre(parts, v, line, move_compliance(C, v), C[d:, d:])


def _symmetric_point(
    A: np.ndarray, turned: np.ndarray, one_direction: bool
) -> tuple[np.ndarray, np.ndarray | None]:
    """V of (tr(A) I - A) v = turned; where A has rank 1, the direction along which v is open.

    Nor can it be found along the only direction of A that is above rounding.
    """
    system = np.trace(A) * np.eye(len(A)) - A
    values, vectors = np.linalg.eigh(system)
    if not one_direction and values[0] > _LOST * values[-1]:
        return np.linalg.solve(system, turned), None
    known = vectors[:, 1:]
    return known @ ((known.T @ turned) / values[1:]), vectors[:, 0]


def _axial(B: np.ndarray) -> np.ndarray:
    """The vector s of B - B^T = (s x); B (2, 1) is the block of forces against turns about z."""
    if B.shape == (2, 1):
        return np.array([-B[1, 0], B[0, 0], 0.0])
    return np.array([B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1]])


def _centre(
    parts: StiffnessParts,
    v: np.ndarray,
    line: np.ndarray | None,
    moved: np.ndarray,
    moved_block: np.ndarray,
) -> Centre:
    """The centre at v (d,) from the reference point, and K or C moved there (n, n)."""
    d = parts.space.translations
    point = parts.result.reference_point + np.append(v, np.zeros(3 - d))
    if line is not None:
        line = np.append(line, np.zeros(3 - d))
    # Moving to the point by v cancels terms of this size.
    lever = max(float(np.linalg.norm(v)), float(parts.result.length))
    nothing = _ROUNDING * lever * float(np.linalg.norm(moved_block, 2))
    status = parts.status
    if line is not None and np.count_nonzero(parts.forces_rotations_held.values) > 1:
        status |= Status.ILL_CONDITIONED  # the point along the line is lost in rounding
    coupled, coupling = np.linalg.norm(moved[:d, d:], 2), 0.0
    if coupled > nothing:
        sizes = np.linalg.norm(moved[:d, :d], 2) * np.linalg.norm(moved[d:, d:], 2)
        coupling = float(coupled / np.sqrt(sizes))
    return Centre(point, line, moved, coupling, status)

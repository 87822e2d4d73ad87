"""Stiffness of forces and of moments along directions, own or given, the rest held or free."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.indices.stiffness_parts import (
    EigenPart,
    StationaryStiffness,
    StiffnessParts,
    stiffness_parts,
)
from robostiff.analysis.result import Stiffness
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.spatial import Space, as_floats


@frozen
class PrincipalStiffnesses(StationaryStiffness):
    """Eigenvalues of K_tt, the rotations held, and of K_rr, the reference point held; ascending.

    The first do not depend on the reference point.
    """

    about: ClassVar[str] = "the other displacements and rotations held"


def principal_stiffness(result: Stiffness) -> PrincipalStiffnesses:
    """Eigenvalues of the diagonal blocks of K: ``K_tt u = k u`` and ``K_rr u = k u``.

    They are the stiffnesses for a task that guides the platform: of a machine that
    presses without letting it turn. What holds the rest is not counted, so they are upper bounds;
    `collinear_stiffness` is that of a platform that is free to deflect. ``K_tt`` is the same
    about every point, ``K_rr`` is not.

    Returns
    -------
    PrincipalStiffnesses
        Zeros, exactly, along free motions.

    References
    ----------
    C. Gosselin: Stiffness mapping for parallel manipulators. IEEE Transactions on Robotics and
    Automation 6(3), 1990.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = principal_stiffness(rs.stiffness(rs.load("gough-stewart-b")))
    >>> (found.translational / 1e6).round(1)
    array([ 68.7,  68.7, 462.7])
    """
    parts = stiffness_parts(result)
    f, m = parts.forces_rotations_held, parts.moments_translations_held
    return PrincipalStiffnesses(f.values, f.directions, m.values, m.directions, parts.status)


@frozen
class CollinearStiffness(StationaryStiffness):
    """Stationary stiffness of forces through the reference point, and of moments, ascending.

    The platform is free to turn under the first, and to shift under the others, which do not depend
    on the reference point.
    """

    about: ClassVar[str] = "the other displacements and rotations free"

    @property
    def smallest(self) -> float:
        """The least collinear stiffness of a force [N/m]."""
        return float(self.translational[0])


def collinear_stiffness(result: Stiffness) -> CollinearStiffness:
    """Stiffness along forces whose displacement is parallel to them, ``C_tt u = (1 / k) u``.

    A force along such a u moves the reference point along u, while the platform turns as it likes;
    1 / (u^T C_tt u) is stationary there, so that the smallest value is the least stiffness against
    any force, the reciprocal of the worst deflection. The same for moments and rotations, with
    ``C_rr``. Where K is singular, ``(C_tt)^-1`` is ``K_tt - K_tr K_rr^-1 K_rt``, and exactly zero
    along forces that drive a free motion.

    References
    ----------
    The name is that of V. Portman: Stiffness evaluation of machines and robots: minimum collinear
    stiffness value approach. Journal of Mechanisms and Robotics 3(1), 011015, 2011. The definition
    is the one written above.

    Examples
    --------
    >>> import robostiff as rs
    >>> free = collinear_stiffness(rs.stiffness(rs.load("hexapod")))
    >>> (free.translational / 1e6).round(1)
    array([ 17.9,  17.9, 321.8])
    """
    parts = stiffness_parts(result)
    f, m = parts.forces_rotations_free, parts.moments_translations_free
    return CollinearStiffness(f.values, f.directions, m.values, m.directions, parts.status)


@frozen
class Anisotropy:
    """Largest over smallest principal compliance, of forces and of moments.

    Attributes
    ----------
    translational : float or None
        1 where a unit force displaces alike in every direction; None where some force meets no
        stiffness.
    rotational : float or None
        In the plane, with one rotation alone, 1.
    status : Status
    """

    about: ClassVar[str] = "largest over smallest principal compliance"
    unit: ClassVar[str] = "1"
    translational: float | None
    rotational: float | None
    status: Status


def anisotropy(result: Stiffness) -> Anisotropy:
    """Ratio of the largest to the smallest eigenvalue of C_tt, and of C_rr.

    Both are numbers without units, and need no characteristic length.

    Examples
    --------
    >>> import robostiff as rs
    >>> round(anisotropy(rs.stiffness(rs.load("hexapod"))).translational, 2)
    18.0
    """
    parts = stiffness_parts(result)
    forces, moments = parts.forces_rotations_free, parts.moments_translations_free
    return Anisotropy(forces.ratio, moments.ratio, parts.status)


_SMALL = 1e-7


@frozen
class DirectionalStiffness:
    """Stiffness of the platform along a direction.

    Attributes
    ----------
    direction : (d,) array
        Unit vector, in world axes.
    free : float
        Force along it per displacement along it, everything else free: 1 / (u^T C_tt u) [N/m].
        Zero where the force drives a free motion (status ``UNBALANCED``), or meets a stiffness that
        is not above rounding (``ILL_CONDITIONED``).
    held : float
        The same with all other displacements and rotations held: u^T K_tt u [N/m].
    unit : str
        N/m, or N m/rad for moments.
    status : Status
    """

    about: ClassVar[str] = "along one direction, everything else free, or held"
    direction: np.ndarray
    free: float
    held: float
    unit: str
    status: Status


def directional_stiffness(result: Stiffness, direction: ArrayLike) -> DirectionalStiffness:
    """Stiffness against a force along a direction, through the reference point [N/m].

    ``free`` is what a force gauge and a dial gauge measure on the machine, ``held`` what they would
    with the platform guided. ``free <= held`` always.

    Parameters
    ----------
    result : Stiffness
    direction : (3,) array-like
        Of any length but zero; (2,) will do in the plane.

    Raises
    ------
    InputError
        For a direction of zero length or out of the plane of a planar robot.

    Examples
    --------
    >>> import robostiff as rs
    >>> along_x = directional_stiffness(rs.stiffness(rs.load("hexapod")), [1, 0, 0])
    >>> print(f"{along_x.free / 1e6:.1f} N/um free, {along_x.held / 1e6:.1f} N/um held")
    17.9 N/um free, 32.3 N/um held
    """
    parts = stiffness_parts(result)
    x = as_floats("direction", direction, "three numbers x y z", "")
    is_planar = parts.space is Space.PLANAR
    u = _vector(np.append(x, 0.0) if is_planar and x.shape == (2,) else x, "direction")
    if is_planar and abs(u[2]) > _SMALL:
        expected = "a direction in the x-y plane: the robot is planar"
        raise InputError("direction", got=direction, expected=expected)
    u = u[: parts.space.translations]
    u = u / np.linalg.norm(u)
    return _along(parts, u, parts.forces_rotations_free, parts.forces_rotations_held, "N/m")


def stiffness_about_axis(result: Stiffness, axis: ArrayLike) -> DirectionalStiffness:
    """Stiffness against a moment about an axis direction [N m/rad].

    ``free`` lets the platform shift and turn otherwise, and does not depend on the reference point;
    ``held`` turns it about an axis through the reference point.

    Parameters
    ----------
    result : Stiffness
    axis : (3,) array-like
        Of any length but zero; along z for a planar robot.

    Raises
    ------
    InputError
        For an axis of zero length, or not along z for a planar robot.

    Examples
    --------
    >>> import robostiff as rs
    >>> planar = stiffness_about_axis(rs.stiffness(rs.load("3-rrr")), [0, 0, 1])
    >>> print(f"{planar.free:.1f} {planar.unit}")
    3883.7 N m/rad
    """
    parts = stiffness_parts(result)
    u = _vector(axis, "axis")
    if parts.space is Space.PLANAR:
        if np.linalg.norm(u[:2]) > _SMALL:
            raise InputError("axis", got=axis, expected="[0, 0, 1]: the robot is planar")
        u = np.array([np.sign(u[2])])
    free, held = parts.moments_translations_free, parts.moments_translations_held
    return _along(parts, u, free, held, "N m/rad")


def _along(
    parts: StiffnessParts, u: np.ndarray, free: EigenPart, held: EigenPart, unit: str
) -> DirectionalStiffness:
    """Stiffness along a unit vector (d,), of the parts of K with all else free and held."""
    status = parts.status
    tolerance = parts.result.details().tolerance.independence
    along = free.directions @ u
    if np.any(np.abs(along[free.values == 0]) > tolerance):
        stiffness_free = 0.0
        if parts.rank < parts.space.size:
            status |= Status.UNBALANCED
    else:
        carried = free.values > 0
        stiffness_free = float(1 / np.sum(along[carried] ** 2 / free.values[carried]))
    stiffness_held = float(np.sum((held.directions @ u) ** 2 * held.values))
    return DirectionalStiffness(u, stiffness_free, stiffness_held, unit, status)


def _vector(vector: ArrayLike, subject: str) -> np.ndarray:
    u = as_floats(subject, vector, "three numbers x y z", "", (3,))
    size = np.linalg.norm(u)
    if size == 0:
        raise InputError(subject, got=vector, expected="a direction, not zero")
    return u / size


@frozen
class WorstDeflections:
    """Largest displacement per unit force, largest rotation per unit moment, and their directions.

    Attributes
    ----------
    translational : float or None
        Displacement of the reference point per force through it [m/N]; None where some force
        meets no stiffness.
    translational_direction : (d,) array
        Of that force and of the displacement; of a force that meets none where there is one.
    rotational : float or None
        Rotation per moment [rad/(N m)]; None where some moment meets no stiffness.
    rotational_direction : (r,) array
    status : Status
        ``UNBALANCED`` as well where one of them is None because of a free motion.
    """

    about: ClassVar[str] = "over all directions of a unit force, and of a unit moment"
    units: ClassVar[tuple[str, str]] = ("m/N", "rad/(N m)")
    translational: float | None
    translational_direction: np.ndarray
    rotational: float | None
    rotational_direction: np.ndarray
    status: Status


def worst_deflection(result: Stiffness) -> WorstDeflections:
    """Largest eigenvalues of C_tt and C_rr: the most that unit vectors u make of ``|C_tt u|``.

    The force acts through the reference point and the platform may turn; displacement and force
    are parallel at the worst, so that this is one over the least collinear stiffness. Maps have it
    as `Quantity.WORST_DEFLECTION`.

    Examples
    --------
    >>> import robostiff as rs
    >>> worst = worst_deflection(rs.stiffness(rs.load("hexapod")))
    >>> print(f"{1e6 * worst.translational:.4f} um/N")
    0.0559 um/N
    >>> print(worst_deflection(rs.stiffness(rs.load("gough-stewart-a"))).translational)
    None
    """
    parts = stiffness_parts(result)
    forces, moments = parts.forces_rotations_free, parts.moments_translations_free
    translational, rotational = forces.largest_inverse, moments.largest_inverse
    status = parts.status
    if parts.rank < parts.space.size and (translational is None or rotational is None):
        status |= Status.UNBALANCED
    return WorstDeflections(
        translational, forces.directions[0], rotational, moments.directions[0], status
    )

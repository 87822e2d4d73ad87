"""Masses of a robot, and small vibrations about an equilibrium: motions that closures allow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from robostiff.model import PlacedMass, PlacedSpring
from robostiff.spatial import skew
from robostiff.statics.chains.beam_bowing import UniformBeam, uniform_beam
from robostiff.statics.chains.elements import BodyPlace, FiniteJoint, Spot
from robostiff.statics.equations.problem import EquilibriumProblem, Linearised, State
from robostiff.statics.equations.stability import unit_sizes, unloaded_curvature, whole_closure

# Cosine, less than one by this: an elastic part whose own x axis is not along it.
_ASIDE = 1e-9
# Of the points from -1 to 1: the squares of cubics are integrated exactly.
_GAUSS = np.polynomial.legendre.leggauss(4)
# Of the largest singular value: of closure, and of the masses, whose roots are taken.
_CLOSED, _MASSLESS = 1e-10, 1e-9
# Of the largest stiffness, or square of a frequency: nothing resists.
_LOOSE = 1e-10


@dataclass(frozen=True)
class CarriedMass:
    """A mass, and what carries it.

    Attributes
    ----------
    mass : PlacedMass
    spot : Spot
        The body that carries it.
    parts : int
        Of the elements before it the last so many are the elastic part along which it is; 0 for
        a mass on a body.
    part : PlacedSpring or None
        That elastic part.
    end : (3,) array
        Where it ends at the unloaded posture [m].
    """

    mass: PlacedMass
    spot: Spot
    parts: int = 0
    part: PlacedSpring | None = None
    end: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def velocities(
        self, bodies: Sequence[BodyPlace], twists: np.ndarray, about: np.ndarray
    ) -> np.ndarray:
        """Rows B (k, m) of velocities times roots of masses: ``B^T B`` is its mass matrix.

        An elastic part is straight between its ends where these are now, and its sections move as
        `motion_of_section` says.

        Parameters
        ----------
        bodies : sequence of BodyPlace
            Where the body at the start of the chain is, and those behind its elements.
        twists : (K + 1, 6, m) array
            Theirs about a point, by the unknowns.
        about : (3,) array
            That point [m].
        """
        mass, part, n = self.mass, self.part, self.parts
        if part is None or mass.start is None or not (n and np.any(self.end - mass.start)):
            at = bodies[self.spot.after].of(np.asarray(mass.centre, dtype=float))
            return np.sqrt(float(mass.value)) * _about(at - about, twists[self.spot.after])[:3]
        x, found = self.end - mass.start, [np.zeros((0, twists.shape[-1]))]
        beam, phi = _uniform_beam(part, x), (0.0, 0.0)
        if beam is not None:
            L = float(np.linalg.norm(x)) / n
            phi = 12 * beam.EIz * beam.shear_y / L**2, 12 * beam.EIy * beam.shear_z / L**2
        for i in range(n):
            sections = list(self._sections(i, _axes(x, part.rotation[:, 1]), x, beam))
            if not sections:
                continue
            near = self.spot.after - n + i
            a = bodies[near].of(mass.start + x * (i / n))
            b = bodies[near + 1].of(mass.start + x * ((i + 1) / n))
            axes = _axes(b - a, (bodies[near].R + bodies[near + 1].R) @ part.rotation[:, 1])
            chord = float(np.linalg.norm(b - a))
            each = []
            for s, weight, aside, radii in sections:
                each.append(_about(aside, motion_of_section(s, chord, phi)) * np.sqrt(weight))
                each[-1][3:] *= radii[:, None]
            rows = np.concatenate(each)
            of_ends = [
                axes.T @ _about(end - about, twist).reshape(2, 3, -1)
                for end, twist in ((a, twists[near]), (b, twists[near + 1]))
            ]
            rows = np.linalg.qr(rows, mode="r") if len(rows) > 12 else rows
            found.append(rows @ np.concatenate(of_ends).reshape(12, -1))
        return np.concatenate(found)

    def _sections(
        self, i: int, axes: np.ndarray, x: np.ndarray, beam: UniformBeam | None
    ) -> Iterator[tuple[float, float, np.ndarray, np.ndarray]]:
        """Sections with a mass in element i of an elastic part along x (3,) [m].

        Part of its length before the section, the mass [kg], and, in the axes of the part, where it
        is beside the axis (3,), and its radii of gyration (3,) [m].
        """
        mass, n = float(self.mass.value), self.parts
        if self.mass.span is None:
            aside = np.asarray(self.mass.centre, dtype=float) - self.mass.start
            s = float(np.clip(aside @ x / (x @ x), 0.0, 1.0))
            if min(int(s * n), n - 1) == i:
                yield s * n - i, mass, axes.T @ (aside - s * x), np.zeros(3)
            return
        first, last = (own * n - i for own in self.mass.span)
        low, high, radii = max(first, 0.0), min(last, 1.0), np.zeros(3)
        if beam is not None:
            radii = np.sqrt(np.array([beam.EIy + beam.EIz, beam.EIy, beam.EIz]) / beam.EA)
        for place, weight in zip(*_GAUSS, strict=True):
            s, share = 0.5 * (low + high + place * (high - low)), (high - low) / (last - first)
            if share > 0:
                yield s, 0.5 * weight * share * mass, np.zeros(3), radii


@dataclass(frozen=True)
class CarriedMasses:
    """All masses of a robot, at the unloaded posture."""

    on_legs: tuple[CarriedMass, ...] = ()
    on_platform: tuple[PlacedMass, ...] = ()


def motion_of_section(s: float, length: float, phi: tuple[float, float]) -> np.ndarray:
    """Twist (6,) of a section of a beam by those of its ends (12,), as under loads at its ends.

    Stretch and torsion are linear. Bending in x-y has, with ``f = 12 E I_z / (G A_y L^2)``, the
    displacement ``((1 - 3 s^2 + 2 s^3 + f (1 - s)) v_1 + (3 s^2 - 2 s^3 + f s) v_2 + L (s - 2 s^2 +
    s^3 + f (s - s^2)/2) r_1 + L (s^3 - s^2 - f (s - s^2)/2) r_2) / (1 + f)``, and sections turn by
    its slope less the shear; in x-z alike, with turns the other way round. The mass matrix that
    follows is the consistent one, with 13/35, 11/210 and 9/70 where ``f`` is zero.

    Parameters
    ----------
    s : float
        Part of the length before the section.
    length : float
        Of the beam, along x [m].
    phi : (float, float)
        f in x-y and in x-z; 0 of a beam without shear.

    Returns
    -------
    (6, 12) array
        Axes of the beam, each twist about its own end or the section [m, rad].

    Notes
    -----
    J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, section 11.3.

    Examples
    --------
    >>> motion_of_section(0.5, 2.0, (0.0, 0.0))[1, [1, 5, 7, 11]]
    array([ 0.5 ,  0.25,  0.5 , -0.25])
    """
    found = np.zeros((6, 12))
    found[[0, 3], [0, 3]], found[[0, 3], [6, 9]] = 1 - s, s
    for v, r, sign, f in ((1, 5, 1.0, phi[0]), (2, 4, -1.0, phi[1])):
        columns, L = [v, r, v + 6, r + 6], sign * length
        bent = s - s**2
        found[v, columns] = (
            1 - 3 * s**2 + 2 * s**3 + f * (1 - s),
            L * (bent * (1 - s) + f * bent / 2),
            3 * s**2 - 2 * s**3 + f * s,
            -L * (bent * s + f * bent / 2),
        )
        found[r, columns] = (
            -6 * bent / L,
            1 - 4 * s + 3 * s**2 + f * (1 - s),
            6 * bent / L,
            3 * s**2 - 2 * s + f * s,
        )
        found[np.ix_([v, r], columns)] /= 1 + f
    return found


def _about(arm: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Twists (6, m) of a body about a point beside that of given ones."""
    return np.concatenate([twists[:3] - skew(arm) @ twists[3:], twists[3:]])


def _axes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Columns: unit vectors along x, across it towards y, and across both."""
    x = x / np.linalg.norm(x)
    y = y - (x @ y) * x
    if np.linalg.norm(y) < _ASIDE:  # of a part whose own axes are not along it
        y = np.eye(3)[np.argmin(np.abs(x))]
        y = y - (x @ y) * x
    y = y / np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def _uniform_beam(part: PlacedSpring, x: np.ndarray) -> UniformBeam | None:
    """The beam that an elastic part along x (3,) is; None where it is none."""
    if part.elasticity.freedoms.size or part.rotation[:, 0] @ x < (1 - _ASIDE) * np.linalg.norm(x):
        return None
    return uniform_beam(part.elasticity.compliance)


@dataclass(frozen=True)
class SmallMotions:
    """Stiffness, masses and closure of all legs and of the platform at a state."""

    K: np.ndarray  # (n, n): second variation of the energy, less the work of loads and wrenches
    # (k, n): B^T B is the mass matrix, of velocities of points times roots of their masses
    B: np.ndarray
    # (c, n): zero for motions that keep the robot together, in robot lengths and radians
    closure: np.ndarray
    size: np.ndarray  # (n,): of a unit of energy in each coordinate, or of motion without

    @staticmethod
    def of(
        problem: EquilibriumProblem, masses: CarriedMasses, known: Linearised, state: State
    ) -> SmallMotions:
        """About a state of a problem, where its equations are known."""
        rows, r, legs = list(problem.rows), problem.size, problem.legs
        number = np.full(legs.numbers.total, -1)
        number[problem.free] = np.arange(len(problem.free))
        n = len(problem.free) + r
        K, stiff = np.zeros((n, n)), np.zeros(n)
        for block, A in zip(problem.blocks, known.equations.A, strict=True):
            m, at = block.free, number[block.coordinates]
            K[at[:, :, None], at[:, None]] = A[:, :m, :m]
            stiff[at] = np.diagonal(unloaded_curvature(legs, block), axis1=-2, axis2=-1)
        K[n - r :, n - r :] += known.K_total - known.K
        B = [np.zeros((0, n)), _rates_of_drives(problem, n)]
        moved = legs.moved(state.legs) if masses.on_legs else []
        for one in masses.on_legs:
            twists = legs.twists(state.legs, state.p, one.spot.chain)
            own = one.velocities(moved[one.spot.chain], twists, state.p)
            B.append(np.concatenate([own[:, problem.free], np.zeros((len(own), r))], axis=1))
        for mass in masses.on_platform:
            b = state.R @ (mass.centre - problem.point)
            rate = np.zeros((3, n))
            rate[:, n - r :] = np.concatenate([np.eye(3), -skew(b)], axis=1)[:, rows]
            B.append(np.sqrt(float(mass.value)) * rate)
        sizes = np.append(problem.units[problem.free], problem.scale / problem.length)
        C = whole_closure(known) * sizes
        return SmallMotions(0.5 * (K + K.T), np.concatenate(B), C, unit_sizes(C, stiff))

    def vibrations(self) -> tuple[np.ndarray, np.ndarray]:
        """Squares of angular frequencies (k,) [rad^2/s^2], slowest first, and motions (k, n).

        The squares are negative where the robot leaves the equilibrium; motions have the kinetic
        energy 1/2 at unit velocity. Those without mass are at rest in the others' balance. Where
        every motion meets stiffness, frequencies are the inverse singular values of ``B`` over
        motions of unit energy: the slow ones keep their digits beside the fast ones.
        """
        Z = self._closed()
        K = Z.T @ self.K @ Z
        w, Q = np.linalg.eigh(K)
        least = _LOOSE * np.max(np.abs(w), initial=0.0)
        if not np.all(w > least):
            return self._loose(Z, K, least)
        unit = Z @ (Q / np.sqrt(w))
        _, values, Vt = np.linalg.svd(self.B @ unit, full_matrices=False)
        heavy = values > _MASSLESS * np.max(values, initial=0.0)
        shapes = (unit @ Vt[heavy].T / values[heavy]).T
        return 1.0 / values[heavy] ** 2, shapes

    def _loose(self, Z: np.ndarray, K: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
        """Where some motion meets no stiffness, or a negative one."""
        B = self.B @ Z
        _, values, Vt = np.linalg.svd(B)
        k = int(np.sum(values > _MASSLESS * np.max(values, initial=0.0)))
        heavy, light = Vt[:k].T / values[:k], Vt[k:].T
        w, Q = np.linalg.eigh(light.T @ K @ light)
        held = np.abs(w) > least
        follow = light @ Q[:, held]
        moved = heavy - follow @ ((follow.T @ K @ heavy) / w[held][:, None])
        squares, own = np.linalg.eigh(moved.T @ K @ moved)
        none = np.abs(squares) <= _LOOSE * np.max(np.abs(squares), initial=0.0)
        return np.where(none, 0.0, squares), (Z @ moved @ own).T

    def _closed(self) -> np.ndarray:
        """Motions (n, k) that keep the robot together."""
        C = self.closure * self.size
        rows = np.linalg.norm(C, axis=1)
        C = C / np.where(rows > 0, rows, 1.0)[:, None]
        _, values, Vt = np.linalg.svd(C)
        rank = int(np.sum(values > _CLOSED * np.max(values, initial=0.0)))
        return Vt[rank:].T * self.size[:, None]


def _rates_of_drives(problem: EquilibriumProblem, size: int) -> np.ndarray:
    """Rates of coordinates and sums times roots of the inertia of their drives (k, size)."""
    legs = problem.legs
    pairs = [(own.drive, a) for own, a in zip(legs.couplings, legs.sum_rows, strict=True)]
    for (c, k), at in legs.places.items():
        element, unit = legs.chains[c].elements[k], np.zeros(legs.numbers.total)
        if isinstance(element, FiniteJoint) and element.inertia:
            unit[legs.numbers.x[at]] = 1.0
            pairs.append((element, unit))
    moving = [np.sqrt(drive.inertia) * a[problem.free] for drive, a in pairs if drive.inertia]
    found = np.zeros((len(moving), size))
    found[:, : len(problem.free)] = np.array(moving).reshape(-1, len(problem.free))
    return found

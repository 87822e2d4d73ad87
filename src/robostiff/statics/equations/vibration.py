"""Small vibrations about an equilibrium: motions that the closure allows, mass and stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.spatial import skew
from robostiff.statics.chains.carried_masses import CarriedMass, CarriedMasses
from robostiff.statics.chains.chain import BodyPlace, FiniteJoint, LegState
from robostiff.statics.chains.legs import LegGroup
from robostiff.statics.equations.problem import EquilibriumProblem, Linearised, State
from robostiff.statics.equations.stability import unit_sizes

# Of the largest singular value: of closure, and of the masses, whose roots are taken.
_CLOSED, _MASSLESS = 1e-10, 1e-9
# Of the largest stiffness, or square of a frequency: nothing resists.
_LOOSE = 1e-10


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
        rows, r = list(problem.rows), problem.size
        n = sum(g.count * g.free_size for g in problem.groups) + r
        K, stiff, at = np.zeros((n, n)), np.zeros(n), 0
        B, closure = [np.zeros((0, n))], []
        for group, eq, own in zip(problem.groups, known.equations, state.legs, strict=True):
            m = group.free_size
            own_stiff = np.diagonal(group.unloaded_curvature, axis1=-2, axis2=-1)
            gaps = group.closure_sizes(problem.length)[:, None]
            B.append(_velocities(group, own, masses.on_legs, state.p, at, n))
            B.append(_rates_of_drives(group, at, n))
            for i in range(group.count):
                here = slice(at, at + m)
                at += m
                K[here, here] = eq.A[i, :m, :m]
                stiff[here] = own_stiff[i]
                closed = np.zeros((eq.A.shape[1] - m, n))
                closed[:, here], closed[:, n - r :] = eq.A[i, m:, :m], eq.A_t[i, m:]
                closure.append(gaps * closed)
                if eq.beside is not None:
                    K[here, n - r :] = eq.A_t[i, :m]
                    K[n - r :, here] = eq.beside.by_unknown[i, :, :m]
                    K[n - r :, n - r :] += eq.beside.by_twist[i]
        K[n - r :, n - r :] += known.K_total - known.K
        for mass in masses.on_platform:
            b = state.R @ (mass.centre - problem.point)
            rate = np.zeros((3, n))
            rate[:, n - r :] = np.concatenate([np.eye(3), -skew(b)], axis=1)[:, rows]
            B.append(np.sqrt(float(mass.value)) * rate)
        C = np.concatenate(closure)
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


def _rates_of_drives(group: LegGroup, first: int, size: int) -> np.ndarray:
    """Rates of coordinates and sums times roots of the inertia of their drives (k, size)."""
    m, found = group.free_size, [np.zeros((0, size))]
    pairs = [(own.drive, a) for own, a in zip(group.couplings, group.sum_rows, strict=True)]
    for chain, own in zip(group.chains, group.coordinates, strict=True):
        for element, place in zip(chain.elements, chain.places, strict=True):
            if isinstance(element, FiniteJoint) and np.any(element.inertia):
                unit = np.eye(m)[own.start + place.start]
                pairs.append((element, np.broadcast_to(unit, (group.count, m))))
    for drive, rates in pairs:
        for row in np.flatnonzero(drive.inertia):
            wide = np.zeros((1, size))
            wide[0, first + row * m : first + (row + 1) * m] = rates[row]
            found.append(np.sqrt(drive.inertia[row]) * wide)
    return np.concatenate(found)


def _velocities(
    group: LegGroup,
    state: LegState,
    masses: Sequence[CarriedMass],
    about: np.ndarray,
    first: int,
    size: int,
) -> np.ndarray:
    """Velocities times roots of the masses on the legs of a group (k, size).

    The unknowns of its legs begin at `first`, among so many of all.
    """
    m, found = group.free_size, [np.zeros((0, size))]
    own = [one for one in masses if one.leg in group.indices]
    twists = group.twists(state, about) if own else []
    moved = group.moved(state) if own else []
    for one in own:
        c, row = group.place_of(one.leg, one.chain)
        bodies = [BodyPlace(place.R[row], place.t[row]) for place in moved[c]]
        rates = one.velocities(bodies, twists[c][row], about)
        wide = np.zeros((len(rates), size))
        wide[:, first + row * m : first + (row + 1) * m] = rates
        found.append(wide)
    return np.concatenate(found)

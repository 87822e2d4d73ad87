"""Beams that bending shortens, so that it meets with axial load; inner modes in balance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.record import square_root, usual_size
from robostiff.spatial import Space, cross

# Of a compliance: shear that is rounding.
_NONE = 1e-9
# Part of the critical load of an inner mode, from which the axial force keeps away.
_NEAREST = 1e-9
# Integrals over s of products of the slopes of inner modes, and of those with the cubic of a turn;
# of products of their third derivatives, less the means. Of the first and the third inner mode.
_SLOPES = np.array([[1 / 42, -(5**0.5) / 420], [-(5**0.5) / 420, 1 / 154]])
_SHEARED = np.array([[60.0, 36 * 5**0.5], [36 * 5**0.5, 360.0]])
_WITH_TURN, _ENDS = (-(5**0.5) / 60, 0.0), (5**0.5, 3.0)


def bending_planes(space: Space, rotation: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Planes in which a beam bends: unit vectors across it and along its turns, in its own axes.

    Two of a robot in space, the plane itself of a planar one; `rotation` (3, 3) has the axes of the
    beam, of numbers or of entries.
    """
    x, y, z = np.eye(3, dtype=int)
    if space is Space.SPATIAL:
        return [(y, z), (z, -y)]
    return [(cross(rotation[2], x), rotation[2])]


@dataclass(frozen=True)
class Bending:
    """How bending shortens beams, by forms z of the motion of the far end that do not mix.

    Under the axial force N the energy of a beam is, beside that of its linear springs, ``sum(h(N)
    z^2) / 2 - (N - k u)^2 / (2 k)``, stationary in N, with ``h = N s - N^2 b / (1 + N l)``, u the
    stretch of the ends and k = EA/L. The forms shorten the line by ``s z^2 / 2``. b and l are those
    of an inner mode, in balance with z: where ``1 + N l`` is zero, it buckles between clamped ends.

    Attributes
    ----------
    z : (..., F, m) array
        F forms by the coordinates of the beam.
    s : (..., F) array
        [1/m] of shifts, [m] of turns.
    b, l : (..., F) arrays
        [1/N] of shifts, [m^2/N] of turns; [1/N]. Zero where there is no inner mode.
    """

    z: np.ndarray
    s: np.ndarray
    b: np.ndarray
    l: np.ndarray

    def terms(self, y: np.ndarray, N: np.ndarray, along: np.ndarray, k: np.ndarray) -> BowingTerms:
        """The energy beside that of linear springs, and what it contributes to equations.

        N is eliminated: with ``q = dz/dy h'(N) z + du/dy`` and ``D = 1/k - sum(h''(N) z^2) / 2``,
        what is stationary in y has the curvature ``sum(h dz/dy dz/dy^T) - k du/dy du/dy^T + q q^T /
        D``, and N follows the coordinates by ``q / D``.

        Parameters
        ----------
        y : (..., m) array
            Coordinates, of numbers or of entries, as all others.
        N, k : (...) arrays
            Axial force, and EA/L; 1 where there is no beam [N, N/m].
        along : (..., m) array
            u by the coordinates.
        """
        z, N_ = (self.z @ y[..., None])[..., 0], N[..., None]
        pivots = self.pivots(N)
        g = 1 / pivots
        h = N_ * self.s - N_ * N_ * self.b * g
        slope = self.s - N_ * self.b * g * (1 + g)
        bend = self.b * g * g * g * 2
        beyond = N - k * (along * y).sum(axis=-1)
        q = along + _times(slope * z, self.z)
        softness = 1 / k + (bend * z * z).sum(axis=-1) * 0.5
        missing = ((slope * z * z).sum(axis=-1) * 0.5 - beyond / k) / softness
        rate = q / softness[..., None]
        return BowingTerms(
            (h * z * z).sum(axis=-1) * 0.5 - beyond * beyond / k * 0.5,
            along * beyond[..., None] + _times(h * z, self.z) + q * missing[..., None],
            np.swapaxes(self.z, -1, -2) @ (self.z * h[..., None])
            - _outer(along * k[..., None], along)
            + _outer(q, rate),
            missing,
            rate,
            pivots,
        )

    def pivots(self, N: np.ndarray) -> np.ndarray:
        """``1 + N l`` (..., F); in numbers, no nearer to zero than digits allow."""
        found = 1 + N[..., None] * self.l
        if found.dtype == object:
            return found
        return np.where(np.abs(found) < _NEAREST, np.copysign(_NEAREST, found), found)

    def with_modes(
        self, y: np.ndarray, N: np.ndarray, along: np.ndarray, k: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Curvature of the energy by coordinates and amplitudes, none of these eliminated.

        By the former (..., m, m), by both (..., F, m), by the latter (..., F, F), that of the modes
        themselves among it; in numbers.
        """
        z, N_, k_ = (self.z @ y[..., None])[..., 0], N[..., None, None], k[..., None, None]
        root, own = np.sqrt(self.b), np.eye(self.l.shape[-1])
        a = -N[..., None] * root * z / self.pivots(N)  # each of which stores a^2 / 2
        of_y = along + _times(self.s * z + root * a, self.z)
        of_a = root * z + self.l * a
        S = np.swapaxes(self.z, -1, -2) @ (self.z * self.s[..., None])
        return (
            _outer(of_y, of_y) * k_ - _outer(along, along) * k_ + N_ * S,
            _outer(of_a, of_y) * k_ + N_ * (root[..., None] * self.z),
            _outer(of_a, of_a) * k_ + (1 + N_ * self.l[..., None]) * own,
        )


@dataclass(frozen=True)
class BowingTerms:
    """What bowing contributes to the equations of beams with m coordinates; see `Bending`."""

    energy: np.ndarray  # (...)
    # (..., m) and (..., m, m): of the energy, the axial force eliminated
    gradient: np.ndarray
    curvature: np.ndarray
    # (...) and (..., m): what the axial force lacks, and how it follows the coordinates
    missing: np.ndarray
    rate: np.ndarray
    pivots: np.ndarray  # (..., F): 1 + N l; positive where inner modes are stable


def _times(v: np.ndarray, M: np.ndarray) -> np.ndarray:
    """``v M`` of vectors (..., i) and matrices (..., i, j)."""
    return (v[..., None, :] @ M)[..., 0, :]


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., :, None] * b[..., None, :]


def bending(
    V: np.ndarray,
    C: np.ndarray,
    L: Any,
    planes: Sequence[tuple[np.ndarray, np.ndarray]],
    *,
    inner: bool,
) -> Bending:
    """How bending shortens one beam, by its cubic between the ends and by inner modes.

    With three inner modes a plane, the deflection at s L is ``w = (3 s^2 - 2 s^3) d + (s^3 - s^2) L
    r + L sum(a_k w_k)``, where w_k and its slope are zero at both ends and its second derivative is
    ``sqrt(2k + 1) P_k(2s - 1)``, k = 2, 3, 4, with Legendre polynomials P_k. The line is then
    shorter by the integral of ``(dw/ds)^2 / (2L)`` over s. Inner modes have the energy ``EI
    sum(a_k^2) / (2L)``, and none with d and r; the axial force couples the second with ``d - L
    r/2``, the first and third with r. In a beam with shear the sections turn by the slopes of w_k;
    the slope of the line is less by ``e`` times the third derivative without its mean, e being ``EI
    / L^2`` times the shear compliance of a unit length.

    Parameters
    ----------
    V : (6, m) array
        ``(d, r)`` of the far end by its coordinates, own axes; of numbers or of entries.
    C : (6, 6) array
        Compliance about its far end, of numbers or of entries.
    L : number or entry
        Length [m].
    planes : sequence of pairs of (3,) arrays
        See `bending_planes`.
    inner : bool
        Whether it has inner modes.

    Returns
    -------
    Bending
        Of one beam.
    """
    forms: list[tuple[np.ndarray, Any, Any, Any]] = []
    for across, turn in planes:
        d, r = across @ V[:3], turn @ V[3:]
        of_shift, of_turn = (d - r * (L * 0.5), 0.2 * (1 / L)), (r, L * (1 / 12))
        forms.append((d, 1 / L, 0, 0))
        if not inner:
            forms += [(*of_shift, 0, 0), (*of_turn, 0, 0)]
            continue
        soft = turn @ C[3:, 3:] @ turn  # L/EI
        e = (across @ C[:3, :3] @ across) * (1 / (soft * L * L)) - 1 / 3
        e = 0 if usual_size(e) <= _NONE else e
        # the second mode: slopes, energy, and slopes with the cubic
        stiff, with_shift = 1 + 140.0 * e, 7**-0.5 / 10 + 2 * 7**0.5 * e
        slopes = 1 / 90 + 2 * e + 140.0 * e * e
        b, l = with_shift * with_shift * (1 / stiff) * soft, slopes * (1 / stiff) * (soft * L)
        forms.append((*of_shift, b, l))
        # the first and the third: c^T (K + N S)^-1 c in partial fractions
        K = np.eye(2, dtype=int) + _SHEARED * e
        S = _SLOPES + np.eye(2) * (2 * e) + _SHEARED * (e * e)
        c = [x - y * e for x, y in zip(_WITH_TURN, _ENDS, strict=True)]
        by = 2 / _determinant(K, K)
        mean, product = _determinant(K, S) * 0.5 * by, _determinant(S, S) * 0.5 * by
        apart = square_root(mean * mean - product)
        first, last = mean + apart, mean - apart
        whole, part = (
            (c[0] * c[0] * M[1, 1] + c[1] * c[1] * M[0, 0] - c[0] * c[1] * M[0, 1] * 2) * by
            for M in (K, S)
        )
        half = 0.5 * (1 / apart) * (soft * L * L)
        forms.append((*of_turn, (whole * first - part) * half, first * (soft * L)))
        forms.append((r, 0, (part - whole * last) * half, last * (soft * L)))
    shapes = (V.shape[1],), (), (), ()
    found = [np.zeros((len(forms), *own), dtype=int).astype(V.dtype) for own in shapes]
    for i, own in enumerate(forms):
        for values, value in zip(found, own, strict=True):
            values[i] = value
    return Bending(*found)


def _determinant(A: np.ndarray, B: np.ndarray) -> Any:
    """Of symmetric (2, 2) arrays: twice the determinant where they are one, bilinear."""
    return A[0, 0] * B[1, 1] + A[1, 1] * B[0, 0] - A[0, 1] * B[0, 1] * 2

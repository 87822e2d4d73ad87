"""Screws that make many turns: steps in which another joint about the same axis takes them back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robostiff.kinematics.frames import place_chain
from robostiff.model import Chain, Joint, JointKind, Locked, ParallelBlock, PlacedFreedom, Telescope

_COAXIAL = 1e-9  # sine, and part of the length
_SEED = 3  # of the postures at which axes are compared


@dataclass(frozen=True)
class PlacedSpin:
    """A screw at some postures, and what takes its turns back."""

    place: int  # of the screw in the coordinate vector of its leg
    back: tuple[int, ...]  # places of a coaxial turn, or of a spherical joint on the axis
    # Angle that advances by the characteristic length, or one radian if that is more [rad]
    unit: float
    shares: np.ndarray  # (N, k): what each of `back` turns where the screw turns by one

    def add_to(self, rates: np.ndarray) -> None:
        """In rates (N, ends, 6, size), the screw's become those of an advance without a turn."""
        own = rates[..., self.place]
        for k, place in enumerate(self.back):
            own = own + self.shares[:, k, None, None] * rates[..., place]
        rates[..., self.place] = self.unit * own

    def take_from(self, step: np.ndarray, back: np.ndarray) -> None:
        """From steps (..., size) so scaled, those of the coordinates, and what is taken back."""
        step[..., self.place] *= self.unit
        for k, place in enumerate(self.back):
            back[..., place] += self.shares[..., k] * step[..., self.place]


@dataclass(frozen=True)
class Spin:
    """A screw, and the joint of the same chain about its axis that can take its turns back.

    A nut advances 100 mm in twenty turns, and nothing but the nut is turned where that joint turns
    back. One step of Newton's method goes that far only where both turn together.
    """

    place: int
    back: tuple[int, ...]
    unit: float

    def after(self, start: int) -> Spin:
        """The same in a vector that has other coordinates before those of the chain."""
        return Spin(self.place + start, tuple(i + start for i in self.back), self.unit)

    def at(self, axes: np.ndarray) -> PlacedSpin:
        """The same at postures with the axes (N, size, 3) of all coordinates."""
        e = axes[:, self.place]
        along = [np.einsum("...i,...i->...", e, axes[:, i]) for i in self.back]
        return PlacedSpin(self.place, self.back, self.unit, -np.stack(along, axis=-1))


def spins_of(chain: Chain, length: float) -> tuple[Spin, ...]:
    """The screws of a chain whose turns another of its joints takes back, at any posture."""
    if chain.is_coupled or not any(screw.turns and screw.slides for screw in chain.freedoms):
        return ()  # what turns back must be free to turn alone
    drawn = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (2, chain.size))
    q = np.where(chain.free, drawn, chain.home)
    freedoms = place_chain(chain, q, np.eye(3), np.zeros(3)).freedoms
    found = []
    for moving in _of_one_chain(chain):
        turning = list(_turning(moving))
        for i in (i for _, where in moving for i in range(where.start, where.stop)):
            screw = freedoms[i]
            if not (screw.turns and screw.slides) or not chain.free[i]:
                continue
            fits = [back for back in turning if _is_on_axis(screw, [freedoms[k] for k in back])]
            if fits:
                nearest = min(fits, key=lambda back: abs(back[0] - i))
                unit = max(1.0, length / abs(float(screw.pitch)))
                found.append(Spin(i, nearest, unit))
    return tuple(found)


_Moving = list[tuple[Joint | Telescope, slice]]


def _of_one_chain(chain: Chain, start: int = 0) -> Iterator[_Moving]:
    """What moves, with its places, in the branches of blocks and in the chain itself."""
    own: _Moving = []
    for element in chain.elements:
        if isinstance(element, ParallelBlock):
            for branch in element.branches:
                yield from _of_one_chain(branch.chain, start)
                start += branch.chain.size
        elif isinstance(element, Joint | Telescope):
            own.append((element, slice(start, start + len(element.freedoms))))
            start += len(element.freedoms)
    yield own


def _turning(moving: _Moving) -> Iterator[tuple[int, ...]]:
    """Places of pure turns, each alone, and of spherical joints, all three."""
    for element, where in moving:
        places = tuple(range(where.start, where.stop))
        if isinstance(element.role, Locked):
            continue
        if isinstance(element, Joint) and element.kind is JointKind.SPHERICAL:
            yield places
        else:
            yield from (
                (i,) for i, screw in zip(places, element.freedoms, strict=True) if screw.is_rotation
            )


def _is_on_axis(screw: PlacedFreedom, back: list[PlacedFreedom]) -> bool:
    """Whether the axis of a turn is that of a screw, or a spherical joint is on it."""
    apart = back[0].point - screw.point
    size = np.linalg.norm(apart, axis=-1).max() + abs(float(screw.pitch))
    off = np.linalg.norm(np.cross(screw.axis, apart), axis=-1).max()
    turned = 0.0
    if len(back) == 1:
        turned = float(np.linalg.norm(np.cross(screw.axis, back[0].axis), axis=-1).max())
    return bool(off <= _COAXIAL * size and turned <= _COAXIAL)

"""Coupled joints in finite motion: sums of their coordinates, held by springs or rigidly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from robostiff.statics.chains.element import FiniteJoint, stacked
from robostiff.statics.chains.leg_state import LegState, Share

if TYPE_CHECKING:
    from robostiff.statics.chains.legs import LegGroup


@dataclass(frozen=True)
class FiniteCoupling:
    """A gear or differential: a sum ``s = sum(a q)`` of joint coordinates, and what holds it."""

    drive: FiniteJoint  # the joint that follows, with the stiffness, preload and law against s
    is_rigid: bool  # whether s stays 0
    place: tuple[int, int]  # chain and element of the joint that follows
    terms: tuple[tuple[int, int], ...]  # the same of all joints that move
    factors: np.ndarray  # (N, k): a, of each leg

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return (self.is_rigid, self.place, self.terms)

    @staticmethod
    def stacked(couplings: Sequence[FiniteCoupling]) -> FiniteCoupling:
        """The same coupling of several legs."""
        drive = stacked([own.drive for own in couplings])
        return replace(
            couplings[0], drive=drive, factors=np.concatenate([own.factors for own in couplings])
        )

    def shifted(self, chains: int) -> FiniteCoupling:
        """The same behind so many other chains."""
        first, *terms = ((c + chains, k) for c, k in (self.place, *self.terms))
        return replace(self, place=first, terms=tuple(terms))

    def pushed(self, preload: float) -> FiniteCoupling:
        """The same with more preload."""
        return replace(self, drive=replace(self.drive, preload=self.drive.preload + preload))


def add_couplings(
    group: LegGroup,
    state: LegState,
    share: Share,
    A: np.ndarray,
    r: np.ndarray,
    r_factor: np.ndarray,
) -> None:
    """Add the couplings of legs to their equations: closures ``s = 0`` of rigid ones, else energy.

    A, r and r_factor are those of `LegEquations`, changed in place.
    """
    m, at = group.free_size, group.size - state.held.shape[1]
    for own, a, s in zip(group.couplings, group.sum_rows, group.sums(state), strict=True):
        if own.is_rigid:
            A[:, at, :m] += a
            A[:, :m, at] -= a
            r[:, at] += s
            r[:, :m] -= a * state.held[:, [at - group.size]]
            at += 1
            continue
        f, k = (
            np.array([each(i, float(q)) for i, q in enumerate(s)])[:, None]
            for each in (own.drive.force, own.drive.tangent)
        )
        push = own.drive.preload[:, None]
        A[:, :m, :m] += (k * a)[:, :, None] * a[:, None]
        r[:, :m] += (f - share.value * push) * a
        r_factor[:, :m] -= share.rate * push * a

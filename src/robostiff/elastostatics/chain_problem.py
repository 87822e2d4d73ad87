"""What a form of K_C is, what it needs, and its input."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import ClassVar

import numpy as np

from robostiff.elastostatics.tolerance import Tolerance, smallest_compliance
from robostiff.frozen import frozen, replace
from robostiff.spatial import Space

# Rounding that grows by more than this leaves no nine digits.
_NINE_DIGITS = 1e-6


@frozen
class ChainProblem:
    """A chain in scaled coordinates, where translations and rotations are both lengths."""

    C: np.ndarray  # (..., n, n): compliance with the passive joints held
    J_q: np.ndarray  # (..., n, q): unit twists of the passive joints
    # (..., n, m): orthonormal basis of the transmitted wrenches, padded with zero columns
    W: np.ndarray
    # (..., q) of bool: passive joints that add no freedom to those before them
    redundant: np.ndarray
    margins: np.ndarray  # (..., q): how far each unit twist lies from the span of those before it
    tolerance: Tolerance

    @cached_property
    def compliance_ratio(self) -> np.ndarray:
        """Smallest compliance under a transmitted wrench, as a part of the trace of C."""
        return smallest_compliance(self.C, self.W)

    @property
    def rigid(self) -> np.ndarray:
        """Whether a transmitted wrench is rigid (...)."""
        return self.compliance_ratio <= self.tolerance.rigidity

    @cached_property
    def regularity(self) -> np.ndarray:
        """Smallest eigenvalue of C, as a part of its trace (...)."""
        every_wrench = np.broadcast_to(np.eye(self.C.shape[-1]), self.C.shape)
        return smallest_compliance(self.C, every_wrench)

    @property
    def regular(self) -> np.ndarray:
        """Whether C can be inverted, rank(J_theta) = n (...)."""
        return self.regularity > self.tolerance.rigidity

    def costs_digits(self, K: np.ndarray, other: np.ndarray, regularity: np.ndarray) -> np.ndarray:
        """Where more than six digits are lost (...).

        The smaller diagonal block of K is as small a part of another matrix as what regularity has
        left; near dependence of joints costs digits besides. A block in which no wrench is
        transmitted has no stiffness, whatever rounding leaves there.
        """
        t = Space.of_size(K.shape[-1]).translations
        diagonal = np.abs(np.einsum("...ii->...i", K))
        transmitted = np.abs(self.W).max(axis=-1, initial=0.0)
        blocks, carried = (
            np.stack([values[..., :t].max(axis=-1), values[..., t:].max(axis=-1)], axis=-1)
            for values in (diagonal, transmitted)
        )
        whole = np.einsum("...ii->...i", other).max(axis=-1)[..., None]
        part = blocks / np.where(whole > 0, whole, 1.0)
        part = np.min(np.where(carried > self.tolerance.rounding, part, 1.0), axis=-1)
        near = np.any(~self.redundant & (self.margins**2 < _NINE_DIGITS), axis=-1)
        return np.asarray((regularity * part < _NINE_DIGITS) | near)

    @property
    def dependent(self) -> np.ndarray:
        """Whether some passive joint is redundant (...)."""
        return np.any(self.redundant, axis=-1)

    @cached_property
    def K0(self) -> np.ndarray:
        """Stiffness without passive joints, C^-1; the identity where C has no inverse."""
        identity = np.eye(self.C.shape[-1])
        return np.linalg.inv(np.where(self.regular[..., None, None], self.C, identity))

    def without(self, refused: np.ndarray) -> ChainProblem:
        """Another chain where it is refused (...), so that these poses do not stop the others."""
        if not np.any(refused):
            return self
        n, q = self.J_q.shape[-2:]
        chosen = refused[..., None, None]
        return replace(
            self,
            C=np.where(chosen, np.eye(n), self.C),
            J_q=np.where(chosen, np.eye(n, q), self.J_q),
            redundant=self.redundant | refused[..., None],
        )


class Form(ABC):
    """A form of K_C: a small frozen object with its own options."""

    #: Name on the command line and in results.
    name: ClassVar[str]
    #: The formula, with its number in the paper.
    equation: ClassVar[str]
    #: What it needs of a chain.
    needs: ClassVar[tuple[Need, ...]] = ()

    @abstractmethod
    def stiffness(self, problem: ChainProblem) -> np.ndarray:
        """K of a scaled chain that has all that the form needs (..., n, n)."""

    def loses_digits(self, problem: ChainProblem, K: np.ndarray) -> np.ndarray:
        """Where K, by the nature of the form, has fewer digits than asked for (...).

        A K that began with K0 = C^-1 has lost the condition of C, and what it has less than K0.
        """
        return problem.costs_digits(K, problem.K0, problem.regularity)


@frozen
class Need:
    """Something that a form needs of a chain, and why."""

    missing: Callable[[ChainProblem], np.ndarray]  # where it has it not (...)
    reason: str


REGULAR = Need(
    lambda chain: ~chain.regular,
    "it inverts the compliance of the chain, which is singular (rank(J_theta) < n)",
)
INDEPENDENT = Need(
    lambda chain: chain.dependent, "it needs independent passive joints, and some are redundant"
)
WELL_APART = Need(
    lambda chain: np.any(
        ~chain.redundant & (chain.margins**2 <= chain.tolerance.rigidity), axis=-1
    ),
    "a passive joint is so nearly redundant that stiffness along it is rounding",
)
COMPLIANT = Need(
    lambda chain: chain.rigid, "a transmitted wrench meets no compliance, so its matrix is singular"
)

"""Angles that are multiples of each other: phi and phi / 2 share one sine and one cosine."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from typing import Any

import sympy as sp


@dataclass(frozen=True)
class Angles:
    """Angles whose sines and cosines are generators.

    Attributes
    ----------
    independent : tuple of SymPy expressions
        None is a rational multiple of another.
    shares : dict
        For directions with several multiples, the one of which all are whole multiples:
        ``{phi: 1/2}`` for phi and phi / 2.
    """

    independent: tuple[Any, ...]
    shares: dict[Any, Any]

    @classmethod
    def of(cls, angles: Iterable[Any]) -> Angles:
        """Independent angles for some angles.

        Examples
        --------
        >>> phi, psi = sp.symbols("phi psi")
        >>> Angles.of([phi, phi / 2, phi / 3, psi / 2]).independent
        (phi/6, psi/2)
        """
        multiples: dict[Any, list[Any]] = {}
        for angle in angles:
            multiple, direction = angle.as_coeff_Mul(rational=True)
            multiples.setdefault(direction, []).append(multiple)
        shares = {
            direction: reduce(sp.gcd, found)
            for direction, found in multiples.items()
            if len(found) > 1
        }
        independent = [
            shares.get(direction, found[0]) * direction for direction, found in multiples.items()
        ]
        return cls(tuple(sorted(independent, key=str)), shares)

    def expanded(self, function: Any) -> Any | None:
        """A sine or cosine in those of the independent angles; None for anything else."""
        if not isinstance(function, sp.sin | sp.cos):
            return None
        argument: Any = function.args[0]
        multiple, direction = argument.as_coeff_Mul(rational=True)
        share = self.shares.get(direction)
        if share is None or multiple == share or not (multiple / share).is_Integer:
            return None
        angle = sp.Dummy()
        whole: Any = sp.expand_trig(function.func(multiple / share * angle))
        return whole.xreplace({angle: share * direction})

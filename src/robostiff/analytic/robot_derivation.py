"""The derivation of a robot's stiffness, leg by leg."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Definition, Derivation


@dataclass(frozen=True)
class LegDerivation:
    """Transmitted wrenches and compliances of a leg.

    Attributes
    ----------
    name : str
    joints : tuple of str
        Its passive freedoms.
    redundant : tuple of str
        Those that add no freedom to the ones before.
    elastic : tuple of str
        Its elastic parts and drives.
    wrenches : tuple of sympy.ImmutableMatrix
        The wrenches (n x 1) that its passive joints transmit, about the reference point, world
        axes; conjugate to one another, of any length.
    compliances : tuple of sympy.Expr
        Compliance of each wrench: K_leg = sum of w w^T / c.
    K : sympy.ImmutableMatrix or None
        Stiffness (n x n) about the reference point, world axes; None in steps.
    definitions : tuple of Definition
        Intermediates that the leg is the first to need.
    """

    name: str
    joints: tuple[str, ...]
    redundant: tuple[str, ...]
    elastic: tuple[str, ...]
    wrenches: tuple[sp.ImmutableMatrix, ...]
    compliances: tuple[sp.Expr, ...]
    K: sp.ImmutableMatrix | None
    definitions: tuple[Definition, ...] = ()


@dataclass(frozen=True)
class Condition:
    """A condition under which a formula holds.

    Attributes
    ----------
    words : str
        Such as "leg 'ram' meets the platform".
    expression : sympy.Expr
        In given symbols; not negative where it holds.
    """

    words: str
    expression: sp.Expr


@dataclass(frozen=True)
class RobotDerivation(Derivation):
    """The stiffness matrix of a robot as a formula, with the derivation of its legs.

    Attributes
    ----------
    legs : tuple of LegDerivation
    where : str
        The pose, in words.
    coordinates : tuple of str
        Names of the symbols of the pose.
    following : tuple of str
        Names of the symbols that the legs decide: coordinates of the platform or of joints, which
        are those at which the legs close, and not free to choose.
    conditions : tuple of Condition
        What must hold besides regular denominators and roots.
    """

    legs: tuple[LegDerivation, ...] = ()
    where: str = ""
    coordinates: tuple[str, ...] = ()
    following: tuple[str, ...] = ()
    conditions: tuple[Condition, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        own = (self.name, self.K0, self.stages, self.K, self.definitions, None)
        of_robot = (self.legs, self.where, self.coordinates, self.following, self.conditions)
        return RobotDerivation, (*own, *of_robot)

"""The derivation of a robot's stiffness, leg by leg."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any, Self

import sympy as sp

from robostiff.analytic.derivation import Derivation, Formula
from robostiff.analytic.exact.definition import Definition, Unwritten, WrittenField, WrittenWhole
from robostiff.analytic.substitution import Substitution, at_values
from robostiff.analytic.vectors.forms import InSeries, VectorForm


@dataclass(frozen=True)
class LegDerivation(WrittenWhole):
    """Transmitted wrenches and compliances of a leg.

    A closed form writes wrenches, compliances and K in SymPy when they are first looked at.

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
    wrenches: WrittenField = WrittenField()
    compliances: WrittenField = WrittenField()
    K: WrittenField = WrittenField()
    definitions: tuple[Definition, ...] = ()


@dataclass(frozen=True)
class InNames(Formula):
    """A closed form as a person writes it: with names for lengths, beams and compliances.

    Attributes
    ----------
    K : sympy.ImmutableMatrix
        Sum of w w^T / c in names.
    legs : tuple of LegDerivation
        Their wrenches and compliances in names; without K.
    definitions : tuple of Definition
        What the names stand for, in the order in which they can be computed.
    before : InNames or None
        The same without names for components of unit vectors; None where there are none.
    """

    K: sp.ImmutableMatrix
    legs: tuple[LegDerivation, ...]
    definitions: tuple[Definition, ...]
    before: InNames | None = field(default=None, compare=False, repr=False)
    _: KW_ONLY
    name: str = "K_C"
    conditions: WrittenField = WrittenField(())
    meanings: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    following: tuple[str, ...] = ()

    keeps_numbers = is_of_legs = True

    @property
    def in_lengths(self) -> tuple[sp.ImmutableMatrix, tuple[Definition, ...]]:
        """K and its names without those of components: what is zero in it is seen at once."""
        return (self.K, self.definitions) if self.before is None else self.before.in_lengths


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
    remark : str
        Why it is in steps where a closed form was to be expected; empty otherwise.
    named : InNames or None
        The same in names, where every leg holds by unit wrenches that share no energy.
    at_vector_level : VectorForm, InSeries or None
        The same at vector level, found when it is first looked at; see `vectors`.
    general_rank : int or None
        Rank of K in numbers, at the random parameters and poses at which the formula was compared
        with them; None after `subs`.
    steps_asked : bool
        Whether named steps were asked for by `Steps()`; exports write them beside `vectors` then.
    """

    legs: tuple[LegDerivation, ...] = ()
    where: str = ""
    coordinates: tuple[str, ...] = ()
    following: tuple[str, ...] = ()
    remark: str = ""
    named: InNames | None = field(default=None, compare=False)
    at_vector_level: WrittenField = WrittenField(None)
    general_rank: int | None = field(default=None, compare=False)
    steps_asked: bool = field(default=False, compare=False)

    is_of_legs = True

    @property
    def as_printed(self) -> tuple[tuple[Any, ...], tuple[Definition, ...]]:
        """K in names, where it has some, and what these stand for."""
        return super().as_printed if self.named is None else self.named.as_printed

    @property
    def vectors(self) -> VectorForm | None:
        """One generic leg, a table of what differs, and the sum; None of other legs than these.

        Struts, rods on slides and cranks, and two links have one by their wrenches; legs with one
        chain have one by their springs, in joint coordinates or by the axes of their joints.

        Found when first looked at, and compared with the numerical form.
        """
        form = self.at_vector_level
        return form if isinstance(form, VectorForm) and not form.is_arm else None

    @property
    def in_series(self) -> InSeries | VectorForm | None:
        """The compliance of a serial arm, a sum over its springs; None of others.

        Entry by entry, or in vectors where these would be long. Found when first looked at, and
        compared with the numerical form.
        """
        form = self.at_vector_level
        return None if form is None or form is self.vectors else form

    def __hash__(self) -> int:
        return hash((self.name, self.where, self.coordinates))

    def __repr__(self) -> str:
        return f"<RobotDerivation of {self.name!r}, {len(self.legs)} legs>"

    def _at_values(self, put_in: Substitution) -> Self:
        bare = replace(self, named=None, at_vector_level=None)
        found = super(RobotDerivation, bare)._at_values(put_in)
        left = {x.name for x in found.symbols}
        own: dict[str, Any] = {
            "conditions": found.conditions,
            "following": tuple(name for name in self.following if name in left),
        }

        def with_names(form: Any) -> Any:
            if form is None:
                return None
            fresh = Substitution(put_in.values)
            return at_values(replace(form, **own), fresh, with_numbers=True)

        return replace(
            found,
            coordinates=tuple(name for name in self.coordinates if name in left),
            following=own["following"],
            named=with_names(self.named),
            at_vector_level=Unwritten(lambda: with_names(self.at_vector_level)),
            general_rank=None,
        )

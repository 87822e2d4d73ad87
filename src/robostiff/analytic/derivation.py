"""Formulas: what all of them can do, and those of chains, of robots, of their legs and levels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import KW_ONLY
from typing import Any, ClassVar, Self

import sympy as sp

from robostiff.analytic.exact.definition import Definition, Unwritten, WrittenField, WrittenWhole
from robostiff.analytic.substitution import (
    Substitution,
    at_values,
    refuse_failing,
    refuse_names_of_steps,
    refuse_negative,
    refuse_undefined,
    values_of_symbols,
)
from robostiff.errors import InputError
from robostiff.frozen import field, frozen, replace


@frozen
class Formula(WrittenWhole):
    """A stiffness, or what follows from one, in given symbols, perhaps by named steps.

    Attributes
    ----------
    name : str
    conditions : tuple of Condition
        What must hold besides regular denominators and roots.
    meanings : mapping of str to str
        Of given symbols, such as "length, 0.35 m in the model".
    following : tuple of str
        Names of the symbols that the legs decide: coordinates of the platform or of joints, which
        are those at which the legs close, and not free to choose.
    named : InNames or None
        The same in names, where every leg holds by unit wrenches that share no energy.
    at_vector_level : VectorForm or None
        The same at vector level, found when it is first looked at.
    general_rank : int or None
        Rank of K in numbers, at the random parameters and poses at which the formula was compared
        with them; None after `subs`.
    steps_asked : bool
        Whether named steps were asked for by `Steps()`; exports write them beside the vectors then.
    """

    _: KW_ONLY
    name: str = "K_C"
    conditions: WrittenField = WrittenField(())
    meanings: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    following: tuple[str, ...] = ()
    named: InNames | None = field(default=None, compare=False)
    at_vector_level: WrittenField = WrittenField(None)
    general_rank: int | None = field(default=None, compare=False)
    steps_asked: bool = field(default=False, compare=False)

    #: Whether it gives the wrench of a twist; a compliance gives the twist of a wrench.
    is_stiffness: ClassVar[bool] = True
    #: Whether names stay that were those of numbers, where values are put in.
    keeps_numbers: ClassVar[bool] = False
    #: Whether a negative stiffness says that the legs do not reach.
    is_of_legs: ClassVar[bool] = False
    #: Methods that the face of the package gives to all formulas; they are written above this one.
    lambdify: ClassVar[Any]
    latex: ClassVar[Any]
    _repr_html_: ClassVar[Any]

    @property
    def definitions(self) -> tuple[Definition, ...]:
        """Named intermediates in the order in which they can be computed; none in closed form."""
        return ()

    @property
    def matrices(self) -> tuple[Any, ...]:
        """What it gives: K, of which a derivative has two matrices, and a compliance another."""
        formula: Any = self
        return (formula.K,)

    @property
    def as_printed(self) -> tuple[tuple[Any, ...], tuple[Definition, ...]]:
        """Its matrices and steps as they are printed and computed: in names, where it has some."""
        formula = self.named or self
        return formula.matrices, formula.definitions

    @property
    def is_closed(self) -> bool:
        """Whether it is written in the given symbols alone."""
        return not self.definitions

    @property
    def _expressions(self) -> Iterator[Any]:
        """What it consists of: matrices, conditions, steps."""
        yield from (x for M in self.matrices for x in M)
        yield from (c.expression for c in self.conditions)
        yield from (d.expression for d in self.definitions)

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """The given symbols, those of conditions among them, in alphabetical order."""
        found = set().union(*(e.free_symbols for e in self._expressions))
        return tuple(sorted(found - {d.symbol for d in self.definitions}, key=str))

    @property
    def free_symbols(self) -> set[sp.Symbol]:
        """The given symbols as a set, as SymPy's expressions have them."""
        return set(self.symbols)

    @property
    def _known(self) -> set[sp.Symbol]:
        """Symbols that may have values."""
        return self.free_symbols

    def subs(self, values: Any, value: Any = None) -> Self:
        """The same with numbers or formulas in place of some of its symbols.

        Steps that become numbers are put in where they are used.

        Parameters
        ----------
        values : mapping of str or Symbol to numbers, quantities or formulas
            In SI units; quantities of pint are converted. Exact numbers such as ``Rational(3, 4)``
            stay exact, floats make floats.
        value : number, quantity or formula, optional
            For a single symbol: ``subs("h", 0.75)``.

        Raises
        ------
        InputError
            When a name is no symbol of the formula, or the formula does not hold at these values.
        """
        given = {values: value} if value is not None else values
        if not isinstance(given, Mapping):
            expected = "names or symbols with their values"
            hint = 'write subs({"h": 0.75})'
            raise InputError("values of symbols", got=given, expected=expected, hint=hint)
        subject = f"formula {self.name!r}"
        chosen = values_of_symbols(sorted(self._known, key=str), given, subject)
        refuse_names_of_steps(chosen, self.definitions)
        found = self._at_values(Substitution(chosen))
        refuse_undefined(found._expressions, subject)
        return found

    def _at_values(self, put_in: Substitution) -> Self:
        """The same with values put in; InputError where a condition fails."""
        put_in.definitions(self.definitions)
        refuse_failing(self.conditions, put_in, f"formula {self.name!r}")
        keeps = self.keeps_numbers
        fresh = Substitution(put_in.values) if keeps else put_in
        found: Any = at_values(self, fresh, with_numbers=keeps)
        if self.is_of_legs:
            refuse_negative(found.matrices[0], f"formula {self.name!r}")
        conditions = tuple(c for c in found.conditions if c.expression.free_symbols)
        return replace(found, conditions=conditions) if self.conditions else found

    def substituted(self, values: Mapping[Any, Any]) -> Any:
        """K at given values of its symbols, the definitions computed one after the other.

        Symbols without a value stay: ``substituted({})`` is K with its steps written out.

        Parameters
        ----------
        values : mapping of str or Symbol to numbers, quantities or formulas
            As for `subs`; beside values of all symbols, other names are not used.

        Returns
        -------
        Matrix, or a tuple of K and dK of a derivative

        Raises
        ------
        InputError
            When the formula does not hold there, or is too long to be written out.
        """
        return self._with_values(values)

    def _with_values(self, values: Mapping[Any, Any], digits: int = 0) -> Any:
        """K as of `substituted`; numbers are exact, or have so many digits."""
        symbols = self.symbols
        names, known = {str(key) for key in values}, {s.name for s in symbols}
        if names - known and known - names:
            raise InputError(
                "values of symbols",
                got=", ".join(sorted(names - known)),
                expected=", ".join(sorted(known)),
            )
        given = {str(key): value for key, value in values.items() if str(key) in known}
        where = f"formula {self.name!r}"
        put_in = Substitution(values_of_symbols(symbols, given, where), digits)
        put_in.definitions(self.definitions, are_put_in=True)
        refuse_failing(self.conditions, put_in, where)
        found = [put_in.matrix(M) for M in self.matrices]
        refuse_undefined((x for M in found for x in M), where)
        if self.is_of_legs:
            refuse_negative(found[0], where)
        return tuple(found) if len(found) > 1 else found[0]

    def evalf(self, n: int = 15, subs: Mapping[Any, Any] | None = None) -> Any:
        """The same in n digits, at values of all or some of the symbols.

        Parameters
        ----------
        n : int
            Digits.
        subs : mapping of str or Symbol to numbers, quantities or formulas, optional
            In SI units; symbols without a value stay.

        Returns
        -------
        Matrix, or a tuple of two of a derivative

        Raises
        ------
        InputError
            When the formula does not hold at these values.
        """
        found = self._with_values(subs or {}, 0 if self.symbols and not subs else n)
        return tuple(M.evalf(n) for M in found) if isinstance(found, tuple) else found.evalf(n)


@frozen
class Stage(WrittenWhole):
    """One passive joint, eq. (15): u = K J, mu = J^T u, K <- K - u u^T / mu.

    A closed form writes u, mu and K in SymPy when they are first looked at.

    Attributes
    ----------
    joint : str
        Name of the joint.
    J : sympy.ImmutableMatrix
        Its column of J_q (n x 1).
    rule : str
        In words what the stage does, such as "trivial joint (19): row and column 6 vanish".
    u : sympy.ImmutableMatrix
        (n x 1).
    mu : sympy.Expr
        0 for a redundant joint, which leaves K unchanged.
    K : sympy.ImmutableMatrix
        Stiffness after the joint (n x n).
    definitions : tuple of Definition
        Intermediates that this stage names, in order; empty in closed form.
    """

    joint: str
    J: WrittenField = WrittenField()
    rule: str  # pyright: ignore[reportGeneralTypeIssues]
    u: WrittenField = WrittenField()
    mu: WrittenField = WrittenField()
    K: WrittenField = WrittenField()
    definitions: tuple[Definition, ...] = ()

    @property
    def is_redundant(self) -> bool:
        """Whether the joint adds no freedom to those before it."""
        return self.mu == 0


@frozen
class Derivation(Formula):
    """A stiffness matrix as a formula, with its derivation; see `Formula` for what all have.

    A closed form writes K in SymPy when it is first looked at.

    Attributes
    ----------
    K0 : sympy.ImmutableMatrix
        Stiffness without passive joints (n x n).
    stages : tuple of Stage
        One a passive joint, in the order of elimination.
    K : sympy.ImmutableMatrix
        The result (n x n), in symbols given or defined.
    definitions : tuple of Definition
        All named intermediates in the order in which they can be computed; empty in closed form.
    """

    name: str = field()  # the first argument, without a default
    K0: WrittenField = WrittenField()
    stages: tuple[Stage, ...]  # pyright: ignore[reportGeneralTypeIssues]
    K: WrittenField = WrittenField()
    definitions: tuple[Definition, ...] = ()  # pyright: ignore[reportIncompatibleMethodOverride]

    @property
    def _known(self) -> set[sp.Symbol]:
        # Some of those from which it begins cancel in K.
        found = self.free_symbols.union(*(s.J.free_symbols for s in self.stages))
        return found | self.K0.free_symbols - {d.symbol for d in self.definitions}


@frozen
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
    wrenches: WrittenField = WrittenField(())
    compliances: WrittenField = WrittenField(())
    K: WrittenField = WrittenField(None)
    definitions: tuple[Definition, ...] = ()


@frozen
class InNames(Formula):
    """A closed form as a person writes it: with names for lengths, beams and compliances."""

    K: sp.ImmutableMatrix  #: sum of w w^T / c in names
    legs: tuple[LegDerivation, ...]  #: their wrenches and compliances in names; without K
    #: what the names stand for, in the order in which they can be computed
    definitions: tuple[Definition, ...] = ()  # pyright: ignore[reportIncompatibleMethodOverride]

    keeps_numbers = is_of_legs = True


@frozen
class RobotDerivation(Derivation):
    """The stiffness matrix of a robot as a formula, with the derivation of its legs.

    Symbols that the legs decide are in `following`; see `Formula` for what all formulas have.

    Attributes
    ----------
    legs : tuple of LegDerivation
    where : str
        The pose, in words.
    coordinates : tuple of str
        Names of the symbols of the pose.
    remark : str
        Why it is in steps where a closed form was to be expected; empty otherwise.
    """

    legs: tuple[LegDerivation, ...] = ()
    where: str = ""
    coordinates: tuple[str, ...] = ()
    remark: str = ""

    is_of_legs = True

    @property
    def vectors(self) -> Any:
        """A `VectorForm`: one generic leg, a table of what differs, the sum; None of other legs.

        Struts, rods on slides and cranks, and two links have one by their wrenches; legs with one
        chain have one by their springs, in joint coordinates or by the axes of their joints.

        Found when first looked at, and compared with the numerical form.
        """
        form = self.at_vector_level
        return None if form is None or form.is_arm else form

    @property
    def in_series(self) -> Any:
        """The compliance of a serial arm, a sum over its springs; None of others.

        Entry by entry, an `InSeries`, or in vectors where these would be long. Found when first
        looked at, and compared with the numerical form.
        """
        form = self.at_vector_level
        return form if form is not None and form.is_arm else None

    def __hash__(self) -> int:
        return hash((self.name, self.where, self.coordinates))

    def __repr__(self) -> str:
        return f"<RobotDerivation of {self.name!r}, {len(self.legs)} legs>"

    def _at_values(self, put_in: Substitution) -> Self:
        bare = replace(self, named=None, at_vector_level=None, general_rank=None)
        found = super(RobotDerivation, bare)._at_values(put_in)
        names = {x.name for x in found.symbols}
        following = tuple(name for name in self.following if name in names)

        def at_level(form: Any) -> Any:
            if form is None:
                return None
            whole = replace(form, conditions=found.conditions, following=following)
            return at_values(whole, Substitution(put_in.values), with_numbers=True)

        return replace(
            found,
            coordinates=tuple(name for name in self.coordinates if name in names),
            following=following,
            named=at_level(self.named),
            at_vector_level=Unwritten(lambda: at_level(self.at_vector_level)),
        )


@frozen
class SnapshotFormula(Formula):
    """Stiffness of a robot and of its legs about the reference point, world axes.

    Attributes
    ----------
    K : sympy.ImmutableMatrix
        (n x n), every entry a sum of canonical fractions, those over one denominator added.
    legs : tuple of sympy.ImmutableMatrix
        Stiffness of each leg; they add up to K.
    """

    K: sp.ImmutableMatrix
    legs: tuple[sp.ImmutableMatrix, ...]

    is_of_legs = True

"""Names for intermediates, elimination by them, conditions of a formula, and how long it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import field, fields
from typing import Any

import sympy as sp
from sympy.core.cache import cacheit

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen


@frozen
class Definition:
    """A named intermediate: ``symbol = expression`` of symbols given or defined before."""

    symbol: sp.Symbol
    expression: sp.Expr
    #: beams or drives of which it is a stiffness, or materials of which it is a modulus
    parts: tuple[str, ...] = field(default=(), compare=False, repr=False)
    unit: str = field(default="", compare=False, repr=False)  #: of the stiffness of a drive


def used_definitions(
    definitions: Sequence[Definition], results: Iterable[Any]
) -> tuple[Definition, ...]:
    """The definitions that results need, directly or through others, in order."""
    wanted = {symbol for result in results for symbol in result.free_symbols}
    kept = []
    for definition in reversed(definitions):
        if definition.symbol in wanted:
            kept.append(definition)
            wanted |= definition.expression.free_symbols
    return tuple(reversed(kept))


def in_given_symbols(definitions: Iterable[Definition]) -> dict[Any, Any]:
    """What names stand for, by symbol, without the other names among them."""
    found: dict[Any, Any] = {}
    for d in definitions:
        found[d.symbol] = d.expression.xreplace(found)
    return found


class NamedSteps:
    """Gives names to scalars that are more than a symbol or a number.

    `taken`: names that stand for something else; `definitions`: of the names, in order, given ones
    first.
    """

    def __init__(self, taken: Iterable[str] = (), definitions: Sequence[Definition] = ()) -> None:
        self.definitions: list[Definition] = list(definitions)
        symbols = (s for d in definitions for s in (d.symbol, *d.expression.free_symbols))
        self.taken: set[str] = {*taken, *map(str, symbols)}

    def named(self, name: str, value: Any) -> Any:
        """A new name for a scalar; symbols and numbers need none."""
        if value.is_Atom or (-value).is_Atom:
            return value
        while name in self.taken:
            name += "'"
        self.taken.add(name)
        self.definitions.append(Definition(sp.Symbol(name, real=True), value))
        return self.definitions[-1].symbol

    def eliminate(self, K: Any, J: Any, index: str) -> tuple[Any, Any, sp.ImmutableMatrix]:
        """K J = u, J^T u = mu and K - u u^T / mu, by names u_i_j, mu_i and K_i_jk, eq. (15).

        A joint along one coordinate takes the index rule (19), (20): its row and column vanish.

        `K`: (n, n) SymPy matrix: before; `J`: (n, 1) SymPy matrix: twist of the joint; `index`:
        what stands behind the letters of names, such as ``_1_``.
        """
        n, joint = K.rows, index.rstrip("_")
        used = [k for k in range(n) if J[k] != 0]
        alone = used[0] if len(used) == 1 else None
        u = [sp.Add(*(K[j, k] * J[k] for k in used)) for j in range(n)]
        if alone is None:
            u = [self.named(f"u{index}{j + 1}", entry) for j, entry in enumerate(u)]
        mu = sp.Add(*(J[k] * u[k] for k in used))
        if alone is None:
            mu = self.named(f"mu{joint}", mu)
        after = {}
        for i, j in _upper(K):
            entry = K[i, j] - u[i] * u[j] / mu if u[i] != 0 and u[j] != 0 else K[i, j]
            is_struck = alone in {i, j}
            after[i, j] = sp.S.Zero if is_struck else self.named(f"K{index}{i + 1}{j + 1}", entry)
        return u, mu, _symmetric(n, after)

    def entries(self, M: Any, letter: str, short: int = -1) -> sp.ImmutableMatrix:
        """A symmetric matrix by names for its entries of more than `short` operations.

        Entries that are equal, or differ by a sign, have one name.
        """
        known: dict[Any, Any] = {}
        for i, j in _upper(M):
            entry = M[i, j]
            if entry not in known:
                is_short = count_of(entry) <= short
                known[entry] = entry if is_short else self.named(f"{letter}{i + 1}{j + 1}", entry)
                known.setdefault(-entry, -known[entry])
        return _symmetric(M.rows, {(i, j): known[M[i, j]] for i, j in _upper(M)})

    def inverse(self, M: Any, step: str, last: str = "") -> sp.ImmutableMatrix:
        """The inverse of a symmetric matrix by Gauss and Jordan, one diagonal entry after another.

        `step`: letter of names, before the number of the diagonal entry; `last`: letter of the
        entries of the inverse, of which the last steps are the negatives where it is left out.

        Raises
        ------
        InputError
            When a pivot is zero.
        """
        n = M.rows
        A: dict[tuple[int, int], Any] = {(i, j): M[i, j] for i, j in _upper(M)}

        def named(k: int, i: int, j: int, entry: Any) -> Any:
            if last and k == n - 1:
                return -self.named(f"{last}{i + 1}{j + 1}", -entry)
            return self.named(f"{step}{k + 1}_{i + 1}{j + 1}", entry)

        for k in range(n):
            column = [A[min(i, k), max(i, k)] for i in range(n)]
            pivot = column[k]
            if pivot == 0:
                raise InputError(
                    "compliance in steps",
                    got=Words(
                        f"no stiffness against coordinate {k + 1} where those before it are free"
                    ),
                    expected="a positive definite stiffness",
                )
            both = [(min(i, k), max(i, k)) for i in range(n)]
            ratio = [
                sp.S.Zero if i == k else named(k, *both[i], column[i] / pivot) for i in range(n)
            ]
            for i, j in _upper(M):
                if k not in (i, j) and ratio[i] != 0 and column[j] != 0:
                    A[i, j] = named(k, i, j, A[i, j] - ratio[i] * column[j])
            A |= {both[i]: ratio[i] for i in range(n)}
            A[k, k] = named(k, k, k, -1 / pivot) if last and k == n - 1 else -1 / pivot
        return _symmetric(n, {place: -x for place, x in A.items()})


def _upper(M: Any) -> list[tuple[int, int]]:
    return [(i, j) for i in range(M.rows) for j in range(i, M.rows)]


def _symmetric(n: int, upper: dict[tuple[int, int], Any]) -> sp.ImmutableMatrix:
    return sp.ImmutableMatrix(n, n, lambda i, j: upper[min(i, j), max(i, j)])


@frozen
class Condition:
    """A condition under which a formula holds."""

    words: str  #: such as "leg 'ram' meets the platform"
    expression: sp.Expr  #: in given symbols; positive where it holds
    #: differences that vanish there, of legs in their joint coordinates
    equations: tuple[sp.Expr, ...] = ()
    leg: str = ""  #: the leg of which the words speak; empty where they speak of none


@frozen
class Unwritten:
    """A formula in exact arithmetic, and a function that writes it."""

    write: Callable[[], Any]  # returns the SymPy expression or matrix


class WrittenField:
    """A field of a frozen dataclass that may be given as `Unwritten`; it is written at first use.

    `default`: of the field.
    """

    def __init__(self, *default: Any) -> None:
        self._default = default

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Any:
        if instance is None:
            if self._default:
                return self._default[0]
            # So that dataclass() sees a field without a default.
            raise AttributeError(self._name)
        value = instance.__dict__[self._name]
        if isinstance(value, Unwritten):
            value = instance.__dict__[self._name] = value.write()
        return value

    def __set__(self, instance: Any, value: Any) -> None:
        instance.__dict__[self._name] = value


class WrittenWhole:
    """A frozen dataclass that is pickled with all of its fields written."""

    def __getstate__(self) -> dict[str, Any]:
        whole: Any = self
        return {x.name: getattr(whole, x.name) for x in fields(whole)}


@cacheit
def count_of(expression: Any) -> int:
    """Operations of an expression, as `sympy.count_ops` counts them, and a minus before a sum."""
    if expression.is_Rational:
        return (expression.p < 0) + (expression.q != 1)
    if expression.is_Mul:
        return _of_product(expression)
    parts = expression.args
    if expression.is_Add:
        minus = [x for x in parts if _has_minus(x)]
        subtracted = sum(x.is_Mul or x.is_Rational for x in minus)
        operations = sum(map(count_of, parts)) - subtracted
        return operations + len(parts) - 1 + (len(minus) == len(parts))
    is_counted = bool(parts) and (expression.is_Pow or expression.is_Function)
    if expression.is_Pow and expression.exp is sp.S.NegativeOne:
        parts = (expression.base,)
    return is_counted + sum(map(count_of, parts))


def _of_product(product: Any) -> int:
    """Of what `sympy.fraction` finds above and below, without making it."""
    number, *factors = product.args
    negative = _has_minus(product)
    if number is sp.S.NegativeOne:
        if len(factors) == 1:
            return 1 + count_of(factors[0])
    elif number is not sp.S.One:
        factors.insert(0, -number if negative else number)
    above: list[Any] = []
    below: list[Any] = []
    for x in factors:
        if x.is_Rational:
            above += [sp.Integer(x.p)] if x.p != 1 else ()
            below += [sp.Integer(x.q)] if x.q != 1 else ()
        elif x.is_Pow and x.exp.is_Rational and x.exp.p < 0:
            below.append(x.base if x.exp is sp.S.NegativeOne else x)
        else:
            above.append(x)
    if not below:
        return negative + len(factors) - 1 + sum(map(count_of, factors))
    # A power below has no minus.
    powers = sum(x.is_Pow and x.exp.is_Rational and x.exp.p < 0 for x in below)
    return negative + 1 + _of_factors(above) + _of_factors(below) - powers


def _of_factors(factors: list[Any]) -> int:
    if len(factors) == 2 and factors[0].is_Integer and factors[1].is_Add:
        return count_of(factors[0] * factors[1])  # multiplied out, as SymPy does
    return sum(map(count_of, factors)) + max(0, len(factors) - 1)


def _has_minus(term: Any) -> bool:
    number = term.args[0] if term.is_Mul else term
    if number.is_Rational:  # SymPy would deduce all that holds of it
        return bool(number.p < 0)
    return bool(number.is_Number and number.is_negative)


def is_shorter_negated(expression: Any) -> bool:
    """Whether the negative of an expression has fewer operations."""
    if expression.is_Add:
        return all(map(_has_minus, expression.args))
    if expression.is_Mul and not any(x.is_Add for x in expression.args):
        return _has_minus(expression)
    return not expression.is_Symbol and count_of(-expression) < count_of(expression)


@cacheit
def parts_of(expression: Any) -> frozenset[Any]:
    """All different parts of an expression, itself among them."""
    found, pending = {expression}, [expression]
    while pending:
        new = set(pending.pop().args) - found
        found |= new
        pending += new
    return frozenset(found)


@cacheit
def symbols_in(expression: Any) -> frozenset[Any]:
    """The symbols of an expression."""
    return frozenset(x for x in parts_of(expression) if x.is_Symbol)


def operations_in(expression: Any) -> int:
    """Operations of a formula; none of a number."""
    return count_of(expression) if symbols_in(expression) else 0


def operations_of(K: Any, definitions: Sequence[Definition]) -> int:
    """Operations of the different entries of a matrix, and of what its names stand for."""
    formulas = (*different_entries(K), *(d.expression for d in definitions))
    return sum(min(count_of(x), count_of(sp.factor_terms(x))) for x in formulas if x.free_symbols)


def different_entries(K: Any) -> list[Any]:
    """Entries of a matrix that are not zero; those that differ by their sign are one."""
    entries: dict[Any, None] = {}
    for entry in K:
        if entry != 0 and -entry not in entries:
            entries[entry] = None
    return list(entries)


def matrix_of(M: Any, change: Callable[[Any], Any]) -> sp.ImmutableMatrix:
    """A matrix with others for its entries; those that differ by their sign alone still do."""
    found: dict[Any, Any] = {}
    for entry in M.flat():
        if entry not in found:
            found[entry] = -found[-entry] if -entry in found else change(entry)
    return sp.ImmutableMatrix(M.rows, M.cols, [found[entry] for entry in M.flat()])

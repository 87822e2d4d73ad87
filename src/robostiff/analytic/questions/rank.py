"""Rank of a formula, and the conditions under which it drops."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import BUDGET, FormulaTooLargeError, OutOfTimeError, within
from robostiff.analytic.derivation import Derivation
from robostiff.analytic.exact.definition import Condition, count_of
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.exact.factors import determinant, echelon, shared_factors
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.placement.robot_pose import exact_angle
from robostiff.analytic.questions.loci import rank_in_numbers, rank_locus, written_steps
from robostiff.errors import InputError

#: Seconds for an answer in steps.
SHORT = 5.0
_LONGEST = 3000  # operations of a factor that is listed


@dataclass(frozen=True)
class RankFormula:
    """Rank of a symmetric positive semidefinite formula.

    Attributes
    ----------
    rank : int
        For general values of the symbols.
    exceptions : tuple of sympy.Expr
        Irreducible factors that all principal minors of that size share: where one is zero, the
        rank drops.
    common_minor : sympy.Expr
        What those minors share, as a product of the exceptions: at full rank the determinant but
        for its denominator and a number, and 1 for the rank 0.
    remark : str
        Why there are no exceptions where they were not looked for, and which are too long to be
        listed; empty otherwise.
    of_formula : Derivation or None
        The formula whose conditions decide what is `allowed`.
    """

    rank: int
    exceptions: tuple[sp.Expr, ...]
    common_minor: sp.Expr
    remark: str = field(default="", repr=False, compare=False)
    of_formula: Derivation | None = field(default=None, repr=False, compare=False)

    @classmethod
    def of(cls, K: Any, rank: int, powers: Mapping[Any, int], remark: str = "") -> RankFormula:
        """Of a matrix or derivation; `powers`: the factors with their exponents in the minors."""
        powers = dict(powers)
        for factor in [x for x in powers if count_of(x) <= _LONG]:
            if (short := _power_of_a_cosine(factor)) is not None:
                powers[short[0]] = short[1] * powers.pop(factor)
        kept = independent_zeros(sorted(powers, key=sp.default_sort_key))
        long = [x for x in kept if count_of(x) > _LONGEST]
        kept = tuple(x for x in kept if x not in long)
        names = sorted({str(s) for x in long for s in x.free_symbols})
        if long:
            lost = f"too long to be listed: where a sum in {', '.join(names)} vanishes"
            remark = "; ".join(filter(None, (remark, lost)))
        common = sp.Mul(*(factor ** powers[factor] for factor in kept))
        return cls(rank, kept, common, remark, K if isinstance(K, Derivation) else None)

    @property
    def allowed(self) -> tuple[sp.Expr, ...]:
        """Exceptions that signs of symbols and conditions allow: a positive length is never zero.

        Examples
        --------
        >>> R, r = sp.symbols("R r", positive=True)
        >>> rank_formula(sp.diag(R, R * (R - r))).allowed
        (R - r,)
        """
        possible = (x for x in self.exceptions if not x.is_nonzero)
        conditions = () if self.of_formula is None else self.of_formula.conditions
        return tuple(x for x in possible if x.is_Symbol or may_vanish(x, conditions))


def closed_matrix(formula: Any, question: str) -> sp.Matrix:
    """The matrix that a question is about: a matrix of formulas, or a derivation in closed form.

    Raises
    ------
    InputError
        For a derivation in steps: their names would be taken for independent symbols.

    Examples
    --------
    >>> k = sp.Symbol("k")
    >>> K = sp.ImmutableMatrix(sp.diag(k, k, 0))
    >>> closed_matrix(Derivation("K_C", K, (), K), "rank")
    Matrix([
    [k, 0, 0],
    [0, k, 0],
    [0, 0, 0]])
    """
    if not isinstance(formula, Derivation):
        return sp.Matrix(formula)
    if not formula.is_closed:
        raise needs_closed_form(formula, question)
    return sp.Matrix(formula.K)


def needs_closed_form(derivation: Derivation, question: str) -> InputError:
    """The error of a question that steps cannot answer."""
    return InputError(
        f"{question} of {derivation.name!r}",
        got="named steps",
        expected="a closed form",
        hint="take the home pose, fewer symbols, or form=Closed(); subs(...) with values for "
        "all symbols but a few makes steps short"
        + "; compliance_steps(...) has it in steps"
        * (question == "compliance"),
    )


def rank_by_legs(K: Any) -> int | None:
    """Rank of a robot's derivation in names or in steps; None of others, and if it is not known."""
    named = getattr(K, "named", None)
    if named is None and (not isinstance(K, Derivation) or K.is_closed):
        return None
    rank = getattr(K, "general_rank", None)
    if rank is None and named is not None:  # values were put in
        written = written_steps(K, math.inf)
        rank = rank_in_numbers([written(w) for leg in named.legs for w in leg.wrenches])
    return rank


def rank_formula(K: Any, budget: float | None = BUDGET) -> RankFormula:
    """Rank of a stiffness formula and the conditions under which it drops.

    A positive semidefinite matrix of rank r has a principal minor of size r that is not zero; the
    rank drops where all of them vanish, so at the zeros of their common factors. Points where it
    drops only because several conditions hold at once are not listed. Exceptions are listed whether
    or not the assumptions of the symbols allow them: h = 0 is the limit of flat platforms for h >
    0.

    Parameters
    ----------
    K : (n, n) matrix of SymPy expressions, or Derivation
        Symmetric and positive semidefinite. In steps, or too long, the rank is that in numbers at
        the parameters and poses at which the formula was compared with them, without exceptions.
    budget : float or None
        Seconds of computing; None for no limit.

    Raises
    ------
    InputError
        For a derivation in steps that was not compared with numbers.
    OutOfTimeError
        When it does not end in time, as with a matrix of long sums.

    Examples
    --------
    >>> a, b = sp.symbols("a b")
    >>> rank_formula(sp.diag(a, a * (a - b), 0))
    RankFormula(rank=2, exceptions=(a, a - b), common_minor=a**2*(a - b))
    """
    by_legs = rank_by_legs(K)
    matrix = closed_matrix(K, "rank") if by_legs is None else None
    rank = getattr(K, "general_rank", None) if by_legs is None else by_legs

    def answer() -> RankFormula:
        if matrix is not None:
            try:
                return RankFormula.of(K, *_rank(matrix))
            except FormulaTooLargeError:
                if rank is None:
                    raise
        return RankFormula.of(K, rank or 0, *rank_locus(K, rank or 0))

    is_closed = matrix is not None or K.is_closed
    seconds = budget if is_closed else min(SHORT, budget or SHORT)
    try:
        return within(seconds, answer, "rank of a formula")
    except FormulaTooLargeError as error:
        if rank is None or (is_closed and isinstance(error, OutOfTimeError)):
            raise
        remark = "it drops where wrenches of the legs depend on one another; too long"
        return RankFormula.of(K, rank, {}, remark)


def _rank(K: Any) -> tuple[int, dict[Any, int]]:
    """Rank, and the factors that all principal minors of its size share, with their exponents."""
    field = ExactField(list(K))
    elements = [[field.element(K[i, j]) for j in range(K.cols)] for i in range(K.rows)]
    rank = len(echelon(field, elements)[1])
    if rank == 0:
        return 0, {}
    chosen = combinations(range(K.rows), rank)
    each = (determinant(field, [[elements[i][j] for j in at] for i in at]) for at in chosen)
    return rank, shared_factors(field, (field.zeros(minor) for minor in each if not minor.is_zero))


_SAMPLES = 4000
_FEWEST = 100  # samples at which the conditions hold, for an answer by signs
_STARTS = 4
_STEPS = 100
_BESIDE = 1e-4  # from a point, to see a slope
# Of Newton's step: a zero without a change of sign is double.
_SHARES = 2.0 ** np.arange(1, -9, -1)
_ROUNDING = 1e-13  # of the sum of the sizes of its terms
_ZERO = 1e-10
_ALIKE = 1e-2  # the same of another factor at such a zero, of high order
_NEAR = 0.1  # a symbol there, of the largest
_LONG = 60  # operations
_SEED = 29


def _power_of_a_cosine(factor: Any) -> tuple[Any, int] | None:
    """A cosine, and its power, that a sum in sines and cosines of one angle is a number times.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> _power_of_a_cosine(1 + sp.cos(x)), _power_of_a_cosine(sp.sin(x) + sp.cos(x))
    ((cos(x/2), 2), (sin(x + pi/4), 1))
    """
    turns = factor.atoms(sp.sin, sp.cos)
    angles = set().union(*(x.free_symbols for x in turns))
    if not factor.is_Add or factor.free_symbols != angles or len(angles) != 1:
        return None
    (x,) = angles
    at = np.linspace(0, 4 * np.pi, _TURNS, endpoint=False)  # of halves of the angle
    values = np.broadcast_to(values_of([factor], {x: at})[0], at.shape)
    waves = np.fft.fft(values)[: _TURNS // 2]
    top = int(np.flatnonzero(np.abs(waves) > _SAME * np.abs(waves).max())[-1])
    for power in (n for n in range(1, top + 1) if top % n == 0):
        for k in range(power):
            phase = (np.angle(waves[top]) + 2 * np.pi * k) / power
            wave = np.cos(top / power * at / 2 + phase) ** power
            number = values @ wave / (wave @ wave)
            if np.max(np.abs(values - number * wave)) <= _SAME * np.max(np.abs(values)):
                found = sp.cos(sp.Rational(top, 2 * power) * x + exact_angle(float(phase)))
                return (-found if found.could_extract_minus_sign() else found), power
    return None


_TURNS = 256
_SAME = 1e-9


@dataclass(frozen=True)
class Samples:
    """Random values of symbols, of their signs or of either, at which conditions hold."""

    symbols: tuple[sp.Symbol, ...]
    conditions: tuple[Condition, ...] = ()
    signed: bool = False  # whether positive symbols have positive values only

    @cached_property
    def values(self) -> np.ndarray:
        """Values (m, symbols) between 0.1 and 3 in size, spread evenly by their logarithms."""
        random = np.random.default_rng(_SEED)
        shape = _SAMPLES, len(self.symbols)
        values = np.exp(random.uniform(np.log(0.1), np.log(3.0), shape))
        if self.symbols:
            signs = random.choice([-1.0, 1.0], shape)
            values *= np.where(
                [self.signed and bool(x.is_positive) for x in self.symbols], 1, signs
            )
        for condition in self.conditions:
            known = dict(zip(self.symbols, values.T, strict=True))
            values = values[values_of([condition.expression], known)[0] > 0]
        return values

    def relative(self, factor: Any) -> Callable[[np.ndarray], np.ndarray]:
        """Values of a sum by the sizes of its terms, as a function of values (..., symbols)."""
        polynomial = sp.Poly(factor)
        powers, numbers = zip(*polynomial.terms(), strict=True)
        coefficients = np.array(numbers, dtype=float)
        each = [np.array(n) for n in zip(*powers, strict=True)]

        def ratio(at: np.ndarray) -> np.ndarray:
            known = dict(zip(self.symbols, np.moveaxis(at, -1, 0), strict=True))
            total: Any = coefficients
            for x, n in zip(values_of(polynomial.gens, known), each, strict=True):
                total = total * (np.asarray(x)[..., None] ** np.arange(max(n) + 1))[..., n]
            sizes = np.sum(np.abs(total), axis=-1)
            return np.sum(total, axis=-1) / np.where(sizes > 0, sizes, 1)

        return ratio

    def zeros(self, factor: Any) -> np.ndarray | None:
        """Points (m, symbols) at which a factor is zero and changes no sign; None if it does.

        Empty for one that is not zero anywhere.
        """
        relative = self.relative(factor)
        values = relative(self.values)
        if len(values) < _FEWEST or max(values) > _ROUNDING < -min(values):
            return None
        at = self.values[np.argsort(np.abs(values))[:_STARTS]]
        size, n = np.abs(relative(at)), len(self.symbols)
        for _ in range(_STEPS):
            beside = at[:, None] + _BESIDE * np.stack([np.eye(n), -np.eye(n)])[:, None]
            up, down = np.abs(relative(beside))
            slope = (up - down) / (2 * _BESIDE)
            with np.errstate(all="ignore"):
                full = np.nan_to_num(slope * (size / np.sum(slope**2, axis=1))[:, None])
            ways = at - _SHARES[:, None, None] * full
            each = np.abs(relative(ways))
            best = np.argmin(each, axis=0), np.arange(len(at))
            is_less = each[best] < size
            if not np.any(is_less):
                break
            at, size = (
                np.where(is_less[:, None], ways[best], at),
                np.where(is_less, each[best], size),
            )
        positive = [i for i, s in enumerate(self.symbols) if self.signed and s.is_positive]
        return at[(size < _ZERO) & np.all(at[:, positive] > 0, axis=1)]

    def are_zeros(self, factors: Sequence[Any], at: np.ndarray) -> bool:
        """Whether one of the factors is nearly zero at a point."""
        small = {s for s, x in zip(self.symbols, at, strict=True) if abs(x) < _NEAR * abs(at).max()}
        return any(
            x in small if x.is_Symbol else abs(self.relative(x)(at)) < _ALIKE for x in factors
        )


def independent_zeros(factors: Sequence[Any]) -> tuple[Any, ...]:
    """Factors without those that are zero nowhere, or only where shorter ones are.

    Sines and cosines have a relation, so that a factor may be a multiple of another by a sum of
    squares without being divisible by it. A factor that changes its sign is kept; a long one where
    it does so for symbols of their signs.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> independent_zeros([x**2 + 3, x**2 - 2 * x * y + y**2, x - y, x])
    (x - y, x)
    """
    symbols = tuple(sorted(set().union(*(x.free_symbols for x in factors)), key=str))
    kept: list[Any] = []
    for factor in sorted(factors, key=count_of):
        samples = Samples(symbols, signed=count_of(factor) > _LONG)
        points = None if factor.is_Symbol else samples.zeros(factor)
        if points is None or any(not samples.are_zeros(kept, at) for at in points):
            kept.append(factor)
    return tuple(x for x in factors if x in kept)


def may_vanish(factor: Any, conditions: Sequence[Condition]) -> bool:
    """Whether a factor is zero for symbols of their signs where conditions hold, or beside it."""
    symbols = factor.free_symbols.union(*(c.expression.free_symbols for c in conditions))
    samples = Samples(tuple(sorted(symbols, key=str)), tuple(conditions), signed=True)
    points = samples.zeros(factor)
    return points is None or len(points) > 0

"""The outline of an exported derivation, independent of its format."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from robostiff.analytic.derivation import Derivation, Stage
from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.export.entries import (
    EntryNames,
    MatrixName,
    factored_matrix,
    in_decimals,
    operations,
    readable,
    readable_matrix,
    without_lost_digits,
)
from robostiff.analytic.reading.combinations import name_combinations
from robostiff.analytic.vectors.vector_expressions import Coordinates, Equation, Sum
from robostiff.errors import printable
from robostiff.spatial import Space

#: A stiffness between two joints with more operations than this is not written out.
LONGEST_STAGE = 1500


@dataclass(frozen=True)
class OutlineHeading:
    """A title; level 1 is the title of the whole."""

    text: str
    level: int = 2

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", printable(self.text, kept="\n"))


@dataclass(frozen=True)
class OutlineText:
    """A paragraph; `{}` in it stands for a formula each, where it has formulas."""

    text: str
    formulas: tuple[MatrixName | str | sp.Expr | Sum, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", printable(self.text, kept="\n"))


@dataclass(frozen=True)
class ScalarEquations:
    """Scalars, one after the other: ``name = expression``."""

    rows: tuple[tuple[str, sp.Expr], ...]
    # For the nomenclature, which has those that are numbers.
    of_springs: tuple[Definition, ...] = ()


@dataclass(frozen=True)
class MatrixEquation:
    """``name = factor * matrix = whole``; a column is given as the row that it is written as."""

    name: MatrixName
    factor: sp.Expr
    matrix: sp.ImmutableMatrix
    whole: sp.ImmutableMatrix
    # name for the entry in row i and column j (from 0) of the whole, where it needs one
    entry_name: Callable[[int, int], str]

    @property
    def is_vector(self) -> bool:
        """Whether it is a column, written as a row."""
        return self.whole.rows == 1


@dataclass(frozen=True)
class Recursion:
    """``after = before - u u^T / mu``, eq. (15)."""

    after: MatrixName
    before: MatrixName
    u: MatrixName
    mu: str


@dataclass(frozen=True)
class Inverse:
    """``left = right^-1`` of two matrices."""

    left: MatrixName
    right: MatrixName


@dataclass(frozen=True)
class Transport:
    """``after = T before T^T``: from axes with an arm to the reference point, eq. (11)-(13)."""

    after: MatrixName
    before: MatrixName
    axes: MatrixName
    arm: MatrixName


@dataclass(frozen=True)
class SpringSum:
    """``result = sum of c t t^T + sum of T D T^T`` of drives and beams in series, and T."""

    result: MatrixName
    drives: bool
    beams: bool


@dataclass(frozen=True)
class EqualMatrices:
    """``left = right`` of two matrices."""

    left: MatrixName
    right: MatrixName


@dataclass(frozen=True)
class WrenchSum:
    """``result = sum of w w^T / c`` over the transmitted wrenches."""

    result: MatrixName


@dataclass(frozen=True)
class VectorEquations:
    """Vectors, rotations and scalars of them, one equation a line."""

    rows: tuple[Equation, ...]


@dataclass(frozen=True)
class FormulaTable:
    """Rows of a name in words and of formulas, under a head of names."""

    head: tuple[MatrixName | str, ...]
    rows: tuple[tuple[str, tuple[MatrixName | Coordinates | sp.Expr, ...]], ...]
    of: str = "leg"  # what the rows are

    def __post_init__(self) -> None:
        rows = tuple((printable(words), cells) for words, cells in self.rows)
        object.__setattr__(self, "rows", rows)


@dataclass(frozen=True)
class LegSum:
    """``result = sum over i of w_i w_i^T / c_i`` of the wrenches of a generic leg.

    Of wrenches that share energy ``W_i C_i^-1 W_i^T``, and the matrices W_i and C_i.
    """

    result: MatrixName
    wrenches: tuple[tuple[str, str], ...]
    rods: tuple[str, str] | None = None  # of parallel rods j: the couple and its compliance
    coupled: tuple[tuple[str, ...], ...] = ()  # names of the entries of C_i, empty for zero


@dataclass(frozen=True)
class Nomenclature:
    """Names and their meanings; several names with the same meaning are listed together."""

    rows: tuple[tuple[tuple[MatrixName | str, ...], str], ...]


#: What is written as formulas.
Displayable = (
    ScalarEquations
    | VectorEquations
    | MatrixEquation
    | Recursion
    | Inverse
    | Transport
    | EqualMatrices
    | WrenchSum
    | LegSum
    | SpringSum
)

Block = OutlineHeading | OutlineText | Displayable | FormulaTable | Nomenclature


def outline(derivation: Derivation) -> tuple[Block, ...]:
    """The blocks of an exported derivation, from the start to the nomenclature.

    Some may be empty; `nomenclature.with_springs` leaves these out, and headings above nothing.

    Examples
    --------
    >>> k = sp.Symbol("k")
    >>> K = sp.ImmutableMatrix(sp.diag(k, k, k))
    >>> blocks = outline(Derivation("K_C", K, (), K))
    >>> [block.text for block in blocks if isinstance(block, OutlineHeading)]
    ['Cartesian stiffness matrix K_C', 'Definitions', 'Result']
    """
    names = EntryNames(derivation)
    blocks: list[Block] = [
        OutlineHeading(title_of(derivation), level=1),
        OutlineText(_summary(derivation)),
    ]
    first, last = _unstaged(derivation)
    blocks += [OutlineHeading("Definitions"), equations(first)]
    if derivation.stages:
        blocks += [OutlineHeading("Start: stiffness without passive joints")]
        blocks += _stiffness(derivation.K0, names.stiffness(0), names)
    for number, stage in enumerate(derivation.stages, start=1):
        is_result = number == len(derivation.stages) and stage.K == derivation.K
        blocks += _stage(stage, number, is_result, names)
    blocks.append(OutlineHeading("Result"))
    blocks.append(equations(last))
    K = derivation.K
    if derivation.is_closed:
        named = name_combinations(K, names.given)
        K = named.matrix
        blocks.append(equations(named.definitions))
    blocks.append(stiffness_equation(K, names.result, names))
    blocks.append(_nomenclature(derivation, names))
    return tuple(blocks)


def title_of(derivation: Derivation) -> str:
    """Title of a derivation."""
    name = " ".join(derivation.name.split())
    return "Cartesian stiffness matrix" + (f" {name}" if name else "")


def _summary(derivation: Derivation) -> str:
    count = len(derivation.stages)
    if not count:
        return "Stiffness as a formula."
    joints = "one passive joint" if count == 1 else f"{count} passive joints"
    form = "in closed form" if derivation.is_closed else "in named steps"
    return f"Elimination of {joints}, eq. (15), {form}."


def _stage(stage: Stage, number: int, is_result: bool, names: EntryNames) -> list[Block]:
    J, u, mu = names.column("J", number), names.column("u", number), names.scalar("mu", number)
    before, after = names.stiffness(number - 1), names.stiffness(number)
    blocks: list[Block] = [
        OutlineHeading(f"Joint {number}: {stage.joint}"),
        OutlineText(f"{stage.rule}."),
        column_equation(J.name, stage.J),
        equations(stage.definitions),
        column_equation(u.name, stage.u),
    ]
    if stage.mu != sp.Symbol(mu):
        blocks.append(ScalarEquations(((mu, readable(stage.mu)),)))
    if stage.is_redundant:
        blocks.append(EqualMatrices(after, before))
    else:
        blocks.append(Recursion(after, before, u, mu))
    if is_result:
        blocks.append(EqualMatrices(after, names.result))
    elif not stage.is_redundant:
        blocks += _stiffness(stage.K, after, names)
    return blocks


def _stiffness(K: sp.ImmutableMatrix, name: MatrixName, names: EntryNames) -> list[Block]:
    count = operations(K)
    if count > LONGEST_STAGE:
        return [OutlineText(f"{{}} takes {count} operations and is not written out.", (name,))]
    return [stiffness_equation(K, name, names)]


def stiffness_equation(
    K: sp.ImmutableMatrix, name: MatrixName, names: EntryNames
) -> MatrixEquation:
    """``name = factor * matrix`` of a stiffness matrix."""
    K = without_lost_digits(K)
    factor, rest = factored_matrix(K)
    return MatrixEquation(name, factor, rest, readable_matrix(K), names.entries_of(name))


def matrix_equation(
    name: MatrixName, matrix: sp.ImmutableMatrix, entry_name: Callable[[int, int], str]
) -> MatrixEquation:
    """``name = matrix`` without a common factor in front."""
    return MatrixEquation(name, sp.Integer(1), matrix, matrix, entry_name)


def column_equation(name: str, column: sp.ImmutableMatrix) -> MatrixEquation:
    """``name = column``, written as a row; its entries are called by the name and a number."""
    row = readable_matrix(column).T
    return matrix_equation(MatrixName(name), row, lambda _, j: f"{name}_{j + 1}")


def equations(definitions: Sequence[Definition]) -> ScalarEquations:
    """Definitions as equations; stiffnesses in numbers are left to the nomenclature."""
    of_springs = tuple(d for d in definitions if d.parts)
    rows = [(d.symbol.name, in_decimals(d.expression)) for d in definitions if not is_value(d)]
    return ScalarEquations(tuple(rows), of_springs)


def is_value(definition: Definition) -> bool:
    """Whether it is a stiffness in numbers."""
    return bool(definition.parts) and definition.expression.is_number


def _unstaged(derivation: Derivation) -> tuple[list[Definition], list[Definition]]:
    """Definitions that no stage lists: those before the stages, and those after."""
    staged = {d.symbol for stage in derivation.stages for d in stage.definitions}
    places = [i for i, d in enumerate(derivation.definitions) if d.symbol in staged]
    first = places[0] if places else 0 if not derivation.stages else len(derivation.definitions)
    unstaged = [(i, d) for i, d in enumerate(derivation.definitions) if d.symbol not in staged]
    return [d for i, d in unstaged if i < first], [d for i, d in unstaged if i >= first]


def meaning_of_result(derivation: Derivation) -> str:
    """A sentence about the stiffness matrix: point, order and units."""
    space = Space.of_size(derivation.K.rows)
    wrench, twist = ", ".join(space.wrench_order), ", ".join(space.twist_order)
    return (
        f"stiffness about the reference point: wrench ({wrench}) for twist ({twist}); "
        "force before moment, translation before rotation, SI units"
    )


def _nomenclature(derivation: Derivation, names: EntryNames) -> Nomenclature:
    rows: list[tuple[tuple[MatrixName | str, ...], str]] = [
        ((names.result,), meaning_of_result(derivation))
    ]
    count = len(derivation.stages)
    if count:
        numbers = [1] if count == 1 else [1, count] if count == 2 else [1, 2, count]
        dots: tuple[str, ...] = ("...",) if count > 3 else ()

        def listed(name: Callable[[int], MatrixName | str]) -> tuple[MatrixName | str, ...]:
            given = [name(i) for i in numbers]
            return (*given[:-1], *dots, given[-1])

        rows += [
            ((names.stiffness(0),), "stiffness without passive joints"),
            (listed(lambda i: names.column("J", i)), "twist of a passive joint"),
            (
                listed(lambda i: names.column("u", i)),
                "reaction to its unit motion, stiffness before the joint times its twist",
            ),
            (listed(lambda i: names.scalar("mu", i)), "stiffness against its unit motion"),
            (listed(names.stiffness), "stiffness after the joint"),
        ]
    return Nomenclature((*rows, *meanings_of_given(names.given, derivation.meanings)))


def meanings_of_given(
    given: Iterable[str], meanings: Mapping[str, str]
) -> list[tuple[tuple[str, ...], str]]:
    """Rows of given symbols; those with the same meaning stand in one."""
    rows: dict[str, list[str]] = {}
    for name in given:
        rows.setdefault(meanings.get(name, "given"), []).append(name)
    return [(tuple(names), meaning) for meaning, names in rows.items()]

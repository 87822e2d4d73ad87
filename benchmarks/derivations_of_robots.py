"""Time and size of the formulas of all robots, each checked against numbers.

Operations are those of all different entries of K and of what its names stand for; lines are those
entries, and the names that are formulas. A name that is zero or a copy of another, and an entry of
K that is zero everywhere but does not print as 0, are defects, as is any difference from the
numbers.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
from sympy.core.cache import clear_cache

import robostiff as rs
from robostiff.analytic import AtHome, AtSymbols, Definition, RobotDerivation
from robostiff.analytic.derivation import InNames
from robostiff.analytic.exact.definition import count_of, different_entries, operations_of
from robostiff.analytic.export.robot_outline import is_vectors_alone
from robostiff.analytic.placement.agreement import closed_places
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.analytic.vectors.forms import VectorForm
from robostiff.analytic.vectors.vector_expressions import (
    Coordinates,
    Equation,
    Stacked,
    Sum,
    Vector,
)
from robostiff.errors import InputError

POSES = {"home": AtHome(), "symbolic": AtSymbols()}
_DIFFERENT = 1e-6  # relative: more than rounding explains
_ZERO = 1e-11  # of the sizes of the terms, at every set
_ROUNDING = 1e-14  # of the ends of an entry of K: parasitic motions couple by as little as 1e-13
_BEGINNING, _END = "<!-- table of derivations -->", "<!-- end of the table -->"


@dataclass(frozen=True)
class Row:
    """What a robot's derivation at a pose gave.

    Attributes
    ----------
    robot, pose : str
    refusal : str
        Why there is no formula; the numbers are zero then.
    form : str
    seconds : float
        Of the processor, until what is printed is found.
    operations, lines, names, sets : int
    error : float
        Largest difference from the numerical form, relative to both ends of an entry.
    defects : tuple of str
    """

    robot: str
    pose: str
    refusal: str = ""
    form: str = ""
    seconds: float = 0.0
    operations: int = 0
    lines: int = 0
    names: int = 0
    sets: int = 0
    error: float = 0.0
    defects: tuple[str, ...] = ()

    def __str__(self) -> str:
        begin = f"{self.robot:<24}{self.pose:<10}"
        if self.refusal:
            return begin + self.refusal
        numbers = f"{self.seconds:>7.2f}{self.operations:>12}{self.lines:>7}{self.names:>7}"
        defects = "".join(f"\n  DEFECT: {defect}" for defect in self.defects)
        return f"{begin}{self.form:>8}{numbers}{self.sets:>6}{self.error:>9.0e}{defects}"

    @property
    def in_table(self) -> str:
        """As a row of Markdown."""
        if self.refusal:
            return f"| {self.robot} | {self.pose} | refused: {self.refusal} | | | | | |"
        numbers = (self.operations, self.lines, self.names, self.sets)
        cells = (self.robot, self.pose, self.form, f"{float(f'{self.seconds:.1g}'):g}", *numbers)
        return "| " + " | ".join(map(str, cells)) + f" | {self.error:.0e} |"


def robots(names: Sequence[str], sets: int, poses: Sequence[str], table: Path | None = None) -> int:
    """Derive robots at poses, print a row each, and write the table; how many have a defect."""
    print(
        f"{'robot':<24}{'pose':<10}{'form':>8}{'s':>7}{'operations':>12}{'lines':>7}"
        f"{'names':>7}{'sets':>6}{'error':>9}"
    )
    rs.derive("planar-link")
    rows = []
    for name in names:
        for pose in poses:
            found, derivation = row_of_robot(name, pose, sets)
            rows.append(found)
            print(found, flush=True)
            if derivation is not None and derivation.named is not None:
                print(lines_of(derivation.named))
    if table is not None:
        _write_table(table, rows)
    return sum(bool(row.defects) for row in rows)


def row_of_robot(name: str, pose: str, sets: int) -> tuple[Row, RobotDerivation | None]:
    """Derive a robot at a pose, and check it at random sets of parameters."""
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    stem = Path(name).stem
    clear_cache()
    start = time.process_time()
    try:
        derivation = rs.derive(robot, pose=POSES[pose])
    except InputError as error:
        return Row(stem, pose, " ".join(str(error).split())), None
    seconds = time.process_time() - start
    alone, series = is_vectors_alone(derivation), derivation.in_series
    if alone or series is not None:
        seconds = time.process_time() - start
    named = derivation.named or derivation
    values, K = random_places(robot, pose, sets)
    found = derivation.lambdify()(**{s.name: values[s.name] for s in derivation.symbols})
    error = largest_error(np.broadcast_to(found, K.shape), K)
    printed = derivation.vectors if alone else series
    if printed is not None:  # not K entry by entry
        each = [{name: float(x[i]) for name, x in values.items()} for i in range(len(K))]
        error = max(
            error, largest_error(np.array([printed.substituted(at) for at in each], dtype=float), K)
        )
    defects = [f"differs from rs.stiffness by {error:.1e}"] if error > _DIFFERENT else []
    defects += wasted(named.definitions, values)
    defects += hidden_zeros(named.K, K)
    form = "springs" if derivation.named else "closed" if derivation.is_closed else "steps"
    entries, definitions = named.K.flat(), named.definitions
    equations: Sequence[Equation] = ()
    if isinstance(series, VectorForm):
        form, definitions, equations = "vectors", series.names, series.leg
        entries = terms_of_springs(series)
    elif series is not None:
        form, definitions = "series", series.names
        entries = [x for x in (*series.C, *series.axes, *series.arm) if x.free_symbols]
    if alone:
        vectors: Any = derivation.vectors
        form, kinds = "vectors", (vectors, *vectors.others)
        entries = [] if vectors.average is None else vectors.average.flat()
        entries += terms_of_springs(vectors)
        definitions = tuple(dict.fromkeys(d for kind in kinds for d in kind.names))
        of_kinds = [e for kind in kinds for e in kind.leg]
        equations = (*vectors.pose, *of_kinds, *vectors.of_rod)
    written = [*(d for d in definitions if d.expression.free_symbols), *equations]
    entries = different_entries(entries)
    row = Row(
        robot=stem,
        pose=pose,
        form=form,
        seconds=seconds,
        operations=operations_of(entries, definitions)
        + sum(operations_of_vectors(e.expression) for e in equations),
        lines=len(written) + len(entries),
        names=len(definitions),
        sets=len(K),
        error=error,
        defects=tuple(defects),
    )
    return row, derivation


def terms_of_springs(form: VectorForm) -> list[Any]:
    """Each drive and each beam is a term of C."""
    return [c for _, _, c in form.drives] + [x for *_, own in form.beams for x in own]


def operations_of_vectors(expression: Any) -> int:
    """Operations of an expression of vectors: sums, products and norms count one each."""
    if isinstance(expression, sp.Expr):
        return count_of(expression)
    parts = expression.args
    own = len(parts) - 1 if isinstance(expression, Sum) else 1
    is_plain = isinstance(expression, Coordinates | Vector | Stacked | sp.Tuple) or not parts
    return (0 if is_plain else own) + sum(map(operations_of_vectors, parts))


def random_places(
    robot: rs.Robot, pose: str, sets: int
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Values of all symbols at which the legs close, and K in numbers (sets, n, n)."""
    placed = place_robot(robot, POSES[pose])
    at_all = list(closed_places(placed, sets=sets, poses=1 if robot.symbols else sets))
    values = {name: np.array([own[name] for own, _, _ in at_all]) for name in at_all[0][0]}
    return values, np.array([result.K for _, result, _ in at_all])


def largest_error(found: np.ndarray, K: np.ndarray) -> float:
    """Largest difference of an entry, relative to both of its ends."""
    return float(np.max(np.abs(found - K) / _sizes(K)))


def _sizes(K: np.ndarray) -> np.ndarray:
    diagonal = np.maximum(np.diagonal(K, axis1=1, axis2=2), 0)
    sizes = np.sqrt(diagonal[:, :, None] * diagonal[:, None, :])
    largest = np.broadcast_to(np.max(sizes, axis=(1, 2), keepdims=True), sizes.shape)
    return np.where(sizes > _ZERO * largest, sizes, largest)


def wasted(definitions: Sequence[Definition], values: Mapping[str, np.ndarray]) -> list[str]:
    """Names that are zero at all sets of values, or a copy of another up to the sign."""
    known: dict[str, Any] = dict(values)
    found, seen = [], []
    for d in definitions:
        symbols = sorted(d.expression.free_symbols, key=str)
        terms = sp.lambdify(symbols, sp.Add.make_args(d.expression))
        parts = [np.asarray(x, dtype=float) for x in terms(*(known[s.name] for s in symbols))]
        value = known[d.symbol.name] = sum(parts)
        size = sum(np.abs(part) for part in parts)
        if np.all(np.abs(value) <= _ZERO * size):
            found.append(f"{d.symbol} is zero")
            continue
        for other, its in seen:
            if any(np.all(np.abs(value - sign * its) <= _ZERO * size) for sign in (1, -1)):
                found.append(f"{d.symbol} is a copy of {other}")
                break
        seen.append((d.symbol, value))
    return found


def hidden_zeros(formula: sp.ImmutableMatrix, K: np.ndarray) -> list[str]:
    """Entries of K that are zero at all sets, and are not written as 0."""
    zero = np.all(np.abs(K) <= _ROUNDING * _sizes(K), axis=0)
    return [
        f"K{i + 1}{j + 1} is zero, and is written {sp.sstr(formula[i, j])[:60]}"
        for i, j in zip(*np.nonzero(np.triu(zero)), strict=True)
        if formula[int(i), int(j)] != 0
    ]


def different(K: sp.ImmutableMatrix) -> dict[sp.Expr, str]:
    """Different entries that are not zero, and the places of each; alike up to a sign are one."""
    places: dict[sp.Expr, str] = {}
    for i in range(K.rows):
        for j in range(i, K.cols):
            entry, place = K[i, j], f"K{i + 1}{j + 1}"
            if -entry in places:
                places[-entry] += f" = -{place}"
            elif entry != 0:
                places[entry] = f"{places[entry]} = {place}" if entry in places else place
    return places


def lines_of(named: InNames) -> str:
    """The names and the different entries, one a line."""
    lines = [f"  {d.symbol} = {d.expression}" for d in named.definitions]
    return "\n".join([*lines, *(f"  {where} = {x}" for x, where in different(named.K).items())])


def _write_table(page: Path, rows: Sequence[Row]) -> None:
    """Put rows in place of those of the same robots and poses between the marks of a page."""
    before, mark, rest = page.read_text(encoding="utf-8").partition(_BEGINNING)
    old, end, after = rest.partition(_END)
    if not (mark and end):
        raise ValueError(f"{page} has no place for the table: {_BEGINNING} and {_END}")
    written = {}
    for line in (line for line in old.splitlines() if line.startswith("|")):
        robot, pose = (cell.strip() for cell in line.split("|")[1:3])
        if pose in POSES:
            written[robot, pose] = line
    written |= {(row.robot, row.pose): row.in_table for row in rows}
    lines = [
        f"Processor: {_processor()}, one thread, SymPy {sp.__version__}.",
        "",
        "| robot | pose | form | s | operations | lines | names | sets | difference |",
        "|---|---|---|---|---|---|---|---|---|",
        *(written[place] for place in sorted(written)),
    ]
    table = "\n".join(lines)
    page.write_text(f"{before}{mark}\n\n{table}\n\n{end}{after}", encoding="utf-8")


def _processor() -> str:
    """Its name, where the system has it in a file."""
    facts = Path("/proc/cpuinfo")
    if facts.exists():
        for line in facts.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    import platform

    return platform.processor() or platform.machine()

"""The stiffness of a snapshot whose points, axes and springs are formulas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.agreement import AGREED, check_value
from robostiff.analytic.closed_sum import closed_sum
from robostiff.analytic.numeric_value import values_of
from robostiff.analytic.record_reading import ClosedReading
from robostiff.errors import InputError
from robostiff.model import Snapshot, with_entries
from robostiff.model.entries import formulas
from robostiff.record import Record
from robostiff.recorded import LegRecorder, entry_reader
from robostiff.spatial import exact_number

# Terms that an entry may have on the way.
_LIMIT = 1_000_000

# Ranges of the symbols at which a snapshot is recorded and compared with numbers; some suit
# lengths, some sines.
_RANGES = ((0.5, 1.5), (0.1, 0.9))
_SAMPLES = 5
_TRIES = 6
_SEED = 11


@dataclass(frozen=True)
class SnapshotFormula:
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


def snapshot_formula(snapshot: Snapshot) -> SnapshotFormula:
    """Stiffness of a robot whose points, axes and springs are formulas, K = W (W^T C W)^-1 W^T.

    Recorded as a robot is, and written out in exact arithmetic.

    Parameters
    ----------
    snapshot : Snapshot
        One pose; its arrays hold SymPy expressions, numbers or both. Axes are unit vectors, and
        square roots in them are kept with their relation.

    Returns
    -------
    SnapshotFormula

    Raises
    ------
    DisagreementError
        When formula and numerical form differ at random values of the symbols.
    InputError
        When a transmitted wrench meets no compliance, so that no matrix exists, or the platform
        is flexible.

    Examples
    --------
    A spring along x between two ball joints a length L apart, seen from its end:

    >>> from robostiff.model import Actuated, Passive, PlacedFreedom, PlacedLeg
    >>> k, L = sp.symbols("k L", positive=True)
    >>> tip, x = np.array([L, 0, 0], dtype=object), np.array([1, 0, 0], dtype=object)
    >>> balls = [PlacedFreedom(e, p, 0, "ball", Passive())
    ...          for p in (0 * tip, tip) for e in np.eye(3, dtype=int).astype(object)]
    >>> slide = PlacedFreedom(x, 0 * tip, None, "slide", Actuated(k))
    >>> rod = Snapshot("rod", (PlacedLeg("rod", (slide, *balls), tip),), tip)
    >>> snapshot_formula(rod).K[0, 0]
    k
    """
    if snapshot.platform is not None:
        raise InputError(
            f"formula of snapshot {snapshot.name!r}",
            got="a flexible platform",
            expected="a rigid one: flexible platforms are computed in numbers only",
        )
    symbols, samples, twin = _sampled(snapshot)
    record = Record(samples)
    exact = with_entries(snapshot, exact_number)
    entries = with_entries(exact, entry_reader(record, exact=True))
    length = float(twin.characteristic_length) or 1.0
    recorder = LegRecorder(record, entries.reference_point, snapshot.space, length)
    read = ClosedReading(record, symbols)
    legs = [recorder.leg(leg) for leg in entries.legs]
    written = [
        ([[read(x) for x in w] for w in leg.basis], [[read(x) for x in row] for row in leg.energy])
        for leg in legs
    ]
    found = closed_sum(written, snapshot.space.size, _LIMIT)
    _check(found.K, snapshot)
    return SnapshotFormula(found.K, found.legs)


def _sampled(snapshot: Snapshot) -> tuple[dict[str, Any], dict[str, Any], Snapshot]:
    """Symbols and random values of them by name, and the snapshot at the first of these values."""
    entries = list(formulas(snapshot))
    symbols = {str(x): x for x in sorted(_symbols(entries), key=str)}
    random = np.random.default_rng(_SEED)
    for attempt in range(_TRIES):
        low, high = _RANGES[attempt % len(_RANGES)]
        samples = {name: random.uniform(low, high, _SAMPLES) for name in symbols}
        each = [
            values_of(entries, {x: samples[name][i] for name, x in symbols.items()})
            for i in range(_SAMPLES)
        ]
        if np.all(np.isfinite(np.array(each, dtype=float))):
            return symbols, samples, _in_numbers(snapshot, entries, each[0])
    raise _without_values(snapshot, "entries without a real value")


def _symbols(entries: list[Any]) -> set[Any]:
    return set().union(*(x.free_symbols for x in entries))


def _in_numbers(snapshot: Snapshot, entries: list[Any], values: list[Any]) -> Snapshot:
    known = dict(zip(entries, map(float, values), strict=True))
    return with_entries(snapshot, lambda x: known.get(x, x))


def _check(K: Any, snapshot: Snapshot) -> None:
    """Compare the formula with the numerical form at random values of its symbols."""
    from robostiff.analysis import stiffness

    random = np.random.default_rng(_SEED + 1)
    entries = list(formulas(snapshot))
    symbols = sorted(_symbols(entries), key=str)
    for attempt in range(_TRIES):
        low, high = _RANGES[attempt % len(_RANGES)]
        values = {symbol: float(random.uniform(low, high)) for symbol in symbols}
        numbers = np.array(values_of(entries, values), dtype=float)
        if not np.all(np.isfinite(numbers)):
            continue
        try:
            twin = _in_numbers(snapshot, entries, numbers.tolist())
            result = stiffness(twin)
        except InputError:  # such as a compliance that is not positive at these values
            continue
        if result.answered:
            where, length = f"snapshot {snapshot.name!r}", float(twin.characteristic_length) or 1.0
            check_value(K, (), values, result.K, AGREED, where, length)
            return
    raise _without_values(snapshot, "no stiffness to compare with")


def _without_values(snapshot: Snapshot, got: str) -> InputError:
    return InputError(
        f"formula of snapshot {snapshot.name!r}",
        got=f"{got} at {_TRIES} sets of symbols between 0.1 and 1.5",
        expected="formulas that hold there: scale lengths to metres near 1",
    )

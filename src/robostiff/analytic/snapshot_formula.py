"""The stiffness of a snapshot whose points, axes and springs are formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.closed import closed_sum
from robostiff.analytic.placement.agreement import AGREED, check_value, random_values
from robostiff.analytic.reading.record_reading import ClosedReading
from robostiff.errors import InputError
from robostiff.model import Snapshot, with_entries
from robostiff.model.entries import formulas
from robostiff.record import Record
from robostiff.recorded import LegRecorder, entry_reader
from robostiff.spatial import exact_number

# Terms that an entry may have on the way.
_LIMIT = 1_000_000

_SAMPLES = 5
_SEED = 11


@dataclass(frozen=True)
class SnapshotFormula(Formula):
    """Stiffness of a robot and of its legs about the reference point, world axes.

    Attributes
    ----------
    K : sympy.ImmutableMatrix
        (n x n), every entry a sum of canonical fractions, those over one denominator added.
    legs : tuple of sympy.ImmutableMatrix
        Stiffness of each leg; they add up to K.
    name : str
    meanings : mapping of str to str
        Of given symbols.
    """

    K: sp.ImmutableMatrix
    legs: tuple[sp.ImmutableMatrix, ...]
    name: str = "K_C"
    meanings: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    is_of_legs = True


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
            expected="a rigid one",
            hint="use stiffness(snapshot), or derive(robot) of a model file",
        )
    given = list(formulas(snapshot))
    drawn = list(random_values(given, _SEED))
    if len(drawn) < _SAMPLES:
        raise _without_values(snapshot, "entries without a real value")
    symbols = {str(x): x for x in drawn[0][0]}
    samples = drawn[:_SAMPLES]
    record = Record({name: np.array([at[x] for at, _ in samples]) for name, x in symbols.items()})
    twin = _in_numbers(snapshot, given, drawn[0][1])
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
    _check(found.K, snapshot, given)
    return SnapshotFormula(found.K, found.legs, snapshot.name)


def _in_numbers(snapshot: Snapshot, entries: list[Any], values: np.ndarray) -> Snapshot:
    known = dict(zip(entries, values.tolist(), strict=True))
    return with_entries(snapshot, lambda x: known.get(x, x))


def _check(K: Any, snapshot: Snapshot, entries: list[Any]) -> None:
    """Compare the formula with the numerical form at random values of its symbols."""
    from robostiff.analysis import stiffness

    for values, numbers in random_values(entries, _SEED + 1):
        try:
            twin = _in_numbers(snapshot, entries, numbers)
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
        got=f"{got} at random values of its symbols between 0.1 and 1.5",
        expected="formulas that hold there: scale lengths to metres near 1",
    )

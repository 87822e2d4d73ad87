"""Wrenches that a leg carries, parallel blocks included, and their energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.record import Entry, is_zero
from robostiff.recorded.elimination import Column, transmitted_by
from robostiff.recorded.working_frame import LocalLeg, energy_of


@dataclass(frozen=True)
class Carried:
    """Ways in which a leg can carry load.

    Attributes
    ----------
    wrenches : list of Column
        W, what each way holds the end of the leg by; of several ways around a loop, some may hold
        it alike, or not at all.
    energy : (m, m) nested list
        Twice the elastic energy of their combinations; W^T C W where nothing is parallel.
    losses : list of entries or numbers
        Of the recorded pivots.
    redundant : tuple of bool
        Of the passive joints: those of the leg, those of the branches of its blocks, and whether
        each further block leaves anything free that the blocks before do.
    """

    wrenches: list[Column]
    energy: list[list[Any]]
    losses: list[Any]
    redundant: tuple[bool, ...]


def carried_by(leg: LocalLeg, rows: Sequence[int], length: float) -> Carried:
    """Ways in which a leg can carry load, in its working frame.

    The branches of a block add their ways to one another, and the joints of the leg take ways
    away. Of several blocks each must carry what the first does.

    Parameters
    ----------
    leg : LocalLeg
    rows : sequence of int
        Which rows of six a wrench has: all, or those of the plane.
    length : float
        Characteristic length [m].
    """
    n = len(rows)
    twists = [[twist[row] for row in rows] for twist in leg.twists]
    scale = [1.0 if row < 3 else length for row in rows]
    if not leg.blocks:
        start = [[int(i == k) for i in range(n)] for k in range(n)]
        found = transmitted_by(twists, start, scale)
        energy = energy_of(leg, found.wrenches, rows)
        return Carried(found.wrenches, energy, found.losses, found.redundant)
    blocks = [[carried_by(branch, rows, length) for branch in block] for block in leg.blocks]
    ways = [[w for branch in block for w in branch.wrenches] for block in blocks]
    inner = sum(map(len, ways))
    columns: list[Column] = []
    conditions: list[Column] = []
    for number, own in enumerate(ways):
        first = len(columns)
        for k, w in enumerate(own):
            held = w if number == 0 else [0] * n
            columns.append([*held, *(int(j == first + k) for j in range(inner))])
        if number:
            conditions += _alike(own, first, n, inner)
    scale += [1.0 / wrench_size(w, scale) for own in ways for w in own]
    idle = [0] * inner
    found = transmitted_by([*conditions, *([*t, *idle] for t in twists)], columns, scale)
    branches = [branch for block in blocks for branch in block]
    return Carried(
        wrenches=[way[:n] for way in found.wrenches],
        energy=_energy(leg, found.wrenches, rows, branches),
        losses=[*found.losses, *(loss for branch in branches for loss in branch.losses)],
        redundant=(
            *found.redundant[len(conditions) :],
            *(r for branch in branches for r in branch.redundant),
            *(any(found.redundant[k : k + n]) for k in range(0, len(conditions), n)),
        ),
    )


def _alike(ways: list[Column], first: int, n: int, inner: int) -> list[Column]:
    """Equations that a further block carries the same wrench as the first: F - A x = 0."""
    conditions = []
    for row in range(n):
        condition: Column = [int(row == i) for i in range(n)] + [0] * inner
        for k, w in enumerate(ways):
            condition[n + first + k] = -w[row]
        conditions.append(condition)
    return conditions


def _energy(
    leg: LocalLeg, ways: Sequence[Column], rows: Sequence[int], branches: Sequence[Carried]
) -> list[list[Any]]:
    """Energy of the leg's own springs, and of every branch in its own share."""
    n, m = len(rows), len(ways)
    energy = energy_of(leg, [way[:n] for way in ways], rows)
    start = n
    for branch in branches:
        stop = start + len(branch.wrenches)
        shares = [way[start:stop] for way in ways]
        given = [times(branch.energy, share) for share in shares]
        for i in range(m):
            for j in range(i, m):
                for x, y in zip(given[i], shares[j], strict=True):
                    if not (is_zero(x) or is_zero(y)):
                        energy[i][j] = energy[i][j] + x * y
                energy[j][i] = energy[i][j]
        start = stop
    return energy


def times(matrix: list[list[Any]], column: Column) -> Column:
    """A matrix times a column; zeros leave no trace."""
    product = []
    for row in matrix:
        total: Any = 0
        for a, x in zip(row, column, strict=True):
            if not (is_zero(a) or is_zero(x)):
                total = total + a * x
        product.append(total)
    return product


def wrench_size(wrench: Column, scale: Sequence[float]) -> float:
    """Norm of a scaled wrench, the mean over the samples; 1 of one that holds nothing."""
    squares = [
        np.mean((x.sample if isinstance(x, Entry) else float(x)) ** 2) / s**2
        for x, s in zip(wrench, scale, strict=False)
    ]
    return float(np.sqrt(sum(squares))) or 1.0

"""What a map comes down to without its arrays: extremes, quantiles, histograms, shares.

Each reduction counts or compares values of some poses after others while they are in the cache, and
adds up what it has of several blocks, in any order: so much memory serves for any number of poses.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.maps.variables import Variable
from robostiff.compiled import PAGES, PLACES, count_by_digits
from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.spatial import as_floats

if TYPE_CHECKING:
    from robostiff.analysis.maps.job import MapJob

#: What a reduction has of some poses: arrays by name, with the entries of a variable first.
State = dict[str, np.ndarray]
#: A result: its name, labels of its first dimensions, values (..., entries of the variable), and
#: whether they have the unit of the variable.
Found = tuple[str, Mapping[str, Sequence[Any]], np.ndarray, bool]
_INFINITE, _SIGN = 0x7F80, 2**15  # first halves of numbers of 32 bits


@frozen
class Reduction(ABC):
    """What becomes of each variable of a map, or of the one that is named.

    Parameters
    ----------
    of : str, optional
        Name of a variable, such as ``translational_stiffness``; all of floats when left out.
    """

    of: str | None = None

    def variables(self, job: MapJob) -> list[Variable]:
        """Those that it is about.

        Raises InputError when there is none of this name.
        """
        known = {v.name: v for v in job.answers if v.is_float}
        if self.of is not None and self.of not in known:
            raise InputError(
                f"variable of {type(self).__name__}", got=self.of, expected=", ".join(known)
            )
        return [*known.values()] if self.of is None else [known[self.of]]

    @abstractmethod
    def initial_state(self, entries: int) -> State:
        """What it has of no poses."""

    def final_state(self, state: State) -> State:
        """What is to be kept of it once no more is added."""
        return state

    @abstractmethod
    def extend(self, state: State, values: np.ndarray, numbers: Sequence[int]) -> None:
        """Add values (entries, N) that may be none, at poses of such numbers."""

    def sum_of(self, a: State, b: State) -> State:
        """What it has of both: sums of counts."""
        return {name: counts + b[name] for name, counts in a.items()}

    @abstractmethod
    def results(self, state: State, name: str, entries: int, job: MapJob) -> Iterator[Found]:
        """Its results at all poses."""


@frozen
class Extremes(Reduction):
    """The least and the greatest value of each entry, and the poses where they are.

    Of several such poses the first counts.

    Examples
    --------
    >>> import robostiff as rs
    >>> grid = rs.Grid(x=rs.Axis(-0.1, 0.1, 21), y=rs.Axis(-0.1, 0.1, 21))
    >>> robot, least = rs.load("3-rpr"), [rs.Extremes("rotational_stiffness")]
    >>> found = rs.stiffness_map(robot, grid, reduce=least)
    >>> found.rotational_stiffness_at.sel(extreme="greatest", coordinate=["x", "y"]).values
    array([[ 0.1],
           [-0.1]])
    """

    def initial_state(self, entries: int) -> State:
        """Values (entries, 2), and numbers of poses, -1 where there is no value."""
        return {"ends": np.full((entries, 2), np.nan), "at": np.full((entries, 2), -1)}

    def extend(self, state: State, values: np.ndarray, numbers: Sequence[int]) -> None:
        """Look for the poses of entries that are beyond those before alone."""
        for k, (end, is_no_further) in enumerate(((np.fmin, np.less), (np.fmax, np.greater))):
            best, ends, at = end.reduce(values, axis=1), state["ends"][:, k], state["at"][:, k]
            for entry in np.flatnonzero(~(is_no_further(ends, best) | np.isnan(best))):
                number = numbers[int(np.argmax(values[entry] == best[entry]))]
                if ends[entry] != best[entry] or number < at[entry]:
                    ends[entry], at[entry] = best[entry], number

    def sum_of(self, a: State, b: State) -> State:
        """The lower and the higher ones; where they are the same, the first pose."""
        sign = np.array([1.0, -1.0])
        x, y = a["ends"] * sign, b["ends"] * sign
        earlier = (x == y) & (a["at"] <= b["at"])
        from_a = np.isnan(y) | (x < y) | earlier
        return {name: np.where(from_a, a[name], b[name]) for name in ("ends", "at")}

    def results(self, state: State, name: str, entries: int, job: MapJob) -> Iterator[Found]:
        """Values and coordinates [m, rad] are none where no pose has an answer."""
        ends = {"extreme": ["least", "greatest"]}
        yield f"{name}_extreme", ends, state["ends"].T, True
        poses = np.full((*state["at"].shape, len(job.columns.names)), np.nan)
        for place in np.argwhere(state["at"] >= 0):
            where = np.unravel_index(int(state["at"][tuple(place)]), job.source.shape)
            poses[tuple(place)] = job.poses(tuple(slice(int(i), int(i) + 1) for i in where))[0]
        labels = {"coordinate": job.columns.names, **ends}
        yield f"{name}_at", labels, poses.transpose(2, 1, 0), False


@frozen
class Quantiles(Reduction):
    """Values below which given shares of the poses lie that have an answer.

    Counts of numbers that agree in their first fourteen binary digits decide, so that a quantile is
    right within 0.01 % of itself.

    Parameters
    ----------
    of : str, optional
        Name of a variable; all of floats when left out.
    shares : sequence of float
        From 0 to 1.

    Examples
    --------
    >>> import robostiff as rs
    >>> poses = rs.RandomPoses(1000, {"x": (-0.1, 0.1)}, seed=1)
    >>> wanted = [rs.Quantiles("rotational_stiffness", [0.05, 0.5])]
    >>> found = rs.stiffness_map(rs.load("3-rpr"), poses, reduce=wanted)
    >>> found.rotational_stiffness_quantile.dims
    ('share', 'principal_rotation')
    """

    shares: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75, 0.95)

    def __init__(self, of: str | None = None, shares: ArrayLike = shares) -> None:
        numbers = as_floats("shares of quantiles", shares, "numbers from 0 to 1")
        if numbers.ndim != 1 or not numbers.size or not np.all((numbers >= 0) & (numbers <= 1)):
            raise InputError("shares of quantiles", got=shares, expected="numbers from 0 to 1")
        object.__setattr__(self, "of", of)
        object.__setattr__(self, "shares", tuple(numbers.tolist()))

    def initial_state(self, entries: int) -> State:
        """Which row of the counts numbers of a first half have; row 0 for those without, so far."""
        return {
            "table": np.zeros((entries, PAGES), dtype=np.uint32),
            "counts": np.zeros((1, PLACES), dtype=int),
            "rows": np.ones((), dtype=int),
        }

    def extend(self, state: State, values: np.ndarray, numbers: Sequence[int]) -> None:
        """Count numbers by their digits; those whose first half is new get a row."""
        with np.errstate(over="ignore"):
            values = np.ascontiguousarray(values, dtype=np.float32)
        for row, table in zip(values, state["table"], strict=True):
            rest = row[count_by_digits(row, table, state["counts"])]
            if not rest.size:
                continue
            new, before = np.unique(rest.view(np.uint32) >> 16), int(state["rows"])
            table[new] = range(before, before + len(new))
            state["rows"] += len(new)
            if (missing := before + len(new) - len(state["counts"])) > 0:
                more = np.zeros((missing + before, PLACES), dtype=int)  # rarely: twice as many
                state["counts"] = np.concatenate([state["counts"], more])
            count_by_digits(rest, table, state["counts"])

    def final_state(self, state: State) -> State:
        """The counts, and of which entries and first halves of numbers they are, in order."""
        entry, upper = np.nonzero(state["table"])
        counts = state["counts"][state["table"][entry, upper]]
        return {"numbers": entry * PAGES + upper, "counts": counts}

    def sum_of(self, a: State, b: State) -> State:
        """The rows of both."""
        numbers = np.union1d(a["numbers"], b["numbers"])
        counts = np.zeros((len(numbers), PLACES), dtype=int)
        for state in (a, b):
            counts[np.searchsorted(numbers, state["numbers"])] += state["counts"]
        return {"numbers": numbers, "counts": counts}

    def results(self, state: State, name: str, entries: int, job: MapJob) -> Iterator[Found]:
        """The middle of the numbers of the same digits."""
        entry, upper = np.divmod(state["numbers"], PAGES)
        places = np.arange(PLACES, dtype=np.uint32) << 10
        middles = ((upper.astype(np.uint32) << 16)[:, None] + places + 0x200).view(np.float32)
        for infinite, value in ((_INFINITE, np.inf), (_INFINITE + _SIGN, -np.inf)):
            middles[upper == infinite, 0] = value
        quantiles = np.full((len(self.shares), entries), np.nan)
        for k in range(entries):
            values, counts = middles[entry == k].ravel(), state["counts"][entry == k].ravel()
            order = np.argsort(values)[: np.count_nonzero(~np.isnan(values))]
            below = np.cumsum(counts[order])
            if below.size and below[-1]:
                least = np.maximum(np.ceil(np.array(self.shares) * below[-1]), 1)
                quantiles[:, k] = values[order[np.searchsorted(below, least)]]
        yield f"{name}_quantile", {"share": self.shares}, quantiles, True


@frozen
class _Counts(Reduction):
    """Counts of values from each of some edges on."""

    edges: tuple[float, ...] = ()

    def initial_state(self, entries: int) -> State:
        """How many values are at least each edge, and how many there are (entries, edges + 1)."""
        return {"counts": np.zeros((entries, len(self.edges) + 1), dtype=int)}

    def extend(self, state: State, values: np.ndarray, numbers: Sequence[int]) -> None:
        """Compare with edge after edge, which is faster than a search for each value."""
        with np.errstate(over="ignore"):
            edges = np.array(self.edges, dtype=values.dtype)  # rounded, to the next higher number
        low = edges < np.array(self.edges)
        edges[low] = np.nextafter(edges[low], np.inf, dtype=values.dtype)
        for k, edge in enumerate((*edges, -np.inf)):
            state["counts"][:, k] += np.count_nonzero(values >= edge, axis=1)


@frozen
class Histogram(_Counts):
    """How many poses have a value from one edge to below the next.

    Parameters
    ----------
    of : str
        Name of a variable.
    edges : (n,) array
        Ascending, in the unit of the variable.

    Examples
    --------
    >>> import robostiff as rs
    >>> poses = rs.RandomPoses(1000, {"x": (-0.1, 0.1)}, seed=1)
    >>> wanted = [rs.Histogram("rotational_stiffness", [0, 1e5, 1e6, 1e9])]
    >>> found = rs.stiffness_map(rs.load("3-rpr"), poses, reduce=wanted)
    >>> int(found.rotational_stiffness_count.sum())
    1000
    """

    def __init__(self, of: str, edges: ArrayLike) -> None:
        numbers = as_floats("edges of a histogram", edges, "ascending numbers")
        if numbers.ndim != 1 or len(numbers) < 2 or not np.all(np.diff(numbers) > 0):
            raise InputError("edges of a histogram", got=edges, expected="ascending numbers")
        super().__init__(of, tuple(numbers.tolist()))

    def results(self, state: State, name: str, entries: int, job: MapJob) -> Iterator[Found]:
        """Counts from each edge to the next; values beyond the edges are left out."""
        counts = -np.diff(state["counts"][:, :-1]).T
        yield f"{name}_count", {f"{name}_from": self.edges[:-1]}, counts, False


@frozen
class ShareAbove(_Counts):
    """The share of poses whose value is at least a limit, of those that have an answer.

    Parameters
    ----------
    of : str
        Name of a variable.
    limits : float or (n,) array
        In its unit.

    Examples
    --------
    >>> import robostiff as rs
    >>> grid = rs.Grid(x=rs.Axis(-0.1, 0.1, 21))
    >>> wanted = [rs.ShareAbove("rotational_stiffness", [0, 1e12])]
    >>> found = rs.stiffness_map(rs.load("3-rpr"), grid, reduce=wanted)
    >>> found.rotational_stiffness_share_above[:, 0].values
    array([1., 0.])
    """

    def __init__(self, of: str, limits: ArrayLike) -> None:
        numbers = np.unique(as_floats("limits of a share", limits, "numbers"))
        super().__init__(of, tuple(numbers.tolist()))

    def results(self, state: State, name: str, entries: int, job: MapJob) -> Iterator[Found]:
        """None where no pose has an answer."""
        counts = state["counts"].T
        with np.errstate(invalid="ignore"):
            shares = counts[:-1] / counts[-1]
        yield f"{name}_share_above", {f"{name}_limit": self.edges}, shares, False


def check_reductions(reductions: Sequence[Reduction], job: MapJob) -> None:
    """Raise InputError where one is none, or its variable is no quantity of the map."""
    for reduction in reductions:
        if not isinstance(reduction, Reduction):
            expected = "Extremes(), Quantiles(), Histogram(name, edges), ShareAbove(name, limit)"
            raise InputError("reduction of a map", got=reduction, expected=expected)
        reduction.variables(job)
    names = [(type(r), v.name) for r in reductions for v in r.variables(job)]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        got = f"{twice[0].__name__} of {twice[1]} twice"
        raise InputError("reductions of a map", got=got, expected="each once")
    if len({r.shares for r in reductions if isinstance(r, Quantiles)}) > 1:
        raise InputError("shares of quantiles", expected="the same ones for all variables")

"""The assembly mode of a recorded leg: what keeps it nearest to its home coordinates."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np

from robostiff.frozen import frozen, replace
from robostiff.kinematics.closure.body import ClosedLeg, direction_across
from robostiff.kinematics.closure.leg_forms import Post, RootSigns
from robostiff.kinematics.closure.leg_solver import LegSolver
from robostiff.kinematics.formula import FormulaPose, Site
from robostiff.kinematics.turn import turn_about, turn_by_vector_of_entries
from robostiff.model import Leg
from robostiff.record import Entry, cosine, most_size, sine, square_root
from robostiff.spatial import exact_number

_EQUAL, _AT_HOME = 1e-9, 1e-12  # distances from home


@frozen
class OtherMode:
    """Why a leg closes in the mode of a record, and not in another one."""

    # all positive where the mode of the record is nearer to the home coordinates
    nearer: tuple[Any, ...]
    # all positive where the drive is within its limits in the mode of the record, and in the other
    # one; empty where limits do not decide
    inside: tuple[Any, ...] = ()
    other_inside: tuple[Any, ...] = ()


def other_modes(
    leg: Leg, home: FormulaPose, solver: LegSolver, modes: Iterable[RootSigns]
) -> Iterator[OtherMode]:
    """Compare the mode of a leg with others that close it at home, as `nearest` does in numbers."""
    form, whole = solver.recorded_form, solver.leg.chain
    if form is None or isinstance(form, Post):
        return
    site, path = Site.of(leg, home, solver), whole.main_path
    given = whole.home_given[whole.main_places]
    limits = path.limits[:, form.leading].tolist()
    decide = not given[form.leading] and math.isfinite(limits[0])

    def closed(mode: RootSigns) -> _Mode:
        own: Any = site.own_form(replace(form, mode=mode))
        own = replace(own, spin_matters=True, name=None)  # it turns from home, as over poses
        return _Mode(site, own, own.leg_between(site.base, site.platform))

    own = closed(form.mode)
    for mode in modes:
        other = closed(mode)
        keys = (np.flatnonzero(given), [form.leading], range(path.size))
        each = (own.nearer_than(other, [int(i) for i in places]) for places in keys)
        is_first = solver.modes.index(form.mode) < solver.modes.index(mode)
        nearer = next(filter(None, each), (1 if is_first else -1,))
        within = [x.within(form.leading, limits) for x in (own, other) if decide]
        yield OtherMode(nearer, *within)


@frozen
class _Mode:
    """A leg in one of its modes, at home."""

    site: Site
    form: Any  # with the entries of the leg
    closed: ClosedLeg

    def nearer_than(self, other: _Mode, places: Collection[int]) -> tuple[Any, ...]:
        """By how much some of its coordinates are nearer to home, in slides [m] and in turns.

        Together where they disagree at the samples. Nothing is nearer than home itself.
        """
        leading = self.form.leading
        roots_differ = self.form.mode.root != other.form.mode.root
        if roots_differ and [*places] == [leading] and leading not in self.closed.slides:
            # positive where home is on the crank's side of the far end of the rod: it is nearer
            base, (rest, _) = self.site.base, self.form.circle
            m, n, _ = (base.direction(axis) for axis in rest.R.T)
            to_B = self.site.platform.point(self.form.B.point) - base.point(rest.p)
            home = self.site.home[leading]
            x = ((to_B @ m) * sine(home) - (to_B @ n) * cosine(home)) * self.form.mode.root
            return (x,) if most_size(x) > _EQUAL else ()
        slides = [i for i in places if i in self.closed.slides]
        turns = [i for i in places if i not in self.closed.slides]
        own = [sum(map(self._off, slides)), sum(map(self._turned, turns))]
        if all(most_size(x) <= _AT_HOME for x in own):
            return (1,) if places else ()
        slid = sum(map(other._off, slides)) - own[0]
        turned = sum(map(other._turned, turns)) - own[1]
        found = [x for x in (slid, turned) if most_size(x) > _EQUAL]
        if len(found) == 2 and min(map(_least, found)) < 0:
            return (slid * (1 / self.site.length) + turned,)
        if len(slides) == 1 and most_size(slid) > _EQUAL:
            # Shorter: where home is from their middle.
            a, b = (x.closed.slides[slides[0]].coordinate for x in (self, other))
            ahead = self.site.home[slides[0]] - (a + b) * 0.5
            found[0] = ahead if _least(a - b) > 0 else -ahead
        return tuple(found)

    def _off(self, place: int) -> Any:
        """How far a slide is from home."""
        x = self.closed.slides[place].coordinate - self.site.home[place]
        return square_root(x * x)

    def _turned(self, place: int) -> Any:
        """1 - cos of the angle of a joint from home; of a spherical joint a third of its part."""
        if place not in self.closed.ball_axes:
            return 1 - self._cosine(place, self.site.home[place])
        first = min(i for i in self.closed.ball_axes if place - 3 < i <= place)
        near, far = self.closed.after(first), self.closed.after(first + 3)
        axes = np.stack([self.site.zero.freedoms[first + k].axis for k in range(3)], axis=-1)
        home = axes @ turn_by_vector_of_entries(np.array(self.site.home[first : first + 3]))
        pairs = zip(home.T, axes.T, strict=True)
        trace = sum(near.direction(x) @ far.direction(y) for x, y in pairs)
        return (3 - trace) * Fraction(1, 6)

    def within(self, place: int, limits: tuple[float, float]) -> tuple[Any, ...]:
        """What is positive where a coordinate is within its limits."""
        if place in self.closed.slides:
            q = self.closed.slides[place].coordinate
            return q - exact_number(limits[0]), exact_number(limits[1]) - q
        low, high = limits
        if high - low >= 2.0 * np.pi:
            return ()
        return (self._cosine(place, 0.5 * (low + high)) - cosine(0.5 * (high - low)),)

    def _cosine(self, place: int, start: Any) -> Any:
        """Of the angle of a joint from another one."""
        axis = self.site.zero.freedoms[place].axis
        across = direction_across(axis)
        home = turn_about(axis, np.array(start, dtype=object)) @ across
        near, far = self.closed.after(place), self.closed.after(place + 1)
        return near.direction(home) @ far.direction(across)


def _least(x: Any) -> float:
    return float(np.min(np.asarray(x.sample if isinstance(x, Entry) else x)))

"""Bars: the elastic energy of parts, and two designs beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import numpy as np

from robostiff.analysis import Deflection
from robostiff.errors import InputError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.ellipsoid import AnyStiffness, Quality, principal_axes
from robostiff.plot.picture import Bars, Category, Group, Panel, PlainColour, Series
from robostiff.plot.posture import single_stiffness
from robostiff.plot.prefix import prefixed, short

_MOST = 7  # kinds of parts that colours distinguish
_BARS = 15  # of parts of a network


def energy_shares(deflection: Deflection, *, backend: PlotBackend[Drawn] = PAPER) -> Drawn:
    """Draw the share of every leg in the elastic energy, part by part.

    Parts of one name in several legs have one colour; beyond seven names, those with the least
    energy are added up. A network has no legs: its parts with the most energy have a bar each.

    Parameters
    ----------
    deflection : Deflection
    backend : Matplotlib

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        When it is no deflection.
    NoAnswerError
        When there is no deflection.

    Examples
    --------
    >>> import robostiff as rs
    >>> bent = rs.deflection(rs.load("hexapod"), wrench=[0, 0, -1000, 0, 0, 0])
    >>> rs.plot.energy_shares(bent).get_xlabel()
    'share of elastic energy [%]'
    """
    if not isinstance(deflection, Deflection):
        raise InputError(
            "deflection of a plot",
            got=deflection,
            expected="a result of rs.deflection(robot, pose, wrench)",
        )
    _ = deflection.twist  # raises with the reason when there is none
    if len(deflection.leg_wrenches) < 2:
        return drawn_by(backend, _part_by_part(deflection))
    # in the order of the robot
    legs = list(dict.fromkeys(own.leg for own in (*deflection.reactions, *deflection.parts)))
    totals: dict[str, float] = {}
    shares: dict[tuple[str, str], float] = {}
    for part in deflection.parts:
        percent = 100 * part.share
        totals[part.part] = totals.get(part.part, 0.0) + percent
        key = (part.leg, part.part)
        shares[key] = shares.get(key, 0.0) + percent
    names = sorted(totals, key=lambda name: -round(totals[name], 9))
    kept, rest = (names, []) if len(names) <= _MOST + 1 else (names[:_MOST], names[_MOST:])
    series = [
        Series(name, Category(i), np.array([shares.get((leg, name), 0.0) for leg in legs]))
        for i, name in enumerate(kept)
    ]
    if rest:
        added = [sum(shares.get((leg, name), 0.0) for name in rest) for leg in legs]
        series.append(Series(f"{len(rest)} more parts", PlainColour.MUTED, np.array(added)))
    whole = np.sum([one.values for one in series], axis=0) if series else np.zeros(len(legs))
    groups = tuple(Group(leg, f"{share:.1f} %") for leg, share in zip(legs, whole, strict=True))
    return drawn_by(backend, _bars(deflection, groups, tuple(series)))


def _part_by_part(deflection: Deflection) -> Bars:
    """A bar for each part, the rest in one."""
    most = _BARS + (len(deflection.parts) == _BARS + 1)
    parts, rest = deflection.parts[:most], deflection.parts[most:]
    is_leg = len({part.leg for part in parts}) == 1  # whose name says nothing
    names = [part.part if is_leg else part.name for part in parts]
    values = [100 * part.share for part in parts]
    if rest:
        names.append(f"{len(rest)} more parts")
        values.append(100 * sum(part.share for part in rest))
    rows = zip(names, values, strict=True)
    groups = tuple(Group(name, f"{value:.1f} %") for name, value in rows)
    return _bars(deflection, groups, (Series("", Category(0), np.array(values)),))


def _bars(deflection: Deflection, groups: tuple[Group, ...], series: tuple[Series, ...]) -> Bars:
    times, unit = prefixed(deflection.energy, "J")
    return Bars(
        f"{deflection.stiffness.name}: elastic energy",
        (Panel("share of elastic energy [%]", groups, series),),
        is_stacked=True,
        notes=(f"elastic energy {short(times * deflection.energy)} {unit}",),
    )


class Measure(Enum):
    """Values by which two stiffnesses are compared.

    ``PRINCIPAL``
        Principal stiffnesses: of forces with rotations held, of moments with displacements held.
    ``DIAGONAL``
        The entries on the diagonal of K.
    """

    PRINCIPAL = "principal stiffnesses"
    DIAGONAL = "diagonal of the stiffness matrix"


def comparison(
    first: AnyStiffness | Deflection,
    second: AnyStiffness | Deflection,
    measure: Measure = Measure.PRINCIPAL,
    *,
    names: tuple[str, str] | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw two stiffnesses, or two deflections, side by side, with the ratio second over first.

    Parameters
    ----------
    first, second : Stiffness or Deflection
        Both of one kind and one space.
    measure : Measure
        Of stiffnesses; deflections are compared by displacements and rotations.
    names : tuple of two str, optional
        What to call them; the names of the robots when left out.
    backend : Matplotlib

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        When the two are of different kinds.
    NoAnswerError
        When one has no answer.

    Examples
    --------
    >>> import robostiff as rs
    >>> thin, thick = rs.load("hexapod"), rs.load("gough-stewart-b-beams")
    >>> axes = rs.plot.comparison(rs.stiffness(thin), rs.stiffness(thick))
    """
    if isinstance(first, Deflection) and isinstance(second, Deflection):
        one, other = first.stiffness, second.stiffness
    else:
        one = single_stiffness(first, "a comparison")
        other = single_stiffness(second, "a comparison")
    if one.space is not other.space:
        raise InputError(
            "comparison of two designs",
            got=f"matrices of {one.space.size} and {other.space.size} rows",
            expected="two of one size",
        )
    called = names or (one.name, other.name)
    if names is None and called[0] == called[1]:
        called = f"{called[0]}, first", f"{called[1]}, second"
    d, title, shifts, turns = one.space.translations, measure.value, "translational", "rotational"
    words: tuple[str, ...] = ()
    if isinstance(first, Deflection) and isinstance(second, Deflection):
        title, shifts, turns, units = "deflection", "displacement", "rotation", ("m", "rad")
        words, values = one.space.twist_order, (first.twist, second.twist)
    elif measure is Measure.DIAGONAL:
        shifts, turns, units = "force / displacement", "moment / rotation", ("N/m", "N m/rad")
        pairs = zip(one.space.wrench_order, one.space.twist_order, strict=True)
        words, values = tuple(map("/".join, pairs)), (np.diag(one.K), np.diag(other.K))
    else:
        qualities = (Quality.STIFFNESS, Quality.ROTATIONAL_STIFFNESS)
        units = tuple(own.unit for own in qualities)
        values = tuple(
            np.concatenate([principal_axes(own, quality).lengths for quality in qualities])
            for own in (one, other)
        )
        # softest first, as in maps
        for n in (d, one.space.size - d):
            words += (("stiffness",), ("least", "most"), ("least", "middle", "most"))[n - 1]
    parts = ((shifts, units[0], slice(d)), (turns, units[1], slice(d, None)))
    panels = tuple(
        _panel(label, unit, words[own], [v[own] for v in values], called)
        for label, unit, own in parts
    )
    return drawn_by(backend, Bars(title, panels))


def _panel(
    label: str, unit: str, names: Sequence[str], both: list[np.ndarray], called: tuple[str, str]
) -> Panel:
    """Quantities (n,) with one unit of two designs, with the ratio second over first."""
    largest = float(np.max(np.abs(both)))
    times, unit = prefixed(largest, unit)
    # beside the largest they are rounding
    values = [np.where(np.abs(v) <= 1e-12 * largest, 0.0, v) for v in both]
    texts = [[short(times * value) for value in own] for own in values]
    for i, (one, other) in enumerate(zip(*values, strict=True)):
        if one != 0:
            texts[1][i] += f" (× {short(other / one)})"
    series = tuple(
        Series(name, Category(i), times * own, tuple(written))
        for i, (name, own, written) in enumerate(zip(called, values, texts, strict=True))
    )
    return Panel(f"{label} [{unit}]", tuple(map(Group, names)), series)

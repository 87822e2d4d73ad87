"""Elastic energy of legs and parts as bars."""

from __future__ import annotations

import numpy as np

from robostiff.analysis import Deflection
from robostiff.errors import InputError
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.picture import Bars, Category, Group, Panel, PlainColour, Series
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
    backend : Matplotlib or Plotly

    Returns
    -------
    Axes or Figure
        Of the backend.

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
    return drawn_by(backend, energy_picture(deflection))


def energy_picture(deflection: Deflection) -> Bars:
    """The picture of `energy_shares`, as data."""
    _ = deflection.twist  # raises with the reason when there is none
    if not deflection.leg_wrenches:
        return _of_network(deflection)
    legs = list(dict.fromkeys(_legs_in_order(deflection)))
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
    return _bars(deflection, groups, tuple(series))


def _of_network(deflection: Deflection) -> Bars:
    """A bar for each part, the rest in one."""
    parts, rest = deflection.parts[:_BARS], deflection.parts[_BARS:]
    names = [part.part if part.leg == "network" else f"{part.leg}/{part.part}" for part in parts]
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


def _legs_in_order(deflection: Deflection) -> list[str]:
    """Names of the legs in the order of the robot."""
    along = [reaction.leg for reaction in deflection.reactions]
    return along + [part.leg for part in deflection.parts]

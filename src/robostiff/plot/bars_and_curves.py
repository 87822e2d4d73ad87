"""Charts: elastic energy of parts, two designs, forces over deflections, residuals, paths."""

from __future__ import annotations

from collections import defaultdict
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from robostiff.analysis import Deflection
from robostiff.errors import InputError, Words
from robostiff.markup import percent, prefixed, quantity, short
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.picture import Bars, Category, Curve, Curves, Panel, PlainColour, Series
from robostiff.plot.sketch import single_stiffness
from robostiff.plot.surfaces import AnyStiffness, Quality, principal_axes

if TYPE_CHECKING:
    import xarray

    from robostiff.compensation.compensate import Compensation
    from robostiff.identification.identified import Identified


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

    Raises
    ------
    InputError
        When it is no deflection.
    NoAnswerError
        When there is no deflection.
    """
    if not isinstance(deflection, Deflection):
        expected = "a result of rs.deflection(robot, pose, wrench)"
        raise InputError("deflection of a plot", got=deflection, expected=expected)
    _ = deflection.twist  # raises with the reason when there is none
    if len(deflection.leg_wrenches) < 2:  # a bar for each part, the rest in one
        most = _BARS + (len(deflection.parts) == _BARS + 1)
        parts, others = deflection.parts[:most], deflection.parts[most:]
        is_leg = len({part.leg for part in parts}) == 1  # whose name says nothing
        bars = {part.part if is_leg else part.name: part.share for part in parts}
        if others:
            bars[f"{len(others)} more parts"] = sum(part.share for part in others)
        series = [Series("", Category(0), 100 * np.array([*bars.values()]))]
        groups = list(bars)
    else:
        # in the order of the robot
        groups = list(dict.fromkeys(x.leg for x in (*deflection.reactions, *deflection.parts)))
        places = {leg: i for i, leg in enumerate(groups)}
        shares: dict[str, np.ndarray] = defaultdict(lambda: np.zeros(len(groups)))
        for part in deflection.parts:
            shares[part.part][places[part.leg]] += 100 * part.share
        names = sorted(shares, key=lambda name: -round(float(shares[name].sum()), 9))
        rest = names[_MOST:] if len(names) > _MOST + 1 else []
        shown = names[: len(names) - len(rest)]
        series = [Series(name, Category(i), shares[name]) for i, name in enumerate(shown)]
        if rest:
            added = np.sum([shares[name] for name in rest], axis=0)
            series.append(Series(f"{len(rest)} more parts", PlainColour.MUTED, added))
    whole = sum((bar.values for bar in series), start=np.zeros(len(groups)))
    notes = tuple(percent(share / 100, 1) for share in whole)
    panel = Panel("share of elastic energy [%]", tuple(groups), tuple(series), notes)
    title = f"{deflection.stiffness.name}: elastic energy"
    energy = f"elastic energy {quantity(deflection.energy, 'J')}"
    return drawn_by(backend, Bars(title, (panel,), is_stacked=True, notes=(energy,)))


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

    Raises
    ------
    InputError
        When the two are of different kinds.
    NoAnswerError
        When one has no answer.
    """
    if isinstance(first, Deflection) and isinstance(second, Deflection):
        one, other = first.stiffness, second.stiffness
    else:
        one = single_stiffness(first, "a comparison")
        other = single_stiffness(second, "a comparison")
    if one.space is not other.space:
        got = Words(f"matrices of {one.space.size} and {other.space.size} rows")
        raise InputError("comparison of two designs", got=got, expected="two of one size")
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
        units = tuple(quality.unit for quality in qualities)
        values = tuple(
            np.concatenate([principal_axes(result, quality).lengths for quality in qualities])
            for result in (one, other)
        )
        # softest first, as in maps
        for n in (d, one.space.size - d):
            words += (("stiffness",), ("least", "most"), ("least", "middle", "most"))[n - 1]
    panels = []
    for label, unit, rows in ((shifts, units[0], slice(d)), (turns, units[1], slice(d, None))):
        pair = [v[rows] for v in values]
        largest = float(np.max(np.abs(pair)))
        times, shown = prefixed(largest, unit)
        # beside the largest they are rounding
        pair = [np.where(np.abs(v) <= 1e-12 * largest, 0.0, v) for v in pair]
        texts = [[short(times * value) for value in v] for v in pair]
        for i, (a, b) in enumerate(zip(*pair, strict=True)):
            texts[1][i] += f" (× {short(b / a)})" if a != 0 else ""
        series = tuple(
            Series(name, Category(i), times * pair[i], tuple(texts[i]))
            for i, name in enumerate(called)
        )
        panels.append(Panel(f"{label} [{shown}]", words[rows], series))
    return drawn_by(backend, Bars(title, tuple(panels)))


_LEAST = 1e-6  # um: what is off a path by less is drawn so large


def load_curve(
    curve: xarray.Dataset, twist: str | None = None, *, backend: PlotBackend[Drawn] = PAPER
) -> Drawn:
    """Draw a force-deflection curve: how far the platform moves under multiples of a wrench.

    The path of equilibria is drawn where it is stable, and dashed where it is not; marks are the
    equilibria at the factors that were asked for.

    Parameters
    ----------
    curve : Dataset
        What ``rs.load_path`` returns.
    twist : str, optional
        Which displacement, such as ``dz``; the largest one when left out.
    backend : Matplotlib

    Raises
    ------
    InputError
        When the dataset is another, or has no displacement of this name.
    """
    if not hasattr(curve, "data_vars") or "path_factor" not in curve:
        names = getattr(curve, "data_vars", None)
        of = f"a dataset of {', '.join(map(str, names or ())) or 'nothing'}"
        got = curve if names is None else of
        raise InputError("force-deflection curve", got=got, expected="what rs.load_path returns")
    names = [str(name) for name in curve["twist"].to_numpy()]
    moved, path = curve["displacement"].to_numpy(), curve["path_displacement"].to_numpy()
    if twist is not None and twist not in names:
        raise InputError("twist of a force-deflection curve", got=twist, expected=", ".join(names))
    if twist is None:
        shifts = [i for i, name in enumerate(names) if name.startswith("d")]
        sizes = np.nanmax(np.abs(np.concatenate([moved, path])[:, shifts]), axis=0, initial=0.0)
        twist = names[shifts[int(np.argmax(sizes))]]
    i = names.index(twist)
    along, at = path[:, i], moved[:, i]
    largest = np.nanmax(np.abs(np.concatenate([along, at])), initial=0.0)
    times, unit = prefixed(float(largest), "m" if twist.startswith("d") else "rad")
    factor, stable = curve["path_factor"].to_numpy(), curve["path_stable"].to_numpy()
    # a stretch begins where the one before it ends
    leaves = ~stable | np.concatenate([~stable[1:], [False]])[: len(stable)]
    leaves = leaves | np.concatenate([[False], ~stable[:-1]])[: len(stable)]
    curves = [Curve("stable", times * np.where(stable, along, np.nan), factor, Category(0))]
    if not np.all(stable):
        unstable = times * np.where(leaves, along, np.nan)
        curves.append(Curve("unstable", unstable, factor, Category(1), is_dashed=True))
    marks = times * np.where(curve["stable"].to_numpy(), at, np.nan)
    factors = curve["factor"].to_numpy()
    curves.append(Curve("at the given loads", marks, factors, Category(0), has_marks=True))
    words = [
        f"{letter}{name[1:]} {quantity(float(value), unit)}"
        for name, value in zip(names, curve.attrs["wrench"], strict=True)
        for letter, unit in [("F", "N") if name.startswith("d") else ("M", "N m")]
        if value
    ]
    picture = Curves(
        f"{curve.attrs['robot']} under load",
        f"{twist} [{unit}]",
        "times the wrench",
        tuple(curves),
        (f"wrench {', '.join(words) or 'none'}",),
    )
    return drawn_by(backend, picture)


def residuals_picture(result: Identified) -> Curves:
    """Residuals of the three coordinates of markers over the readings [µm]."""
    readings = np.arange(1, len(result.measured) + 1, dtype=float)
    rest = 1e6 * result.residuals
    rest[result.measured.of_drives] = np.nan
    curves = [
        Curve(axis, readings, rest[:, k], Category(k))
        for k, axis in enumerate("xyz")
        if np.isfinite(rest[:, k]).any()
    ]
    title = f"Residuals of {result.robot.name}"
    return Curves(title, "reading", "residual [µm]", tuple(curves))


def compensation_picture(result: Compensation) -> Curves:
    """Shift of the platform from each point of the path, without and with correction, as data."""
    points = np.arange(1, len(result.target) + 1, dtype=float)
    curves = []
    for k, (name, twists) in enumerate(
        (("without correction", result.deviation), ("with correction", result.residual))
    ):
        moved = 1e6 * np.linalg.norm(twists[:, :3], axis=1)
        curves.append(Curve(name, points, np.maximum(moved, _LEAST), Category(k)))
    title = f"{result.robot.name} along a path"
    return Curves(title, "point", "off the path [µm]", tuple(curves), is_log=True)

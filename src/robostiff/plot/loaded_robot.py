"""A robot under finite loads and in its modes: shapes beside the unloaded one, and curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from robostiff.analysis import PartShare
from robostiff.errors import InputError
from robostiff.model import Snapshot
from robostiff.model.cable import CableRobot
from robostiff.plot.backend import PAPER, Drawn, PlotBackend, drawn_by
from robostiff.plot.geometry.displacement import finite_motions, spatial
from robostiff.plot.outline import of_cables, outline_of
from robostiff.plot.picture import Category, Curve, Curves, Item, LineWeight, Path
from robostiff.plot.posed_robot import Colouring, loaded_sketch
from robostiff.plot.prefix import prefixed, short
from robostiff.plot.sketch import Sketch, exaggeration_note
from robostiff.spatial import Space
from robostiff.statics import BodyPlaces, Equilibrium, Modes

if TYPE_CHECKING:
    import xarray

    from robostiff.statics.equations.problem import EquilibriumProblem

_COILS, _WIDE = 7, 0.012  # of a spring, and how wide they are, of the robot


def equilibrium(
    result: Equilibrium,
    *,
    colouring: Colouring = Colouring.LEGS,
    exaggeration: float | None = None,
    backend: PlotBackend[Drawn] = PAPER,
) -> Drawn:
    """Draw a robot where it comes to rest under finite loads, and without them in dashed lines.

    Parameters
    ----------
    result : Equilibrium
        What ``rs.equilibrium`` answers.
    colouring : Colouring
        Meaning of the colours: shares in the elastic energy.
    exaggeration : float, optional
        Factor of all displacements; 1 for the true shape. When left out, a round number from 1 on
        that draws the largest displacement as a tenth of the robot.
    backend : Matplotlib or Plotly

    Returns
    -------
    Axes or Figure
        Of the backend.

    Raises
    ------
    InputError
        When `result` is no equilibrium.
    NoAnswerError
        When there is none.

    Examples
    --------
    >>> import robostiff as rs
    >>> loaded = rs.equilibrium(rs.load("3-puu"), wrench=[500, 0, 0, 0, 0, 0])
    >>> rs.plot.equilibrium(loaded).get_title()
    '3-puu under load'
    """
    if not isinstance(result, Equilibrium):
        raise InputError(
            "equilibrium of a plot",
            got=result,
            expected="a result of rs.equilibrium(robot, pose, wrench), one of a batch",
        )
    _ = result.displacement  # raises with the reason when there is none
    posed, problem = result.posed, cast("EquilibriumProblem", result.problem)
    tensions = np.array([own.tension for own in result.springs])
    sketch = _sketch(posed, problem, result.places, result.shares, colouring, tensions)
    sketch = sketch.exaggerated(exaggeration, is_finite=True)
    notes = exaggeration_note(sketch.scale)
    notes += () if result.stable else ("the robot does not stay there",)
    load = problem.point, spatial(result.wrench, result.space.rows)
    more = _springs(posed, result, sketch) if isinstance(posed, Snapshot) else ()
    scene = sketch.scene(f"{result.name} under load", load, notes=notes, more=more)
    return drawn_by(backend, scene)


def _sketch(
    posed: Any,
    problem: EquilibriumProblem,
    places: BodyPlaces,
    shares: Sequence[PartShare],
    colouring: Colouring,
    tensions: np.ndarray | None = None,
) -> Sketch:
    """A machine of any kind with its bodies at other places, coloured by elastic energy."""
    if isinstance(posed, CableRobot):
        springs = problem.legs.springs
        ends = np.array([own.points for own in springs])
        names, space = [own.name for own in springs], Space.of_size(len(problem.rows))
        outline = of_cables(names, (ends[:, 0], ends[:, 1]), problem.point, space, tensions)
    else:
        outline = outline_of(posed)
    return loaded_sketch(outline, finite_motions(posed, places), shares, colouring)


def mode(
    modes: Modes, number: int = 1, side: float = 1.0, *, backend: PlotBackend[Drawn] = PAPER
) -> Drawn:
    """Draw a robot in one of its modes, at one end of the vibration, and at rest in dashed lines.

    Parameters
    ----------
    modes : Modes
        What ``rs.modes`` answers.
    number : int
        Of the mode, 1 for the slowest.
    side : float
        -1 for the other end of the vibration.
    backend : Matplotlib or Plotly

    Returns
    -------
    Axes or Figure
        Of the backend.

    Raises
    ------
    InputError
        When there is no such mode.

    Examples
    --------
    >>> import robostiff as rs
    >>> rs.plot.mode(rs.modes(rs.load("hexapod"), masses={"platform": 150})).get_title()
    'hexapod, mode 1: 49.65 Hz'
    """
    if not isinstance(modes, Modes):
        raise InputError("modes of a plot", got=modes, expected="a result of rs.modes(robot)")
    _ = modes.frequencies  # raises with the reason when there are none
    whole = isinstance(number, int) and not isinstance(number, bool)
    if not (whole and 1 <= number <= len(modes)):
        raise InputError(
            "number of a mode", got=number, expected=f"1 to {len(modes)}, the slowest first"
        )
    own = modes[number - 1]
    rate = f"{own.frequency:.4g} Hz" if own.growth == 0 else f"grows by {own.growth:.4g} /s"
    title = f"{modes.name}, mode {number}: {rate}"
    problem = cast("EquilibriumProblem", modes.problem)
    sketch = _sketch(modes.posed, problem, own.motion, own.shares, Colouring.PARTS)
    sketch = sketch.exaggerated(side * sketch.exaggerated(None).scale)
    scene = sketch.scene(title, at_rest="at rest")
    # room for both ends of the vibration
    margin = 0.1 * sketch.in_unit().factor * sketch.size
    low, high = scene.box
    return drawn_by(backend, replace(scene, frame=np.array([low - margin, high + margin])))


def _springs(posed: Snapshot, result: Equilibrium, sketch: Sketch) -> list[Item]:
    """Springs between bodies as coils, their ends displaced as the bodies are."""
    items: list[Item] = []
    label, factor = "spring", sketch.in_unit().factor
    for placed, own in zip(posed.springs, result.springs, strict=True):
        pairs = zip(placed.points, own.points, strict=True)
        a, b = (p + sketch.scale * (now - p) for p, now in pairs)
        about = f"{own.name}: {own.tension:.4g} N"
        points = factor * _coil(a, b, _WIDE * sketch.size)
        items.append(Path(points, Category(2), LineWeight.LINE, label=label, about=about))
        label = ""
    return items


def _coil(a: np.ndarray, b: np.ndarray, wide: float) -> np.ndarray:
    """A zigzag (n, 3) between two points."""
    d = b - a
    length = float(np.linalg.norm(d))
    if length == 0:
        return np.array([a, b])
    across = np.cross(d, np.eye(3)[np.argmin(np.abs(d))])
    across = wide * across / np.linalg.norm(across)
    s = np.linspace(0.2, 0.8, 2 * _COILS + 1)
    side = np.array([0.0, *((-1.0) ** np.arange(2 * _COILS - 1)), 0.0])
    inner = a + s[:, None] * d + side[:, None] * across
    return np.array([a, *inner, b])


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

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        When the dataset is another, or has no displacement of this name.

    Examples
    --------
    >>> import robostiff as rs
    >>> curve = rs.load_path(rs.load("3-puu"), None, [500, 0, 0, 0, 0, 0], [0.5, 1.0])
    >>> rs.plot.load_curve(curve).get_xlabel()
    'dx [mm]'
    """
    if "path_factor" not in curve:
        raise InputError(
            "force-deflection curve",
            got=f"a dataset of {', '.join(map(str, curve.data_vars)) or 'nothing'}",
            expected="what rs.load_path returns",
        )
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
        lost = times * np.where(leaves, along, np.nan)
        curves.append(Curve("unstable", lost, factor, Category(1), is_dashed=True))
    marks = times * np.where(curve["stable"].to_numpy(), at, np.nan)
    factors = curve["factor"].to_numpy()
    curves.append(Curve("at the given loads", marks, factors, Category(0), has_marks=True))
    words = [
        f"{letter}{name[1:]} {short(own * float(value))} {shown}"
        for name, value in zip(names, curve.attrs["wrench"], strict=True)
        for letter, base in [("F", "N") if name.startswith("d") else ("M", "N m")]
        for own, shown in [prefixed(abs(float(value)), base)]
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

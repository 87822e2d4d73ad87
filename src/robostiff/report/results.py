"""Findings, stiffness, what loads do, vibrations, another design, and slices of a map."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness, Deflection
from robostiff.analysis.free_motion import direction_in_words
from robostiff.errors import NoAnswerError
from robostiff.markup import (
    COMPLIANCE_UNITS,
    Block,
    Bullets,
    Cell,
    Facts,
    Folded,
    LabelledMatrix,
    Number,
    Paragraph,
    Section,
    SideBySide,
    Table,
    Tone,
    number,
    percent,
    quantity,
)
from robostiff.page.indices import centres, principal_table, ratios, worst_table
from robostiff.page.loads import KNOWN, matrix_under_load, stability_in_words
from robostiff.page.of_result import page_of
from robostiff.page.stiffness import energy_table, shown_twist, small_motion, stiffness_matrix
from robostiff.plot.backend import DATA
from robostiff.plot.bars_and_curves import comparison, energy_shares, load_curve
from robostiff.plot.map_pictures import OVERVIEW, map_slice
from robostiff.plot.map_selection import CLASSES
from robostiff.plot.picture import Bars, Field
from robostiff.plot.posed_robot import Colouring, equilibrium, mode, picture_of_posed
from robostiff.plot.stiffness_pictures import ellipsoid, free_motions
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure, Level, one_figure
from robostiff.spatial import Space

if TYPE_CHECKING:
    import xarray


Row = tuple[str, str]  # what it is, and its value with where or of what it is


def findings_section(contents: ReportContents) -> Section | None:
    """The findings beside a picture of the robot; nothing where there is neither."""
    result, rows = contents.stiffness, []
    if int(result.rank) >= 0:
        count = len(result.free_motions)
        free = "free in one way" if count == 1 else f"free in {count} ways"
        words = free if count else "held in every direction"
        rows.append(("rank", f"{int(result.rank)} of {result.space.size}: {words}"))
    if isinstance(result, CableStiffness) and np.all(result.answered):
        for word, i in (("least", np.argmin), ("greatest", np.argmax)):
            at = int(i(result.tensions))
            tension = quantity(float(result.tensions[at]), "N", 4)
            rows.append((f"{word} tension", f"{tension}, {result.cable_names[at]}"))
    if contents.indices is not None:
        worst = contents.indices.worst_deflection
        along = f"along {direction_in_words(worst.translational_direction)}"
        about = f"about {direction_in_words(worst.rotational_direction)}"
        most = (
            ("softest for a force", worst.translational, "m/N", along),
            ("softest for a moment", worst.rotational, "rad/(N m)", about),
        )
        rows += [(name, f"{quantity(v, unit, 4)} {at}") for name, v, unit, at in most if v]
    rows += _of_load(contents)
    for slowest in contents.modes.each[:1] if contents.modes is not None else ():
        rows.append(("slowest vibration", str(slowest)))
    if contents.found is not None:
        reached, poses = (contents.found.attrs[name] for name in ("poses_reachable", "poses"))
        part = f"{percent(int(reached) / int(poses))} of {poses}"
        rows.append(("poses of the map within reach", part))
    table = Facts(tuple(rows))
    if contents.posed is None:
        return Section("findings", "Findings", [table]) if rows else None
    picture = picture_of_posed(contents.posed, colouring=Colouring.NAMES)
    figure = one_figure("robot", "The robot at this pose.", picture)
    return Section("findings", "Findings", [SideBySide((table, figure)) if rows else figure])


def _of_load(contents: ReportContents) -> Iterator[Row]:
    bent = contents.deflection
    if bent is not None and not bent.has_answer:
        yield "under the load", str(bent.status)
    elif isinstance(bent, CableResponse):
        space, length = bent.before.space, float(bent.before.placed.characteristic_length)
        if bent.displacement is not None:
            yield from _moved(space, space.without_rounding(bent.displacement, length))
        yield "slack cables", ", ".join(bent.slack) or "none"
    elif bent is not None:
        yield from _moved(bent.stiffness.space, shown_twist(bent))
        for part in bent.parts[:1] if bent.energy > 0 else ():
            yield "most elastic energy", f"{percent(part.share)} in {part.name}"
        of_force = [a for a in bent.actuators if a.unit == "N"] or list(bent.actuators)
        if of_force:
            drive = max(of_force, key=lambda a: abs(a.load))
            load = quantity(float(drive.load), drive.unit, 4)
            yield "most loaded drive", f"{load}, {drive.name}"
    if contents.under_load is not None:
        at_rest, critical = contents.under_load.equilibrium, contents.under_load.critical
        if at_rest.has_answer:
            yield "under the finite load", stability_in_words(at_rest)
        words = f"none up to {number(critical.searched_to)} times the load"
        if critical.is_found:
            words = f"{number(critical.factor)} times the load: {critical.mode}"
        if critical.is_found or critical.searched_to > 0:
            yield "critical load", words


def _moved(space: Space, twist: np.ndarray) -> Iterator[Row]:
    """Magnitudes of displacement and rotation, and their directions."""
    for word, at, part, unit in (
        ("displacement", "along", twist[: space.translations], "m"),
        ("rotation", "about", twist[space.translations :], "rad"),
    ):
        size = float(np.linalg.norm(part))
        where = f" {at} {direction_in_words(part / size)}" if size else ""
        yield f"{word} under the load", f"{quantity(size, unit, 4)}{where}"


def matrices_section(contents: ReportContents) -> Section:
    """K and C with units, rank, free motions and decision: the page of the stiffness, and C."""
    result = contents.stiffness
    space, C = result.space, result.compliance
    blocks = list(page_of(result).blocks)
    at = next((i for i, block in enumerate(blocks) if isinstance(block, LabelledMatrix)), None)
    if at is None:
        blocks.insert(0, Paragraph(f"There is no stiffness matrix: status {result.status}."))
    elif C is None:
        words = Paragraph("K is singular: there is no compliance matrix.")
        blocks[at : at + 1] = [stiffness_matrix(result), words]
    else:
        units = COMPLIANCE_UNITS
        inverse = LabelledMatrix("C", C, space.twist_order, space.wrench_order, units)
        blocks[at] = SideBySide((stiffness_matrix(result), inverse))
    figures: list[Block] = []
    if result.free_motions and contents.posed is not None:
        picture = free_motions(result, within=contents.posed, backend=DATA)
        figures.append(one_figure("free-motions", "Free motions of the platform.", picture))
    if contents.indices is None:
        figures += _ellipsoid(contents)
    return Section("stiffness", "Stiffness and compliance", [*blocks, *figures])


def _ellipsoid(contents: ReportContents) -> list[Block]:
    """The ellipsoid of displacements; nothing where there is none."""
    result = contents.stiffness
    if result.space.translations < 3 or result.compliance is None:
        return []
    with suppress(NoAnswerError):
        picture = ellipsoid(result, within=contents.posed, backend=DATA)
        caption = "Displacements under unit forces in all directions (compliance ellipsoid)."
        return [one_figure("ellipsoid", caption, picture)]
    return []


def weakest_section(contents: ReportContents) -> Section | None:
    """Principal stiffnesses, worst directions and ratios; nothing where there is no matrix."""
    indices = contents.indices
    if indices is None:
        return None
    words = Paragraph(
        "The principal stiffnesses are those with all other displacements and rotations held. The "
        "largest displacement is with rotations free, the largest rotation with displacements free."
    )
    tables = (principal_table(indices), worst_table(indices), ratios(indices), centres(indices))
    figures = _ellipsoid(contents)
    blocks = SideBySide((tables, *figures)) if figures else SideBySide((tables[0], tables[1:]))
    return Section("weakest", "Where it is soft", [words, blocks])


def bending_section(contents: ReportContents) -> Section | None:
    """The page of what a load does, with the deformed shape; nothing without a load."""
    bent = contents.deflection
    if bent is None:
        return None
    blocks = [block for block in page_of(bent).blocks if block is not None]
    if not bent.has_answer:
        words = f"There is no deflection: status {bent.status}."
        if isinstance(bent, CableResponse):
            part = f"{percent(bent.carried)} of it are carried"
            words = f"The load is not carried: status {bent.status}; {part}."
        blocks += [Paragraph(words), Bullets(tuple(bent.advice), Tone.WARNING)]
    elif isinstance(bent, CableResponse):
        if contents.posed is not None:
            caption = "The robot where it rests under the load, and without it in dashed lines."
            deformed = one_figure("deformed", caption, picture_of_posed(contents.posed, bent))
            blocks[:1] = [SideBySide((blocks[0], deformed))]
    elif bent.energy > 0 and contents.posed is not None:
        table = energy_table(bent.parts, bent.energy, most=None)
        caption = "The robot under the load; colours show shares of the elastic energy."
        of = "each leg, part by part" if len(bent.leg_wrenches) > 1 else "each part"
        blocks = [
            SideBySide(tuple(b for b in blocks if getattr(b, "title", "") != table.title)),
            one_figure("deformed", caption, picture_of_posed(contents.posed, bent)),
            one_figure("energy", f"Elastic energy of {of}.", energy_shares(bent, backend=DATA)),
            Folded(f"{len(bent.parts)} parts, one by one", (table,)),
        ]
    return Section("load", "Under the load", blocks)


def finite_load_section(contents: ReportContents) -> Section | None:
    """Equilibrium, K with and without load, critical load and curve; nothing where not asked."""
    known = contents.under_load
    if known is None:
        return None
    result, robot = known.equilibrium, contents.robot
    words = stability_in_words(result) if result.has_answer else "no equilibrium was found"
    blocks: list[Block | None] = [Paragraph(f"Status {result.status}: {words}.")]
    if not robot.is_frozen and getattr(robot, "gravity", None) is not None:
        blocks.append(Paragraph("The weights of the robot act besides the load."))
    if result.advice:
        blocks.append(Bullets(tuple(result.advice), Tone.WARNING))
    if result.has_answer:
        bent = contents.deflection
        small: Any = [None] * result.space.size
        if isinstance(bent, Deflection) and bent.has_answer:
            small = shown_twist(bent)
        moved = result.space.without_rounding(result.displacement)
        heads = ["displacement", "under the load", "proportional to the load"]
        rows: list[list[Cell]] = [
            [name, small_motion(name, value), "none" if x is None else small_motion(name, x)]
            for name, value, x in zip(result.space.twist_order, moved, small, strict=True)
        ]
        tables = [Table(heads, rows)]
        # what the load changes of the diagonal of K, where there is one without load
        if np.all(contents.stiffness.answered) and result.status.has_stiffness:
            K, space = contents.stiffness.K, result.space
            rows = []
            names = zip(space.wrench_order, space.twist_order, strict=True)
            for i, (force, motion) in enumerate(names):
                half = slice(space.translations)
                if i >= space.translations:
                    half = slice(space.translations, None)
                part: Cell = "from none"
                if K[i, i] > KNOWN * np.max(np.diagonal(K)[half]):
                    part = Number(100 * float(result.K[i, i] / K[i, i] - 1), "%")
                rows.append([f"{force}/{motion}", part])
            tables.append(Table(["diagonal of K", "change by the load"], rows))
        words = (
            "K under load is the rate of the wrench that the legs carry; K total, less the rate of "
            "loads that turn with the platform, is what more load meets."
        )
        caption = "Where the robot comes to rest, without load in dashed lines."
        blocks += [
            SideBySide(tuple(tables)),
            matrix_under_load(result),
            Paragraph(words, Tone.QUIET),
            one_figure("loaded-shape", caption, equilibrium(result, backend=DATA)),
        ]
    if np.any(np.isfinite(known.curve["displacement"].to_numpy())):
        caption = "Force and deflection up to twice the load; dashed where the robot does not stay."
        blocks.append(one_figure("load-curve", caption, load_curve(known.curve, backend=DATA)))
    critical = known.critical
    if critical.is_found:
        factor = number(critical.factor)
        words = f"Critical load: {factor} times the load. There {critical.mode}."
    else:
        factor = number(critical.searched_to)
        sentence = f"No critical load was found up to {factor} times the load"
        words = f"{sentence}: {'; '.join(critical.advice)}." if critical.advice else f"{sentence}."
    blocks.append(Paragraph(words))
    return Section("finite-load", "Under finite load", blocks)


_DRAWN = 4


def vibrations_section(contents: ReportContents) -> Section | None:
    """The slowest modes, listed and animated; nothing of a robot without masses."""
    modes = contents.modes
    if modes is None:
        return None
    words = (
        "Small vibrations without load, of the masses of the model: parts, platform and what it "
        "carries. Drives are held at their coordinates by their own stiffness."
    )
    levels = tuple(
        Level(
            f"mode {i}: {number(vibration.frequency, 4)} Hz",
            mode(modes, i, backend=DATA),
            mode(modes, i, -1.0, backend=DATA),
        )
        for i, vibration in enumerate(modes.each[:_DRAWN], start=1)
    )
    caption = "The slowest modes, displacements exaggerated."
    figure = Figure("modes", caption, levels)
    return Section(
        "vibrations", "Natural frequencies", [Paragraph(words), *page_of(modes).blocks, figure]
    )


def comparison_section(contents: ReportContents) -> Section | None:
    """The robot and another design; nothing where there is no other."""
    other = contents.compared
    if other is None:
        return None
    first, second = contents.stiffness, other.stiffness
    names = (contents.robot.name, other.robot.name)
    title = f"Beside {names[1]}"
    if names[0] == names[1]:
        names = (f"{names[0]}, first", f"{names[1]}, second")
    rows: list[list[Cell]] = [
        ["status", str(contents.status), str(other.status)],
        ["rank", str(int(first.rank)), str(int(second.rank))],
    ]
    blocks: list[Block] = [Table(["", *names], rows)]
    advice = (*second.advice, *other.advice_of_load)
    blocks += [Bullets(advice, Tone.WARNING)] if advice else []
    if not (np.all(first.answered) and np.all(second.answered)):
        blocks.append(Paragraph("One of the two has no stiffness matrix to be compared."))
        return Section("comparison", title, blocks)
    blocks.append(replace(stiffness_matrix(second), symbol=f"K of {names[1]}"))
    try:
        picture = comparison(first, second, names=names, backend=DATA)
        for i, panel in enumerate(picture.panels):  # beside each other
            caption = f"Principal stiffnesses of both designs, {panel.label.partition(' [')[0]}."
            blocks.append(one_figure(f"comparison-{i}", caption, Bars(picture.title, (panel,))))
    except NoAnswerError as error:
        blocks.append(Paragraph(str(error)))
    bends = contents.deflection, other.deflection
    both = [bent for bent in bends if isinstance(bent, Deflection) and bent.has_answer]
    if len(both) == 2:
        rows = [
            [name, small_motion(name, a), small_motion(name, b), Number(float(b / a)) if a else ""]
            for name, a, b in zip(first.space.twist_order, *map(shown_twist, both), strict=True)
        ]
        blocks.append(Table(["under the load", *names, "second over first"], rows))
    return Section("comparison", title, blocks)


_MOST_LEVELS = 25
_MOST_VALUES = 40_000  # of all figures, by which a page stays below 2 MB


def map_section(contents: ReportContents) -> Section | None:
    """A figure for each quantity of the map; nothing without a map."""
    dataset = contents.found
    if dataset is None:
        return None
    axes = [str(name) for name in dataset["status"].dims if dataset.sizes[name] > 1]
    title = "Over the workspace"
    if len(axes) < 2 or any(name not in dataset.coords for name in axes):
        why = "The map has no grid over two coordinates, so there is no slice to draw."
        return Section("map", title, [Paragraph(why)])
    # ranks and statuses where there is more than one of them
    several = [name for name in CLASSES if len(np.unique(dataset[name].values)) > 1]
    names = [name for name in (*OVERVIEW, *several) if name in dataset]
    poses = int(np.prod([dataset.sizes[name] for name in axes]))
    words = [f"{poses} poses over {', '.join(axes)}."]
    # so few values of the first coordinates that slices of all stay small
    counts = {name: dataset.sizes[name] for name in axes[:3]}
    for name in axes[2:3]:
        counts[name] = min(counts[name], _MOST_LEVELS)
    while len(names) * math.prod(counts.values()) > _MOST_VALUES:
        longest = max(axes[:2], key=lambda name: counts[name])
        counts[longest] = math.ceil(0.9 * counts[longest])
    chosen = {name: np.linspace(0, dataset.sizes[name] - 1, n) for name, n in counts.items()}
    shown = dataset.isel({name: np.round(places).astype(int) for name, places in chosen.items()})
    thin = [
        f"{shown.sizes[name]} of {dataset.sizes[name]} values of {name}"
        for name in axes[:3]
        if shown.sizes[name] < dataset.sizes[name]
    ]
    if thin:
        words.append(f"The slices show {', '.join(thin)}.")
    figures = [_slices(contents, shown, name, axes) for name in names]
    return Section("map", title, [Paragraph(" ".join(words)), *figures])


def _slices(
    contents: ReportContents, dataset: xarray.Dataset, variable: str, axes: list[str]
) -> Figure:
    x, y, *rest = axes
    fixed: dict[str, Any] = {name: _near(contents, dataset, name) for name in rest[1:]}
    levels = [float(value) for value in dataset[rest[0]].values] if rest else [None]
    rank = contents.stiffness.space.size
    pictures: list[Field] = []
    for value in levels:
        at = dict(OVERVIEW.get(variable, {})) | fixed
        if value is not None:
            at[rest[0]] = value
        field = map_slice(dataset, variable, x=x, y=y, at=at, full_rank=rank, backend=DATA)
        pictures.append(field)
    labels = [
        "" if value is None else f"{rest[0]} = {number(value)} {dataset[rest[0]].attrs['units']}"
        for value in levels
    ]
    start = 0
    if rest:
        start = int(np.argmin(np.abs(np.array(levels) - _near(contents, dataset, rest[0]))))
    caption = str(dataset[variable].attrs.get("long_name", variable))
    if OVERVIEW.get(variable, {}):
        caption = f"The smallest of the {caption.partition(';')[0]}"  # which are in ascending order
    units = {name: dataset[name].attrs["units"] for name in fixed}
    places = ", ".join(f"{n} = {number(value)} {units[n]}" for n, value in fixed.items())
    caption = f"{caption[0].upper()}{caption[1:]}{f', at {places}' if places else ''}."
    # the same colours for the same values at all levels
    scales = [p.scale for p in pictures if p.scale and np.isfinite(p.values).any()]
    low, high = min((s.low for s in scales), default=0), max((s.high for s in scales), default=0)
    shown = [
        replace(p, scale=replace(p.scale, low=low, high=high)) if p.scale and scales else p
        for p in pictures
    ]
    return Figure(variable.replace("_", "-"), caption, tuple(map(Level, labels, shown)), start)


def _near(contents: ReportContents, dataset: xarray.Dataset, name: str) -> float:
    """Value of a coordinate nearest to the pose of the report, or in the middle of the map."""
    values = np.asarray(dataset[name].values, dtype=float)
    pose, names = contents.stiffness.pose, ("x", "y", "z", "rx", "ry", "rz")
    wanted = values.mean() if pose is None or name not in names else pose[names.index(name)]
    return float(values[np.argmin(np.abs(values - wanted))])

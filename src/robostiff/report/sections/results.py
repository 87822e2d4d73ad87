"""Stiffness, the deflection under the load, finite loads, vibrations, and another design."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness, Deflection, Stiffness
from robostiff.errors import NoAnswerError
from robostiff.markup import (
    COMPLIANCE_UNITS,
    Bullets,
    Cell,
    LabelledMatrix,
    Number,
    Paragraph,
    Table,
    Tone,
)
from robostiff.model import Robot
from robostiff.page.cables import cable_load_blocks, tension_table
from robostiff.page.indices import centres, principal_table, ratios, worst_table
from robostiff.page.loads import (
    KNOWN,
    matrix_under_load,
    mode_table,
    other_modes,
    stability_in_words,
)
from robostiff.page.stiffness import (
    actuator_table,
    displacement_table,
    energy_table,
    free_motion_table,
    shown_twist,
    small_motion,
    stiffness_matrix,
)
from robostiff.plot.energy_bars import comparison_picture, energy_picture
from robostiff.plot.loaded_robot import equilibrium_picture, load_curve_picture, mode_picture
from robostiff.plot.picture import Bars
from robostiff.plot.posed_robot import picture_of_posed
from robostiff.plot.posture import surroundings
from robostiff.plot.stiffness_pictures import Quality, ellipsoid_picture, free_motions_picture
from robostiff.report.contents import AnswersUnderLoad, ReportContents
from robostiff.report.section import (
    Figure,
    Folded,
    Level,
    Part,
    Section,
    SideBySide,
    one_figure,
    section,
)

_TITLE = "Stiffness and compliance"


def matrices_section(contents: ReportContents) -> Section:
    """K and C with units, rank, free motions and decision."""
    result = contents.stiffness
    parts: list[Part | None] = []
    if np.all(result.answered):
        K, C = stiffness_matrix(result), _compliance_matrix(result)
        parts.append(SideBySide((K,) if C is None else (K, C)))
        if C is None:
            parts.append(Paragraph("K is singular: there is no compliance matrix."))
    else:
        parts.append(Paragraph(f"There is no stiffness matrix: status {result.status}."))
    if int(result.rank) < 0:
        return section("stiffness", _TITLE, parts)
    count = len(result.free_motions)
    moves = "free to move in one way" if count == 1 else f"free to move in {count} ways"
    meaning = f"the platform is {moves if count else 'held in every direction'}"
    parts.append(Paragraph(f"Rank {int(result.rank)} of {result.space.size}: {meaning}."))
    parts.append(free_motion_table(result))
    if result.free_motions and contents.posed is not None:
        caption = "Free motions of the platform."
        picture = free_motions_picture(result, surroundings(contents.posed, result))
        parts.append(one_figure("free-motions", caption, picture))
    if isinstance(result, CableStiffness):
        return section("stiffness", _TITLE, [*parts, _ellipsoid(contents), tension_table(result)])
    lost = tuple(f"redundant passive joint: {name}" for name in result.redundant_joints)
    parts.append(Bullets(lost) if lost else None)
    parts.append(Paragraph(f"Rank decided by {result.decision}.", Tone.QUIET))
    return section("stiffness", _TITLE, parts)


def _compliance_matrix(result: Stiffness | CableStiffness) -> LabelledMatrix | None:
    """The compliance; None where there is none."""
    C, space = result.compliance, result.space
    if C is None:
        return None
    return LabelledMatrix("C", C, space.twist_order, space.wrench_order, COMPLIANCE_UNITS)


def _ellipsoid(contents: ReportContents) -> Figure | None:
    """The ellipsoid of displacements; nothing where there is none."""
    result = contents.stiffness
    if result.space.translations < 3 or result.compliance is None:
        return None
    with suppress(NoAnswerError):
        around = surroundings(contents.posed, result)
        picture = ellipsoid_picture(result, Quality.COMPLIANCE, around)
        caption = "Displacements under unit forces in all directions (compliance ellipsoid)."
        return one_figure("ellipsoid", caption, picture)
    return None


def weakest_section(contents: ReportContents) -> Section | None:
    """Principal stiffnesses, worst directions and ratios; nothing where there is no matrix."""
    found = contents.indices
    if found is None:
        return None
    words = Paragraph(
        "The principal stiffnesses are those with all other displacements and rotations held. The "
        "largest displacement is with rotations free, the largest rotation with displacements free."
    )
    tables = SideBySide((principal_table(found), worst_table(found)))
    parts = [words, tables, ratios(found), centres(found), _ellipsoid(contents)]
    return section("weakest", "Where it is soft", parts)


_LOAD = "Under the load"


def bending_section(contents: ReportContents) -> Section | None:
    """Displacement, shares of the elastic energy, loads on actuators; nothing without a load."""
    bent = contents.deflection
    if bent is None:
        return None
    if isinstance(bent, CableResponse):
        return section("load", _LOAD, list(_cables_bent(contents, bent)))
    if not bent.has_answer:
        words = Paragraph(f"There is no deflection: status {bent.status}.")
        return section("load", _LOAD, [words, Bullets(tuple(bent.advice), Tone.WARNING)])
    loads = (displacement_table(bent), actuator_table(bent))
    parts: list[Part | None] = [SideBySide(tuple(table for table in loads if table is not None))]
    if bent.energy > 0 and contents.posed is not None:
        caption = "The robot under the load; colours show shares of the elastic energy."
        parts.append(one_figure("deformed", caption, picture_of_posed(contents.posed, bent)))
        of = "each leg, part by part" if len(bent.leg_wrenches) > 1 else "each part"
        caption = f"Elastic energy of {of}."
        parts.append(one_figure("energy", caption, energy_picture(bent)))
        every = energy_table(bent.parts, bent.energy, most=None)
        parts.append(Folded(f"{len(bent.parts)} parts, one by one", (every,)))
    return section("load", _LOAD, parts)


def _cables_bent(contents: ReportContents, bent: CableResponse) -> Iterator[Part]:
    """Displacement, the robot where it rests, tensions, and when the first cable is slack."""
    if bent.after is None or contents.posed is None:
        part = f"{100 * bent.carried:.4g} % of it are carried"
        yield Paragraph(f"The load is not carried: status {bent.status}; {part}.")
        yield Bullets(tuple(bent.advice), Tone.WARNING)
        return
    displacement, *rest = cable_load_blocks(bent)
    yield displacement
    caption = "The robot where it rests under the load, and without it in dashed lines."
    yield one_figure("deformed", caption, picture_of_posed(contents.posed, bent))
    yield from rest


def finite_load_section(contents: ReportContents) -> Section | None:
    """Equilibrium, K with and without load, critical load and curve; nothing where not asked."""
    known = contents.under_load
    if known is None:
        return None
    result = known.equilibrium
    words = stability_in_words(result) if result.has_answer else "no equilibrium was found"
    parts: list[Part | None] = [Paragraph(f"Status {result.status}: {words}.")]
    robot = contents.robot
    if isinstance(robot, Robot) and robot.gravity is not None:
        parts.append(Paragraph("The weights of the robot act besides the load."))
    if result.advice:
        parts.append(Bullets(tuple(result.advice), Tone.WARNING))
    if result.has_answer:
        tables = (_displacements(known, contents), *_changes(known, contents))
        parts += [SideBySide(tables), matrix_under_load(result)]
        words = (
            "K under load is the rate of the wrench that the legs carry; K total, less the rate of "
            "loads that turn with the platform, is what more load meets."
        )
        parts.append(Paragraph(words, Tone.QUIET))
    if result.has_answer:
        words = "Where the robot comes to rest, without load in dashed lines."
        parts.append(one_figure("loaded-shape", words, equilibrium_picture(result)))
    if np.any(np.isfinite(known.curve["displacement"].to_numpy())):
        caption = "Force and deflection up to twice the load; dashed where the robot does not stay."
        parts.append(one_figure("load-curve", caption, load_curve_picture(known.curve)))
    parts.append(Paragraph(_critical(known)))
    return section("finite-load", "Under finite load", parts)


def _displacements(known: AnswersUnderLoad, contents: ReportContents) -> Table:
    """Displacement under the finite load beside that of small loads."""
    result, bent = known.equilibrium, contents.deflection
    rows: list[list[Cell]] = []
    small = shown_twist(bent) if isinstance(bent, Deflection) and bent.has_answer else None
    moved = result.space.without_rounding(result.displacement)
    for i, name in enumerate(result.space.twist_order):
        other: Cell = "none" if small is None else small_motion(name, small[i])
        rows.append([name, small_motion(name, moved[i]), other])
    return Table(["displacement", "under the load", "proportional to the load"], rows)


def _changes(known: AnswersUnderLoad, contents: ReportContents) -> Iterator[Table]:
    """How the load changes the diagonal of K; nothing where there is no K without it."""
    result, space = known.equilibrium, known.equilibrium.space
    if not (np.all(contents.stiffness.answered) and result.status.has_stiffness):
        return
    change = result.K - contents.stiffness.K
    diagonal = np.diagonal(contents.stiffness.K)
    rows: list[list[Cell]] = []
    names = zip(space.wrench_order, space.twist_order, strict=True)
    for i, (force, motion) in enumerate(names):
        shifts = np.arange(space.size) < space.translations
        alike = diagonal[shifts == shifts[i]]
        part: Cell = "from none"
        if diagonal[i] > KNOWN * np.max(alike):
            part = Number(100 * float(change[i, i] / diagonal[i]), "%")
        rows.append([f"{force}/{motion}", part])
    yield Table(["diagonal of K", "change by the load"], rows)


def _critical(known: AnswersUnderLoad) -> str:
    critical = known.critical
    if not critical.is_found:
        why = "; ".join(critical.advice)
        found = f"No critical load was found up to {critical.searched_to:g} times the load"
        return f"{found}: {why}." if why else f"{found}."
    return f"Critical load: {critical.factor:.4g} times the load. There {critical.mode}."


_DRAWN = 4


def vibrations_section(contents: ReportContents) -> Section | None:
    """The slowest modes, listed and animated; nothing of a robot without masses."""
    found = contents.modes
    if found is None:
        return None
    words = (
        "Small vibrations without load, of the masses of the model: parts, platform and what it "
        "carries. Drives are held at their coordinates by their own stiffness."
    )
    levels = tuple(
        Level(
            f"mode {i}: {mode.frequency:.4g} Hz",
            mode_picture(found, i),
            mode_picture(found, i, -1.0),
        )
        for i, mode in enumerate(found.each[:_DRAWN], start=1)
    )
    figure = Figure("modes", "The slowest modes, displacements exaggerated.", levels)
    parts = [Paragraph(words), mode_table(found), other_modes(found), figure]
    return section("vibrations", "Natural frequencies", parts)


def comparison_section(contents: ReportContents) -> Section | None:
    """The robot and another design; nothing where there is no other."""
    other = contents.compared
    if other is None:
        return None
    first, second = contents.stiffness, other.stiffness
    title = f"Beside {other.name}"
    names = (contents.robot.name, other.name)
    if names[0] == names[1]:
        names = (f"{names[0]}, first", f"{names[1]}, second")
    rows: list[list[Cell]] = [
        ["status", str(contents.status), str(other.status)],
        ["rank", str(int(first.rank)), str(int(second.rank))],
    ]
    parts: list[Part | None] = [Table(["", *names], rows)]
    parts.append(Bullets(other.advice, Tone.WARNING) if other.advice else None)
    if not (np.all(first.answered) and np.all(second.answered)):
        parts.append(Paragraph("One of the two has no stiffness matrix to be compared."))
        return section("comparison", title, parts)
    parts.append(SideBySide((replace(stiffness_matrix(second), symbol=f"K of {names[1]}"),)))
    try:
        picture = comparison_picture(first, second, names=names)
        for i, panel in enumerate(picture.panels):  # beside each other
            caption = f"Principal stiffnesses of both designs, {panel.label.partition(' [')[0]}."
            parts.append(one_figure(f"comparison-{i}", caption, Bars(picture.title, (panel,))))
    except NoAnswerError as error:
        parts.append(Paragraph(str(error)))
    one, two = contents.deflection, other.deflection
    if one is not None and two is not None and one.has_answer and two.has_answer:
        parts.append(_both_displacements(contents, names))
    return section("comparison", title, parts)


def _both_displacements(contents: ReportContents, names: tuple[str, str]) -> Table:
    """Displacements of both under the load, and the second over the first."""
    one, other = contents.deflection, contents.compared
    if not isinstance(one, Deflection) or other is None or other.deflection is None:
        raise ValueError("there are two deflections where they are compared")
    rows: list[list[Cell]] = []
    space = one.stiffness.space
    both = (shown_twist(one), shown_twist(other.deflection))
    for name, first, second in zip(space.twist_order, *both, strict=True):
        ratio: Cell = Number(float(second / first)) if first else ""
        rows.append([name, small_motion(name, first), small_motion(name, second), ratio])
    return Table(["under the load", *names, "second over first"], rows)

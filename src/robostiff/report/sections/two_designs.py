"""Another design beside this one: matrices, principal stiffnesses, displacements."""

from __future__ import annotations

import numpy as np

from robostiff.analysis import Deflection
from robostiff.analysis.result_tables import stiffness_matrix
from robostiff.errors import NoAnswerError
from robostiff.markup import Bullets, Cell, Number, Paragraph, Table, Tone, shown_vector
from robostiff.plot.two_designs import comparison_picture
from robostiff.report.contents import ReportContents
from robostiff.report.section import Part, Section, SideBySide, one_figure, section


def comparison_section(contents: ReportContents) -> Section | None:
    """The robot and another design; nothing where there is no other."""
    other = contents.compared
    if other is None:
        return None
    first, second = contents.stiffness, other.stiffness
    title = f"Beside {other.name}"
    rows: list[list[Cell]] = [
        ["status", str(contents.status), str(other.status)],
        ["rank", str(int(first.rank)), str(int(second.rank))],
    ]
    parts: list[Part | None] = [Table(["", contents.robot.name, other.name], rows)]
    parts.append(Bullets(other.advice, Tone.WARNING) if other.advice else None)
    if not (np.all(first.answered) and np.all(second.answered)):
        parts.append(Paragraph("One of the two has no stiffness matrix to be compared."))
        return section("comparison", title, parts)
    names = (contents.robot.name, other.name)
    if names[0] == names[1]:
        names = (f"{names[0]}, first", f"{names[1]}, second")
    parts.append(SideBySide((stiffness_matrix(second),)))
    try:
        picture = comparison_picture(first, second, names=names)
        parts.append(one_figure("comparison", "Principal stiffnesses of both designs.", picture))
    except NoAnswerError as error:
        parts.append(Paragraph(str(error)))
    one, two = contents.deflection, other.deflection
    if one is not None and two is not None and one.has_answer and two.has_answer:
        parts.append(_displacements(contents, names))
    return section("comparison", title, parts)


def _displacements(contents: ReportContents, names: tuple[str, str]) -> Table:
    """Displacements of both under the load, and the second over the first."""
    one, other = contents.deflection, contents.compared
    if not isinstance(one, Deflection) or other is None or other.deflection is None:
        raise ValueError("there are two deflections where they are compared")
    rows: list[list[Cell]] = []
    space = one.stiffness.space
    both = (shown_vector(bent.twist, space.translations) for bent in (one, other.deflection))
    for name, first, second in zip(space.twist_order, *both, strict=True):
        unit = "µrad" if name.startswith("r") else "µm"
        ratio: Cell = Number(float(second / first)) if first else ""
        rows.append(
            [name, Number(1e6 * float(first), unit), Number(1e6 * float(second), unit), ratio]
        )
    return Table(["under the load", *names, "second over first"], rows)

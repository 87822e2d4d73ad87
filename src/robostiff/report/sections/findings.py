"""The findings that matter, on the first page: what holds, what is soft, and what the load does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robostiff.analysis import CableResponse, CableStiffness, Deflection, Stiffness
from robostiff.analysis.free_motion import direction_in_words
from robostiff.markup import Facts, Section, SideBySide
from robostiff.page.loads import stability_in_words
from robostiff.page.stiffness import shown_twist
from robostiff.plot.posed_robot import Colouring, picture_of_posed
from robostiff.plot.prefix import prefixed, short
from robostiff.report.contents import ReportContents
from robostiff.report.figures import one_figure
from robostiff.spatial import Space

Row = tuple[str, str]  # what it is, and its value with where or of what it is


def findings_section(contents: ReportContents) -> Section | None:
    """The findings beside a picture of the robot; nothing where there is neither."""
    rows = [row for rows in _findings(contents) for row in rows]
    table = Facts(tuple(rows))
    if contents.posed is None:
        return Section("findings", "Findings", [table]) if rows else None
    picture = picture_of_posed(contents.posed, colouring=Colouring.NAMES)
    figure = one_figure("robot", "The robot at this pose.", picture)
    return Section("findings", "Findings", [SideBySide((table, figure)) if rows else figure])


def _findings(contents: ReportContents) -> Iterator[Iterator[Row]]:
    yield _of_stiffness(contents.stiffness)
    if contents.indices is not None:
        worst = contents.indices.worst_deflection
        along = f"along {direction_in_words(worst.translational_direction)}"
        about = f"about {direction_in_words(worst.rotational_direction)}"
        most = (
            ("softest for a force", worst.translational, "m/N", along),
            ("softest for a moment", worst.rotational, "rad/(N m)", about),
        )
        yield ((name, f"{_shown(v, unit)} {at}") for name, v, unit, at in most if v)
    if contents.deflection is not None:
        yield _under(contents.deflection)
    if contents.under_load is not None:
        at_rest, critical = contents.under_load.equilibrium, contents.under_load.critical
        if at_rest.has_answer:
            yield iter([("under the finite load", stability_in_words(at_rest))])
        words = f"none up to {critical.searched_to:g} times the load"
        if critical.is_found:
            words = f"{critical.factor:.4g} times the load: {critical.mode}"
        if critical.is_found or critical.searched_to > 0:
            yield iter([("critical load", words)])
    for mode in contents.modes.each[:1] if contents.modes is not None else ():
        yield iter([("slowest vibration", str(mode))])
    if contents.found is not None:
        reached, poses = (contents.found.attrs[own] for own in ("poses_reachable", "poses"))
        part = f"{100 * int(reached) / int(poses):.4g} % of {poses}"
        yield iter([("poses of the map within reach", part)])


def _shown(value: float, unit: str) -> str:
    times, own = prefixed(abs(value), unit)
    return f"{short(times * value, 4)} {own}"


def _of_stiffness(result: Stiffness | CableStiffness) -> Iterator[Row]:
    if int(result.rank) >= 0:
        count = len(result.free_motions)
        free = "free in one way" if count == 1 else f"free in {count} ways"
        words = free if count else "held in every direction"
        yield "rank", f"{int(result.rank)} of {result.space.size}: {words}"
    if isinstance(result, CableStiffness) and np.all(result.answered):
        for word, i in (("least", np.argmin), ("greatest", np.argmax)):
            at = int(i(result.tensions))
            tension = _shown(float(result.tensions[at]), "N")
            yield f"{word} tension", f"{tension}, {result.cable_names[at]}"


def _under(bent: Deflection | CableResponse) -> Iterator[Row]:
    if not bent.has_answer:
        yield "under the load", str(bent.status)
        return
    if isinstance(bent, CableResponse):
        moved = np.zeros(0) if bent.displacement is None else bent.displacement
        yield from _moved(bent.before.space, moved)
        yield "slack cables", ", ".join(bent.slack) or "none"
        return
    yield from _moved(bent.stiffness.space, shown_twist(bent))
    for part in bent.parts[:1] if bent.energy > 0 else ():
        yield "most elastic energy", f"{100 * part.share:.3g} % in {part.name}"
    of_force = [own for own in bent.actuators if own.unit == "N"] or list(bent.actuators)
    if of_force:
        most = max(of_force, key=lambda own: abs(own.load))
        yield "most loaded drive", f"{_shown(float(most.load), most.unit)}, {most.name}"


def _moved(space: Space, twist: np.ndarray) -> Iterator[Row]:
    """Magnitudes of displacement and rotation, and their directions."""
    for word, at, own, unit in (
        ("displacement", "along", twist[: space.translations], "m"),
        ("rotation", "about", twist[space.translations :], "rad"),
    ):
        size = float(np.linalg.norm(own))
        where = f" {at} {direction_in_words(own / size)}" if size else ""
        yield f"{word} under the load", f"{_shown(size, unit)}{where}"

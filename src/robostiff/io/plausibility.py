"""Warnings about numbers that are possible but probably wrong, and about what is not read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from robostiff.errors import Location, warn_of_slip
from robostiff.io.suggest import listing
from robostiff.io.units import Dimension
from robostiff.model.checks import FARTHEST, FULL_TURN

# Elastic moduli [Pa]: with a unit, and as bare numbers, which are often in another unit.
_SOFTEST, _SOFTEST_BARE, _HARDEST = 1e3, 1e6, 1e13
# Advance of a screw in one turn [m].
_STEEPEST = 2.0


def question(
    number: float,
    dimension: Dimension,
    location: Callable[[Sequence[str | int]], Location],
    path: Sequence[str | int] = (),
    *,
    has_unit: bool = False,
    in_si: bool = False,
) -> None:
    """Warn when a number, in SI units, is probably meant in another unit.

    Where it is written is looked up for a warning only; `in_si` says that no unit can be written
    there.
    """
    number = float(number)
    if dimension in _LARGEST:
        largest, words, unit = _LARGEST[dimension]
        meant = has_unit and dimension is Dimension.ANGLE  # turns that are written in degrees
        if meant or abs(number) <= largest:
            return
        words = words.format(number)
    else:
        softest = _SOFTEST if has_unit else _SOFTEST_BARE
        if dimension is not Dimension.MODULUS or softest <= number <= _HARDEST:
            return
        words, unit = f"an elastic modulus of {number:g} Pa", "GPa" if number < _SOFTEST else "MPa"
        if number > _HARDEST:
            words, unit = f"{words}, harder than diamond", ""
    if unit:
        words += f"; in {'degrees' if unit == 'deg' else unit}?"
        if not has_unit:
            words += " numbers here are in SI units" if in_si else f" write {number:g} {unit}"
    warn_of_slip(f"{location(path)}: {words}")


# Beyond it a number is probably a slip; what it is called, and the unit that is probably meant.
_LARGEST = {
    Dimension.LENGTH: (FARTHEST, "a length of {:g} m", "mm"),
    Dimension.ADVANCE_PER_TURN: (_STEEPEST, "an advance of {:g} m in one turn", "mm"),
    Dimension.ANGLE: (FULL_TURN, "an angle of {:g} rad", "deg"),
}


def warn_of_parts_not_read(
    parts: Mapping[str, Sequence[tuple[str, Location]]],
    instead: str = "nothing stands in their place",
) -> None:
    """Warn of parts of a description that move, bend, weigh or hold others, and are not read.

    For each kind their names and places; that of the first is shown.
    """
    for kind, found in parts.items():
        if found:
            names = listing([name or "without a name" for name, _ in found], 12)
            words = f"not read: {kind} {names}; {instead}"
            warn_of_slip(f"{found[0][1]}: {words}")

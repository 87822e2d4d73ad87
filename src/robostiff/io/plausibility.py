"""Warnings about numbers that are possible but probably wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from robostiff.errors import Location, warn_of_slip
from robostiff.io.units import Dimension
from robostiff.kinematics.pose import FARTHEST, FULL_TURN

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
    """Warn when a number is probably meant in another unit.

    Parameters
    ----------
    number : float
        In SI units.
    dimension : Dimension
    location, path
        Where it is written; looked up for a warning only.
    has_unit : bool
        Whether a unit is written with it.
    in_si : bool
        Whether none can be written there, as numbers are always in SI units.
    """
    doubt = _DOUBTS.get(dimension)
    found = doubt(float(number), has_unit) if doubt else None
    if found is None:
        return
    words, unit = found
    if unit:
        words += f"; in {_NAMES.get(unit, unit)}?"
        if not has_unit:
            words += " numbers here are in SI units" if in_si else f" write {number:g} {unit}"
    warn_of_slip(f"{location(path)}: {words}")


def _length(number: float, _: bool) -> tuple[str, str] | None:
    return (f"a length of {number:g} m", "mm") if abs(number) > FARTHEST else None


def _advance(number: float, _: bool) -> tuple[str, str] | None:
    steep = abs(number) > _STEEPEST
    return (f"an advance of {number:g} m in one turn", "mm") if steep else None


def _angle(number: float, has_unit: bool) -> tuple[str, str] | None:
    if has_unit or abs(number) <= FULL_TURN:
        return None
    return f"an angle of {number:g} rad", "deg"


def _modulus(number: float, has_unit: bool) -> tuple[str, str] | None:
    softest = _SOFTEST if has_unit else _SOFTEST_BARE
    if softest <= number <= _HARDEST:
        return None
    if number > _HARDEST:
        return f"an elastic modulus of {number:g} Pa, harder than diamond", ""
    return f"an elastic modulus of {number:g} Pa", "GPa" if number < _SOFTEST else "MPa"


_NAMES = {"deg": "degrees"}
_DOUBTS = {
    Dimension.LENGTH: _length,
    Dimension.ADVANCE_PER_TURN: _advance,
    Dimension.ANGLE: _angle,
    Dimension.MODULUS: _modulus,
}

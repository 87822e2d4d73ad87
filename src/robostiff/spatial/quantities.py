"""Quantities with units where numbers are expected: converted to SI units, or refused.

They are known by what they do, so that no package for units is imported: quantities of pint, of any
registry, are converted; other arrays that carry units are refused, as NumPy would drop the units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robostiff.errors import InputError, Words

#: SI unit of all entries, or of the entries of the last axis; by the length of that axis where it
#: says what the entries are.
Units = str | Sequence[str] | Mapping[int, Sequence[str]]

_WORDS = {
    "": "a plain number",
    "m": "a length",
    "rad": "an angle",
    "s": "a time",
    "N": "a force",
    "N m": "a moment",
}
# Powers of rad by which a quantity of the same powers of m, kg and s measures something else.
_OTHER_KIND = {"": 1, "N m": -1}


def holds_quantities(value: Any) -> bool:
    """Whether a value, or an entry of it, carries a unit.

    Examples
    --------
    >>> holds_quantities([0.0, 1.0])
    False
    """
    kind = type(value)
    if kind in (float, int, str, bool):
        return False
    if isinstance(value, np.ndarray):
        carries = kind is not np.ndarray and _is_foreign(value)
        return carries or (value.dtype == object and any(map(holds_quantities, value.flat)))
    if isinstance(value, list | tuple):
        return any(map(holds_quantities, value))
    if is_pint(value) or _is_foreign(value):
        return True
    # Labelled arrays, such as those of xarray, around a quantity.
    return hasattr(value, "dims") and holds_quantities(getattr(value, "data", None))


def refuse_quantities(subject: str, value: Any, expected: str) -> None:
    """Raise an InputError where a number carries a unit that is not known to be wanted."""
    if holds_quantities(value):
        hint = "write the number of SI units: quantity.m_as(...)"
        raise InputError(subject, got=str(value), expected=f"{expected}, without units", hint=hint)


def in_si(subject: str, value: Any, expected: str, units: Units | None) -> Any:
    """A value in which each quantity is replaced by its number of SI units; numbers stay.

    An array with one unit is taken where that unit fits every entry. Entries of zero fit anywhere,
    so that ``Q([0, 0, 800, 0, 0, 0], "mm")`` is a pose and ``Q([0.5, 0, 0, 0, 0, 0], "kN")`` a
    wrench.

    Parameters
    ----------
    subject : str
        What the numbers are, in words.
    value : array-like
        Numbers, quantities, or lists of both.
    expected : str
        What was expected, for the message.
    units : str, sequence of str, mapping of int to sequence of str, or None
        None where no quantity is taken.

    Raises
    ------
    InputError
        When a quantity measures something else.
    """
    if not holds_quantities(value):
        return value
    if units is None:
        refuse_quantities(subject, value, expected)
    if hasattr(value, "dims") and not is_pint(value):
        value = value.data
    return _converted(subject, value, expected, units)


def _converted(subject: str, value: Any, expected: str, units: Any) -> Any:
    if is_pint(value):
        if np.ndim(value.magnitude) == 0:
            if not isinstance(units, str):
                raise InputError(subject, got=str(value), expected=expected)
            return _number(subject, value, units)
        count = np.shape(value.magnitude)[-1]
        return _array(subject, value, _of_entries(subject, count, expected, units))
    if _is_foreign(value):
        raise InputError(
            subject,
            got=str(value),
            expected=f"{expected}; of quantities those of pint",
            hint="write the number of SI units: quantity.to_value(...)",
        )
    if not isinstance(value, list | tuple | np.ndarray):
        return value
    entries = list(value)
    plain = [entry.magnitude if is_pint(entry) else entry for entry in entries]
    if not any(isinstance(entry, list | tuple) or np.ndim(entry) for entry in plain):
        entry_units = _of_entries(subject, len(entries), expected, units)
        return [
            _number(f"{subject}, entry [{k}]", entry, unit) if is_pint(entry) else entry
            for k, (entry, unit) in enumerate(zip(entries, entry_units, strict=True))
        ]
    return [_converted(subject, entry, expected, units) for entry in entries]


def _of_entries(subject: str, count: int, expected: str, units: Any) -> Sequence[str]:
    """Units of so many entries of the last axis."""
    if isinstance(units, str):
        return [units] * count
    if isinstance(units, Mapping):
        units = units.get(count, ())
    if len(units) != count:
        raise InputError(subject, got=Words(f"{count} entries in the last axis"), expected=expected)
    return units


def _array(subject: str, value: Any, units: Sequence[str]) -> np.ndarray:
    """Numbers of an array with one unit; what it does not fit must be zero."""
    numbers = np.asarray(value.magnitude)
    found = np.zeros(numbers.shape)
    fits = {unit: _fits(value, unit) for unit in units}
    hint = "write a list of quantities, each with its own unit" if any(fits.values()) else None
    for k, unit in enumerate(units):
        if fits[unit] or hint is None or np.any(numbers[..., k] != 0):
            found[..., k] = _number(f"{subject}, entry [{k}]", value[..., k], unit, hint)
    return found


def _number(subject: str, quantity: Any, unit: str, hint: str | None = None) -> Any:
    if not _fits(quantity, unit):
        what = _WORDS.get(unit, "a quantity")
        expected = f"{what}, in {unit} or a unit like it" if unit else what
        raise InputError(subject, got=str(quantity), expected=expected, hint=hint)
    return quantity.to(unit or "dimensionless").magnitude


def _fits(quantity: Any, unit: str) -> bool:
    """Whether a quantity can be expressed in a unit, and measures the same kind of thing."""
    try:
        quantity.to(unit or "dimensionless")
        roots = dict(quantity.to_root_units().unit_items())
    except (TypeError, AttributeError, ValueError):  # of pint: other dimensions, unknown units
        return False
    powers = {str(name): power for name, power in roots.items()}
    rad = powers.get("rad", powers.get("radian", 0))
    return rad == 0 or rad != _OTHER_KIND.get(unit)


def is_pint(value: Any) -> bool:
    """Whether a value is a quantity of pint, of any registry."""
    return hasattr(type(value), "to_root_units") and hasattr(value, "magnitude")


_SI = {"[length]": "meter", "[mass]": "kilogram", "[time]": "second"}


def si_number(subject: str, quantity: Any) -> Any:
    """The number of SI units in a quantity of pint, whatever units its registry prefers.

    Raises InputError for a quantity of anything but length, mass and time.
    """
    powers = dict(quantity.dimensionality)
    if not powers.keys() <= _SI.keys():
        raise InputError(subject, got=str(quantity), expected="a quantity of mechanics")
    units = " * ".join(f"{_SI[name]} ** {power}" for name, power in powers.items())
    return quantity.to(units or "dimensionless").magnitude


def _is_foreign(value: Any) -> bool:
    """Arrays of astropy, unyt and pandas that carry units in other ways."""
    kind = type(value)
    return hasattr(kind, "to_value") or hasattr(getattr(value, "dtype", None), "units")


#: Size of a number that is given: far beyond any robot, and far from overflow.
LARGEST = 1e30


def as_floats(
    subject: str,
    value: Any,
    expected: str,
    units: Units | None = None,
    shape: tuple[int, ...] | None = None,
    *,
    copy: bool = True,
) -> np.ndarray:
    """Real finite numbers, or quantities in SI units, as an array of floats.

    Parameters
    ----------
    subject : str
        What the numbers are, in words.
    value : array-like
        What came.
    expected : str
        What was expected, for the message.
    units : str, sequence of str, mapping of int to sequence of str, optional
        SI unit of all entries, or of those of the last axis, by its length if need be: that of the
        numbers, and what quantities are converted to. Left out, none are taken.
    shape : tuple of int, optional
        The one that fits.
    copy : bool
        Whether the array is a copy: answers that are worked out later need one, as the caller may
        fill his array anew.

    Raises
    ------
    InputError
        For texts, truth values, complex, ragged or masked input, for numbers that are not finite or
        beyond 1e30, and for quantities that measure something else.

    Examples
    --------
    >>> as_floats("point", [0, 0, 1], "three numbers")
    array([0., 0., 1.])
    """
    mask = getattr(getattr(value, "magnitude", value), "_mask", False)  # without importing np.ma
    value = in_si(subject, value, expected, units)
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.asarray(None)
    if array.dtype.kind not in "iuf" or np.any(mask):
        raise InputError(subject, got=value, expected=expected)
    # NaN fails the comparisons as well.
    if array.size and not (array.max() <= LARGEST and array.min() >= -LARGEST):
        wrong = ~(np.abs(array.astype(float)) <= LARGEST)
        place = tuple(int(i) for i in np.argwhere(wrong)[0])
        entry = f"{subject}, entry {list(place)}" if place else subject
        raise InputError(entry, got=array[place], expected="a finite number up to 1e30")
    if shape is not None and array.shape != shape:
        raise InputError(subject, got=value, expected=expected)
    return np.array(array, dtype=float, copy=copy or None)


def check_order(subject: str, value: Any, *orders: Sequence[str]) -> None:
    """Refuse a table of pandas or xarray with names of the last axis in another order.

    Raises an InputError where it has those of one of the orders, and not in that order.
    """
    labels: Any = getattr(value, "columns", ())
    if hasattr(value, "to_frame"):  # a Series
        labels = value.index
    elif getattr(value, "dims", ()):
        labels = value.indexes.get(value.dims[-1], ())
    names = [str(name) for name in labels]
    for order in map(list, orders):
        if names != order and sorted(names) == sorted(order):
            raise InputError(
                f"order of {subject}",
                got=" ".join(names),
                expected=" ".join(order),
                hint=f"numbers are read by their places: write table[{order}]",
            )


def check_whole(subject: str, value: Any, least: int = 1) -> None:
    """Raise an InputError for what is no whole number from a least one on, or is True or False."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
        raise InputError(subject, got=value, expected=f"a whole number from {least} on")


def as_float(subject: str, value: Any, expected: str, unit: str | None = None) -> float:
    """One real finite number, or a quantity in an SI unit, as a float.

    Raises
    ------
    InputError
        As `as_floats`, and for an array.

    Examples
    --------
    >>> as_float("length", 3, "a length [m]", "m")
    3.0
    """
    return float(as_floats(subject, value, expected, unit, ()))

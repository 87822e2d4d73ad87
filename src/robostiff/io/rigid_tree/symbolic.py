"""Symbols in the stiffnesses of a linkage whose dimensions are numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import cast

from robostiff.errors import InputError
from robostiff.linkage import Linkage
from robostiff.model import Joint, Link
from robostiff.model.entries import free_symbols


def with_symbols(
    known: Linkage, build: Callable[[], Linkage], nominal: Mapping[str, float]
) -> Linkage:
    """The linkage of numbers with the stiffnesses of the same one built with symbols.

    Raises
    ------
    InputError
        When a dimension depends on a symbol.
    """
    try:
        return _with_stiffnesses(known, build(), nominal)
    except (InputError, TypeError):  # a dimension that is computed with a symbol is no number
        raise InputError(
            f"symbols of linkage {known.name!r}",
            got=tuple(nominal),
            expected="parameters of stiffnesses, elastic parts and masses alone",
            hint="give values to parameters of dimensions: load_linkage(path, {NAME: ...})",
        ) from None


def _with_stiffnesses(known: Linkage, symbolic: Linkage, nominal: Mapping[str, float]) -> Linkage:
    connections = []
    for own, other in zip(known.connections, symbolic.connections, strict=True):
        element, given = own.element, other.element
        if isinstance(element, Joint) and isinstance(given, Joint):
            k = getattr(given.role, "stiffness", None)
            if free_symbols(k):
                element = replace(element, role=replace(element.role, stiffness=k))
        elif isinstance(element, Link) and free_symbols(given):
            given = cast("Link", given)
            element = replace(element, elasticity=given.elasticity, masses=given.masses)
        connections.append(replace(own, element=element))
    plain = [(c.before, c.after, getattr(c.element, "to", None)) for c in symbolic.connections]
    homes = [getattr(c.element, "home", None) for c in symbolic.connections]
    if free_symbols((tuple(plain), tuple(homes), symbolic.reference_point)):
        raise InputError("dimensions", got="symbols", expected="numbers")
    return replace(known, connections=tuple(connections), nominal=nominal)

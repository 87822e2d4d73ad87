"""The page of a robot or of a result of any kind, and pages as plain data for JSON."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields, is_dataclass
from enum import Flag
from importlib import import_module
from math import isfinite
from typing import TYPE_CHECKING, Any

from robostiff.markup import Folded, Page, Table
from robostiff.version import __version__

if TYPE_CHECKING:
    from robostiff.spatial import Space

# The module and function of this package that write the page of a kind of result. They are imported
# with the first page of that kind, as they import the questions that it answers.
_WRITERS = {
    "Subject": ("facts", "machine_page"),
    "Stiffness": ("stiffness", "stiffness_page"),
    "Deflection": ("stiffness", "deflection_page"),
    "Verification": ("stiffness", "verification_page"),
    "StiffnessIndices": ("indices", "indices_page"),
    "CableTensions": ("stiffness", "cable_tensions_page"),
    "CableStiffness": ("stiffness", "cable_stiffness_page"),
    "CableResponse": ("stiffness", "cable_response_page"),
    "Equilibrium": ("loads", "equilibrium_page"),
    "CriticalLoad": ("loads", "critical_page"),
    "Modes": ("loads", "modes_page"),
    "NetworkResponse": ("loads", "response_page"),
    "Compensation": ("calibration_and_design", "compensation_page"),
    "Identified": ("calibration_and_design", "identification_page"),
    "Optimum": ("calibration_and_design", "optimum_page"),
    "Tolerances": ("calibration_and_design", "tolerances_page"),
    "Dataset": ("maps", "map_page"),
}


def page_of(result: object) -> Page:
    """The page of a machine or of a result; of a batch in short."""
    kinds = [kind.__name__ for kind in type(result).__mro__]
    if getattr(result, "batch_shape", ()) and "Compensation" not in kinds:
        return Page(repr(result))
    module, function = next(_WRITERS[kind] for kind in kinds if kind in _WRITERS)
    return getattr(import_module(f"robostiff.page.{module}"), function)(result)


def robots_page(listed: Sequence[Any]) -> Page:
    """Shipped robots by what `robostiff.robots.describe` says of each; sources not as text."""
    table = Table(("", ""), [(robot.name, robot.title) for robot in listed])
    sources = Table(("robot", "source"), [(robot.name, robot.source) for robot in listed])
    blocks = [table, Folded("Where their numbers come from", (sources,))]
    data = {"robots": list(map(asdict, listed))}
    return Page("", f"{len(listed)} robots come with robostiff:", blocks=blocks, data=data)


#: Units of displacements under loads.
UNDER_LOAD = {"length": "m", "angle": "rad", "force": "N", "moment": "N m", "energy": "J"}


def page_data(page: Page) -> dict[str, Any]:
    """A page as plain data: the version, the robot, what happened, advice, and all values.

    JSON-ready; what there is none of is null. ``status`` joins what happened with ``+``, and is
    ``ok`` for a plain answer.
    """
    head = {"robot": page.name} if page.name else {}
    head |= {} if page.status is None else {"status": str(page.status)}
    return {
        "robostiff": __version__,
        **head,
        "advice": list(page.advice),
        **{name: plain(value) for name, value in page.data.items()},
    }


def plain(value: Any) -> Any:
    """A result or a part of it: arrays and tuples as lists, statuses in words, NaN as None."""
    if hasattr(value, "tolist") or (isinstance(value, float) and not isfinite(value)):
        import numpy as np  # loaded where there is an array

        is_float = np.asarray(value).dtype.kind == "f"
        array: Any = np.ma.masked_invalid(value) if is_float else value
        return array.tolist()
    if isinstance(value, Flag):
        return str(value)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if is_dataclass(value):
        from robostiff.analysis.free_motion import FreeMotion

        if isinstance(value, FreeMotion):
            return {"description": str(value), "twist": value.twist.tolist()}
        names = [field.name for field in fields(value)]
        names += [name for name in ("about", "unit", "units") if hasattr(type(value), name)]
        value = {name: getattr(value, name) for name in names}
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    return value


def attributes(result: Any, names: str, known: bool = True) -> dict[str, Any]:
    """Attributes of a result or of a part of it, by names with blanks between; None if unknown."""
    return {name: getattr(result, name) if known else None for name in names.split()}


def picked(parts: Iterable[Any], names: str) -> list[dict[str, Any]]:
    """The same attributes of each of some parts."""
    return [attributes(part, names) for part in parts]


def order(space: Space) -> dict[str, tuple[str, ...]]:
    """Names of the coordinates of twists and wrenches, in order."""
    return {"twist": space.twist_order, "wrench": space.wrench_order}

"""Pages as plain data for JSON."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from robostiff.analysis.free_motion import FreeMotion
from robostiff.elastostatics import Status
from robostiff.markup import Page
from robostiff.spatial import Space
from robostiff.version import __version__

#: Units of displacements under loads.
UNDER_LOAD = {"length": "m", "angle": "rad", "force": "N", "moment": "N m", "energy": "J"}


def page_data(page: Page) -> dict[str, Any]:
    """A page as plain data: the version, the robot, what happened, advice, and all values.

    JSON-ready; what there is none of is null. ``status`` joins what happened with ``+``, and is
    ``ok`` for a plain answer.
    """
    status = {} if page.status is None else {"status": str(page.status)}
    return {
        "robostiff": __version__,
        "robot": page.name,
        **status,
        "advice": list(page.advice),
        **{name: plain(value) for name, value in page.data.items()},
    }


def plain(value: Any) -> Any:
    """A result or a part of it: arrays and tuples as lists, statuses in words."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Status):
        return str(value)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, FreeMotion):
        value = {"description": str(value), "twist": value.twist}
    elif is_dataclass(value):
        names = [field.name for field in fields(value)]
        names += [own for own in ("about", "unit", "units") if hasattr(type(value), own)]
        value = {name: getattr(value, name) for name in names}
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    return value


def picked(parts: Iterable[Any], names: str) -> list[dict[str, Any]]:
    """Attributes of some parts, by their names with blanks between them."""
    return [{name: getattr(own, name) for name in names.split()} for own in parts]


def order(space: Space) -> dict[str, tuple[str, ...]]:
    """Names of the coordinates of twists and wrenches, in order."""
    return {"twist": space.twist_order, "wrench": space.wrench_order}

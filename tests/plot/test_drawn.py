"""Pictures as data, item by item, on file in ``drawn.txt``.

A line there is an expression of Python, below it what is drawn: what it says and where it is, in
the units of the picture. ``python -m tests.plot.test_drawn`` writes the page anew.
"""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.plot.bars_and_curves import Measure
from robostiff.plot.picture import Scene
from robostiff.plot.posed_robot import Colouring, picture_of_posed
from robostiff.plot.stiffness_pictures import Kind, Shade
from tests.plot import machines
from tests.plot.machines import LOAD, POSE, robot
from tests.project.shown_output import ROOT, first_difference
from tests.said import indented, now, on_file, write

PAGE, DATA = Path(__file__).parent / "drawn.txt", rs.plot.PictureData()
#: So many numbers are written one by one.
FEW = 12


@cache
def home(name: str) -> Any:
    return rs.find_posture(robot(name)).snapshot.one(0)


@cache
def posture() -> Any:
    return rs.find_posture(robot("hexapod"), POSE).snapshot.one(0)


@cache
def star() -> Any:
    return rs.load(str(ROOT / "tests/model/star-platform.yaml"))


def bent(machine: Any, *wrench: float) -> Any:
    return rs.deflection(robot(machine) if isinstance(machine, str) else machine, wrench=wrench)


def free_all_around() -> Any:
    free, here = rs.Passive(), machines.HERE
    joints = (rs.planar((0, 0, 1), free), rs.prismatic((0, 0, 1), free), rs.spherical(free))
    chain = rs.Chain((*joints, rs.revolute((1, 0, 0), rs.Actuated(10.0))))
    return rs.stiffness(rs.Robot("loose", (rs.Leg("leg", here, chain, here),)))


def plot(kind: str, *subjects: Any, **options: Any) -> Any:
    return getattr(rs.plot, kind)(*subjects, **options, backend=DATA)


NAMES = {
    **{name: own for name, own in vars(machines).items() if not name.startswith("_")},
    **{"rs": rs, "Colouring": Colouring, "Kind": Kind, "Shade": Shade},
    **{"Measure": Measure, "posed": picture_of_posed, "home": home, "posture": posture},
    **{"star": star, "bent": bent, "free_all_around": free_all_around, "plot": plot},
    **{"LOAD": LOAD, "POSE": POSE},
}


def number(x: float) -> str:
    return "0" if abs(x) < 1e-9 else f"{x:.5g}"


def words(own: Any) -> str:
    """A value in a line."""
    if isinstance(own, np.ndarray):
        if own.size <= FEW or own.dtype.kind not in "fiub":
            return " ".join(number(x) if own.dtype.kind in "fiub" else str(x) for x in own.ravel())
        known = own[np.isfinite(own)]
        if not known.size:
            return f"{own.shape}, none"
        ends = f"{number(float(known.min()))} to {number(float(known.max()))}"
        return f"{own.shape}, {known.size} of {ends}, in all {number(float(known.sum()))}"
    if isinstance(own, float):
        return number(own)
    if isinstance(own, Enum):
        return own.name.lower()
    if is_dataclass(own):
        return f"{type(own).__name__}({inside(own)})"
    if isinstance(own, tuple | list):
        return f"[{', '.join(map(words, own))}]"
    return str(own)


def inside(own: Any) -> str:
    """All that a part says of itself, but what is as it is by default."""
    return ", ".join(
        f"{field.name} {words(value)}"
        for field in fields(own)
        if isinstance(value := getattr(own, field.name), np.ndarray)
        or value not in (field.default, ())
    )


def lines_of(picture: Any) -> Iterator[str]:
    for field in fields(picture):
        value = getattr(picture, field.name)
        if isinstance(picture, Scene) and field.name == "items":
            yield from (f"{type(item).__name__}: {inside(item)}" for item in value)
        elif value is not None and not (isinstance(value, tuple) and not value):
            yield f"{field.name}: {words(value)}"


def say(_: str, expression: str) -> str:
    try:
        picture = eval(expression, dict(NAMES))  # noqa: S307
    except rs.RobostiffError as error:
        return indented(f"error: {error}")
    return indented("\n".join(lines_of(picture)))


@pytest.mark.parametrize("subject", on_file(PAGE))
def test_what_is_drawn_is_what_is_on_file(subject):
    told = on_file(PAGE)[subject]
    drawn = now({subject: told}, say)[subject]
    found = {picture: first_difference(text, drawn[picture]) for picture, text in told.items()}
    assert {picture: own for picture, own in found.items() if own} == {}


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))

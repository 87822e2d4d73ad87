"""Calls of Python that cannot be answered: what is said of each is on file in ``misuse.txt``.

A line there is an expression. ``python -m tests.laws.test_misuse`` writes the messages anew.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pint
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform

import robostiff as rs
from robostiff import elasticity, elastostatics, linkage, model, network, spatial
from robostiff.analysis import indices
from robostiff.io.expression import parse
from robostiff.io.snapshot import snapshot_to_data
from robostiff.io.units import Dimension, to_si
from robostiff.record import Record, derivatives_along
from robostiff.robots import describe, robot_file
from tests.plot.machines import hexapod_deflection, tripod_map
from tests.said import now, on_file, said, write

PAGE = Path(__file__).parent / "misuse.txt"


def put(matrix: Any, entries: dict[tuple[int, ...], Any]) -> np.ndarray:
    """A matrix with other entries."""
    own = np.array(matrix, dtype=float)
    for place, value in entries.items():
        own[place] = value
    return own


def quantity(number: Any, unit: str) -> Any:
    return pint.get_application_registry().Quantity(number, unit)


def arm(*couplings: Any) -> model.Chain:
    """Joints a, b and c and a beam."""
    axes: dict[str, tuple[list[float], Any]] = {
        "a": ([0, 0, 1], rs.Actuated(1e4)), "b": ([0, 1, 0], rs.Passive()),
        "c": ([1, 0, 0], rs.Actuated(1e4)),
    }  # fmt: skip
    joints = [rs.revolute(axis, role, name=name) for name, (axis, role) in axes.items()]
    beam = rs.beam_link([0.3, 0.1, 0], rs.material("steel"), rs.circle(0.02))
    return model.Chain((*joints, beam), couplings)


@cache
def compiled(name: str) -> Any:
    return rs.compile(rs.load(name), backend=rs.Backend.ARRAYS)


@cache
def by_R() -> Any:
    return rs.compile(PLATFORM, parameters=("R",), backend=rs.Backend.ARRAYS)


@cache
def under_load(name: str) -> Any:
    return rs.compile_loaded(rs.load(name), backend=rs.Backend.ARRAYS)


def sprung(body: str, at: Any = (0, 0, 0), **values: Any) -> rs.Robot:
    """A hexapod with a spring from its base to a point of a body."""
    ends = rs.BodyPoint("base"), rs.BodyPoint(body, at)
    return rs.load("hexapod").with_springs([rs.BodySpring("s", ends, 10.0, **values)])


def graph(nodes: str = "ab", fixed: str = "a", platform: str = "b", **more: Any) -> rs.Network:
    """Nodes a metre apart, by their letters."""
    every = tuple(network.Node(name, np.eye(3)[0] * "ab".index(name)) for name in nodes)
    return rs.Network("n", every, tuple(fixed), platform, every[-1].point, **more)


def ball(name: str, a: str = "base", b: str = "platform") -> linkage.Connection:
    return linkage.Connection(name, a, b, HERE, rs.spherical(rs.Passive(), name=name), HERE)


def weld(a: str, b: str, x: float = 0.0) -> linkage.Connection:
    at = rs.Frame(np.eye(3), np.array([x, 0, 0]))
    return linkage.Connection(f"weld {x}", a, b, at, None, HERE)


@cache
def by_screw() -> Any:
    return rs.compile(LIFT, backend=rs.Backend.ARRAYS)


def mapped_linkage(**more: Any) -> Any:
    given = {"poses": rs.Grid(screw=rs.Axis(0, 0.1, 2)), **more}
    return rs.stiffness_map(LIFT, **given)


def mapped(name: str, **more: Any) -> Any:
    return rs.stiffness_map(rs.load(name), **{"poses": rs.Grid(x=rs.Axis(0, 0.1, 2)), **more})


PLATFORM = rs.load("gough-stewart-b", symbols=("R", "r", "k"))
LIFT, HERE = rs.load_linkage("double-pantograph"), rs.Frame.identity()
CABLES = rs.load("cable-8").cables
A, B = (network.Node(name, x * np.eye(3)[0]) for name, x in (("a", 0), ("b", 1)))
ROD = network.beam_between(A, B, rs.material("steel"), rs.circle(0.02), name="rod")
MOVED = rs.Measurements(
    *([[0, 0, 0.9, 0, 0, 0]], [[1e-6, 0, 2e-6]], [0, 0, -1.0, 0, 0, 0]),
    kinds=rs.Reading.DISPLACEMENT, sigma=1e-6,
)  # fmt: skip
NAMES: dict[str, Any] = {
    **{name: getattr(own, name)
       for own in (elasticity, elastostatics, linkage, network, model, spatial, indices, rs)
       for name in dir(own) if not name.startswith("_")},
    **{"np": np, "sp": sp, "rs": rs, "Path": Path, "replace": replace, "nan": np.nan},
    **{"ROOT": PAGE.parents[2]},
    **{"inf": np.inf, "I": np.eye(6), "load": cache(rs.load), "Q": quantity},
    **{"put": put, "arm": arm},
    **{str(symbol): symbol for symbol in sp.symbols("d h L k c E G", positive=True)},
    **{"platform": PLATFORM, "compiled": compiled, "by_R": by_R, "mapped": mapped},
    **{"tripod_map": tripod_map, "hexapod_deflection": hexapod_deflection},
    **{"DATA": rs.plot.PictureData()},
    **{"steel": rs.material("steel"), "bar": rs.circle(0.02), "here": HERE, "Z": [0, 0, 1]},
    **{"under_load": under_load, "sprung": sprung, "graph": graph, "a": A, "b": B, "rod": ROD},
    **{"hub": model.PlatformNode("hub", np.zeros(3)), "rim": model.PlatformNode("rim", np.ones(3))},
    **{"ball": ball, "weld": weld, "lift": LIFT, "by_screw": by_screw},
    **{"mapped_linkage": mapped_linkage},
    **{"endless": tuple(replace(own, greatest_tension=np.inf) for own in CABLES)},
    **{"campaign": MOVED, "RigidTransform": RigidTransform, "describe": describe},
    **{"parse": parse, "to_si": to_si, "Dimension": Dimension},
    **{"snapshot_to_data": snapshot_to_data},
    **{"robot_file": robot_file, "Record": Record, "derivatives_along": derivatives_along},
    **{"AT": [0.02, -0.01, 0.8, 0.01, -0.02, 0.1]},
}  # fmt: skip


def say(_: str, expression: str) -> str:
    call: Callable[[str], Any] = lambda text: eval(text, NAMES)  # noqa: E731, S307
    return said(call, expression)


@pytest.mark.parametrize("subject", on_file(PAGE))
def test_what_is_said_of_a_call_is_what_is_on_file(subject):
    told = {subject: on_file(PAGE)[subject]}
    assert now(told, say) == told


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))

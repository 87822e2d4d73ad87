"""Answers that several tests draw."""

from functools import cache
from typing import Any

import numpy as np

import robostiff as rs

POSE = (0.06, 0.02, 0.9, 0, 0.17, 0)
HERE = rs.Frame(np.eye(3), np.zeros(3))
LOAD = (300, 100, -200, 0, 0, 20)


def turn(motion: Any) -> np.ndarray:
    """Rotation (3,) of a body that moves little [rad]."""
    D = motion.D
    return np.array([D[2, 1], D[0, 2], D[1, 0]])


def twist_about(motion: Any, point: np.ndarray) -> np.ndarray:
    """Twist (6,) of a body that moves little, about a point (3,) [m, rad]."""
    return np.concatenate([motion.displacement(point), turn(motion)])


@cache
def robot(name: str) -> Any:
    return rs.load(name)


@cache
def hexapod_stiffness() -> rs.Stiffness:
    return rs.stiffness(robot("hexapod"), POSE)


@cache
def hexapod_deflection() -> rs.Deflection:
    return rs.deflection(robot("hexapod"), POSE, LOAD)


@cache
def tripod_map() -> Any:
    """Reachable and unreachable poses of a translational tripod."""
    grid = rs.Grid(x=rs.Axis(-0.5, 0.5, 6), y=rs.Axis(-0.4, 0.4, 5), z=rs.Axis(0.2, 0.4, 3))
    quantities = [rs.Quantity.WORST_DEFLECTION, rs.Quantity.PRINCIPAL_STIFFNESS]
    return rs.stiffness_map(robot("3-puu"), grid, quantities)


@cache
def held_across_x() -> rs.Stiffness:
    """A platform on five springs that slides along x."""
    slide = rs.prismatic((1, 0, 0), rs.Passive())
    springs = [
        rs.prismatic((0, 1, 0), rs.Actuated(2e6), name="y"),
        rs.prismatic((0, 0, 1), rs.Actuated(3e6), name="z"),
        rs.revolute((1, 0, 0), rs.Actuated(1e4), name="a"),
        rs.revolute((0, 1, 0), rs.Actuated(1e4), name="b"),
        rs.revolute((0, 0, 1), rs.Actuated(1e4), name="c"),
    ]
    leg = rs.Leg("arm", HERE, rs.Chain((slide, *springs)), HERE)
    return rs.stiffness(rs.Robot("held", (leg,)))


def sprung_arm() -> rs.Robot:
    """An arm with a spring from its base to its first link."""
    ends = rs.BodyPoint("base", [0.1, 0, 0.2]), rs.BodyPoint("arm/upper arm", [0, 0.1, 0.1])
    return robot("six-joint-arm").with_springs([rs.BodySpring("spring", ends, 2e4, preload=50.0)])


def all_scenes(b: Any) -> dict[str, Any]:
    """One picture of each kind that can be turned, by a backend."""
    hexapod, result, bent = robot("hexapod"), hexapod_stiffness(), hexapod_deflection()
    found = tripod_map()
    level = float(found.worst_deflection.median())
    return {
        "robot": rs.plot.robot(hexapod, POSE, deflection=bent, backend=b),
        "planar": rs.plot.robot(robot("3-rrr"), backend=b),
        "ellipsoid": rs.plot.ellipsoid(result, within=hexapod, backend=b),
        "free": rs.plot.free_motions(rs.stiffness(robot("gough-stewart-a")), backend=b),
        "surface": rs.plot.map_isosurface(
            found, "worst_deflection", level, x="x", y="y", z="z", backend=b
        ),
    }


def all_plots(b: Any) -> dict[str, Any]:
    """One picture of each kind, by a backend."""
    result, bent, found = hexapod_stiffness(), hexapod_deflection(), tripod_map()
    at = {"z": 0.3}
    return {
        **all_scenes(b),
        "matrix": rs.plot.matrix(result, backend=b),
        "energy": rs.plot.energy_shares(bent, backend=b),
        "comparison": rs.plot.comparison(result, result, backend=b),
        "slice": rs.plot.map_slice(
            found, "worst_deflection", x="x", y="y", at=at, isolines=3, backend=b
        ),
        "bands": rs.plot.map_bands(found, "worst_deflection", along="x", backend=b),
    }

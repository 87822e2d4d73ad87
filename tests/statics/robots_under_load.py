"""Robots of the loaded reference cases, and small ones with closed forms, as snapshots."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import Elasticity, cantilever_compliance
from robostiff.model import Actuated, Passive, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.spatial import Space
from tests.campaign.assembled import Assembly, of_robot
from tests.campaign.reread import placed, turned

DATA = Path(__file__).parent / "data"


def case(name: str) -> dict[str, Any]:
    return json.loads((DATA / f"{name}.json").read_text())


def joint(
    name: str,
    point: Sequence[float] | np.ndarray,
    axis: Sequence[float] | np.ndarray,
    kind: str = "R",
    k: float | None = None,
) -> PlacedFreedom:
    role = Passive() if k is None else Actuated(k)
    pitch = 0.0 if kind == "R" else None
    return PlacedFreedom(
        np.array(axis, dtype=float), np.array(point, dtype=float), pitch, name, role
    )


def beam(
    name: str, start: Sequence[float], end: Sequence[float], EA: float, EI: float, GJ: float
) -> PlacedSpring:
    """A beam that bends alike in all directions."""
    along = np.subtract(end, start)
    L = float(np.linalg.norm(along))
    R = np.array(Rotation.align_vectors([along / L], [[1.0, 0, 0]])[0].as_matrix())
    C = cantilever_compliance(L, 1.0, 1.0, EA, EI, EI, GJ)
    return PlacedSpring(name, np.array(end, dtype=float), R, Elasticity(C))


def struts(
    base: np.ndarray, tops: np.ndarray, k: float, point: np.ndarray, name: str = "struts"
) -> Snapshot:
    """Elastic struts between universal and spherical joints."""
    legs = []
    for i, (a, e) in enumerate(zip(base, tops, strict=True)):
        z = (e - a) / np.linalg.norm(e - a)
        x = np.cross(z, [0.3, 0.5, 0.1])
        x /= np.linalg.norm(x)
        y = np.cross(z, x)
        elements = (
            joint("u1", a, x),
            joint("u2", a, y),
            joint("strut", a, z, "P", k),
            joint("s1", e, x),
            joint("s2", e, y),
            joint("s3", e, z),
        )
        legs.append(PlacedLeg(f"leg{i + 1}", elements, e))
    return Snapshot(name, tuple(legs), point)


def stewart(data: dict[str, Any]) -> tuple[Snapshot, np.ndarray, np.ndarray, float]:
    """The robot of L1 and L2b; base points, points on the platform about its centre, stiffness."""
    pose = data["params"]["unloaded_pose"]
    R = Rotation.from_rotvec(np.radians(pose["rotvec_deg"])).as_matrix()
    p = np.array(pose["p"], dtype=float)
    base = np.array(data["base_points"])
    arms = np.array(data["platform_points_local"]) @ R.T
    k = data["params"]["k_leg"]
    return struts(base, p + arms, k, p, data["name"]), base, arms, k


def beam_legs(data: dict[str, Any]) -> Snapshot:
    """The robot of LP1."""
    legs = []
    for i, leg in enumerate(data["legs"]):
        assert leg["node_loads"] == []
        elements = []
        for n, e in enumerate(leg["elements"]):
            if e["type"] == "joint":
                assert e["rest"] == 0
                assert e["preload"] == 0
                elements.append(joint(f"j{n}", e["point"], e["axis"], e["motion"], e["k"]))
            else:
                R = np.array(e["rotation_columns"])
                C = Elasticity(np.array(e["compliance"]))
                elements.append(PlacedSpring(f"s{n}", np.array(e["far_end"]), R, C))
        legs.append(PlacedLeg(f"leg{i + 1}", tuple(elements), np.array(leg["end"])))
    return Snapshot(data["name"], tuple(legs), np.array(data["reference"]))


def planar_chain(k1: float, k2: float, k3: float) -> Snapshot:
    """The chain of L4, hinged at both ends: slide, elbow, slide."""
    a = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    b = np.array([np.cos(0.9), np.sin(0.9), 0.0])
    elbow, tip, z = 0.5 * a, 0.5 * a + 0.4 * b, [0, 0, 1]
    elements = (
        joint("base", [0, 0, 0], z),
        joint("slide1", elbow, a, "P", k1),
        joint("elbow", elbow, z, "R", k2),
        joint("slide2", tip, b, "P", k3),
        joint("end", tip, z),
    )
    return Snapshot("L4", (PlacedLeg("chain", elements, tip),), tip, Space.PLANAR)


def column(k: float, stretch: float, L: float, guide: float) -> Snapshot:
    """Two hinged links of length L along y with a spring at their joint; the tip slides in y."""
    z, y = [0, 0, 1], [0, 1, 0]
    tip = np.array([0, 2 * L, 0])
    links = (
        joint("base", [0, 0, 0], z),
        joint("link1", [0, 0, 0], y, "P", stretch),
        joint("knee", [0, L, 0], z, "R", k),
        joint("link2", [0, L, 0], y, "P", stretch),
        joint("end", tip, z),
    )
    rail = (
        joint("rail", tip, y, "P"),
        joint("across", tip, [1, 0, 0], "P", guide),
        joint("turn", tip, z, "R", guide),
    )
    legs = (PlacedLeg("links", links, tip), PlacedLeg("guide", rail, tip))
    return Snapshot("column", legs, tip, Space.PLANAR)


def root(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function vanishes."""
    return float(brentq(function, low, high, xtol=1e-15))  # type: ignore[arg-type]


def number(value: float | None) -> float:
    """A number that is there."""
    assert value is not None
    return value


loaded: Any = rs.equilibrium


def same_as_each(
    many: rs.Equilibrium,
    each: Iterable[rs.Equilibrium],
    of_K: float = 1e-10,
    rtol: float = 1e-9,
    atol: float = 1e-14,
) -> None:
    """Equilibria at once are those of each by itself: K against its diagonal, displacements.

    Where there is none, nothing is given.
    """
    for k, one in enumerate(each):
        assert many.status_codes[k] == int(one.status)
        assert many.stable[k] == one.stable
        assert many.answered[k] == one.has_answer
        if not one.has_answer:
            assert many.K[k].mask.all()
            assert many.displacement[k].mask.all()
            continue
        size = np.sqrt(np.abs(np.diag(one.K)))
        for name in ("K", "K_total"):
            off = (getattr(many, name)[k] - getattr(one, name)) / np.outer(size, size)
            assert np.max(np.abs(off)) < of_K
        assert np.allclose(many.displacement[k], one.displacement, rtol=rtol, atol=atol)


def bodies_of(robot: rs.Robot, pose: Any = None, beams: int = 0) -> Assembly:
    """A robot at a pose, or at home, as bodies in the world, from the numbers of its model."""
    posture = rs.find_posture(robot, pose)
    six, length = posture.pose[0], float(posture.snapshot.one(0).characteristic_length)
    home = placed(turned(six[3:]), six[:3])
    return of_robot(robot, [q[0] for q in posture.coordinates], home, length, beams)


def spring(first: rs.BodyPoint, second: rs.BodyPoint, **values: Any) -> rs.BodySpring:
    return rs.BodySpring(f"{first.body} {second.body}", (first, second), **values)


def on(body: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> rs.BodyPoint:
    return rs.BodyPoint(body, [x, y, z])


# Bodies of an arm, its base and its platform; of legs that were struts without, under gravity; of
# the plane; and of the parallel blocks of legs, before them and behind.
UPPER, TOOL = on("arm/upper arm", 0, 0.1, 0.1), on("platform", 0, 0, 0.05)
SPRINGS = {
    "six-joint-arm": (
        spring(on("base", 0.1, 0, 0.2), UPPER, stiffness=2e4, free_length=0.1),
        spring(UPPER, TOOL, stiffness=1e4, preload=300.0),
        spring(TOOL, on("base", 0.5, 0.5, 0.5), stiffness=5e4, free_length=0.0),
    ),
    "hexapod": (
        spring(on("base", 0.1, 0, 0), on("platform", 0, 0.1, 0), stiffness=2e5, preload=2e3),
        spring(on("leg2/strut", 0.02), on("base", 0.5, 0.5, 0.3), stiffness=1e5, free_length=0.2),
    ),
    "3-rpr-beams": (
        spring(on("base", 0.1, 0.1), on("platform", 0.02, 0.03), stiffness=3e4, preload=-100.0),
        spring(on("leg1/strut", 0, 0.02), on("platform", 0.02), stiffness=1e4, free_length=0.1),
    ),
    "orthoglide": (
        spring(on("leg-x/parallelogram"), on("base", 0.4, 0.3, 0.2), stiffness=3e3, preload=20.0),
        spring(on("leg-y/drive", 0, 0.1), TOOL, stiffness=2e3, free_length=0.05),
        spring(on("leg-x/parallelogram"), on("leg-y/drive", 0, 0.1), stiffness=3e3, preload=20.0),
    ),
}

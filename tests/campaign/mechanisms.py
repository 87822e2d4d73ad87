"""Robot descriptions, linkages and cable robots at random, against plain mechanics."""
# pyright: reportArgumentType=false
# pyright: reportReturnType=false
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import circle, material
from robostiff.spatial import Frame
from tests.campaign import loaded_cables
from tests.campaign.answers import Complaint, Judge

_RADIUS = 0.02


def _tree(rng: np.random.Generator, urdf: bool) -> list[Complaint]:
    """A serial tree as URDF or MJCF with `ref`, beside the same arm built in Python."""
    count = int(rng.integers(1, 6))
    kinds = [("hinge", "slide")[int(rng.uniform() < 0.3)] for _ in range(count)]
    axes = rng.normal(size=(count, 3))
    places, turns = rng.uniform(-0.5, 0.5, (count + 1, 3)), rng.uniform(-1, 1, (count + 1, 3))
    refs = rng.uniform(-0.5, 0.5, count) * (rng.uniform(size=count) < 0.6) * (not urdf)
    ks = 10 ** rng.uniform(4, 6, count)
    beams = rng.uniform(size=count) < 0.6
    side = {
        "robostiff": 1,
        "source": "random",
        "tool": f"b{count}",
        "joints": {f"j{i}": {"role": "locked", "stiffness": float(k)} for i, k in enumerate(ks)},
        "links": {},
    }
    for i in range(count):
        # the frame of the next body begins where a beam ends: turned frames only behind rigid ones
        if beams[i]:
            section = {"circle": {"diameter": 2 * _RADIUS}}
            side["links"][f"b{i}"] = {"type": "beam", "material": "steel", "section": section}
    side["links"] = {k: v for k, v in side["links"].items() if k != "b0"}
    text = _urdf(kinds, axes, places, turns) if urdf else _mjcf(kinds, axes, places, turns, refs)
    ending = "urdf" if urdf else "xml"
    with tempfile.TemporaryDirectory() as folder:
        path, beside = Path(folder, f"robot.{ending}"), Path(folder, "side.yaml")
        path.write_text(text)
        beside.write_text(json.dumps(side))
        loaded = rs.load(path, side=beside)
    found = rs.stiffness(loaded)
    expected = rs.stiffness(_same_arm(kinds, axes, places, turns, ks, beams))
    judge = Judge(None, 1.0, False)
    name = "URDF" if urdf else "MJCF"
    C, own = expected.compliance, found.compliance
    if C is None and own is None:
        return []
    if C is None or own is None:
        judge.say(name, "a compliance of one alone", f"{found.status} for {expected.status}")
    else:
        off = judge.distance(own, C)
        gap = np.abs(found.reference_point - expected.reference_point).max()
        if not (off <= 1e-9 and gap <= 1e-9):
            judge.say(name, "another compliance than the arm", f"{off:.2e}, tool {gap:.1e} m away")
    return judge.complaints


def _same_arm(kinds, axes, places, turns, ks, beams) -> rs.Robot:
    """Body i + 1 hangs on body i at a place and a turn, and its joint moves it."""
    elements = []
    for i, kind in enumerate(kinds):
        R = Rotation.from_rotvec(turns[i]).as_matrix()
        to = places[i]
        if i and beams[i]:
            steel = material("steel")
            elements.append(rs.beam_link(to, steel, circle(2 * _RADIUS)))
            elements.append(rs.Rigid(Frame(R, np.zeros(3))))
        else:
            elements.append(rs.Rigid(Frame(R, to)))
        make = rs.revolute if kind == "hinge" else rs.prismatic
        elements.append(make(axes[i], rs.Locked(float(ks[i])), name=f"j{i}"))
    leg = rs.Leg("arm", Frame.identity(), rs.Chain(tuple(elements)), Frame.identity())
    return rs.Robot("arm", (leg,))


def _mjcf(kinds, axes, places, turns, refs) -> str:
    text, close = "", ""
    for i, kind in enumerate(kinds):
        q = Rotation.from_rotvec(turns[i]).as_quat(scalar_first=True)
        text += (
            f'<body name="b{i + 1}" pos="{_row(places[i])}" quat="{_row(q)}">'
            f'<joint name="j{i}" type="{kind}" axis="{_row(axes[i])}" ref="{float(refs[i])!r}"/>'
            '<geom size="0.01"/>\n'
        )
        close += "</body>"
    head = '<mujoco model="g"><compiler angle="radian"/><worldbody>'
    return f"{head}\n{text}{close}</worldbody></mujoco>"


def _urdf(kinds, axes, places, turns) -> str:
    text = '<robot name="g"><link name="b0"/>\n'
    for i, kind in enumerate(kinds):
        rpy = Rotation.from_rotvec(turns[i]).as_euler("xyz")
        word = "revolute" if kind == "hinge" else "prismatic"
        text += (
            f'<link name="b{i + 1}"/><joint name="j{i}" type="{word}"><parent link="b{i}"/>'
            f'<child link="b{i + 1}"/><origin xyz="{_row(places[i])}" rpy="{_row(rpy)}"/>'
            f'<axis xyz="{_row(axes[i] / np.linalg.norm(axes[i]))}"/>'
            '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>\n'
        )
    return text + "</robot>"


def _row(values: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in values)


def _linkage(rng: np.random.Generator) -> list[Complaint]:
    """A planar four-bar that a crank drives far from home, where it can go all the way round."""
    from robostiff.linkage import Connection, Linkage
    from robostiff.model import Passive

    ground, coupler, rocker = 1.0, rng.uniform(0.7, 1.3), rng.uniform(0.7, 1.3)
    shortest = min(ground, coupler, rocker)
    crank = rng.uniform(0.1, 0.5) * shortest
    longest = max(ground, coupler, rocker)
    others = ground + coupler + rocker - longest
    if crank + longest > others:
        crank = 0.5 * (others - longest)
    if crank < 0.02:
        return []
    start = rng.uniform(-np.pi, np.pi)
    end = start + rng.uniform(0.5, 2.8) * rng.choice([-1, 1])
    branch = rng.choice([-1, 1])

    def knees(angle: float) -> tuple[np.ndarray, np.ndarray]:
        A = crank * np.array([np.cos(angle), np.sin(angle)])
        B = np.array([ground, 0.0])
        d = np.linalg.norm(B - A)
        along = (d**2 + coupler**2 - rocker**2) / (2 * d)
        e = (B - A) / d
        across = branch * np.sqrt(coupler**2 - along**2)
        return A, A + along * e + across * np.array([-e[1], e[0]])

    A, P = knees(start)
    phi = np.arctan2(*(P - A)[::-1])
    psi = np.arctan2(*(P - [ground, 0])[::-1])

    def at(x: float, angle: float = 0.0) -> Frame:
        return Frame(Rotation.from_rotvec([0, 0, angle]).as_matrix(), np.array([x, 0.0, 0]))

    def hinge(name: str, home: float, role=None) -> rs.Leg:
        return rs.revolute([0, 0, 1], role or Passive(), home=[home], name=name)

    I = Frame.identity()
    bar = rs.beam_link([coupler, 0, 0], material("steel"), circle(_RADIUS), name="bar")
    connections = (
        Connection("crank", "ground", "arm", I, hinge("crank", start, rs.Actuated(1e4)), at(crank)),
        Connection("knee", "arm", "coupler", I, hinge("knee", phi - start), I),
        Connection("bar", "coupler", "tip", I, bar, I),
        Connection("foot", "ground", "rocker", at(ground), hinge("foot", psi), at(rocker)),
        Connection("loop", "tip", "rocker", I, hinge("loop", psi - phi), I),
    )
    linkage = Linkage("four bar", connections, "ground", "tip", np.zeros(3))
    judge = Judge(None, 1.0, True)
    try:
        network = rs.network_at(linkage, {"crank": end})
    except rs.NoAnswerError as error:
        judge.say("linkage", "open, and a smooth way closes it", str(error)[:200])
        return judge.complaints
    _, P = knees(end)
    where = network.reference_point[:2]
    if np.abs(where - P).max() > 1e-7:
        judge.say("linkage", "another assembly mode than home's", f"{where} for {P}")
    return judge.complaints


KINDS: dict[str, Callable[[np.random.Generator], list[Complaint]]] = {
    "MJCF": lambda rng: _tree(rng, False),
    "URDF": lambda rng: _tree(rng, True),
    "linkage": _linkage,
    "cables": loaded_cables.cable_robot,
}

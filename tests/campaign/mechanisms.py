"""Linkages and cable robots at random, against plain mechanics."""
# pyright: reportArgumentType=false
# pyright: reportReturnType=false
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import circle, material
from robostiff.spatial import Frame
from tests.campaign import loaded_cables
from tests.campaign.answers import Complaint, Judge

_RADIUS = 0.02


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
    "linkage": _linkage,
    "cables": loaded_cables.cable_robot,
}

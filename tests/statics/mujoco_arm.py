"""An arm of sprung hinges as a model of MuJoCo and as a snapshot: two programs, one robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from robostiff.model import PlacedBodySpring, PlacedLeg, Snapshot
from tests.statics.robots_under_load import joint

mujoco = pytest.importorskip("mujoco")

AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], dtype=float)
STEPS = np.array(
    [[0, 0, 0.2], [0, 0, 0.25], [0.35, 0, 0.05], [0.2, 0, 0], [0.15, 0.02, 0], [0.1, 0, -0.03]]
)
TIP = np.array([0.12, 0.03, -0.05])
STIFFNESS = np.array([900.0, 1200, 700, 300, 250, 120])
MASSES = np.array([8.0, 6, 4, 2.5, 1.5, 1])
CENTRES = np.array(
    [
        [0.01, 0, 0.1],
        [0.15, 0, 0.02],
        [0.1, 0.02, 0],
        [0.07, 0, 0.01],
        [0.05, 0, 0],
        [0.06, 0.01, -0.02],
    ]
)
INERTIAS = np.array(
    [
        [0.05, 0.06, 0.03],
        [0.02, 0.08, 0.08],
        [0.01, 0.04, 0.04],
        [0.004, 0.01, 0.01],
        [0.002, 0.003, 0.004],
        [0.001, 0.002, 0.0015],
    ]
)
G = 9.81


@dataclass(frozen=True)
class Rest:
    """An equilibrium found by MuJoCo's forces alone."""

    q: np.ndarray
    tip: np.ndarray
    K: np.ndarray
    frequencies: np.ndarray


@dataclass(frozen=True)
class Tendon:
    """A spring between points of two bodies: 0 is the world, i the body behind joint i."""

    bodies: tuple[int, int]
    points: tuple[np.ndarray, np.ndarray]
    stiffness: float
    length: float

    @property
    def placed(self) -> PlacedBodySpring:
        names = ["base", *(f"arm/j{i + 1}" for i in range(6))]
        a, b = (names[body] for body in self.bodies)
        name = f"{a} to {b}"
        return PlacedBodySpring(name, (a, b), self.points, self.stiffness, self.length)


def arm() -> Snapshot:
    points = np.cumsum(STEPS, axis=0)
    elements = tuple(
        joint(f"j{i + 1}", point, axis, "R", k)
        for i, (point, axis, k) in enumerate(zip(points, AXES, STIFFNESS, strict=True))
    )
    tip = points[-1] + TIP
    return Snapshot("arm", (PlacedLeg("arm", elements, tip),), tip)


def centres() -> np.ndarray:
    """Of gravity, in the world at the unloaded posture (6, 3) [m]."""
    return np.cumsum(STEPS, axis=0) + CENTRES


def model(tendons: Sequence[Tendon] = ()) -> Any:
    """The arm, and springs between points of it and of the world, as spatial tendons."""
    text, end = "", ""
    sites = dict.fromkeys(range(7), "")
    springs = ""
    for n, tendon in enumerate(tendons):
        names = [f"t{n}a", f"t{n}b"]
        for name, body, point in zip(names, tendon.bodies, tendon.points, strict=True):
            at = point - (np.cumsum(STEPS, axis=0)[body - 1] if body else 0)
            at = " ".join(map(repr, map(float, at)))
            sites[body] += f'<site name="{name}" pos="{at}"/>'
        springs += (
            f'<spatial stiffness="{tendon.stiffness}" springlength="{tendon.length}">'
            f'<site site="{names[0]}"/><site site="{names[1]}"/></spatial>'
        )
    for i in range(6):
        numbers = [
            " ".join(map(repr, map(float, v))) for v in (STEPS[i], AXES[i], CENTRES[i], INERTIAS[i])
        ]
        step, axis, centre, inertia = numbers
        text += (
            f'<body pos="{step}"><joint type="hinge" axis="{axis}" stiffness="{STIFFNESS[i]}"/>'
            f'<inertial pos="{centre}" mass="{MASSES[i]}" diaginertia="{inertia}"/>' + sites[i + 1]
        )
        end += "</body>"
    tip = " ".join(map(repr, map(float, TIP)))
    site = f'<site name="tip" pos="{tip}"/>'
    option = f'<option gravity="0 0 -{G}"><flag contact="disable"/></option>'
    world = f"<worldbody>{sites[0]}{text}{site}{end}</worldbody>"
    xml = f"<mujoco>{option}{world}<tendon>{springs}</tendon></mujoco>"
    return mujoco.MjModel.from_xml_string(xml)


def at_rest(wrench: np.ndarray, tendons: Sequence[Tendon] = ()) -> Rest:
    """Where springs, weights and a dead wrench on the tip balance, and the rates there."""
    m = model(tendons)
    d = mujoco.MjData(m)
    tip = m.site("tip").id

    def unbalanced(q: np.ndarray) -> np.ndarray:
        d.qpos[:], d.qvel[:] = q, 0
        mujoco.mj_forward(m, d)
        return d.qfrc_bias - d.qfrc_passive - jacobian().T @ wrench

    def jacobian() -> np.ndarray:
        J = np.zeros((6, m.nv))
        mujoco.mj_jacSite(m, d, J[:3], J[3:], tip)
        return J

    def rates(q: np.ndarray) -> np.ndarray:
        h, H = 1e-3, np.zeros((6, 6))
        for i in range(6):
            e = h * np.eye(6)[i]
            near = unbalanced(q + e) - unbalanced(q - e)
            far = unbalanced(q + 2 * e) - unbalanced(q - 2 * e)
            wide = unbalanced(q + 3 * e) - unbalanced(q - 3 * e)
            H[:, i] = (45 * near - 9 * far + wide) / (60 * h)
        return H

    q = np.zeros(6)
    for _ in range(30):
        q = q - np.linalg.solve(rates(q), unbalanced(q))
    H = rates(q)
    assert np.abs(unbalanced(q)).max() < 1e-11
    J = jacobian()
    M = np.zeros((6, 6))
    mujoco.mj_fullM(m, d, M)
    squares = np.linalg.eigvals(np.linalg.solve(M, H)).real
    K = np.linalg.inv(J @ np.linalg.solve(H, J.T))
    return Rest(q, d.site_xpos[tip].copy(), K, np.sqrt(np.sort(squares)) / 2 / np.pi)

"""Random URDF and MJCF files with masses and springs, against pinocchio and MuJoCo.

Natural frequencies follow from the mass matrix that the other program computes from the same file,
and from the stiffnesses of the joints; sinking under weight from its gravity torques.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import robostiff as rs
from tests.campaign.answers import Complaint, Judge
from tests.campaign.mechanisms import _row

_SAME = 1e-6
_LIGHT = 1e-5  # m/s^2: weights so small that what sinks is proportional to them
_STEP = 1e-4


@dataclass(frozen=True)
class Tree:
    """A serial tree: joints, bodies with inertia, and what holds the joints."""

    kinds: list[str]
    axes: np.ndarray
    places: np.ndarray
    turns: np.ndarray
    masses: np.ndarray
    centres: np.ndarray
    inertias: np.ndarray  # about the centres, in the axes of the bodies
    side: np.ndarray  # stiffness in the side file, 0 for none
    springs: np.ndarray  # in the MJCF file
    servos: np.ndarray  # (n, 2): kp and gear
    armatures: np.ndarray  # of joints with a servo


def _random_tree(rng: np.random.Generator, urdf: bool) -> Tree:
    n = int(rng.integers(1, 6))
    axes = rng.normal(size=(n, 3))
    inertias = []
    for _ in range(n):
        A = rng.normal(size=(3, 3)) * 0.2
        inertias.append(np.trace(A @ A.T) * np.eye(3) - A @ A.T)
    side = 10 ** rng.uniform(2, 5, n)
    springs, servos = np.zeros(n), np.zeros((n, 2))
    if not urdf:
        has_spring, has_servo = rng.uniform(size=(2, n)) < 0.4
        springs = np.where(has_spring, 10 ** rng.uniform(2, 5, n), 0)
        servos[has_servo, 0] = 10 ** rng.uniform(2, 5, np.count_nonzero(has_servo))
        servos[has_servo, 1] = rng.uniform(0.5, 3, np.count_nonzero(has_servo))
        side = np.where((rng.uniform(size=n) < 0.5) | ~(has_spring | has_servo), side, 0)
    return Tree(
        [("hinge", "slide")[int(rng.uniform() < 0.3)] for _ in range(n)],
        axes / np.linalg.norm(axes, axis=1, keepdims=True),
        rng.uniform(-0.5, 0.5, (n, 3)),
        rng.uniform(-1, 1, (n, 3)),
        10 ** rng.uniform(-1, 1.3, n),
        rng.uniform(-0.3, 0.3, (n, 3)),
        np.array(inertias) * rng.uniform(0.1, 1, (n, 1, 1)),
        side,
        springs,
        servos,
        np.where(servos[:, 0] > 0, rng.uniform(0, 0.3, n) * (rng.uniform(size=n) < 0.5), 0.0),
    )


def _urdf(tree: Tree) -> str:
    text = '<robot name="g"><link name="b0"/>\n'
    for i, kind in enumerate(tree.kinds):
        rpy = Rotation.from_rotvec(tree.turns[i]).as_euler("xyz")
        word = "revolute" if kind == "hinge" else "prismatic"
        # The inertia in axes of its own, turned against those of the body.
        own = Rotation.from_euler("xyz", 0.3 * tree.centres[i])
        M = own.as_matrix().T @ tree.inertias[i] @ own.as_matrix()
        names = {
            "ixx": (0, 0),
            "iyy": (1, 1),
            "izz": (2, 2),
            "ixy": (0, 1),
            "ixz": (0, 2),
            "iyz": (1, 2),
        }
        moments = " ".join(f'{name}="{float(M[at])!r}"' for name, at in names.items())
        text += (
            f'<link name="b{i + 1}"><inertial><origin xyz="{_row(tree.centres[i])}" '
            f'rpy="{_row(0.3 * tree.centres[i])}"/><mass value="{float(tree.masses[i])!r}"/>'
            f"<inertia {moments}/></inertial></link>"
            f'<joint name="j{i}" type="{word}"><parent link="b{i}"/><child link="b{i + 1}"/>'
            f'<origin xyz="{_row(tree.places[i])}" rpy="{_row(rpy)}"/>'
            f'<axis xyz="{_row(tree.axes[i])}"/>'
            '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>\n'
        )
    return text + "</robot>"


def _mjcf(tree: Tree) -> str:
    text, close, servos = "", "", ""
    for i, kind in enumerate(tree.kinds):
        q = Rotation.from_rotvec(tree.turns[i]).as_quat(scalar_first=True)
        M = tree.inertias[i]
        full = [M[0, 0], M[1, 1], M[2, 2], M[0, 1], M[0, 2], M[1, 2]]
        spring = f'stiffness="{float(tree.springs[i])!r}" ' if tree.springs[i] else ""
        rotor = f'armature="{float(tree.armatures[i])!r}" ' if tree.armatures[i] else ""
        text += (
            f'<body name="b{i + 1}" pos="{_row(tree.places[i])}" quat="{_row(q)}">'
            f'<joint name="j{i}" type="{kind}" axis="{_row(tree.axes[i])}" {spring}{rotor}/>'
            f'<inertial pos="{_row(tree.centres[i])}" mass="{float(tree.masses[i])!r}" '
            f'fullinertia="{_row(np.array(full))}"/>\n'
        )
        close += "</body>"
        kp, gear = tree.servos[i]
        if kp:
            servos += (
                f'<position name="s{i}" joint="j{i}" kp="{float(kp)!r}" gear="{float(gear)!r}"/>'
            )
    head = '<mujoco model="g"><compiler angle="radian"/><worldbody>'
    return f"{head}\n{text}{close}</worldbody><actuator>{servos}</actuator></mujoco>"


def _of_mujoco(text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mass matrix, stiffness of springs and servos, weights' torques, Jacobian of the last body."""
    mujoco = import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    model.opt.gravity[:] = 0, 0, -1

    def forces(q: np.ndarray) -> np.ndarray:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        return data.qfrc_passive + data.qfrc_actuator

    n = model.nv
    steps = _STEP * np.eye(n)
    K = -np.array([(forces(d) - forces(-d)) / (2 * _STEP) for d in steps]).T
    forces(np.zeros(n))
    M = np.zeros((n, n))
    for row, unit in zip(M, np.eye(n), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    J = np.zeros((6, n))
    mujoco.mj_jacBody(model, data, J[:3], J[3:], model.nbody - 1)
    return M, K, -data.qfrc_bias.copy(), J


def _of_pinocchio(text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    pin = import_module("pinocchio")

    model = pin.buildModelFromXML(text)
    data, q = model.createData(), np.zeros(model.nq)
    M = pin.crba(model, data, q)
    M = np.triu(M) + np.triu(M, 1).T
    model.gravity.linear[:] = 0, 0, -1
    torques = -pin.computeGeneralizedGravity(model, data, q)
    pin.framesForwardKinematics(model, data, q)
    frame = model.getFrameId(f"b{model.nv}")
    J = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
    return M, np.zeros_like(M), torques, J.reshape(6, model.nv)


def described(rng: np.random.Generator) -> list[Complaint]:
    """Frequencies and sinking of a robot whose file has its masses."""
    urdf = rng.uniform() < 0.5
    tree = _random_tree(rng, urdf)
    name, ending = ("URDF", "urdf") if urdf else ("MJCF", "xml")
    judge = Judge(None, 1.0, False)
    text = _urdf(tree) if urdf else _mjcf(tree)
    n = len(tree.kinds)
    joints = {
        f"j{i}": {"role": "actuated", "stiffness": float(k)} for i, k in enumerate(tree.side) if k
    }
    side: dict[str, Any] = {"robostiff": 1, "source": "random", "tool": f"b{n}"}
    side |= {"joints": joints} if joints else {}
    try:
        M, own, torques, J = _of_pinocchio(text) if urdf else _of_mujoco(text)
    except ImportError:
        return []
    with tempfile.TemporaryDirectory() as folder:
        path, beside = Path(folder, f"robot.{ending}"), Path(folder, "side.yaml")
        path.write_text(text)
        beside.write_text(json.dumps(side))
        robot = rs.load(path, side=beside)
    # A stiffness in the side file is that of the drive, beside a spring of the joint.
    servo = tree.servos[:, 0] * tree.servos[:, 1] ** 2
    K = own + np.diag(tree.side - np.where(tree.side > 0, servo, 0.0))
    known = np.sqrt(eigh(K, M, eigvals_only=True)) / (2 * np.pi)
    compliance = J @ np.linalg.solve(K, J.T)
    found = rs.stiffness(robot)
    C = found.compliance
    words = f"{tree.kinds}, side {tree.side}, springs {tree.springs}, servos {servo}"
    if C is None or not judge.distance(C, compliance) <= 1e-8:
        judge.say(name, "another compliance", words)
        return judge.complaints
    try:
        modes = rs.modes(robot, gravity=[0, 0, 0])
    except rs.InputError as error:
        judge.say(name, "masses of the file are not read", str(error)[:80])
        return judge.complaints
    if len(modes) != n or not np.max(np.abs(modes.frequencies / known - 1)) <= _SAME:
        detail = f"{modes.frequencies} for {known}, armatures {tree.armatures.round(2)}"
        judge.say(name, "other frequencies", detail)
    sunk = J @ np.linalg.solve(K, torques) * _LIGHT
    own = rs.equilibrium(robot, gravity=[0, 0, -_LIGHT]).displacement
    size = np.maximum(np.abs(sunk), 1e-3 * np.abs(sunk).max())
    if not np.max(np.abs(own - sunk) / size) <= 1e-3:
        judge.say(name, "sinks by another displacement", f"{own} for {sunk}")
    return judge.complaints

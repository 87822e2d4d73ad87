"""Real robots from the example-robot-data package, and machines made of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.files import text_of, written
from tests.other_programs import ROBOTS

UR5 = ROBOTS / "ur_description/urdf/ur5_robot.urdf"
PANDA = ROBOTS / "panda_description/urdf/panda.urdf"
ROMEO = ROBOTS / "romeo_description/urdf/romeo.urdf"
TALOS = ROBOTS / "talos_data/robots/talos_full_v2.urdf"

UR5_JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
UR5_SIDE = text_of("ur5.stiffness.yaml")

needs_examples = pytest.mark.needs("example-robot-data")


def with_side(folder: Path, side: str) -> Path:
    """A side file in a folder."""
    return written(folder / "side.yaml", side)


def robot_of(
    description: Path | str,
    side: Path | None = None,
    parameters: Mapping[str, str | float] | None = None,
) -> rs.Robot:
    """The robot of a description and a side file, which must not be a network."""
    robot = rs.load(description, parameters, side=side)
    assert isinstance(robot, rs.Robot)
    return robot


def network_of(description: Path, side: Path) -> rs.Network:
    """The network at home of a description and a side file that make no robot."""
    network = rs.load(description, side=side)
    assert isinstance(network, rs.Network)
    return network


def pinocchio_model(path: Path) -> Any:
    """The robot as pinocchio reads it, with its data."""
    pin = import_module("pinocchio")

    model = pin.buildModelFromUrdf(str(path))
    return pin, model, model.createData()


def two_ur5(folder: Path) -> Path:
    """A cell of two UR5 that face each other, and a part in the hand of the left one."""
    text = UR5.read_text(encoding="utf-8")
    body = re.search(r"<robot[^>]*>(.*)</robot>", text, re.DOTALL)
    assert body is not None
    arms = "".join(
        re.sub(r'(<(?:link|joint) name|link)="', rf'\1="{side}_', _kinematics(body[1]))
        for side in ("left", "right")
    )
    cell = f"""<robot name="cell"><link name="cell"/>{arms}
    <joint name="left_foot" type="fixed"><parent link="cell"/><child link="left_world"/></joint>
    <joint name="right_foot" type="fixed"><parent link="cell"/><child link="right_world"/>
      <origin xyz="1.1 0 0" rpy="0 0 3.141592653589793"/></joint>
    <link name="part"/>
    <joint name="grasp" type="fixed"><parent link="left_tool0"/><child link="part"/>
      <origin xyz="0 0 0.1"/></joint>
    </robot>"""
    return written(folder / "cell.urdf", cell)


def _kinematics(text: str) -> str:
    """Links without contents, and joints."""
    links = re.findall(r'<link name="[^"]*"', text)
    joints = re.findall(r'<joint name="[^"]*" type=.*?</joint>', text, re.DOTALL)
    return "".join(f"{link}/>" for link in links) + "".join(joints)


def matrix_distance(K: np.ndarray, other: np.ndarray) -> float:
    """Largest difference in units of the largest entry of its block."""
    worst = 0.0
    for rows in (slice(0, 3), slice(3, 6)):
        for columns in (slice(0, 3), slice(3, 6)):
            scale = np.abs(other[rows, columns]).max()
            worst = max(worst, np.abs(K - other)[rows, columns].max() / scale)
    return float(worst)

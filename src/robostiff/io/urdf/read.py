"""From a URDF to a tree of rigid links."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.errors import FileError, InputError, Location
from robostiff.io.rigid_tree.tree import JointType, Mimic, RigidTree, TreeJoint
from robostiff.io.rigid_tree.xml_text import XmlElement, parse_xml, read_bytes
from robostiff.io.suggest import Words
from robostiff.io.urdf.check import check_structure, kinematics_alone
from robostiff.model import Actuated, Passive
from robostiff.spatial import Frame

_TYPES = {
    "fixed": JointType.FIXED,
    "revolute": JointType.REVOLUTE,
    "continuous": JointType.REVOLUTE,
    "prismatic": JointType.PRISMATIC,
    "planar": JointType.PLANAR,
    "floating": JointType.FLOATING,
}


def read_urdf(source: Path | str, content: bytes | None = None) -> RigidTree:
    """Read a URDF.

    Meshes, inertias and collision shapes are not looked at, and no other file is opened.

    Parameters
    ----------
    source : path or str
        The file.
    content : bytes, optional
        Its text, where it has been read already; then the file is for messages only.

    Raises
    ------
    FileError
        When it cannot be read or is no URDF that makes sense.
    InputError
        When yourdfpy is not installed.
    """
    file = str(source)
    root = parse_xml(read_bytes(source) if content is None else content, file)
    check_structure(root)
    robot = _parsed(root)
    places = {joint.attributes["name"]: joint.location for joint in root.all("joint")}
    return RigidTree(
        name=robot.name,
        file=file,
        links=tuple(link.name for link in robot.links),
        joints=tuple(_joint(joint, places[joint.name]) for joint in robot.joints),
    )


def _parsed(root: XmlElement) -> Any:
    """The robot as yourdfpy reads it, from links and joints alone."""
    try:
        from yourdfpy import URDF
    except ImportError:
        raise InputError(
            "URDF",
            got=Words("no yourdfpy, which reads it"),
            expected="the extra urdf",
            hint="pip install 'robostiff[urdf]'",
        ) from None
    text = io.BytesIO(kinematics_alone(root))
    return URDF.load(text, build_scene_graph=False, load_meshes=False).robot


def _joint(joint: Any, place: Location) -> TreeJoint:
    kind = _TYPES[joint.type]
    origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=float)
    axis = np.asarray(joint.axis, dtype=float)
    moves = kind in (JointType.REVOLUTE, JointType.PRISMATIC, JointType.PLANAR)
    if moves and not np.any(axis):
        raise FileError(
            place, f"axis of joint {joint.name!r}", got=axis, expected="a direction, not zero"
        )
    mimic = None
    if joint.mimic is not None:
        mimic = Mimic(joint.mimic.joint, float(joint.mimic.multiplier), float(joint.mimic.offset))
    return TreeJoint(
        name=joint.name,
        type=kind,
        parent=joint.parent,
        child=joint.child,
        before=Frame(origin[:3, :3], origin[:3, 3]),
        axis=axis,
        role=Passive() if kind is JointType.PLANAR else Actuated(limits=_limits(joint)),
        mimic=mimic,
    )


def _limits(joint: Any) -> tuple[float, float] | None:
    limit = joint.limit
    if joint.type == "continuous" or limit is None or None in (limit.lower, limit.upper):
        return None
    low, high = float(limit.lower), float(limit.upper)
    return (low, high) if low < high else None

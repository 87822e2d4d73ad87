"""Models of Pinocchio as trees of rigid links."""

from __future__ import annotations

import re
from importlib import import_module
from typing import Any

import numpy as np

from robostiff.errors import FileError, Location, Words
from robostiff.io.rigid_tree import JointType, Mimic, RigidTree, TreeJoint, mass_of_body
from robostiff.model import Actuated, Passive
from robostiff.spatial import Frame

_TYPES = (
    (r"R(UB)?[XYZ]|Revolute(Unbounded)?Unaligned", JointType.REVOLUTE),
    (r"P[XYZ]|PrismaticUnaligned", JointType.PRISMATIC),
    (r"Spherical", JointType.SPHERICAL),
    (r"Planar", JointType.PLANAR),
    (r"FreeFlyer", JointType.FLOATING),
)
_FARTHEST = 1e30  # beyond that a limit stands for none


def tree_of_pinocchio(model: Any) -> RigidTree:
    """The tree of a ``pinocchio.Model``: a link for each joint, and for each frame of a body.

    Pinocchio merges links that are fixed to each other. A joint's link has the name of the body
    whose frame is the joint's own; other bodies are fixed to it. Raises FileError for joints that
    have no counterpart here, such as composite ones.
    """
    file = f"model of Pinocchio {model.name!r}"
    bodies = [frame for frame in model.frames if "BODY" in str(frame.type)]
    links = ["universe", *(f"link of {name}" for name in list(model.names)[1 : model.njoints])]
    for body in reversed(bodies):  # the first at a joint's own frame gives its link the name
        if body.placement.isIdentity(1e-12):
            links[body.parentJoint] = body.name
    pinocchio: Any = import_module("pinocchio")
    data = model.createData()
    pinocchio.forwardKinematics(model, data, pinocchio.neutral(model))
    # Columns (6, n) of each joint at the neutral configuration: translation, rotation.
    columns = [np.array(own.S).reshape(6, -1) for own in data.joints]
    joints = [
        _joint(model, joint, links, columns[joint], file) for joint in range(1, model.njoints)
    ]
    for body in bodies:
        if body.name not in links:
            parent, frame = links[body.parentJoint], _frame(body.placement)
            own = f"{body.name} on {parent}"
            joints.append(TreeJoint(own, JointType.FIXED, parent, body.name, frame, np.zeros(3)))
    names = (links[0], *(joint.child for joint in joints))
    masses = {}
    for link, own in zip(links, model.inertias, strict=True):
        inertia, place = np.array(own.inertia), Location(file, path=link)
        mass = mass_of_body(link, float(own.mass), np.array(own.lever), inertia, place)
        masses |= {} if mass is None else {link: mass}
    return RigidTree(model.name, file, names, tuple(joints), masses=masses)


def _joint(model: Any, joint: int, links: list[str], columns: np.ndarray, file: str) -> TreeJoint:
    name, mimic = model.names[joint], None
    follows = model.joints[joint].shortname() == "JointModelMimic"
    if follows:
        # Its column is that of the joint that it stands for, times the factor.
        own = model.joints[joint].extract()
        leader = int(model.mimicked_joints[list(model.mimicking_joints).index(joint)])
        mimic = Mimic(model.names[leader], float(own.scaling), float(own.offset))
        columns = columns / (mimic.multiplier or 1.0)
        turns, slides = np.any(columns[3:]), np.any(columns[:3])
        kind = JointType.REVOLUTE if turns else JointType.PRISMATIC
        if turns == slides:
            raise _refused(
                model,
                joint,
                "a joint that follows another one, and neither turns nor slides alone",
                file,
            )
    else:
        own = model.joints[joint].shortname().removeprefix("JointModel")
        kind = next((kind for pattern, kind in _TYPES if re.fullmatch(pattern, own)), None)
        if kind is None:
            raise _refused(model, joint, own, file)
    axis = np.zeros(3)
    if kind is JointType.REVOLUTE:
        axis = columns[3:, 0]
    elif kind is JointType.PRISMATIC:
        axis = columns[:3, 0]
    elif kind is JointType.PLANAR:
        axis = np.array([0.0, 0.0, 1.0])
    driven = kind in (JointType.REVOLUTE, JointType.PRISMATIC)
    return TreeJoint(
        name=name,
        type=kind,
        parent=links[model.parents[joint]],
        child=links[joint],
        before=_frame(model.jointPlacements[joint]),
        axis=axis,
        role=Actuated(limits=None if follows else _limits(model, joint)) if driven else Passive(),
        inertia=float(model.armature[model.joints[joint].idx_v]) if driven else 0.0,
        mimic=mimic,
    )


def _refused(model: Any, joint: int, words: str, file: str) -> FileError:
    return FileError(
        Location(file),
        f"joint {model.names[joint]!r}",
        got=Words(words),
        expected="a revolute, prismatic, spherical, planar or free-flying joint",
        hint="write it as several joints, one after the other",
    )


def _limits(model: Any, joint: int) -> tuple[float, float] | None:
    own = model.joints[joint]
    if own.nq != 1:
        return None  # a joint that turns without end
    low = float(model.lowerPositionLimit[own.idx_q])
    high = float(model.upperPositionLimit[own.idx_q])
    bounded = low < high and max(abs(low), abs(high)) < _FARTHEST
    return (low, high) if bounded else None


def _frame(placement: Any) -> Frame:
    return Frame(np.array(placement.rotation), np.array(placement.translation))

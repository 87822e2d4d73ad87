"""Loops and springs that are written in a URDF beside its tree, and what else of it holds a robot.

Loops are joints of Gazebo, ``<gazebo><joint>`` as in SDF; ``<loop_joint>``, as Drake had it; and
``<constraint>`` with an origin in each link. Springs are ``springStiffness`` of Gazebo, and
``spring_stiffness`` among the dynamics of a joint, as SDF has it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.io.plausibility import warn_of_parts_not_read
from robostiff.io.rigid_tree.build_links import drawn_links
from robostiff.io.rigid_tree.tree import JointType, RigidTree, TreeLoop
from robostiff.io.rigid_tree.xml_text import XmlElement
from robostiff.model import Actuated, Joint, Passive, prismatic, revolute, spherical
from robostiff.spatial import Frame

_HARMLESS = frozenset(
    (
        *("link", "joint", "material", "gazebo", "transmission", "ros2_control", "sensor"),
        *("loop_joint", "constraint", "mujoco", "plugin", "version", "verbose"),
        *("drake:collision_filter_group", "collision_checking"),
    )
)
_TURNING, _BALL = ("revolute", "continuous", "hinge"), ("ball", "spherical")


def with_extensions(tree: RigidTree, root: XmlElement) -> RigidTree:
    """The tree with the loops and springs of its file; warns of what is not read.

    Raises FileError where their numbers are none.
    """
    unread: dict[str, list[XmlElement]] = {}
    drawn = drawn_links(tree, {})
    loops = []
    for element in _loop_elements(root):
        loop = _loop(element, drawn)
        if loop is None:
            unread.setdefault("loops", []).append(element)
        else:
            taken = {joint.name for joint in tree.joints} | {own.name for own in loops}
            name = loop.name
            while name in taken:
                name = f"loop {name}"
            loops.append(replace(loop, name=name))
    springs = _springs(root, unread)
    for joint in tree.joints:
        moves = joint.type in (JointType.REVOLUTE, JointType.PRISMATIC)
        if not moves and springs.get(joint.name):
            unread.setdefault(f"springs of {joint.type.value} joints", []).append(
                next(own for own in root.all("joint") if own.attributes["name"] == joint.name)
            )
            del springs[joint.name]
    for element in root.children:
        if element.tag not in _HARMLESS and not element.tag.startswith("xacro"):
            unread.setdefault(f"<{element.tag}>", []).append(element)
        elif element.tag == "transmission" and len(element.all("joint")) > 1:
            unread.setdefault("transmissions that connect several joints", []).append(element)
        elif element.tag == "gazebo" and "reference" not in element.attributes:
            for child in element.children:
                if child.tag == "link" or child.tag.startswith("joint:"):
                    unread.setdefault(f"<{child.tag}> of Gazebo", []).append(child)
    warn_of_parts_not_read(
        {
            kind: [
                (own.attributes.get("name") or own.attributes.get("reference", ""), own.location)
                for own in elements
            ]
            for kind, elements in unread.items()
        }
    )
    joints = tuple(replace(own, spring=springs.get(own.name, 0.0)) for own in tree.joints)
    return replace(tree, joints=joints, loops=tuple(loops))


def rotor_inertias(root: XmlElement) -> dict[str, float]:
    """Inertia of the rotor of each joint that has one, at the joint [kg m^2 or kg].

    That of a ``<transmission>`` of one joint, ``drake:rotor_inertia`` as Drake has it or
    ``rotorInertia``, times the square of its reduction; or the ``armature`` among the dynamics of a
    joint, which is at the joint already.
    """
    found: dict[str, float] = {}
    for own in root.all("transmission"):
        joints = own.all("joint")
        parts = [part for tag in ("actuator", "joint") for part in own.all(tag)]
        ratio = _of_drive(parts, "drake:gear_ratio", "mechanicalReduction", 1.0)
        inertia = _of_drive(parts, "drake:rotor_inertia", "rotorInertia", 0.0)
        if len(joints) == 1 and inertia:
            found[joints[0].attributes.get("name", "")] = inertia * ratio**2
    for own in root.all("joint"):
        armature = _attribute_or_text(own, "armature", "armature")
        if armature:
            found[own.attributes["name"]] = armature
    for name, inertia in found.items():
        if inertia < 0:
            raise root.error(f"rotor of joint {name!r}", got=inertia, expected="an inertia, or 0")
    return found


def _of_drive(parts: Sequence[XmlElement], of_drake: str, tag: str, otherwise: float) -> float:
    """A number of a drive, as the value of an element or as its text."""
    for own in parts:
        texts = [child.attributes.get("value") for child in own.all(of_drake)]
        texts += [child.text for child in own.all(tag)]
        for text in texts:
            return float(own.numbers(f"{tag} of <{own.tag}>", text, (otherwise,))[0])
    return otherwise


def _springs(root: XmlElement, unread: dict[str, list[XmlElement]]) -> dict[str, float]:
    """Stiffness of the spring of each joint that has one [N m/rad or N/m]."""
    springs: dict[str, float] = {}
    names = {own.attributes["name"] for own in root.all("joint")}
    for own in (*root.all("joint"), *root.all("gazebo")):
        name = own.attributes.get("name" if own.tag == "joint" else "reference", "")
        k = _spring(own)
        if not k or name not in names:
            continue
        if springs.setdefault(name, k) != k:
            unread.setdefault("a second spring of", []).append(own)
        elif _attribute_or_text(own, "spring_reference", "springReference"):
            unread.setdefault("the load at home of springs with a reference,", []).append(own)
    return springs


def _spring(element: XmlElement) -> float:
    """The stiffness written in an element, or among its dynamics; 0 for none."""
    k = _attribute_or_text(element, "spring_stiffness", "springStiffness")
    if k < 0:
        raise element.error(f"spring in <{element.tag}>", got=k, expected="a stiffness, or 0")
    return k


def _attribute_or_text(element: XmlElement, key: str, of_gazebo: str) -> float:
    """A number among the dynamics, as an attribute or an element, or in an element of Gazebo."""
    dynamics = element.one("dynamics")
    texts = [own.text for own in element.all(of_gazebo)]
    if dynamics is not None:
        texts += [dynamics.attributes.get(key), *(own.text for own in dynamics.all(key))]
    text = next((text for text in texts if text), None)
    return float(element.numbers(f"{key} of <{element.tag}>", text, (0.0,))[0])


def _loop_elements(root: XmlElement) -> list[XmlElement]:
    of_gazebo = [
        joint
        for own in root.all("gazebo")
        if "reference" not in own.attributes
        for joint in own.all("joint")
    ]
    return [*of_gazebo, *root.all("loop_joint"), *root.all("constraint")]


def _loop(element: XmlElement, drawn: Mapping[str, Frame]) -> TreeLoop | None:
    """The loop that an element closes; None where its joint or its links are of another kind."""
    ends = _ends_of_gazebo(element, drawn) if element.tag == "joint" else _ends(element)
    if ends is None:
        return None
    links, frames, axis = ends
    name, kind = element.attributes.get("name") or element.tag, element.attributes.get("type")
    if not set(links) <= set(drawn) or links[0] == links[1]:
        return None
    if kind == "fixed":
        return TreeLoop(name, links, frames, None)
    if kind in _BALL:
        return TreeLoop(name, links, frames, spherical(Passive(), name=name))
    if (kind != "prismatic" and kind not in _TURNING) or not np.any(axis):
        return None
    make = prismatic if kind == "prismatic" else revolute
    spring = _spring(element.one("axis") or element)
    joint: Joint = make(axis, Actuated(spring) if spring else Passive(), name=name)
    return TreeLoop(name, links, frames, joint)


_Ends = tuple[tuple[str, str], tuple[Frame, Frame], np.ndarray]


def _ends_of_gazebo(element: XmlElement, drawn: Mapping[str, Frame]) -> _Ends | None:
    """Parent and child, the frame of the joint in each, and its axis there.

    The joint stands in the frame of its child, and the links stand as they do at zero coordinates.
    """
    links = _text(element, "parent"), _text(element, "child")
    pose, axis = element.one("pose"), element.one("axis")
    direction = None if axis is None else axis.one("xyz")
    elsewhere = [own.attributes for own in (pose, direction) if own is not None]
    in_model = axis is not None and _text(axis, "use_parent_model_frame") in ("true", "1")
    if not set(links) <= set(drawn) or any(elsewhere) or in_model:
        return None
    text = None if pose is None else pose.text
    numbers = element.numbers("pose of <joint>", text, (0.0,) * 6)
    seen = _frame(numbers[:3], numbers[3:])
    in_parent = drawn[links[0]].inverse @ drawn[links[1]] @ seen
    text = None if direction is None else direction.text
    return links, (in_parent, seen), element.numbers("axis of <joint>", text, (0.0, 0.0, 1.0))


def _ends(element: XmlElement) -> _Ends:
    """Both links, the frame of the joint in each, and its axis in both; zero where they differ."""
    if element.tag == "loop_joint":
        ends = origins = [element.one("link1"), element.one("link2")]
        axes = [element.one("axis")] * 2
    else:
        ends = [element.one("parent"), element.one("child")]
        origins = [element.one("parent_origin"), element.one("child_origin")]
        axes = [element.one("parent_axis") or element.one("axis"), element.one("child_axis")]
    first, second = ("" if own is None else own.attributes.get("link", "") for own in ends)
    frames = []
    for own in origins:
        at, turn = (_attribute(own, key, np.zeros(3)) for key in ("xyz", "rpy"))
        frames.append(_frame(at, turn))
    axis = _attribute(axes[0], "xyz", np.array([1.0, 0.0, 0.0]))
    other = _attribute(axes[1], "xyz", axis)
    same = np.allclose(axis, other, rtol=0, atol=1e-12)
    return (first, second), (frames[0], frames[1]), axis * same


def _frame(at: np.ndarray, turn: np.ndarray) -> Frame:
    """Frame from a place and from roll, pitch and yaw about fixed axes."""
    return Frame(Rotation.from_euler("xyz", turn).as_matrix(), at + 0.0)


def _attribute(element: XmlElement | None, key: str, otherwise: np.ndarray) -> np.ndarray:
    if element is None:
        return otherwise
    return element.numbers(f"{key} of <{element.tag}>", element.attributes.get(key), otherwise)


def _text(element: XmlElement, tag: str) -> str:
    own = element.one(tag)
    return "" if own is None else own.text.strip()

"""Trees of rigid links from robot description files, with what a side file adds to them.

A `Reader` of descriptions makes a `RigidTree`; `read_xml` reads XML from unknown sources, bounded.

``tree`` is the description as data, ``side_file`` what is written beside it, and ``build`` makes
linkages and robots of both.
"""

from robostiff.io.rigid_tree.build import linkage_of_tree, robot_of_tree
from robostiff.io.rigid_tree.side_file import key_of_joint
from robostiff.io.rigid_tree.tree import (
    JointType,
    Mimic,
    Reader,
    RigidTree,
    TreeJoint,
    TreeLoop,
    XmlElement,
    XmlLimits,
    mass_of_body,
    question_place,
    read_side,
    read_xml,
    warn_of_parts_not_read,
)

__all__ = [
    "JointType",
    "Mimic",
    "Reader",
    "RigidTree",
    "TreeJoint",
    "TreeLoop",
    "XmlElement",
    "XmlLimits",
    "key_of_joint",
    "linkage_of_tree",
    "mass_of_body",
    "question_place",
    "read_side",
    "read_xml",
    "robot_of_tree",
    "warn_of_parts_not_read",
]

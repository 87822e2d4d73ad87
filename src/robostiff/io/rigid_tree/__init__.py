"""Trees of rigid links from robot description files, with what a side file adds to them.

``tree`` is the description as data, ``written_side`` defines side files,
``build_joints`` and ``build`` make linkages and robots of both; ``build`` is the entry point.
"""

from robostiff.io.rigid_tree.build import linkage_of_tree, robot_of_tree
from robostiff.io.rigid_tree.tree import JointType, Mimic, RigidTree, TreeJoint, TreeLoop
from robostiff.io.rigid_tree.written_side import read_side

__all__ = [
    "JointType",
    "Mimic",
    "RigidTree",
    "TreeJoint",
    "TreeLoop",
    "linkage_of_tree",
    "read_side",
    "robot_of_tree",
]

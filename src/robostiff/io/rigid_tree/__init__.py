"""Trees of rigid links from robot description files, with what a side file adds to them.

A `Reader` of descriptions makes a `RigidTree`; `read_xml` reads XML from unknown sources, bounded.

``tree`` is the description as data, ``side_file`` what is written beside it, and ``build`` makes
linkages and robots of both.
"""

from robostiff.io.rigid_tree.build import linkage_of_tree as linkage_of_tree
from robostiff.io.rigid_tree.build import robot_of_tree as robot_of_tree
from robostiff.io.rigid_tree.side_file import key_of_joint as key_of_joint
from robostiff.io.rigid_tree.tree import JointType as JointType
from robostiff.io.rigid_tree.tree import Mimic as Mimic
from robostiff.io.rigid_tree.tree import Reader as Reader
from robostiff.io.rigid_tree.tree import RigidTree as RigidTree
from robostiff.io.rigid_tree.tree import TreeJoint as TreeJoint
from robostiff.io.rigid_tree.tree import TreeLoop as TreeLoop
from robostiff.io.rigid_tree.tree import XmlElement as XmlElement
from robostiff.io.rigid_tree.tree import XmlLimits as XmlLimits
from robostiff.io.rigid_tree.tree import mass_of_body as mass_of_body
from robostiff.io.rigid_tree.tree import question_place as question_place
from robostiff.io.rigid_tree.tree import read_side as read_side
from robostiff.io.rigid_tree.tree import read_xml as read_xml
from robostiff.io.rigid_tree.tree import warn_of_parts_not_read as warn_of_parts_not_read

"""What a distribution may add to robostiff: a command, a reader and a writer."""

from pathlib import Path

import numpy as np

from robostiff.cli import Answer, Command, Model, group, show
from robostiff.extras import Writer
from robostiff.io.rigid_tree import JointType, Reader, RigidTree, TreeJoint
from robostiff.spatial import Frame


class CountLegs(Command, name="legs"):
    """Count the legs of a robot.

    $ legs hexapod
    """

    model: Model = group(Model)
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Print the number of legs."""
        legs = len(self.model.load().legs)
        show({"legs": legs} if self.answer.as_json else f"{legs} legs")
        return 0


def _slide(path) -> RigidTree:
    """A slide along x of the length that the file holds."""
    length = float(Path(path).read_text())
    end = Frame(np.eye(3), np.array([length, 0.0, 0.0]))
    joint = TreeJoint("slide", JointType.PRISMATIC, "base", "tip", end, np.array([1.0, 0.0, 0.0]))
    return RigidTree("slide", str(path), ("base", "tip"), (joint,))


SLIDE = Reader("a slide", _slide)
COUNT = Writer((".count",), lambda network, ending: f"{len(network.nodes)} bodies{ending}\n")

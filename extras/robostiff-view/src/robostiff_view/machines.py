"""What each kind of robot answers where its sliders are."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from pathlib import Path
from typing import Any

import numpy as np

from robostiff import CableRobot, cable_response
from robostiff.analysis import CableResponse, Deflection, stiffness
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.kinematics import JointCoordinates, find_posture
from robostiff.linkage import Linkage, close, closed_at
from robostiff.markup import blocks_html, page_html
from robostiff.model import Actuated, Robot, Snapshot
from robostiff.network import Network
from robostiff.page import cable_load_blocks, cable_stiffness_page
from robostiff.plot import Layers, layers_of
from robostiff.spatial import Space
from robostiff.statics import deflection
from robostiff_view.answer import UNDER_LOAD, Look, ShownAnswer, answer_of, kind_of
from robostiff_view.sliders import (
    Slider,
    coordinate_sliders,
    joint_sliders,
    joint_values,
    slider_around,
)


class Machine:
    """A robot of legs, a snapshot, a network or a linkage at the values of its sliders.

    Its load acts on the platform; see `machine_of`.
    """

    robot: Any
    name: str
    space: Space
    size: float
    box: tuple[np.ndarray, np.ndarray]
    sliders: tuple[Slider, ...]
    exaggeration = 1000.0  # of the displacements that were drawn last

    def __init__(self, robot: Any, pose: Any = None) -> None:
        self.robot, self.name, self.space = robot, robot.name, robot.space
        at_home = layers_of(self.loaded(None, np.zeros(self.space.size)), ())
        # one of joints in one point is drawn as if it were a metre large
        self.size, self.box, self._scales = at_home.size or 1.0, at_home.box, at_home.scales
        self.sliders = self.sliders_from(pose)

    def loaded(self, pose: Any, wrench: np.ndarray) -> Any:
        """Its answer at a pose under a load (n,)."""
        return deflection(self.robot, pose, wrench)

    def like(self, robot: Any) -> Machine:
        """The same with a robot of other dimensions: its sliders and scales stay."""
        found = copy(self)
        found.robot = robot.numeric
        return found

    def sliders_from(self, pose: Any) -> tuple[Slider, ...]:
        """What can be moved, beginning at a pose: nothing of what is frozen at its own."""
        if pose is not None:
            raise InputError(
                f"pose of {self.name!r}", got=pose, expected="none: it is frozen at its own pose"
            )
        return ()

    def pose(self, values: Mapping[str, float]) -> Any:
        """The pose of values by the names of the sliders, as `robostiff.stiffness` takes it."""
        del values

    def answer(self, values: Mapping[str, float], wrench: np.ndarray, look: Look) -> ShownAnswer:
        """What is shown at values in SI units, under a load (n,) on the platform."""
        bent = self.loaded(self.pose(values), wrench)
        if Status.UNREACHABLE in bent.stiffness.status:
            return ShownAnswer(str(bent.status), "bad", tuple(bent.advice))
        return answer_of(bent, self.layers(bent, look))

    def layers(self, answer: Deflection | CableResponse, look: Look) -> Layers:
        """Layers that are wanted, with ellipsoids on the scale of the first answer that has one."""
        drawn = layers_of(answer, look.seen, exaggeration=look.exaggeration, scales=self._scales)
        self._scales, self.exaggeration = drawn.scales, drawn.exaggeration or self.exaggeration
        return drawn


def machine_of(robot: Any, pose: Any = None) -> Machine:
    """The machine of a robot, snapshot, network, cable robot or linkage.

    Parameters
    ----------
    robot : Robot, Snapshot, Network, CableRobot or Linkage
    pose : as for `robostiff.stiffness`, or mapping of str to float
        Where the sliders begin, of a linkage those of joints by name; home when left out.

    Raises
    ------
    InputError
        When it is none of these, or the pose does not fit.
    """
    for kind, machine in (
        (Robot, RobotMachine),
        (CableRobot, CableMachine),
        (Linkage, LinkageMachine),
        (Snapshot | Network, Machine),
    ):
        if isinstance(robot, kind):
            return machine(robot.numeric, pose)
    raise InputError(
        "robot of a view",
        got=robot,
        expected="a Robot, Snapshot, Network, CableRobot or Linkage",
        hint='write rs.load("hexapod")',
    )


class RobotMachine(Machine):
    """A robot of legs, moved by its pose or by its joints."""

    def sliders_from(self, pose: Any) -> tuple[Slider, ...]:
        """Of joints of an arm, or of free coordinates."""
        start = find_posture(self.robot, pose)
        if start.batch:
            raise InputError("pose of a view", got=pose, expected="a single pose")
        if self.robot.is_posed_by_joints:
            return joint_sliders(self.robot, start.coordinates[0][0], self.size)
        home = find_posture(self.robot).pose[0]
        return coordinate_sliders(self.robot.coordinates, home, start.pose[0], self.size)

    def pose(self, values: Mapping[str, float]) -> Any:
        """Joint coordinates of an arm, or free coordinates."""
        if not self.sliders:
            return None
        if self.robot.is_posed_by_joints:
            return JointCoordinates(joint_values(self.robot, values))
        return np.array([values[slider.name] for slider in self.sliders])


class LinkageMachine(Machine):
    """Bodies and joints in loops: joints that keep their coordinates, or drives, are moved."""

    def sliders_from(self, pose: Any) -> tuple[Slider, ...]:
        """Of those joints."""
        home, joints = close(self.robot).coordinates, self.robot.joints
        start = home if pose is None else {**home, **closed_at(self.robot, pose)[1].coordinates}
        drives = {joint.name for joint in joints if isinstance(joint.role, Actuated)}
        moved = [j for j in joints if j.size == 1 and j.name in (self.robot.held or drives)]
        ends = [[float(at[j.name][0]) for at in (home, start)] for j in moved]
        return tuple(
            slider_around(j.name, bool(j.freedoms[0].turns), *pair, size=self.size)
            for j, pair in zip(moved, ends, strict=True)
        )

    def pose(self, values: Mapping[str, float]) -> Any:
        """Their coordinates by name."""
        return {slider.name: values[slider.name] for slider in self.sliders}


class CableMachine(Machine):
    """A cable robot: the load is carried by locked winches."""

    def loaded(self, pose: Any, wrench: np.ndarray) -> CableResponse:
        """Its answer at a pose under a load (n,)."""
        return cable_response(self.robot, pose, wrench)

    def sliders_from(self, pose: Any) -> tuple[Slider, ...]:
        """Of coordinates of the pose."""
        home, start = (np.asarray(stiffness(self.robot, own).pose) for own in (None, pose))
        return coordinate_sliders(self.robot.coordinates, home, start, self.size)

    def answer(self, values: Mapping[str, float], wrench: np.ndarray, look: Look) -> ShownAnswer:
        """What is shown at values in SI units, under a load (n,) on the platform."""
        found = self.loaded(np.array([values[slider.name] for slider in self.sliders]), wrench)
        before, is_loaded = found.before, np.any(wrench)
        drawn = self.layers(found, look)
        blocks = cable_load_blocks(found) if is_loaded else []
        status = found.status if is_loaded else before.status
        return ShownAnswer(
            str(status),
            kind_of(status.is_bad, not status),
            tuple(dict.fromkeys([*before.advice, *found.advice])),
            drawn.items,
            page_html(cable_stiffness_page(before)),
            UNDER_LOAD + blocks_html(blocks) if blocks else "",
            drawn.notes,
        )


def parameters_written(source: Any, side: str | Path | None) -> Mapping[str, Any]:
    """Parameters as they are written in the model file, or in the side file of a description."""
    from robostiff.io.document import read_document
    from robostiff.io.rigid_tree import read_side
    from robostiff.robots import robot_file, shipped_names

    path = robot_file(source) if source in shipped_names() else source
    models = {"", ".yaml", ".yml", ".json"}
    beside = side is not None or Path(str(path)).suffix.lower() not in models
    data = (read_side(path, side) if beside else read_document(path)).data
    found = data.get("parameters") if isinstance(data, dict) else None
    return found if isinstance(found, dict) else {}

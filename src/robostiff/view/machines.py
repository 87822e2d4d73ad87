"""What each kind of robot answers where its sliders are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.analysis import stiffness
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.kinematics import JointCoordinates, find_posture
from robostiff.kinematics.pose import home_coordinates
from robostiff.linkage import Linkage
from robostiff.markup import blocks_html, page_html
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.page.cables import cable_load_blocks, cable_stiffness_page
from robostiff.plot.geometry.displacement import motion_under, spatial
from robostiff.plot.geometry.ellipsoid import AnyStiffness, Quality
from robostiff.plot.outline import outline_of
from robostiff.plot.picture import Item, PlainColour
from robostiff.plot.posed_robot import moved_cables
from robostiff.plot.posture import placed
from robostiff.plot.prefix import short
from robostiff.plot.sketch import Sketch, colours_of_parts
from robostiff.plot.stiffness_pictures import free_motion_items
from robostiff.spatial import Space
from robostiff.statics import cable_response, deflection
from robostiff.view.answer import UNDER_LOAD, Ellipsoids, Look, ShownAnswer, answer_of, kind_of
from robostiff.view.sliders import (
    Slider,
    coordinate_sliders,
    joint_sliders,
    joint_values,
    slider_around,
)

_AXIS = 0.3  # of the robot: half the axis of a free motion
_QUALITIES = {
    "ellipsoid of displacements": Quality.COMPLIANCE,
    "ellipsoid of rotations": Quality.ROTATIONAL_COMPLIANCE,
}


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

    def __init__(self, robot: Any, pose: Any = None) -> None:
        self.robot, self.name, self.space = robot, robot.name, robot.space
        outline = outline_of(placed(robot))
        points = np.array([at.point for at in outline.anchors])
        self.size, self.box = outline.size, (points.min(axis=0), points.max(axis=0))
        self.sliders = self.sliders_from(pose)
        self._ellipsoids = Ellipsoids()

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
        bent = deflection(self.robot, self.pose(values), wrench)
        if Status.UNREACHABLE in bent.stiffness.status:
            return ShownAnswer(str(bent.status), "bad", tuple(bent.advice))
        posed = bent.stiffness.placed()
        outline = outline_of(posed)
        colours = colours_of_parts(outline.part_names)
        sketch = Sketch(
            outline=outline, colours=colours, of_joints=colours, plain=PlainColour.MUTED
        )
        if bent.has_answer and np.any(bent.wrench):
            sketch = replace(sketch, motions=motion_under(posed, bent))
            sketch = sketch.exaggerated(look.exaggeration)
        load = bent.stiffness.reference_point, spatial(bent.wrench, self.space.rows)
        return answer_of(bent, *self._layers(sketch, bent.stiffness, load, look), colours)

    def _layers(
        self, sketch: Sketch, result: AnyStiffness, load: tuple[np.ndarray, np.ndarray], look: Look
    ) -> tuple[dict[str, Sequence[Item]], list[str]]:
        """Layers that are wanted, and what they mean; a load is a point and a wrench (6,)."""
        drawn: dict[str, Callable[[], list[Item]]]
        drawn = {
            "robot": sketch.parts,
            "names of joints": sketch.names,
            "load": lambda: sketch.load(*load, self.space is Space.PLANAR),
        }
        words = [f"displacements × {short(sketch.scale, 6)}"] if sketch.scale else []
        if sketch.scale:
            drawn["shape without load"] = sketch.ghost
        layers: dict[str, Sequence[Item]]
        layers = {name: items() for name, items in drawn.items() if name in look.seen}
        words += [f"free: {motion}" for motion in result.free_motions]
        for name, quality in _QUALITIES.items():
            if name in look.seen:
                layers[name], meaning = self._ellipsoids.items(result, quality, sketch.size)
                words += [meaning] if meaning else []
        if "free motions" in look.seen:
            layers["free motions"] = free_motion_items(result, _AXIS * sketch.size, 1.0)
        return layers, words


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
        home = home_coordinates(self.robot)
        return coordinate_sliders(self.robot.coordinates, home, start.pose[0], self.size)

    def pose(self, values: Mapping[str, float]) -> Any:
        """Joint coordinates of an arm, or free coordinates."""
        if not self.sliders:
            return None
        if self.robot.is_posed_by_joints:
            return JointCoordinates(joint_values(self.robot, values))
        return np.array([values[slider.name] for slider in self.sliders])


class LinkageMachine(Machine):
    """Bodies and joints in loops: the joints that keep their coordinates are moved."""

    def sliders_from(self, pose: Any) -> tuple[Slider, ...]:
        """Of those joints."""
        moved = [
            (joint.name, bool(joint.freedoms[0].turns), float(np.asarray(joint.home)[0]))
            for joint in self.robot.joints
            if joint.size == 1 and joint.name in self.robot.held
        ]
        return tuple(
            slider_around(name, turns, home, (pose or {}).get(name, home), self.size)
            for name, turns, home in moved
        )

    def pose(self, values: Mapping[str, float]) -> Any:
        """Their coordinates by name."""
        return {slider.name: values[slider.name] for slider in self.sliders}


class CableMachine(Machine):
    """A cable robot: the load is carried by locked winches."""

    def sliders_from(self, pose: Any) -> tuple[Slider, ...]:
        """Of coordinates of the pose."""
        home, start = (np.asarray(stiffness(self.robot, own).pose) for own in (None, pose))
        return coordinate_sliders(self.robot.coordinates, home, start, self.size)

    def answer(self, values: Mapping[str, float], wrench: np.ndarray, look: Look) -> ShownAnswer:
        """What is shown at values in SI units, under a load (n,) on the platform."""
        pose = np.array([values[slider.name] for slider in self.sliders])
        found = cable_response(self.robot, pose, wrench)
        before = found.before
        sketch = Sketch(outline=outline_of(before))
        if found.has_answer and np.any(wrench):
            motions, outline = moved_cables(found)
            sketch = Sketch(outline=outline, motions=motions).exaggerated(look.exaggeration)
        load = sketch.outline.point.point, spatial(found.load, self.space.rows)
        layers, words = self._layers(sketch, before, load, look)
        blocks = cable_load_blocks(found) if np.any(wrench) else []
        status = found.status if np.any(wrench) else before.status
        advice = tuple(dict.fromkeys([*before.advice, *found.advice]))
        return ShownAnswer(
            str(status),
            kind_of(status.is_bad, not status),
            advice,
            layers,
            page_html(cable_stiffness_page(before)),
            UNDER_LOAD + blocks_html(blocks) if blocks else "",
            tuple(words),
        )


def parameters_written(source: Any, side: str | Path | None) -> Mapping[str, Any]:
    """Parameters as they are written in the model file, or in the side file of a description."""
    from robostiff.io.document import read_document
    from robostiff.robots import robot_file, shipped_names

    is_shipped = source in shipped_names()
    path = side if side is not None else robot_file(source) if is_shipped else source
    if str(path) == "-" or Path(str(path)).suffix.lower() not in {".yaml", ".yml", ".json"}:
        return {}
    data = read_document(path).data
    found = data.get("parameters") if isinstance(data, dict) else None
    return found if isinstance(found, dict) else {}

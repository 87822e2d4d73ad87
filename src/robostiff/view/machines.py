"""What each kind of robot answers where its sliders are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.analysis import Deflection
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
from robostiff.plot.geometry.displacement import spatial
from robostiff.plot.geometry.ellipsoid import AnyStiffness, Quality
from robostiff.plot.outline import Outline, outline_of
from robostiff.plot.picture import Item, PlainColour
from robostiff.plot.posed_robot import motion_of, moved_cables
from robostiff.plot.prefix import short
from robostiff.plot.sketch import Sketch, colours_of_parts
from robostiff.plot.stiffness_pictures import free_motion_items
from robostiff.spatial import Space
from robostiff.statics import cable_response, deflection
from robostiff.view.answer import (
    UNDER_LOAD,
    Ellipsoids,
    Look,
    ShownAnswer,
    answer_of,
    kind_of,
)
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


class Machine(ABC):
    """A robot of any kind at the values of its sliders: see `machine_of`."""

    sliders: tuple[Slider, ...] = ()

    def __init__(self, robot: Any, outline: Outline) -> None:
        self.robot, self.name, self.space = robot, robot.name, robot.space
        points = np.array([at.point for at in outline.anchors])
        self.size, self.box = outline.size, (points.min(axis=0), points.max(axis=0))
        self._ellipsoids = Ellipsoids()

    def like(self, robot: Any) -> Machine:
        """The same with a robot of other dimensions: its sliders and scales stay."""
        found = copy(self)
        found.robot = robot.numeric if isinstance(robot, Robot) else robot
        return found

    @abstractmethod
    def answer(self, values: Mapping[str, float], wrench: np.ndarray, look: Look) -> ShownAnswer:
        """What is shown at values in SI units, under a load (n,) on the platform."""

    def _layers(
        self,
        sketch: Sketch,
        result: AnyStiffness,
        load: tuple[np.ndarray, np.ndarray],
        look: Look,
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
        layers = {name: items() for name, items in drawn.items() if name in look.seen}
        shapes, meanings = shapes_of(result, self._ellipsoids, sketch.size, look)
        return {**layers, **shapes}, [*words, *meanings]

    def _bent(self, posed: Snapshot | Network, bent: Deflection, look: Look) -> ShownAnswer:
        """What is shown of a robot with legs or of a network under a load on its platform."""
        outline = outline_of(posed)
        colours = colours_of_parts(outline.part_names)
        sketch = Sketch(
            outline=outline, colours=colours, of_joints=colours, plain=PlainColour.MUTED
        )
        if bent.has_answer and np.any(bent.wrench):
            sketch = replace(sketch, motions=motion_of(posed, bent))
            sketch = sketch.exaggerated(look.exaggeration)
        load = bent.stiffness.reference_point, spatial(bent.wrench, self.space.rows)
        return answer_of(bent, *self._layers(sketch, bent.stiffness, load, look), colours)


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
    if isinstance(robot, Robot):
        return RobotMachine(robot.numeric, pose)
    if isinstance(robot, CableRobot):
        return CableMachine(robot, pose)
    if isinstance(robot, Linkage):
        return LinkageMachine(robot, pose or {})
    if pose is not None:
        raise InputError(
            f"pose of {robot.name!r}", got=pose, expected="none: it is frozen at its own pose"
        )
    if isinstance(robot, Snapshot):
        return RobotMachine(robot)
    if isinstance(robot, Network):
        return NetworkMachine(robot)
    raise InputError(
        "robot of a view",
        got=robot,
        expected="a Robot, Snapshot, Network, CableRobot or Linkage",
        hint='write rs.load("hexapod")',
    )


class RobotMachine(Machine):
    """A robot of legs, or a snapshot of one."""

    def __init__(self, robot: Robot | Snapshot, pose: Any = None) -> None:
        if isinstance(robot, Snapshot):
            super().__init__(robot, outline_of(robot))
            return
        super().__init__(robot, outline_of(find_posture(robot, None).snapshot.one(0)))
        start = find_posture(robot, pose)
        if start.batch:
            raise InputError("pose of a view", got=pose, expected="a single pose")
        if robot.is_posed_by_joints:
            q = start.coordinates[0][0]
            self.sliders = joint_sliders(robot, q, self.size)
        else:
            home = home_coordinates(robot)
            self.sliders = coordinate_sliders(robot.coordinates, home, start.pose[0], self.size)

    def pose(self, values: Mapping[str, float]) -> Any:
        """The pose of values by the names of the sliders, as `robostiff.stiffness` takes it."""
        if isinstance(self.robot, Snapshot) or not self.sliders:
            return None
        if self.robot.is_posed_by_joints:
            return JointCoordinates(joint_values(self.robot, values))
        return np.array([values[slider.name] for slider in self.sliders])

    def answer(self, values: Mapping[str, float], wrench: np.ndarray, look: Look) -> ShownAnswer:
        """What is shown at values in SI units, under a load (n,) on the platform."""
        bent = deflection(self.robot, self.pose(values), wrench)
        result = bent.stiffness
        if Status.UNREACHABLE in result.status:
            return ShownAnswer(str(bent.status), "bad", tuple(bent.advice))
        snapshot = self.robot if isinstance(self.robot, Snapshot) else result.snapshot()
        return self._bent(snapshot, bent, look)


def shapes_of(
    result: AnyStiffness, ellipsoids: Ellipsoids, size: float, look: Look
) -> tuple[dict[str, list[Item]], list[str]]:
    """Ellipsoids and free motions of a result, as far as they are wanted, and what they mean."""
    layers: dict[str, list[Item]] = {}
    words = [f"free: {motion}" for motion in result.free_motions]
    for name, quality in _QUALITIES.items():
        if name in look.seen:
            layers[name], meaning = ellipsoids.items(result, quality, size)
            words += [meaning] if meaning else []
    if "free motions" in look.seen:
        layers["free motions"] = free_motion_items(result, _AXIS * size, 1.0)
    return layers, words


class NetworkMachine(Machine):
    """A network of bodies: it does not move, its load does."""

    def __init__(self, network: Network) -> None:
        super().__init__(network, outline_of(network))

    def answer(self, values: Mapping[str, float], wrench: np.ndarray, look: Look) -> ShownAnswer:
        """What is shown under a load (n,) on the platform."""
        return self._bent(self.robot, deflection(self.robot, None, wrench), look)


class LinkageMachine(Machine):
    """Bodies and joints in loops: the joints that keep their coordinates are moved."""

    def __init__(self, linkage: Linkage, start: Mapping[str, float]) -> None:
        super().__init__(linkage, outline_of(linkage.network_at()))
        moved = [
            (joint.name, bool(joint.freedoms[0].turns), float(np.asarray(joint.home)[0]))
            for joint in linkage.joints
            if joint.size == 1 and joint.name in linkage.held
        ]
        self.sliders = tuple(
            slider_around(name, turns, home, start.get(name, home), self.size)
            for name, turns, home in moved
        )

    def answer(self, values: Mapping[str, float], wrench: np.ndarray, look: Look) -> ShownAnswer:
        """What is shown at values in SI units, under a load (n,) on the platform."""
        network = self.robot.network_at({s.name: values[s.name] for s in self.sliders})
        return self._bent(network, deflection(network, None, wrench), look)


class CableMachine(Machine):
    """A cable robot: the load is carried by locked winches."""

    def __init__(self, robot: CableRobot, pose: Any = None) -> None:
        first = cable_response(robot, pose, np.zeros(robot.space.size)).before
        super().__init__(robot, outline_of(first))
        home = cable_response(robot, None, np.zeros(robot.space.size)).before.pose
        self.sliders = coordinate_sliders(robot.coordinates, home, first.pose, self.size)

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

"""Slips in files, expressions and quantities: what is said of each is on file in ``slips.txt``.

A line there is what is read, or texts in a sound file and what stands in their place.
``python -m tests.io.test_slips`` writes the messages anew.
"""

import ast
import json
from collections.abc import Callable
from contextlib import chdir
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.expression import exact_mathematics, parameter_values, parse
from robostiff.io.map_files import read_poses
from robostiff.io.model_file import model_from_document
from robostiff.io.snapshot import network_from_document, snapshot_from_document
from robostiff.io.units import Dimension, parse_quantities, to_si
from robostiff.robots import robot_file
from tests.cables import test_cable_files
from tests.identification import test_measurement_files
from tests.io import (
    test_model_file,
    test_model_file_errors,
    test_snapshot,
    test_springs_laws_and_masses,
    test_units,
)
from tests.io.urdf import (
    test_harmful_files,
    test_loops_and_springs_of_descriptions,
    test_side_files,
)
from tests.model import test_flexible_platform
from tests.network import test_graph_files
from tests.robots import test_coupled_joints, test_helical_joints, test_hybrid_machines
from tests.said import now, on_file, said, write

PAGE = Path(__file__).parent / "slips.txt"


def changed(text: str, *changes: str) -> str:
    """A text with something else in place of each first, third, ... of some texts."""
    for old, new in zip(changes[::2], changes[1::2], strict=True):
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def model(text: str, *changes: str, file: str = "robot.yaml") -> Any:
    return model_from_document(parse_document(changed(text, *changes), file))


def snapshot(text: str, *changes: str) -> Any:
    return snapshot_from_document(parse_document(changed(text, *changes), "arm.json"))


def from_files(read: Callable[[], Any], **files: str) -> Any:
    """Of files in the folder, which messages then do not name."""
    with TemporaryDirectory() as folder, chdir(folder):
        for name, text in files.items():
            Path(name.replace("_", ".")).write_text(text, encoding="utf-8")
        return read()


def described(urdf: str, side: str) -> Any:
    return from_files(lambda: rs.load("arm.urdf", side="side.yaml"), arm_urdf=urdf, side_yaml=side)


def of_tree(name: str, text: str, part: str = "<r/>") -> Any:
    """Of a description, and of what it includes."""
    files = {name.replace(".", "_"): text, "part_xacro": part, "side_yaml": test_harmful_files.SIDE}
    return from_files(lambda: rs.load(name, side="side.yaml"), **files)


def poses(text: str) -> Any:
    return from_files(lambda: read_poses(rs.load("hexapod"), "poses.csv"), poses_csv=text)


def graph(*changes: str) -> Any:
    text = changed(test_graph_files.TEXT, *changes)
    return network_from_document(parse_document(text, "table.json"))


def program(text: str, robot: str = "hexapod") -> Any:
    return from_files(lambda: rs.read_program(rs.load(robot), "path.csv"), path_csv=text)


def heavy(*masses: dict[str, Any]) -> Any:
    return snapshot(json.dumps(test_springs_laws_and_masses.crane(masses=masses)))


def measured(text: str) -> Any:
    arm = rs.load("six-joint-arm")
    text = text.replace("JOINTS", test_measurement_files.JOINTS)
    return from_files(lambda: rs.Measurements.read("arm.csv", arm), arm_csv=text)


def module(own: str) -> Any:
    text = f"{test_hybrid_machines.HEAD}{own}"
    return from_files(lambda: rs.load("machine.yaml"), machine_yaml=text)


def screw(given: dict[str, Any], is_planar: bool = False) -> Any:
    part = {"type": "spring", "point": [0, 0, 0], "axis": [0, 0, 1], "k": 5.0, **given}
    leg = {"name": "a", "end": [1, 0, 0], "chain": [part]}
    data = {"name": "p", "planar": is_planar, "reference_point": [1, 0, 0], "legs": [leg]}
    return snapshot(json.dumps(data))


OPEN_SQUARE = test_loops_and_springs_of_descriptions
READERS: dict[str, Callable[..., Any]] = {
    "model file": partial(model, test_model_file_errors.ROBOT),
    "element of a leg": partial(
        model, test_model_file_errors.ROBOT, test_model_file_errors.DRIVE
    ),
    "planar model file": partial(model, test_model_file_errors.PLANAR),
    "values of parameters": partial(
        model_from_document, parse_document(test_model_file_errors.ARM, "arm.yaml")
    ),
    "table of Denavit and Hartenberg": partial(model, test_model_file.TABLE),
    "coordinates of an arm": lambda own: test_model_file.scara(f"coordinates: [{own}]"),
    "masses": partial(model, test_springs_laws_and_masses.MODEL),
    "springs and laws": partial(model, test_springs_laws_and_masses.LAWS),
    "parallel block": partial(model, test_model_file.PARALLEL),
    "parallelogram": partial(model, test_model_file.PARALLELOGRAM),
    "plausibility": partial(model, test_model_file_errors.PLAUSIBLE),
    "snapshot": partial(snapshot, test_snapshot.TEXT),
    "block of a snapshot": partial(snapshot, json.dumps(test_model_file.PAIR)),
    "planar snapshot": lambda own: snapshot(f"{test_snapshot.PLANAR}{own}]}}]}}"),
    "masses of a snapshot": heavy,
    "plausibility of a snapshot": partial(snapshot, json.dumps(test_model_file_errors.SNAPSHOT)),
    "flexible platform": partial(model, test_flexible_platform.FILE.read_text()),
    "module of a machine": module,
    "coupled joints": partial(model, test_coupled_joints.MODEL),
    "pitch of a screw": test_helical_joints.load_arm,
    "screw of a snapshot": screw,
    "URDF": lambda *own: described(changed(test_harmful_files.ARM, *own), test_harmful_files.SIDE),
    "file of a description": of_tree,
    "loops and springs of a URDF": lambda own: described(
        OPEN_SQUARE.SQUARE.format(own), OPEN_SQUARE.OPEN
    ),
    "side file": lambda own: described(test_side_files.ARM, f"{test_side_files.HEAD}{own}"),
    "YAML": lambda text: parse_document(text, "robot.yaml"),
    "JSON": lambda text: parse_document(text, "robot.json"),
    "expression": lambda text: parse(text).evaluate(test_units.ENVIRONMENT),
    "exact expression": lambda text: parse(text).evaluate(
        test_units.IN_SYMBOLS, exact_mathematics()
    ),
    "parameters": parameter_values,
    "quantity": lambda own, name: to_si(own, Dimension[name]),
    "pose": lambda text: parse_quantities(text, test_units.POSE, test_units.POSE_NAMES, "pose"),
    "table of poses": poses,
    "measurements": measured,
    "graph": graph,
    "cables": lambda own: test_cable_files.built(own.replace("ROPE", test_cable_files.ROPE)),
    "program of a path": program,
    "shipped file": partial(model, robot_file("3-puu").read_text()),
}  # fmt: skip


def say(kind: str, slip: str) -> str:
    return said(lambda slip: READERS[kind](*ast.literal_eval(f"({slip},)")), slip)


@pytest.mark.parametrize("kind", READERS)
def test_what_is_said_of_slips_is_what_is_on_file(kind):
    told = {kind: on_file(PAGE)[kind]}
    assert now(told, say) == told


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))

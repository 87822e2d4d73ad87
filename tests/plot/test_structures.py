"""Cable robots, networks and arms in pictures."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.plot.picture import LineWeight, Marks, Path, Text
from robostiff.plot.posed_robot import robot_picture
from robostiff.plot.structures import cable_scene, network_scene
from tests.plot.machines import robot


def test_every_cable_runs_from_its_eyelet_to_the_platform():
    known = robot("cable-8")
    pose = [0.3, 0.1, 1.2, 0, 0, 0]
    lines = [one for one in cable_scene(rs.stiffness(known, pose)).items if isinstance(one, Path)]
    assert len(lines) == 8
    for line, cable in zip(lines, known.cables, strict=True):
        np.testing.assert_allclose(line.points[0], cable.exit_point, atol=1e-12)
        np.testing.assert_allclose(line.points[1], np.array(pose[:3]) + cable.attachment)
        assert line.about.startswith(f"{cable.name}: ")


def test_every_joint_of_a_network_is_marked_where_it_is():
    network = robot("double-pantograph")
    scene = network_scene(network)
    names = [name for one in scene.items if isinstance(one, Marks) for name in one.about]
    for joint in network.joints:
        for freedom in joint.freedoms:
            assert f"{joint.name}/{freedom.name}" in names


def test_an_arm_is_coloured_part_by_part_and_its_joints_are_named():
    picture = robot_picture(rs.find_posture(robot("six-joint-arm")).snapshot.one(0))
    bold = [i for i in picture.items if isinstance(i, Path) and i.weight is LineWeight.BOLD]
    assert len({repr(one.paint) for one in bold}) == len(bold) > 3
    words = ", ".join(one.words for one in picture.items if isinstance(one, Text)).split(", ")
    assert sorted(words) == [f"joint{i}" for i in range(1, 7)]


@pytest.mark.parametrize("name", ["cable-4-planar", "double-pantograph"])
def test_they_are_drawn_as_robots_are(name):
    assert rs.plot.robot(robot(name)).get_title() == name
    assert rs.plot.robot(robot(name), backend=rs.plot.Plotly()).data


def test_a_deflection_of_them_is_refused():
    bent = rs.deflection(robot("double-pantograph"), None, [1, 0, 0, 0, 0, 0])
    with pytest.raises(rs.InputError, match="without load"):
        rs.plot.robot(robot("double-pantograph"), deflection=bent)

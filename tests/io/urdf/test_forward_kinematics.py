"""Where the tool of a loaded arm is, against readers of URDF by others."""

import numpy as np
import pytest

import robostiff as rs
from tests.io.urdf.examples import (
    PANDA,
    TALOS,
    UR5,
    needs_examples,
    pinocchio_model,
    robot_of,
    with_side,
)

# Talos has a differential in its torso, and the Panda a stiffness that nothing reads.
pytestmark = [
    needs_examples,
    pytest.mark.filterwarnings(
        "ignore:.*(transmissions that connect several joints|K in <dynamics>)"
        ":robostiff.errors.PlausibilityWarning"
    ),
]
PANDA_TOOL = "panda_link8"
ARMS = [
    pytest.param(UR5, "world", "tool0", id="ur5"),
    pytest.param(PANDA, "panda_link0", PANDA_TOOL, id="panda"),
    pytest.param(TALOS, "base_link", "left_sole_link", id="talos-leg"),
    pytest.param(TALOS, "left_sole_link", "base_link", id="talos-leg-from-the-ground"),
    pytest.param(TALOS, "left_sole_link", "right_sole_link", id="talos-from-foot-to-foot"),
]


def _arm(path, base, tool, folder):
    side = f"""
robostiff: 1
source: chosen here
base: {base}
tool: {tool}
joints: {{"*": {{stiffness: 1e4}}}}
"""
    return robot_of(path, with_side(folder, side))


def _at_random(robot, seed):
    """Values of its joints by name, within what they can turn."""
    (leg,) = robot.legs
    rng = np.random.default_rng(seed)
    return {joint.name: rng.uniform(-2.0, 2.0) for joint, _ in leg.chain.moving}


@pytest.mark.parametrize(("path", "base", "tool"), ARMS)
@pytest.mark.needs("pinocchio")
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_tool_frame_is_that_of_pinocchio(path, base, tool, seed, tmp_path):
    robot = _arm(path, base, tool, tmp_path)
    values = _at_random(robot, seed)
    pin, model, data = pinocchio_model(path)
    q = pin.neutral(model)
    for name, value in values.items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, q)
    frames = [data.oMf[model.getFrameId(name)] for name in (base, tool)]
    wanted = frames[0].actInv(frames[1])

    posture = rs.find_posture(robot, rs.JointCoordinates(list(values.values())))
    (leg,) = posture.snapshot.legs
    pose = posture.pose[0]
    R = pin.exp3(pose[3:])
    assert np.abs(pose[:3] - wanted.translation).max() < 1e-12
    assert np.abs(R - wanted.rotation).max() < 1e-12
    assert leg.name == robot.name


@pytest.mark.parametrize(("path", "base", "tool"), ARMS[:3])
def test_tool_frame_is_that_of_yourdfpy(path, base, tool, tmp_path):
    from yourdfpy import URDF

    robot = _arm(path, base, tool, tmp_path)
    values = _at_random(robot, 4)
    urdf = URDF.load(str(path), load_meshes=False)
    urdf.update_cfg(values)
    posture = rs.find_posture(robot, rs.JointCoordinates(list(values.values())))
    assert np.allclose(posture.pose[0, :3], urdf.get_transform(tool, base)[:3, 3], atol=1e-12)

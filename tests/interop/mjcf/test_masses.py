"""Masses of MJCF bodies: what is written and what shapes have, against MuJoCo's mass matrix."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.files import text_of
from tests.io.urdf.examples import robot_of, with_side
from tests.statics.mass_matrices import mass_matrix

mujoco = pytest.importorskip("mujoco")

SIDE = """
robostiff: 1
source: chosen here
tool: tip
joints: {"j*": {stiffness: 1e5}}
"""
# diaginertia with a quaternion, fullinertia, shapes of every kind by density and by mass, a box on
# a welded body, a finger beyond a joint, and a world that has a shape, too
ARM = text_of("heavy-tree.xml")


def of_mujoco(model: Any, q: np.ndarray) -> np.ndarray:
    """MuJoCo's mass matrix over the first joints, the last one held."""
    data = mujoco.MjData(model)
    data.qpos[: len(q)] = q
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M[: len(q), : len(q)]


def check_mass_matrix(text: str, folder: Path) -> None:
    """Compare that of an arm, from its file and from MuJoCo's model, with MuJoCo's."""
    path, q = folder / "arm.xml", np.array([0.3, -0.5, 0.1, 0.4, -0.2])
    path.write_text(text, encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(path))
    exact, side = of_mujoco(model, q), with_side(folder, SIDE)
    for source in (path, model):
        M = mass_matrix(robot_of(source, side), rs.JointCoordinates(q))
        assert np.abs(M - exact).max() < 1e-12 * np.abs(exact).max()


@pytest.mark.parametrize(
    "compiler",
    ["", 'inertiafromgeom="true"', 'inertiafromgeom="false"', 'settotalmass="20"', 'boundmass="2"'],
)
def test_mass_matrix_is_that_of_mujoco(tmp_path: Path, compiler: str):
    text = ARM.replace("{compiler}", compiler)
    if "false" in compiler:  # MuJoCo has no bodies without masses, robostiff does
        weighed = '<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
        for name in ("fore", "hand", "finger"):
            start = text.index(">", text.index(f'name="{name}"')) + 1
            text = text[:start] + weighed + text[start:]
    check_mass_matrix(text, tmp_path)


def test_rotors_of_drives_are_those_of_mujoco(tmp_path: Path):
    """Of motors and a servo, by their gears, beside the armature of the joint."""
    drives = (
        '<actuator><motor joint="j1" class="geared"/><position joint="j2" kp="9" armature="0.3"/>'
        '<motor joint="j2" armature="0.1" gear="3"/></actuator>'
    )
    text = (
        ARM.replace("{compiler}", "")
        .replace("</mujoco>", drives + "</mujoco>")
        .replace(
            "<worldbody>",
            '<default><default class="geared"><motor gear="5" armature="0.2"/></default></default>'
            "<worldbody>",
            1,
        )
    )
    check_mass_matrix(text, tmp_path)


def test_masses_of_meshes_are_not_read_and_named(tmp_path: Path):
    """Only where they decide the mass: not beside an inertial, nor without density."""
    mesh = '<geom type="mesh" mesh="shell"/>'
    path = tmp_path / "arm.xml"
    text = ARM.replace("{compiler}", "").replace(
        '<body name="finger"', f'{mesh}<body name="finger"'
    )
    path.write_text(text, encoding="utf-8")
    with pytest.warns(rs.PlausibilityWarning, match="the masses of meshes of hand;"):
        robot_of(path, with_side(tmp_path, SIDE))
    path.write_text(text.replace('mesh="shell"', 'mesh="shell" mass="0"'), encoding="utf-8")
    robot_of(path, with_side(tmp_path, SIDE))

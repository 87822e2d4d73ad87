"""Masses of MJCF bodies: what is written and what shapes have, against MuJoCo's mass matrix."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.io.urdf.examples import robot_of, with_side
from tests.statics.mass_matrices import mass_matrix

mujoco = pytest.importorskip("mujoco")

SIDE = """
robostiff: 1
source: chosen here
tool: tip
joints: {"j*": {stiffness: 100}}
"""
# diaginertia with a quaternion, fullinertia, shapes of every kind by density and by mass, a box on
# a welded body, a finger beyond a joint, and a world that has a shape, too
ARM = """<mujoco>
  <compiler angle="radian" {compiler}/>
  <default><geom density="700"/><default class="heavy"><geom density="7850" type="box"/></default>
  </default>
  <worldbody><geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.4" euler="0.2 0 0.1">
      <inertial pos="0.02 0.01 0.1" quat="0.9 0.1 -0.2 0.3" mass="4" diaginertia="0.05 0.04 0.02"/>
      <joint name="j1" axis="0 0 1"/><geom type="sphere" size="0.1"/>
      <body name="upper" pos="0.1 0 0.3" quat="0.8 0.1 0.5 0.2">
        <inertial pos="0.1 0 0" mass="3" fullinertia="0.03 0.05 0.06 0.004 -0.002 0.001"/>
        <joint name="j2" axis="0 1 0" pos="0.01 0.02 0" armature="0.3"/>
        <body name="fore" pos="0.5 0 0" childclass="heavy">
          <geom size="0.02 0.03 0.2" pos="0.1 0 0.1" euler="0.3 0.2 0.1"/>
          <geom type="capsule" fromto="0 0 0 0.3 0.1 0" size="0.02" mass="1.5"/>
          <geom type="ellipsoid" size="0.1 0.05 0.03" class="main"/>
          <joint name="j3" type="slide" axis="0 1 1" armature="2"/>
          <joint name="j4" axis="1 0 0" pos="0 0 0.1"/>
          <body name="hand" pos="0.3 0 0.1" euler="0 0.4 0">
            <geom type="cylinder" size="0.04 0.1"/><joint name="j5" axis="0 0 1"/>
            <body name="box" pos="0 0.1 0.1" euler="1 0 0"><geom size="0.02 0.02 0.05"/></body>
            <body name="finger" pos="0 0 0.2"><geom type="sphere" size="0.02"/>
              <joint name="grip" type="slide" axis="1 0 0"/></body>
            <site name="tip" pos="0 0 0.2"/>
  </body></body></body></body></worldbody>
  <actuator><motor joint="j1"/><motor joint="j2"/><motor joint="j3"/><motor joint="j4"/>
    <motor joint="j5"/></actuator>
</mujoco>"""


def of_mujoco(model: Any, q: np.ndarray) -> np.ndarray:
    """MuJoCo's mass matrix over the first joints, the last one held."""
    data = mujoco.MjData(model)
    data.qpos[: len(q)] = q
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M[: len(q), : len(q)]


@pytest.mark.parametrize(
    "compiler",
    ["", 'inertiafromgeom="true"', 'inertiafromgeom="false"', 'settotalmass="20"', 'boundmass="2"'],
)
def test_mass_matrix_is_that_of_mujoco(tmp_path: Path, compiler: str):
    text, q = ARM.replace("{compiler}", compiler), np.array([0.3, -0.5, 0.1, 0.4, -0.2])
    if "false" in compiler:  # MuJoCo has no bodies without masses, robostiff does
        weighed = '<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
        for name in ("fore", "hand", "finger"):
            start = text.index(">", text.index(f'name="{name}"')) + 1
            text = text[:start] + weighed + text[start:]
    path = tmp_path / "arm.xml"
    path.write_text(text, encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(path))
    exact, side = of_mujoco(model, q), with_side(tmp_path, SIDE)
    for source in (path, model):
        M = mass_matrix(robot_of(source, side), rs.JointCoordinates(q))
        assert np.abs(M - exact).max() < 1e-12 * np.abs(exact).max()


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

"""Masses of URDF links: mass matrices of Pinocchio, weights on paper, and what is no mass."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.files import text_of
from tests.io.urdf.examples import UR5, UR5_JOINTS, UR5_SIDE, needs_examples, robot_of, with_side
from tests.statics.mass_matrices import mass_matrix

ARM = text_of("heavy-arm.urdf")
SIDE = """
robostiff: 1
source: chosen here
tool: {link: tool}
joints: {"*": {stiffness: 2e4 N m/rad}}
"""
BEAMS = (
    SIDE
    + """
links:
  a: &beam {type: beam, material: aluminium,
            section: {tube: {outer_diameter: 60 mm, inner_diameter: 54 mm}}}
  b: {type: beam, material: aluminium,
      section: {tube: {outer_diameter: 60 mm, inner_diameter: 54 mm}}}
"""
).replace("&beam ", "")
G = 9.80665


def written(folder: Path, text: str, side: str) -> rs.Robot:
    path = folder / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    return robot_of(path, with_side(folder, side))


def joint_load(robot: rs.Robot, joint: str) -> float:
    sunk = rs.deflection(robot, gravity="-z")
    return next(own.load for own in sunk.actuators if own.joint == joint)


@pytest.mark.parametrize("side", [SIDE, BEAMS])
def test_weights_are_those_of_the_file(tmp_path: Path, side: str):
    """Elastic links have the mass of the description, and no second one of their beams."""
    robot = written(tmp_path, ARM, side)
    assert np.isclose(joint_load(robot, "j1"), (5 * 0.3 + 8 * 0.8) * G, rtol=1e-12)
    assert np.isclose(joint_load(robot, "j2"), 8 * 0.2 * G, rtol=1e-12)


def test_frequencies_are_those_of_the_masses_of_the_file(tmp_path: Path):
    K, (Ia, Ib) = 2e4 * np.eye(2), (0.1, 0.1)
    outer = np.array([[8 * 0.8**2 + Ib, 8 * 0.8 * 0.2 + Ib], [8 * 0.8 * 0.2 + Ib, 8 * 0.04 + Ib]])
    M = outer + np.diag([5 * 0.09 + Ia, 0])
    exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)) / (2 * np.pi)
    assert np.allclose(rs.modes(written(tmp_path, ARM, SIDE)).frequencies, exact, rtol=1e-9)
    bent = rs.modes(written(tmp_path, ARM, BEAMS)).frequencies
    assert 0.8 * exact[0] < bent[0] < exact[0] < 9.12


def random_urdf(rng: np.random.Generator, joints: int) -> str:
    """An arm with links of any inertia, on which others are fixed, and a finger on the hand."""

    def numbers(values: Any) -> str:
        return " ".join(f"{x:.17g}" for x in np.ravel(values))

    def origin() -> str:
        xyz, rpy = rng.normal(scale=0.3, size=3), rng.uniform(-1.5, 1.5, size=3)
        return f'<origin xyz="{numbers(xyz)}" rpy="{numbers(rpy)}"/>'

    def link(name: str) -> str:
        second = rng.uniform(0.01, 0.2, size=3)  # of any body: I = tr(P) 1 - P
        A = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        inertia = np.sum(second) * np.eye(3) - A @ np.diag(second) @ A.T
        keys = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2)}
        moments = " ".join(f'{k}="{inertia[at]:.17g}"' for k, at in {**keys, "izz": (2, 2)}.items())
        mass = f'<mass value="{rng.uniform(1, 5):.17g}"/><inertia {moments}/>'
        return f'<link name="{name}"><inertial>{origin()}{mass}</inertial></link>'

    def joint(name: str, kind: str, parent: str, child: str) -> str:
        e = rng.normal(size=3)
        ends = f'<parent link="{parent}"/><child link="{child}"/>'
        moving = f'<axis xyz="{numbers(e / np.linalg.norm(e))}"/>' if kind != "fixed" else ""
        limit = '<limit lower="-3" upper="3" effort="1" velocity="1"/>' if moving else ""
        return f'<joint name="{name}" type="{kind}">{ends}{origin()}{moving}{limit}</joint>'

    parts = ['<link name="base"/>']
    for i in range(joints):
        before = f"l{i - 1}" if i else "base"
        kind = ("revolute", "prismatic")[int(rng.integers(2))]
        parts += [link(f"l{i}"), joint(f"j{i}", kind, before, f"l{i}")]
        parts += [link(f"box{i}"), joint(f"weld{i}", "fixed", f"l{i}", f"box{i}")]
    parts += [link("finger"), joint("grip", "prismatic", f"l{joints - 1}", "finger")]
    parts += [link("nail"), joint("weld", "fixed", "finger", "nail")]
    return f'<robot name="arm">{"".join(parts)}</robot>'


def of_pinocchio(text: str, q: dict[str, float]) -> np.ndarray:
    """Mass matrix over the joints in q; all others stay at zero."""
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromXML(text)
    others = [model.getJointId(name) for name in list(model.names)[1:] if name not in q]
    model = pin.buildReducedModel(model, others, pin.neutral(model))
    M = pin.crba(model, model.createData(), np.array([q[n] for n in list(model.names)[1:]]))
    return np.triu(M) + np.triu(M, 1).T


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_mass_matrix_is_that_of_pinocchio(tmp_path: Path, seed: int):
    rng = np.random.default_rng(seed)
    text, q = random_urdf(rng, 5), rng.uniform(-1, 1, size=5)
    side = SIDE.replace("{link: tool}", "box4").replace("2e4 N m/rad", "1e5")
    robot = written(tmp_path, text, side)
    M = mass_matrix(robot, rs.JointCoordinates(q))
    exact = of_pinocchio(text, {f"j{i}": x for i, x in enumerate(q)})
    assert np.abs(M - exact).max() < 1e-12 * np.abs(exact).max()


@pytest.mark.slow
@needs_examples
def test_mass_matrix_of_a_ur5_is_that_of_pinocchio(tmp_path: Path):
    """From its file, and from Pinocchio's own model of it."""
    pin = pytest.importorskip("pinocchio")
    side, q = with_side(tmp_path, UR5_SIDE), np.array([0.3, -1.0, 1.2, -0.4, 0.7, 0.2])
    exact = of_pinocchio(UR5.read_text(), dict(zip(UR5_JOINTS, q, strict=True)))
    for source in (UR5, pin.buildModelFromUrdf(str(UR5))):
        M = mass_matrix(robot_of(source, side), rs.JointCoordinates(q))
        assert np.abs(M - exact).max() < 1e-12 * np.abs(exact).max()


def test_what_is_no_mass_is_named(tmp_path: Path):
    broken = ARM.replace('iyy="0.1"', 'iyy="1"', 1)
    with pytest.warns(rs.PlausibilityWarning, match="the other two together"):
        robot = written(tmp_path, broken, SIDE)
    assert np.isclose(joint_load(robot, "j1"), 7.9 * G, rtol=1e-12)
    with pytest.warns(rs.PlausibilityWarning, match="'b' has moments of inertia and no mass"):
        written(tmp_path, ARM.replace('value="8"', 'value="0"'), SIDE)
    with pytest.raises(rs.FileError, match="mass in the inertial of link 'a': got 'x'"):
        written(tmp_path, ARM.replace('value="5"', 'value="x"'), SIDE)
    with pytest.raises(rs.FileError, match="zero or more"):
        written(tmp_path, ARM.replace('value="5"', 'value="-5"'), SIDE)

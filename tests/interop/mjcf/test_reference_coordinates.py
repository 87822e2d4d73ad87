"""Compliance does not depend on the coordinate at which a joint is drawn."""

import json

import numpy as np
import pytest

import robostiff as rs
from tests.io.urdf.examples import matrix_distance

CANTILEVER = """<mujoco><worldbody><body name="arm"><joint name="h" axis="0 1 0"/>
  <body name="car" pos="1 0 0"><joint name="s" type="slide" axis="1 0 0" ref="{ref}"/></body>
</body></worldbody></mujoco>"""
STEEL = {"type": "beam", "material": "steel", "section": {"circle": {"diameter": 0.02}}}


def _loaded(folder, mjcf, **side):
    (folder / "m.xml").write_text(mjcf)
    (folder / "s.yaml").write_text(json.dumps({"robostiff": 1, "source": "chosen here", **side}))
    return rs.load(folder / "m.xml", side=folder / "s.yaml")


@pytest.mark.parametrize("ref", [0, 0.3, -0.3])
def test_a_link_before_a_slide_ends_where_the_slide_is_drawn(ref, tmp_path):
    joints = {"h": {"role": "locked", "stiffness": 1e6}, "s": {"role": "locked", "stiffness": 1e9}}
    side = {"tool": "car", "joints": joints, "links": {"arm": STEEL}}
    robot = _loaded(tmp_path, CANTILEVER.format(ref=ref), **side)
    E, inertia = rs.material("steel").E, np.pi * 0.02**4 / 64
    assert rs.compliance(robot)[1, 1] == pytest.approx(1 / (3 * E * inertia), rel=1e-12)


def _random_arm(random, refs, springs=""):
    """Bodies one after the other, with one or two joints each, drawn at their references."""
    text, ends, names = "", "", []
    for i in range(4):
        at = " ".join(f"{x:.6f}" for x in random.uniform(-0.4, 0.4, 3))
        turn = " ".join(f"{x:.6f}" for x in random.uniform(-1, 1, 3))
        text += f'<body name="b{i}" pos="{at}" euler="{turn}">'
        for j in range(random.integers(1, 3)):
            kind = random.choice(["hinge", "slide"])
            axis = " ".join(f"{x:.6f}" for x in random.normal(size=3))
            place = " ".join(f"{x:.6f}" for x in random.uniform(-0.1, 0.1, 3))
            text += f'<joint name="j{i}{j}" type="{kind}" axis="{axis}" pos="{place}" '
            text += f'ref="{refs[len(names)]:.6f}" {springs}/>'
            names.append(f"j{i}{j}")
        ends += "</body>"
    site = '<site name="tip" pos="0.1 0.2 0.3"/>'
    head = '<mujoco><compiler angle="radian"/><worldbody>'
    return f"{head}{text}{site}{ends}</worldbody></mujoco>", names


@pytest.mark.parametrize("seed", range(3))
def test_compliance_of_random_arms_does_not_depend_on_references(seed, tmp_path):
    side = {
        "tool": "tip",
        "joints": {"*": {"role": "actuated", "stiffness": 1e4, "spring": 0}},
        "links": {"b0": STEEL, "b1": STEEL, "b2": STEEL},
    }
    C = []
    for refs in (np.zeros(8), np.random.default_rng(90 + seed).uniform(-1, 1, 8)):
        mjcf, _ = _random_arm(np.random.default_rng(seed), refs)
        C.append(rs.compliance(_loaded(tmp_path, mjcf, **side)))
    assert matrix_distance(C[0], C[1]) < 1e-9
    sprung, _ = _random_arm(np.random.default_rng(seed), refs, 'stiffness="1" springref="0.4"')
    with pytest.warns(rs.PlausibilityWarning, match="not read: the load at home of springs"):
        robot = _loaded(tmp_path, sprung, **side)
    assert matrix_distance(C[0], rs.compliance(robot)) < 1e-9

"""Hybrid machines under weights and loads, against the least energy of bodies in the world."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import Actuated, Chain, Mass, ParallelBlock
from tests.campaign.bodies import DeadPull, frequencies
from tests.campaign.minima import least
from tests.statics.robots_under_load import bodies_of, loaded

DOWN = np.array([0, 0, -9.80665])
W = np.array([300.0, -200, -500, 40, 30, -20])
AT, FORCE = np.array([0.1, 0.2, 0.3]), np.array([30.0, -20, 40])


def without_masses_of_links(leg: rs.Leg) -> rs.Leg:
    """The same leg, its elastic parts weightless."""
    each = (replace(e, masses=()) if isinstance(e, rs.Link) else e for e in leg.chain.elements)
    return replace(leg, chain=Chain(tuple(each)))


def machine(name: str, *, rail: bool, light: bool = False) -> rs.Robot:
    """A parallel module that carries a head of two axes, on a rail if wanted, all with masses."""

    def arm(x: float, y: float, *masses: Mass) -> rs.Rigid:
        return rs.Rigid(rs.Frame(np.eye(3), np.array([x, y, -0.1])), "arm", masses=masses)

    robot = rs.load(f"examples/{name}.yaml" if name == "tricept" else name)
    robot = replace(
        robot, platform_masses=(Mass(20, [0.01, 0.02, 0.03]), Mass(5, inertia=[1, 2, 1.5]))
    )
    if light:
        robot = replace(robot, legs=tuple(map(without_masses_of_links, robot.legs)))
    c = rs.revolute([0, 0, 1], Actuated(1e4), name="c")
    a = rs.revolute([1, 0, 0], Actuated(2e4), name="a")
    tool = Mass(2), Mass(1, [0, 0.1, 0.02], inertia=[0.01, 0.01, 0.01])
    head = Chain(
        (c, arm(0.05, 0, Mass(4, [0.1, 0, 0])), a, replace(arm(0, 0.02, *tool), name="tool"))
    )
    modules = [rs.Module(name, robot), rs.Module("head", head)]
    if rail:
        slide = rs.prismatic([1, 0, 0], Actuated(3e6), name="slide")
        modules.insert(0, rs.Module("rail", Chain((slide, arm(0, 0.3, Mass(30))))))
    return rs.hybrid_machine(modules)


@pytest.mark.parametrize(("name", "rail"), [("3-prs", True), ("3-rps", False), ("tricept", True)])
@pytest.mark.parametrize("how", ["weights", "load in a module", "held"])
def test_it_rests_where_the_energy_of_its_bodies_is_least(name: str, how: str, rail: bool):
    robot = machine(name, rail=rail)
    own, given = bodies_of(robot), {"wrench": 10 * W, "gravity": DOWN}
    if how == "held":
        given = {"displacement": 1e-3 * np.array([1, -2, 1, 2, 10, -20]), "gravity": DOWN}
    elif how == "load in a module":
        (block,) = (e for e in robot.legs[0].chain.elements if isinstance(e, ParallelBlock))
        branch = block.branches[-1]
        path = f"machine/{block.name}/{branch.name}/{branch.chain.elements[1].name}"
        given = {"wrench": W, "loads": {path: [rs.DeadForce(FORCE, AT)]}}
        own.bodies.pulls.append(DeadPull(own.behind[path][0], AT, FORCE))
    if "gravity" in given:
        own.fall(DOWN)
    answer = loaded(robot, beams=rs.Linear(), **given)
    assert str(answer.status) == "ok"
    truth = least(own, answer.wrench)
    size = np.abs(truth.displacement).max()
    assert np.allclose(answer.displacement, truth.displacement, rtol=0, atol=1e-9 * size)
    off = np.abs(answer.compliance - truth.compliance).max()
    assert off < 1e-6 * np.abs(truth.compliance).max()
    if "gravity" in given:  # module 25, head 7, rail 30, and what the parts of its legs weigh
        whole = sum(m for _, m, *_ in own.bodies.masses) + sum(part[-1] for part in own.spread)
        assert whole > 32 + 30 * rail
        lift = answer.wrench[:3] + whole * DOWN
        assert np.allclose(np.sum(answer.reactions, axis=0)[:3], lift, rtol=1e-9, atol=1e-6)


def test_it_vibrates_as_its_bodies_do():
    """Masses on rigid parts."""
    wrench = np.array([900.0, -600, -1500, 0, 0, 0])
    robot = machine("3-prs", rail=False, light=True)
    own = bodies_of(robot)
    own.fall(DOWN)
    expected = frequencies(own.bodies, least(own, wrench).state)
    found = rs.modes(robot, wrench=wrench, gravity=DOWN, beams=rs.Linear()).frequencies
    assert np.allclose(found[:15], expected[:15], rtol=1e-7)


def test_loads_on_the_platform_of_an_inner_module():
    """By the name of the module: as a force on a rigid part that its platform carries."""
    robot, force = rs.load("examples/tricept-with-head.yaml"), np.array([200.0, 100, -300])
    name, at = "machine/tricept", [0.1, 0.05, 0.2]
    flange = rs.Link(np.zeros(3), rs.Elasticity(1e-14 * np.eye(6)), np.eye(3), "flange")
    (leg,) = robot.legs
    block, *others = leg.chain.elements
    marked = replace(robot, legs=(replace(leg, chain=Chain((block, flange, *others))),))
    for load in (force, rs.DeadForce(force, at), rs.Mass(20, [0.1, 0, 0.2])):
        pairs = ((robot, name), (marked, "machine/flange"))
        for moved in (
            [rs.deflection(own, loads={body: load}).twist for own, body in pairs],
            [loaded(own, loads={body: load}).displacement for own, body in pairs],
        ):
            assert np.abs(moved[1]).max() > 1e-7
            assert np.allclose(moved[0], moved[1], rtol=0, atol=3e-6 * np.abs(moved[1]).max())
    heavy = rs.Mass(50, [0.02, 0.1, 0.1], inertia=[1, 2, 2.5])
    found = rs.modes(robot, masses={name: heavy}).frequencies
    known = rs.modes(marked, masses={"machine/flange": heavy}).frequencies
    assert np.allclose(found, known[: len(found)], rtol=1e-4)


def test_masses_on_the_platform_of_a_module_of_legs(tmp_path: Path):
    """Written with its legs: as those of the same module in a file of its own."""
    tripod = Path("examples/tricept.yaml").read_text(encoding="utf-8")
    masses = "platform_masses: [{name: plate, mass: 20 kg, centre: [0, 0, 0.05]}]\n"
    (tmp_path / "tripod.yaml").write_text(tripod + masses, encoding="utf-8")
    head = """
  - name: head
    chain:
      - {type: revolute, name: a, axis: x, role: actuated, stiffness: 1e6 N m/rad}
      - {type: rigid, name: tool, to: [0, 0, -0.2], mass: 2 kg}
"""
    first = "robostiff: 1\nname: both\nsource: chosen\n"
    path, module = tmp_path / "both.yaml", "modules:\n  - name: tripod\n"
    path.write_text(f"{first}{module}    robot: tripod.yaml\n{head}", encoding="utf-8")
    known = rs.modes(rs.load(path)).frequencies
    start, home, legs = (tripod.index(f"\n{key}:") for key in ("parameters", "home", "legs"))
    own = tripod[home : tripod.index("\n", home + 1)] + tripod[legs:] + masses
    module += "".join(f"    {line}\n" for line in own.splitlines())
    path.write_text(first + tripod[start:home] + "\n" + module + head, encoding="utf-8")
    assert np.allclose(rs.modes(rs.load(path)).frequencies, known, rtol=1e-9)
    path.write_text(path.read_text().replace("legs:", "chain:"), encoding="utf-8")
    with pytest.raises(rs.FileError):
        rs.load(path)


def test_a_kernel_takes_the_posture_of_a_redundant_machine_that_is_nearest_to_home():
    slide = rs.prismatic([1, 0, 0], Actuated(3e8), name="slide")
    rail = rs.Module("rail", Chain((slide,)))
    robot = rs.hybrid_machine([rail, rs.Module("hexapod", rs.load("hexapod"))])
    poses = np.array([[0.05, 0.02, 0.92, 0, 0.1, 0], [-0.03, 0.04, 0.88, 0.1, 0, 0.1]])
    fast = rs.compile_loaded(robot, backend=rs.Backend.ARRAYS).evaluate(poses, W)
    assert not fast.guarded.any()
    slow = rs.equilibrium(robot, poses, W)
    np.testing.assert_allclose(fast.displacement, slow.displacement, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(fast.K, slow.K, rtol=1e-9, atol=1e-9 * np.abs(slow.K).max())

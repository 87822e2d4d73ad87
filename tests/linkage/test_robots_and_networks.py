"""Linkages of legs: the robot and the network that are made of one are equally stiff."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import circle, material
from robostiff.kinematics import place_chain
from robostiff.linkage import Connection, Linkage, close, essential, robot_of
from robostiff.linkage.essential import network_of
from robostiff.spatial import Frame


def _frame(rng):
    return Frame(Rotation.random(rng=rng).as_matrix(), rng.normal(size=3))


def _element(rng, name, kind):
    home = rng.uniform(-1, 1, 2).tolist()
    axis, other = rng.normal(size=3), rng.normal(size=3)
    match kind:
        case 0:
            return rs.beam_link(axis, material("steel"), circle(0.03), name=name)
        case 1:
            return rs.universal(axis, other, rs.Passive(), home=home, name=name)
        case 2:
            return rs.revolute(axis, rs.Actuated(3e4), home=home[:1], name=name)
        case 3:
            return rs.prismatic(axis, rs.Actuated(2e6), home=home[:1], name=name)
        case 5:
            return rs.helical(axis, 0.1, rs.Passive(), home=home[:1], name=name)
    return rs.revolute(axis, rs.Passive(), home=home[:1], name=name)


def _closed(name, a, b, frames, element, rng):
    """A connection that fits the frames of its bodies."""
    before = _frame(rng)
    start = frames[a] @ before
    q = np.array(getattr(element, "home", ()), dtype=float)
    end = place_chain(rs.Chain((element,)), q, start.R, start.p)
    return Connection(name, a, b, before, element, Frame(end.R, end.p).inverse @ frames[b])


def _parallel(rng, legs):
    """Legs of six elements, some described from platform to base, and an arm that dangles."""
    frames = {"base": Frame.identity(), "platform": _frame(rng)}
    connections = []
    for leg in range(legs):
        bodies = ["base", *(f"{leg}.{i}" for i in range(5)), "platform"]
        frames |= {body: _frame(rng) for body in bodies[1:-1]}
        kinds = rng.permutation([0, 1, 2, 3, 5, 0])
        for i, kind in enumerate(kinds):
            a, b = bodies[i : i + 2] if rng.random() < 0.5 else bodies[i : i + 2][::-1]
            name = f"leg{leg}.{i}"
            connections.append(_closed(name, a, b, frames, _element(rng, name, kind), rng))
    frames["hook"] = _frame(rng)
    hook = _closed("hook", "0.2", "hook", frames, _element(rng, "hook", 4), rng)
    rng.shuffle(connections)
    tip = rng.normal(size=3)
    return Linkage("random", (hook, *connections), "base", "platform", tip), frames


@pytest.mark.parametrize("legs", [1, 2, 3])
@pytest.mark.parametrize("seed", range(2))
def test_a_robot_and_a_network_of_one_linkage_agree(legs, seed):
    linkage, frames = _parallel(np.random.default_rng([legs, seed]), legs)
    part = essential(linkage)
    assert len(part.connections) == 6 * legs
    found = close(part)
    assert found.is_closed
    for body, frame in found.frames.items():
        assert np.allclose(frame.p, frames[body].p, atol=1e-9)
        assert np.allclose(frame.R, frames[body].R, atol=1e-9)
    robot = robot_of(part, found)
    assert robot is not None
    one, other = rs.stiffness(robot), rs.stiffness(network_of(part, found))
    assert one.rank == other.rank
    scale = np.abs(other.K).max()
    assert np.abs(one.K - other.K).max() < 1e-8 * scale
    assert np.allclose(one.reference_point, other.reference_point, atol=1e-9)


def test_legs_that_share_a_body_are_no_robot():
    linkage, frames = _parallel(np.random.default_rng(4), 2)
    rng = np.random.default_rng(5)
    bridge = _closed("bridge", "0.2", "1.3", frames, _element(rng, "bridge", 0), rng)
    part = essential(Linkage("l", (*linkage.connections, bridge), "base", "platform", np.zeros(3)))
    assert robot_of(part, close(part)) is None


def test_coordinates_of_all_drives_need_no_names_under_load_either():
    lift = rs.load_linkage("double-pantograph")
    load = [100.0, 50, -30, 1, 1, 1]
    by_name = rs.equilibrium(lift, {"screw": -0.1}, load).displacement
    for values in ([-0.1], [[-0.1]], np.array([-0.1]), rs.ActuatorCoordinates([-0.1])):
        np.testing.assert_array_equal(rs.equilibrium(lift, values, load).displacement, by_name)
        assert rs.modes(lift, values, {"platform": 1.0}).frequencies[0] > 0
    with pytest.raises(rs.InputError, match="expected one configuration"):
        rs.equilibrium(lift, [[-0.1], [0.0]], load)

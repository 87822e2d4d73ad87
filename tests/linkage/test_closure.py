"""How linkages close, and which of their parts carry anything."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robostiff as rs
from robostiff import InputError
from robostiff.elasticity import circle, material
from robostiff.linkage import Connection, Linkage, close, essential
from robostiff.model import Joint, Passive, spherical
from robostiff.spatial import Frame


def _four_bar(roles, held=frozenset(), start=0.0, coupler=2.0):
    """Cranks of 1 m on feet 2 m apart, a coupler of 2 m: a parallelogram, at any crank angle."""
    here, right = Frame.identity(), Frame(np.eye(3), np.array([2.0, 0, 0]))
    up, along = (Frame(np.eye(3), np.array(p)) for p in ([0, 0, 1.0], [coupler, 0, 0]))

    def hinge(name, i):
        return rs.revolute([0, 1, 0], roles[i], home=[start * (i == 0)], name=name)

    connections = (
        Connection("left", "ground", "crank", here, hinge("left", 0), here),
        Connection("knee", "crank", "coupler", up, hinge("knee", 1), here),
        Connection("right", "ground", "rocker", right, hinge("right", 2), here),
        Connection("loop", "coupler", "rocker", along, hinge("loop", 3), up.inverse),
    )
    return Linkage("four bar", connections, "ground", "coupler", np.zeros(3), held)


@pytest.mark.parametrize("angle", [-0.9, 0.3, 1.2])
def test_a_parallelogram_keeps_its_coupler_level(angle):
    linkage = _four_bar([rs.Actuated(1.0), rs.Passive(), rs.Passive(), rs.Passive()])
    found = close(linkage, {"left": angle})
    assert found.is_closed
    assert found.coordinates["left"] == [angle]
    assert found.coordinates["right"][0] == pytest.approx(angle, abs=1e-12)
    assert np.allclose(found.frames["coupler"].R, np.eye(3), atol=1e-12)


def test_what_was_asked_before_changes_no_answer():
    """Home is closed once for all paths; each begins there, also after one that leads nowhere."""
    roles = [rs.Actuated(1.0), rs.Passive(), rs.Passive(), rs.Passive()]
    asked = _four_bar(roles, held=frozenset({"left"}), coupler=2.3)
    angles = [0.3, 1.5, 2.9, -0.4, -2.0, 0.3, 3.1, 0.0]
    lost = 0
    for angle in angles:
        fresh = replace(asked)
        assert fresh is not asked
        try:
            points = [node.point for node in rs.network_at(fresh, {"left": angle}).nodes]
        except rs.NoAnswerError as error:
            lost += 1
            with pytest.raises(rs.NoAnswerError, match=re.escape(str(error))):
                rs.network_at(asked, {"left": angle})
            continue
        again = [node.point for node in rs.network_at(asked, {"left": angle}).nodes]
        np.testing.assert_array_equal(again, points)
    assert 0 < lost < len(angles) - 3


def test_driven_joints_stay_where_passive_ones_can_close():
    linkage = _four_bar([rs.Actuated(1.0), rs.Passive(), rs.Passive(), rs.Passive()], start=0.5)
    found = close(linkage)
    assert found.coordinates["left"] == [0.5]


def test_driven_joints_follow_where_they_must():
    roles = [rs.Actuated(1.0), rs.Passive(), rs.Actuated(1.0), rs.Passive()]
    found = close(_four_bar(roles, start=0.5))
    assert found.is_closed
    left, right = found.coordinates["left"][0], found.coordinates["right"][0]
    assert left == pytest.approx(right, abs=1e-12)
    assert 0.0 < left < 0.5


def test_held_and_locked_joints_do_not_follow():
    roles = [rs.Actuated(1.0), rs.Passive(), rs.Actuated(1.0), rs.Passive()]
    held = close(_four_bar(roles, held=frozenset({"left"}), start=0.5))
    assert held.coordinates["right"][0] == pytest.approx(0.5, abs=1e-12)
    locked = [rs.Actuated(1.0), rs.Passive(), rs.Locked(), rs.Passive()]
    assert close(_four_bar(locked, start=0.5)).coordinates["left"][0] == pytest.approx(
        0.0, abs=1e-6
    )


def test_values_that_contradict_each_other_leave_a_gap():
    linkage = _four_bar([rs.Actuated(1.0), rs.Passive(), rs.Actuated(1.0), rs.Passive()])
    found = close(linkage, {"left": 0.5, "right": -0.5})
    assert not found.is_closed
    assert "at 'loop'" in found.complaint
    shift = np.hypot(2 * np.sin(0.5), 0) / 2
    assert found.gaps["loop"][0] > 0.1 * shift


def _bars(rng, spatial):
    """A crank, a coupler and a rocker of random lengths, closed at home at a random crank angle.

    Its joints are parallel hinges, or two hinges askew and two balls.
    """
    while True:
        crank, foot = rng.uniform(0.3, 1.0), np.array([rng.uniform(1.5, 2.5), 0, 0])
        coupler, rocker = rng.uniform(1.0, 2.5, 2)
        angle = rng.uniform(0, 2 * np.pi)
        tip = crank * np.array([np.cos(angle), 0, -np.sin(angle)])
        way = foot - tip
        far = np.linalg.norm(way)
        if abs(coupler - rocker) * 1.2 < far < (coupler + rocker) / 1.1:
            break
    along = (far**2 + coupler**2 - rocker**2) / (2 * far)
    side = np.cross([0, 1.0, 0], way / far) * np.sqrt(coupler**2 - along**2)
    top = tip + along * way / far + side
    tilt = 0.3 * rng.normal(size=3) if spatial else np.zeros(3)
    axes = [np.array([0, 1.0, 0]), np.array([tilt[0], 1.0, tilt[2]])]

    def at(point, origin):
        return Frame(np.eye(3), point - origin)

    o, level = np.zeros(3), Frame.identity()

    def pin(name):
        if spatial:
            return rs.spherical(rs.Passive(), name=name)
        return rs.revolute([0, 1, 0], rs.Passive(), name=name)

    crank_pin = rs.revolute(axes[0], rs.Actuated(1.0), name="crank")
    rocker_pin = rs.revolute(axes[1], rs.Passive(), name="rocker")
    connections = (
        Connection("crank", "ground", "a", level, crank_pin, level),
        Connection("knee", "a", "b", at(tip, o), pin("knee"), level),
        Connection("rocker", "ground", "c", at(foot, o), rocker_pin, level),
        Connection("loop", "b", "c", at(top, tip), pin("loop"), at(foot, top)),
    )
    return Linkage("bars", connections, "ground", "b", o)


@pytest.mark.parametrize(("spatial", "seed"), [(False, 1006), (False, 1011), (True, 1017)])
def test_values_are_reached_where_a_smooth_path_leads_to_them(spatial, seed):
    """Random bars driven in small steps: far values give the same, or are refused beyond.

    One search from home closes those of seeds 1006 and 1017 in another assembly mode. Those of 1011
    pass a position where crank and coupler align: they close again behind it.
    """
    rng = np.random.default_rng(seed)
    linkage = _bars(rng, spatial)
    goal, steps = rng.uniform(2, 6) * rng.choice([-1, 1]), 20
    last = close(linkage)
    smooth = last.is_closed
    assert smooth
    for k in range(1, steps + 1):
        near = [
            replace(c, element=replace(c.element, home=tuple(last.coordinates[c.name])))
            for c in linkage.connections
            if isinstance(c.element, Joint)
        ]
        here = close(replace(linkage, connections=tuple(near)), {"crank": k / steps * goal})
        smooth = here.is_closed
        if not smooth:
            break
        last = here
    found = close(linkage, {"crank": goal})
    assert found.is_closed == smooth == (seed != 1011)
    if smooth:
        for body in "abc":
            assert np.allclose(found.frames[body].p, last.frames[body].p, atol=1e-9)
        turned = found.coordinates["rocker"] - last.coordinates["rocker"]
        assert np.abs(turned).max() < 1e-9
    else:
        assert "another assembly mode" in found.complaint
        assert "home" in found.advice


def lead_screw() -> Linkage:
    """A motor turns a screw, whose nut moves a table along a guide."""
    here, pitch = Frame.identity(), 0.01
    joints = (
        ("motor", "base", "screw", rs.revolute([0, 0, 1], rs.Actuated(1e4), name="motor")),
        ("nut", "screw", "table", rs.helical([0, 0, 1], pitch, rs.Passive(), name="nut")),
        ("guide", "base", "table", rs.prismatic([0, 0, 1], rs.Passive(), name="guide")),
        ("spindle", "table", "tool", rs.beam_link([0, 0, 0.2], material("steel"), circle(0.03))),
    )
    connections = (Connection(name, a, b, here, part, here) for name, a, b, part in joints)
    return Linkage("lead screw", tuple(connections), "base", "tool", np.zeros(3))


@pytest.mark.parametrize("turn", [1.0, 4.0, -60.0])
def test_a_nut_follows_a_screw_over_many_turns(turn):
    """A loop closes on every turn of the nut; the one along the path from home is meant."""
    there = close(lead_screw(), {"motor": turn})
    assert there.is_closed
    np.testing.assert_allclose(there.coordinates["nut"], -turn, rtol=1e-12)
    np.testing.assert_allclose(there.coordinates["guide"], -0.01 * turn / (2 * np.pi), rtol=1e-9)


def test_kernels_leave_turns_of_screws_to_the_path_from_home():
    compiled = rs.compile(lead_screw(), backend=rs.Backend.ARRAYS)
    answer = compiled.evaluate({"motor": np.array([0.5, 4.0])}, again=False)
    assert answer.guarded.tolist() == [False, True]


def test_turns_of_a_screw_are_bounded():
    with pytest.raises(
        InputError, match="turn of a joint that screws follow: got '5000 rad', expected"
    ):
        close(lead_screw(), {"motor": 5000.0})


_HERE = Frame.identity()


def _ball(name, a, b):
    return Connection(name, a, b, _HERE, spherical(Passive(), name=name), _HERE)


def _weld(name, a, b, x=0.0):
    return Connection(name, a, b, Frame(np.eye(3), np.array([x, 0, 0])), None, _HERE)


def _linkage(connections, base="base", platform="platform"):
    return Linkage("l", tuple(connections), base, platform, np.zeros(3))


def _on_simple_ways(edges, base, platform):
    """By trying all ways: names of the edges on those that pass no body twice."""
    found = set()

    def go(body, passed, way):
        if body == platform:
            found.update(way)
            return
        for name, a, b in edges:
            if body in (a, b) and name not in way:
                other = b if body == a else a
                if other not in passed:
                    go(other, passed | {other}, (*way, name))

    go(base, {base}, ())
    return found


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=11))
def test_kept_is_what_lies_on_ways_that_pass_no_body_twice(pairs):
    edges = [(f"e{i}", f"b{a}", f"b{b}") for i, (a, b) in enumerate(pairs) if a != b]
    bodies = {body for _, a, b in edges for body in (a, b)}
    if not {"b0", "b1"} <= bodies:
        return
    wanted = _on_simple_ways(edges, "b0", "b1")
    linkage = _linkage(itertools.starmap(_ball, edges), "b0", "b1")
    if wanted:
        assert {c.name for c in essential(linkage).connections} == wanted
    else:
        with pytest.raises(InputError, match="nothing between it and the base"):
            essential(linkage)


def test_welded_bodies_are_one():
    linkage = _linkage(
        [
            _weld("w1", "base", "table", 1.0),
            _ball("j", "table", "arm"),
            _weld("w2", "arm", "hand", 2.0),
            _weld("w3", "hand", "platform", 3.0),
        ]
    )
    (kept,) = essential(linkage).connections
    assert (kept.a, kept.b) == ("base", "platform")
    assert kept.before.p.tolist() == [1, 0, 0]
    assert kept.after.p.tolist() == [5, 0, 0]


def test_long_chains_are_no_problem():
    names = ["base", *(f"b{i}" for i in range(3000)), "platform"]
    chain = [_ball(f"j{i}", a, b) for i, (a, b) in enumerate(itertools.pairwise(names))]
    assert len(essential(_linkage([*chain, _ball("side", "b7", "hook")])).connections) == 3001

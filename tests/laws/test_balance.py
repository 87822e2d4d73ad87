"""Loads, weights and reactions of the base are in equilibrium, forces and moments; or no answer."""

import pkgutil
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.network import Network, beam_between
from tests.network.frames import BAR, STEEL, nodes
from tests.statics.robots_under_load import loaded

# Functions that the tests damage.
LOADING = "robostiff.statics.loading.loaded_posture.on_platform"
REACTIONS = "robostiff.statics.loaded_parts.CarriedLoads.reactions"
BEAM_LOADS = "robostiff.network.response.beam_load"
SUPPORTS = "robostiff.network.solution.reactions"
LEGS = "robostiff.analysis.deflection_under_load.ConjugateWrenches.carried"


def overhang() -> Network:
    """A cantilever whose platform is described about a point beyond its node."""
    wall, tip = nodes(wall=[0, 0, 0], tip=[1.0, 0, 0])
    rod = beam_between(wall, tip, STEEL, rs.circle(0.02), name="rod")
    return Network("overhang", (wall, tip), ("wall",), "tip", np.array([1.5, 0, 0]), beams=(rod,))


def test_a_force_at_the_node_of_the_platform_acts_there():
    """It acted at the reference point, about which wrenches of the platform are given."""
    network, force = overhang(), np.array([0.0, 0, -10])
    found = rs.deflection(network, loads={"tip": force})
    wanted = rs.deflection(network, wrench=[*force.tolist(), 0, 0, 0], at=[1.0, 0, 0])
    np.testing.assert_allclose(found.energy, wanted.energy, rtol=1e-9)
    np.testing.assert_allclose(rs.network_response(network, {"tip": force}).energy, found.energy)
    small = loaded(network, loads={"tip": 1e-3 * force}, beams=rs.Linear())
    np.testing.assert_allclose(small.displacement, 1e-3 * found.twist, rtol=1e-5, atol=1e-11)


def test_a_load_that_loses_its_moment_on_the_way_is_no_load_of_an_equilibrium(
    monkeypatch: pytest.MonkeyPatch,
):
    right = pkgutil.resolve_name(LOADING)

    def without_arms(forces: Any, point: np.ndarray) -> Any:
        found = right(forces, point)
        return replace(found, levers=0 * found.levers)

    loads = {"platform": rs.DeadForce([0, 0, -50], [0.2, 0.1, 0.5])}
    assert loaded(rs.load("hexapod"), loads=loads).has_answer
    monkeypatch.setattr(LOADING, without_arms)
    for asked in (loaded, rs.deflection):
        with pytest.raises(rs.NoAnswerError, match="not those that are given"):
            asked(rs.load("hexapod"), loads=loads)


def test_an_equilibrium_whose_reactions_lack_a_moment_has_no_answer(
    monkeypatch: pytest.MonkeyPatch,
):
    right = pkgutil.resolve_name(REACTIONS)

    def turned(*args: Any) -> Any:
        return tuple(own + np.array([0, 0, 0, 1e-3, 0, 0]) for own in right(*args))

    robot, wrench = rs.load("hexapod"), [0, 0, -100.0, 0, 0, 0]
    loads = {"leg1/strut": [0, 0, -5.0]}
    monkeypatch.setattr(REACTIONS, turned)
    for asked in (loaded, rs.deflection):
        answer = asked(robot, wrench=wrench, loads=loads)
        assert not answer.has_answer
        assert answer.status & rs.Status.ILL_CONDITIONED


def propped() -> Network:
    """A beam to a body that two rigid struts hold, which share what they carry in no one way."""
    a, b, c, d = nodes(a=[0, 0, 0], b=[1.0, 0, 0], c=[2.0, 0, 0], d=[2.0, 0, 1.0])
    along_y = np.array([0.0, 1, 0])
    rod = beam_between(a, b, STEEL, BAR, y_axis=along_y, name="ab")
    struts = [beam_between(b, o, STEEL, BAR, y_axis=along_y, name=f"b{o.name}") for o in (c, d)]
    rigid = [replace(own, tip_compliance=np.zeros((6, 6))) for own in struts]
    fixed = ("a", "c", "d")
    return Network("propped", (a, b, c, d), fixed, "b", b.point, beams=(rod, *rigid))


@pytest.mark.parametrize("rigid", [False, True])
def test_a_response_whose_reactions_lack_a_moment_has_no_answer(
    rigid: bool, monkeypatch: pytest.MonkeyPatch
):
    """Of supports that rigid parts leave statically indeterminate, too."""
    network = propped() if rigid else overhang()
    name = network.beams[0].name
    loads = {name: rs.ForceOnBeam([0, 0, -10.0], 0.4)}
    right = rs.network_response(network, loads)
    assert (len(right.reactions) < len(network.fixed)) == rigid
    of_load = pkgutil.resolve_name(BEAM_LOADS)

    def without_moment(*args: Any) -> Any:
        found = of_load(*args)
        return replace(found, at_start=found.at_start * [1, 1, 1, 0, 0, 0])

    monkeypatch.setattr(BEAM_LOADS, without_moment)
    with pytest.raises(rs.NoAnswerError, match="do not balance the loads"):
        rs.network_response(network, loads)


def test_a_deflection_whose_reactions_lack_a_moment_has_no_answer(monkeypatch: pytest.MonkeyPatch):
    network, right = overhang(), pkgutil.resolve_name(SUPPORTS)
    asked: tuple[dict[str, Any], ...] = (
        {"wrench": [0, 0, -10.0, 0, 0, 0]},
        {"loads": {"tip": [0, 0, -10.0]}},
    )
    assert all(rs.deflection(network, **own).has_answer for own in asked)

    def turned(*args: Any) -> Any:
        more = np.array([0, 0, 0, 0.1, 0, 0])
        return {name: (at, F + more) for name, (at, F) in right(*args).items()}

    monkeypatch.setattr(SUPPORTS, turned)
    for own in asked:
        answer = rs.deflection(network, **own)
        assert not answer.has_answer
        assert answer.status & rs.Status.ILL_CONDITIONED


def test_legs_that_do_not_carry_the_whole_load_have_no_deflection(monkeypatch: pytest.MonkeyPatch):
    robot, wrench = rs.load("hexapod"), [0, 0, -100.0, 0, 0, 0]
    right = pkgutil.resolve_name(LEGS)

    def more(*args: Any) -> list[np.ndarray]:
        return [1.001 * own for own in right(*args)]

    monkeypatch.setattr(LEGS, staticmethod(more))
    one = rs.deflection(robot, wrench=wrench)
    many = rs.deflection(robot, np.array([rs.stiffness(robot).pose] * 3), wrench)
    assert not one.has_answer
    assert not np.any(many.answered)
    assert one.status & rs.Status.ILL_CONDITIONED

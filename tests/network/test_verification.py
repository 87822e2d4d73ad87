"""`verify` sees that methods agree, and sees planted errors."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff import network as networks
from robostiff.analysis import Outcome, verification, verify
from robostiff.model import Actuated
from robostiff.network import energy, network_of_snapshot
from tests.analysis.kernels.cases import around_home, model, row
from tests.campaign import placed
from tests.cases.reference_case import case
from tests.network.frames import GRAPH_NAMES, ball, chain_of_beams, graph

ROBOT = "gough-stewart-b-beams"


def outcomes(robot, pose=None):
    result = verify(robot, pose)
    return result.agree, {c.method: c.outcome for c in result.comparisons}


@pytest.mark.parametrize("name", rs.shipped_robots())
def test_methods_agree_at_every_shipped_robot(name):
    """At home, and beside it where nothing is symmetric."""
    robot = model(name)
    for pose in (None, row(around_home(robot, 1, 0.01), 0)):
        agree, by_method = outcomes(robot, pose)
        assert agree
        assert by_method["network"] is by_method["energy"] is Outcome.AGREES
        assert set(by_method) == {
            "saddle-point", "block", "recursive", "index-rules", "network", "energy",
        }  # fmt: skip


@pytest.mark.parametrize("name", GRAPH_NAMES)
def test_two_methods_agree_at_every_graph_case(name):
    agree, by_method = outcomes(graph(name)[0])
    assert agree
    assert by_method == {"energy": Outcome.AGREES}


def test_methods_agree_that_a_direction_is_rigid():
    rigid = replace(case("a17_rigid_UPS_actuator_only").snapshot)
    (leg,) = rigid.legs
    stiff = tuple(
        replace(e, role=Actuated()) if getattr(e, "stiffness", None) else e for e in leg.elements
    )
    agree, by_method = outcomes(replace(rigid, legs=(replace(leg, elements=stiff),)))
    assert agree
    assert by_method["network"] is by_method["energy"] is Outcome.AGREES


def planted(monkeypatch, change):
    """Every network made of a robot gets an error."""
    monkeypatch.setattr(
        verification, "network_of_snapshot", lambda snapshot: change(network_of_snapshot(snapshot))
    )


def with_penalty(k):
    def change(network):
        joints = tuple(
            replace(
                joint,
                freedoms=tuple(
                    replace(f, role=Actuated(k)) if f.is_passive else f for f in joint.freedoms
                ),
            )
            for joint in network.joints
        )
        return replace(network, joints=joints)

    return change


@pytest.mark.parametrize("k", [1e-2, 1e4])
def test_a_penalty_in_place_of_a_passive_joint_is_seen(monkeypatch, k):
    planted(monkeypatch, with_penalty(k))
    agree, by_method = outcomes(rs.load(ROBOT))
    assert not agree
    assert by_method["network"] is by_method["energy"] is Outcome.DIFFERS


def test_a_wrong_beam_is_seen(monkeypatch):
    """The energy builds its beams from the matrix of a free beam, the network does not."""
    right = networks.beam_stiffness_12

    def wrong(tip_stiffness, length):
        K = right(tip_stiffness, length)
        K[1, 11] = K[11, 1] = -K[1, 11]
        return K

    monkeypatch.setattr(energy, "beam_stiffness_12", wrong)
    result = verify(chain_of_beams(np.array([[0, 0, 0], [1.0, 0, 0]]), 3))
    assert not result.agree


def test_the_command_exits_with_one_when_methods_differ(monkeypatch, capsys):
    from robostiff.cli.answers import PrintVerification
    from robostiff.cli.options import Answer, Model, Posing

    planted(monkeypatch, with_penalty(1.0))
    asked = PrintVerification(model=Model(ROBOT), place=Posing(), answer=Answer())
    assert asked.run() == 1
    assert "methods DISAGREE" in capsys.readouterr().out


@pytest.mark.parametrize("seed", range(6))
def test_duplicated_joints_and_slender_beams_are_no_false_alarm_of_the_energy(seed):
    rng = np.random.default_rng(seed)
    legs = []
    for leg in placed.KINDS["thin"](rng).legs:
        beam, *joints = leg.elements
        joints = joints or ball(leg.end)[:2]
        twins = [beam, *joints, replace(joints[-1], name="twin")]
        legs.append(replace(leg, elements=tuple(twins)))
    checked = verify(rs.Snapshot("twins", tuple(legs), legs[0].end))
    energy = checked.comparisons[-1]
    assert energy.method == "energy"
    assert energy.outcome is Outcome.AGREES

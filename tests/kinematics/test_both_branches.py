"""Legs of five joints reach some orientations by one way of pointing their rod alone."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

import robostiff as rs
from robostiff.kinematics import place_chain
from robostiff.model import (
    Actuated,
    Chain,
    Leg,
    Passive,
    Rigid,
    Robot,
    prismatic,
    universal,
)
from robostiff.spatial import Frame

ROD = Rigid(Frame(np.eye(3), np.array([0, 0, 0.5])), "rod")
UPU = Chain(
    (
        universal([0, 1, 0], [1, 0.3, 0], Passive(), name="A"),
        ROD,
        prismatic([0, 0, 1], Actuated(1e7), name="P"),
        universal([1, 0.2, 0], [0.1, 1, 0.2], Passive(), name="B"),
    )
)
PUU = Chain(
    (
        prismatic([0, 0, 1], Actuated(1e7), name="P"),
        universal([0, 1, 0], [1, 0.2, 0], Passive(), name="A"),
        Rigid(Frame(np.eye(3), np.array([0.6, 0, -0.4])), "rod"),
        universal([1, 0, 0.1], [0, 1, 0], Passive(), name="B"),
    )
)


@pytest.mark.parametrize("chain", [UPU, PUU], ids=["UPU", "PUU"])
def test_every_pose_made_by_forward_kinematics_is_reached(chain):
    home = place_chain(chain, chain.home, np.eye(3), np.zeros(3))
    leg = Leg("leg", Frame.identity(), chain, Frame.identity())
    robot = Robot("one leg", (leg,), home=Frame(home.R, home.p))
    random = np.random.default_rng(4)
    q = random.uniform(-2.4, 2.4, (300, 5))
    slide = 2 if chain is UPU else 0
    q[:, slide] = random.uniform(0.0, 0.3, 300)
    placed = place_chain(chain, q, np.eye(3), np.zeros(3))
    T = np.tile(np.eye(4), (300, 1, 1))
    T[:, :3, :3], T[:, :3, 3] = placed.R, placed.p
    posture = rs.find_posture(robot, RigidTransform.from_matrix(T))
    if chain is UPU:
        assert posture.reached.all()
    else:  # the slide has two roots, of which a working mode takes one
        other = rs.find_posture(robot.with_elbows(rs.Elbow.MINUS), RigidTransform.from_matrix(T))
        plus = rs.find_posture(robot.with_elbows(rs.Elbow.PLUS), RigidTransform.from_matrix(T))
        assert (other.reached | plus.reached).all()

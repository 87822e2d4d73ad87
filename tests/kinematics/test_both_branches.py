"""Legs of five joints reach some orientations by one way of pointing their rod alone.

That way is the one of home; the other is another assembly mode, which `near` chooses.
"""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

import robostiff as rs
from robostiff.kinematics import place_chain
from robostiff.model import Actuated, Chain, Leg, Passive, Rigid, Robot, prismatic, universal
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
def test_poses_of_the_assembly_mode_of_home_are_reached_and_the_others_by_near(chain):
    home = place_chain(chain, chain.home, np.eye(3), np.zeros(3))
    leg = Leg("leg", Frame.identity(), chain, Frame.identity())
    robot = Robot("one leg", (leg,), home=Frame(home.R, home.p))
    q = random_coordinates(chain)
    placed = place_chain(chain, q, np.eye(3), np.zeros(3))
    T = np.tile(np.eye(4), (len(q), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = placed.R, placed.p
    poses = RigidTransform.from_matrix(T)
    posture = rs.find_posture(robot, poses)
    as_home = sign_at_first_joint(chain, q) == sign_at_first_joint(chain, chain.home[None])
    if chain is PUU:  # the slide has two roots as well
        as_home &= root_of_slide(q) == root_of_slide(chain.home[None])
    assert 0.2 < as_home.mean() < 0.8
    assert posture.reached[as_home].all()
    turned = posture.coordinates[0][as_home] - q[as_home]
    assert np.abs(np.sin(turned / 2)).max() < 1e-6
    for i in np.flatnonzero(~as_home)[:40]:
        other = rs.find_posture(robot, poses[i], near=q[i])
        assert other.reached.all()
        assert np.abs(other.coordinates[0][0] - q[i]).max() < 1e-6


def random_coordinates(chain: Chain) -> np.ndarray:
    random = np.random.default_rng(4)
    q = random.uniform(-2.4, 2.4, (300, 5))
    q[:, 2 if chain is UPU else 0] = random.uniform(0.0, 0.3, 300)
    return q


def sign_at_first_joint(chain: Chain, q: np.ndarray) -> np.ndarray:
    """Sign of b.(a x d): first axis a, second axis b, direction d of the rod, in the world."""
    freedoms = place_chain(chain, q, np.eye(3), np.zeros(3)).freedoms
    first, last = (0, 3) if chain is UPU else (1, 3)
    rod = freedoms[last].point - freedoms[first].point
    normal = np.cross(freedoms[first].axis, rod)
    return np.sign(np.einsum("ij,ij->i", freedoms[first + 1].axis, normal))


def root_of_slide(q: np.ndarray) -> np.ndarray:
    """On which side of its slide, along z, the rod of PUU ends."""
    freedoms = place_chain(PUU, q, np.eye(3), np.zeros(3)).freedoms
    return np.sign((freedoms[3].point - freedoms[1].point)[:, 2])

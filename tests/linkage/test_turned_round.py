"""A connection seen from its other end is the same connection."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.kinematics import freedom_twists, place_chain
from robostiff.linkage import Connection
from robostiff.linkage.essential import turned_round
from robostiff.spatial import Frame

_RNG = np.random.default_rng(8)


def _frame():
    return Frame(Rotation.random(rng=_RNG).as_matrix(), _RNG.normal(size=3))


JOINTS = [
    rs.revolute([1, 2, 3], rs.Passive(), home=[0.4]),
    rs.prismatic([1, 2, -3], rs.Passive(), home=[0.4]),
    rs.helical([2, -1, 1], 0.03, rs.Passive(), home=[5.0]),
    rs.universal([1, 0, 0], [0.3, 1, 0], rs.Passive(), home=[0.4, -0.7]),
    rs.spherical(rs.Passive(), home=[0.3, -0.5, 0.8]),
    rs.cylindrical([0, 1, 1], rs.Passive(), home=[0.2, 0.9]),
    rs.planar([0.2, 0.1, 1], rs.Passive(), home=[0.2, -0.3, 0.7]),
]


def _end(connection, start):
    """Frame of body b, and what is placed, where body a is."""
    near = start @ connection.before
    q = connection.home
    placed = place_chain(rs.Chain((connection.element,)), q, near.R, near.p)
    return Frame(placed.R, placed.p) @ connection.after, placed


@pytest.mark.parametrize("joint", JOINTS, ids=lambda joint: joint.kind.value)
def test_a_joint_leads_back_and_moves_alike(joint):
    connection = Connection("c", "a", "b", _frame(), joint, _frame())
    start = _frame()
    end, placed = _end(connection, start)
    back, placed_back = _end(turned_round(connection), end)
    assert np.allclose(back.R, start.R, atol=1e-12)
    assert np.allclose(back.p, start.p, atol=1e-12)
    twists, other = (freedom_twists(p.freedoms, start.p) for p in (placed, placed_back))
    # The same motions: each set of columns spans the other.
    both = np.concatenate([twists, other], axis=1)
    assert np.linalg.matrix_rank(both, tol=1e-9) == joint.size
    assert turned_round(turned_round(connection)).home == pytest.approx(connection.home)

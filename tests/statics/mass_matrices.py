"""The mass matrix of an arm over the coordinates of its joints."""

import numpy as np

import robostiff as rs
from robostiff.statics.chains.elements import Spot
from robostiff.statics.equations.vibration import mass_rows
from robostiff.statics.loading.given_loads import Acting
from robostiff.statics.loading.loaded_posture import postures_of


def mass_matrix(robot: rs.Robot, pose: rs.JointCoordinates) -> np.ndarray:
    """Of a serial arm whose joints all have a stiffness and whose links are rigid (m, m)."""
    loaded = postures_of(robot, pose, None).with_loads(0, Acting(beams=rs.Linear()), masses={})
    problem, state = loaded.problem, loaded.problem.unloaded
    of_legs, _, of_twist = mass_rows(problem, loaded.masses, state)
    # the platform moves with the body behind the last joint, so that the chain stays closed
    last = Spot(0, len(problem.legs.chains[0].elements))
    twist = problem.legs.twists(state, [last], state.p[None])[0, list(problem.rows)]
    B = np.concatenate([of_legs, of_twist[0] @ twist])
    return B.T @ B

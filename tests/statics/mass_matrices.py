"""The mass matrix of an arm over the coordinates of its joints."""

import numpy as np

import robostiff as rs
from robostiff.statics.equations.problem import LoadCase
from robostiff.statics.equations.stability import whole_closure
from robostiff.statics.equations.vibration import mass_rows
from robostiff.statics.loading.given_loads import Acting
from robostiff.statics.loading.loaded_posture import postures_of


def mass_matrix(robot: rs.Robot, pose: rs.JointCoordinates) -> np.ndarray:
    """Of a serial arm whose joints all have a stiffness and whose links are rigid (m, m)."""
    loaded = postures_of(robot, pose, None).loaded(0, Acting(beams=rs.Linear()), masses={})
    problem, nothing = loaded.problem, np.zeros(loaded.problem.size)
    known = problem.linearised(problem.unloaded, LoadCase(nothing, nothing), 0.0)
    B, m = mass_rows(problem, loaded.masses, problem.unloaded), len(problem.free)
    closure = whole_closure(known) * np.append(
        problem.units[problem.free], problem.scale / problem.length
    )
    # the twist of the platform follows from the joints, so that the chain stays closed
    twist = -np.linalg.lstsq(closure[:, m:], closure[:, :m], rcond=None)[0]
    B = B[:, :m] + B[:, m:] @ twist
    return B.T @ B

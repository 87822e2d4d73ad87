"""A script of a user, in which pyright is strict: `make lint`."""

import numpy as np

import robostiff as rs

robot = rs.load("hexapod")
pose = [0.06, 0.02, 0.9, 0.0, 0.17, 0.0]
result = rs.stiffness(robot, pose)
print(result.K[0, 0], result.rank, result.reference_point, result.joint_coordinates)
print(result.free_motions, result.transform.translation)
bent = rs.deflection(robot, pose, wrench=[300, 0, 0, 0, 0, 0])
print(bent.twist[:3], bent.parts[0].share)
poses = np.tile(pose, (5, 1))
many = rs.stiffness(robot, poses)
print(many.K[:, 0, 0], many[0].status)
rested = rs.equilibrium(robot, pose, [0, 0, -1e3, 0, 0, 0])
print(rested.K, rested.displacement)
fast = rs.compile(robot, [rs.StiffnessMatrix()])
answer = fast.evaluate(poses)
print(answer.values["K"].shape)
found = rs.stiffness_map(robot, rs.Grid(x=rs.Axis(-0.1, 0.1, 5)))
print(found.translational_stiffness.dims)
axes = rs.plot.robot(robot, pose, deflection=bent)
axes.figure.savefig("a.png")
first = rs.indices(robot, pose).collinear.smallest
line = rs.deflection(robot, [pose, pose], wrench=[300, 0, 0, 0, 0, 0])
print(first, line.twist[:, 0], rs.indices(robot, [pose, pose]).anisotropy[0])

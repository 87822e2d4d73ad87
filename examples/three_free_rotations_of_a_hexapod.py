"""
Three free rotations of a hexapod
=================================

**Which free motions has a hexapod with similar base and platform?** In case A of the paper
:cite:p:`pashkevich2011cartesian` base and platform are similar regular hexagons. The text says that
the platform turns freely about the vertical axis. By its matrix, it has three free rotations.
"""

import numpy as np

import robostiff as rs
from robostiff.analytic import fixed_point_formula, rank_formula

robot = rs.load("gough-stewart-a")  # R = 500 mm, r = 300 mm, h = 800 mm
result = rs.stiffness(robot)
print(f"rank {result.rank} of 6, status {result.status}")
print(*result.free_motions, sep="\n")

# %%
# All six legs point at one apex, and forces through a point have no moment about it. The legs
# therefore hold only the apex: the platform turns about it as on a ball joint.

axes = rs.plot.free_motions(result, within=robot)

# %%
# With symbols in place of numbers, the point that all free motions leave at rest has a formula,
# relative to the reference point of the platform:

K = rs.derive("gough-stewart-a").K
apex = fixed_point_formula(K)
print("rank", rank_formula(K).rank, "for all dimensions; apex at", list(apex))

# %%
# At home the legs carry a vertical load. A horizontal load does work on the free motions; it has no
# deflection, which the status reports:

print("100 N down:    ", rs.deflection(robot, wrench=[0, 0, -100, 0, 0, 0]).status)
print("100 N sideways:", rs.deflection(robot, wrench=[100, 0, 0, 0, 0, 0]).status)

# %%
# At a thousand poses around home, the rank is 5: one free motion is left at each of them. With
# joints in pairs, case B, the platform is held.

rng = np.random.default_rng(1)
poses = rng.uniform(-0.1, 0.1, (1000, 6))
poses[:, 2] += 0.8  # m
for name in ("gough-stewart-a", "gough-stewart-b"):
    rank = rs.stiffness(rs.load(name), poses).rank
    print(f"{name}: rank {rank.min()} to {rank.max()}")

# %%
# **Answer:** three rotations about the apex, h r/(R - r) = 1.2 m above the platform, and one free
# motion at general poses.

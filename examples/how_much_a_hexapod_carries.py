"""
How much a hexapod carries
==========================

**A platform stands on six slender tubes between joints. Which load makes them buckle, and what
announces it?** The stiffness matrix of the unloaded robot does not contain the answer.
"""

import numpy as np

import robostiff as rs

robot = rs.load("gough-stewart-b-beams", {"D": "16 mm", "d": "12 mm"})
down = np.array([0, 0, -1000.0, 0, 0, 0])  # N, N m

found = rs.critical_load(robot, wrench=down)
print(f"critical load: {found.factor:.1f} kN")
print(found.mode)

# %%
# A tube between a universal and a spherical joint is Euler's column between hinges. Each of the six
# tubes, of length L, carries a sixth of the load, times L over the height of the platform:

leg = rs.find_posture(robot).snapshot.one(0).legs[0]
L = np.linalg.norm(leg.end - next(leg.parts).point)
(tube,) = robot.legs[0].chain.elements[1].beams
euler = np.pi**2 * tube.material.E * tube.section.Iy / L**2
carried = found.factor * 1e3 / 6 * L / 0.8
print(f"each tube carries {carried / 1e3:.2f} kN there; Euler: {euler / 1e3:.2f} kN")

# %%
# A force from the side, of a fifth of the load, presses some of the tubes more than others:

aside = down + np.array([200.0, 0, 0, 0, 0, 0])
sooner = rs.critical_load(robot, wrench=aside)
print(f"critical load: {sooner.factor:.1f} kN, {sooner.factor / found.factor - 1:.0%}")

# %%
# Up to the critical point, the force-deflection curve is almost a straight line:

curve = rs.load_path(robot, wrench=aside, factors=np.linspace(0, 1.2 * sooner.factor, 7))
axes = rs.plot.load_curve(curve)

unloaded = rs.stiffness(robot).K
loaded = rs.equilibrium(robot, wrench=0.99 * found.factor * down)
change = np.diag(loaded.K) / np.diag(unloaded) - 1
print(f"stiffness at 99 % of the critical load: {change.min():+.1%} to {change.max():+.1%}")

# %%
# Natural frequencies announce the buckling. The slowest vibration is that of the tubes. Its
# frequency falls with the square root of the remaining part of the critical load:

for share in (0.0, 0.5, 0.9, 0.99):
    vibrating = rs.modes(robot, wrench=share * found.factor * down)
    print(f"{share:4.0%} of the critical load: {vibrating.frequencies[0]:.1f} Hz")

# %%
# **Answer:** 29 kN straight down, and 18 kN if a fifth of the load comes from the side. The
# deflection does not announce the buckling, but the vibrations of the tubes do.

"""
How stiff for how much mass
===========================

**How much stiffer is a robot with another kilogram?** A Stewart-Gough platform has legs of steel
tubes. Its circles and tubes are chosen anew for each mass of the legs, on a small and on a large
base: the best designs form two Pareto fronts of mass and stiffness.
"""

import matplotlib.pyplot as plt
import numpy as np

import robostiff as rs

robot = rs.load("gough-stewart-b-beams", symbols=("R", "r", "D"))
poses = np.array([[0, 0, 0.8, 0, 0, 0], [0.1, 0, 0.8, 0, 0.1, 0], [-0.05, 0.1, 0.75, 0.1, 0, 0.1]])

# %%
# The objective is the worst deflection under one newton in any direction, at the worst of the three
# poses. The limit is on the mass at each pose, because the length of the legs depends on the pose.


def front(widest, masses):
    """Least deflections [m/N] for masses [kg], with a base of at most this radius [m]."""
    ranges = {"R": (0.3, widest), "r": (0.15, 0.4), "D": (0.031, 0.08)}
    found = []
    for most in masses:
        limit = [rs.mass_below(most)]
        best = rs.optimise(robot, rs.WorstDeflection(), ranges, poses=poses, constraints=limit)
        found.append(best.objective)
        circles = ", ".join(f"{name} = {1e3 * value:.0f} mm" for name, value in best.values.items())
        print(f"{most:.0f} kg: {1e9 * best.objective:.2f} nm/N, {best.ending.value}; {circles}")
    return np.array(found)


masses = np.linspace(10, 40, 7)
small, large = front(0.5, masses), front(0.8, masses)

# %%
# Deflection against mass, and the robot as it is shipped:

kernel = rs.compile(rs.load("gough-stewart-b-beams"), [rs.WorstDeflection(), rs.TotalMass()])
shipped = kernel.evaluate(poses).values
mass, deflection = shipped["mass"].max(), shipped["worst_deflection"].max()
print(f"as shipped: {mass:.1f} kg, {1e9 * deflection:.2f} nm/N")

figure, axes = plt.subplots()
axes.plot(masses, 1e9 * small, "o-", label="base up to 500 mm")
axes.plot(masses, 1e9 * large, "o-", label="base up to 800 mm")
axes.plot(mass, 1e9 * deflection, "s", label="as shipped")
axes.set_xlabel("mass of the legs [kg]")
axes.set_ylabel("worst deflection [nm/N]")
axes.legend()

# %%
# **Answer:** on each front the deflection times the mass is the same, because legs between ball
# joints stretch and do not bend: with 50 % more mass the deflection is a third less. A base of
# 800 mm in place of 500 mm reduces it by 28 %, at the same mass of the legs.

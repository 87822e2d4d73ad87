"""
What parallelograms are good for
================================

**An Orthoglide has two bars in each leg, in a parallelogram. How much stiffness is lost if both are
merged into one, between two universal joints?** That makes a 3-PRPaR a 3-PUU. Both have the same
motion, the same drives and the same mass. :doc:`/orthoglide` explains the answer.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from scipy.linalg import eigvalsh

import robostiff as rs

NAMES = "3-PRPaR", "3-PUU"
here = Path(__file__).parent if "__file__" in globals() else Path.cwd()
robots = rs.load("orthoglide"), rs.load(here / "orthoglide-3-puu.yaml")

# %%
# The tool moves along the diagonal x = y = z through the usual workspace, where the ratio of the
# speeds of drives and tool is between 1/2 and 2.


def compared(s):
    """Stiffness of both robots with the tool at x = y = z = s [m], that of the 3-PRPaR first."""
    K = np.stack([rs.stiffness(robot, np.outer(s, [1, 1, 1])).K for robot in robots])
    C = np.linalg.inv(K)
    return {
        "held": np.linalg.eigvalsh(K[..., :3, :3])[..., 0],
        "alone": 1 / np.linalg.eigvalsh(C[..., :3, :3])[..., -1],
        "torque": 1 / np.linalg.eigvalsh(C[..., 3:, 3:])[..., -1],
        # How many times further torques turn the 3-PUU: least and most over all axes.
        "factors": np.array([eigvalsh(b, a) for a, b in zip(*C[..., 3:, 3:], strict=True)]),
    }


print("              force, softest direction [N/um]          torque, softest axis [kN m/rad]")
print("         turning held          left to turn                             3-PRPaR stiffer")
print("x=y=z    3-PRPaR   3-PUU     3-PRPaR   3-PUU        3-PRPaR   3-PUU       over all axes")
s = np.linspace(-0.12, 0.24, 10)
table = compared(s)
for i, at in enumerate(1e3 * s):
    held, alone, torque = (table[name][:, i] for name in ("held", "alone", "torque"))
    forces = "{:11.2f}{:8.2f}{:12.2f}{:8.2f}".format(*1e-6 * held, *1e-6 * alone)
    torques = "{:15.1f}{:8.2f}".format(*1e-3 * torque)
    least, *_, most = table["factors"][i]
    print(f"{at:5.0f} mm{forces[2:]}{torques}{least:9.0f} to {most:3.0f} times")

# %%
# Bars carry axial forces, so with rotations held, both robots are the same up to rounding.
# Rotations are resisted by two bars in one robot, one in tension and one in compression, and by
# the torsion of a single bar in the other.

s = np.linspace(-0.12, 0.24, 181)
along = compared(s)
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
left.plot(1e3 * s, 1e-6 * along["held"][0], "--", color="gray", label="both, turning held")
for name, colour, alone, torque in zip(
    NAMES, ("C0", "C1"), along["alone"], along["torque"], strict=True
):
    left.plot(1e3 * s, 1e-6 * alone, color=colour, label=name)
    right.semilogy(1e3 * s, 1e-3 * torque, color=colour, label=name)
left.set(title="force, softest direction", ylabel="N/µm", ylim=(0, None))
right.set(title="torque, softest axis", ylabel="kN m/rad")
for axes in (left, right):
    axes.set_xlabel("tool at x = y = z [mm]")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
if len(sys.argv) > 1:
    figure.savefig(sys.argv[1], dpi=110, metadata={"Software": None})

# %%
# **Answer:** at the centre nothing against forces, and a factor of 131 against torques. Elsewhere
# the lines along the legs do not meet. A force across the diagonal then turns the tool, and the
# 3-PUU becomes soft against forces, too.

"""
Stiffer screws or stiffer joints
================================

**A hexapod deflects too much under the cutting force. What should be made twice as stiff?** The
ball screws of its legs, or the bearings of its joints? Each design changes one parameter.
"""

import numpy as np

import robostiff as rs

pose = [0.06, 0.02, 0.9, 0, np.radians(10), 0]  # m, rotation vector
load = [300, 100, -200, 0, 0, 0]  # N, N m
now = rs.deflection(rs.load("hexapod"), pose, load)
print(f"now: {1e6 * np.linalg.norm(now.twist[:3]):.1f} um")

# %%
# The elastic energy of each part, as a share of the total, is its share in the deflection along the
# load:

axes = rs.plot.energy_shares(now)

shares = {"screws": 0.0, "bearings": 0.0, "tubes": 0.0}
for part in now.parts:
    kind = "bearings" if "bearings" in part.part else "tubes" if "beam" in part.part else "screws"
    shares[kind] += part.share
for kind, share in shares.items():
    print(f"{kind:9} {share:.0%}")

# %%
# A part that is twice as stiff deflects half as much under the same load. In this hexapod the load
# on a leg does not depend on stiffness, so the shares predict the gain:

designs = {
    "screws": rs.load("hexapod", {"k_screw": "240 N/um"}),
    "bearings": rs.load("hexapod", {"k_joint": "800 N/um"}),
}
bent = {kind: rs.deflection(robot, pose, load) for kind, robot in designs.items()}
for kind, answer in bent.items():
    print(
        f"stiffer {kind:9} {1e6 * np.linalg.norm(answer.twist[:3]):.1f} um,"
        f" energy {answer.energy / now.energy - 1:+.1%} (predicted {-shares[kind] / 2:+.1%})"
    )

# %%
# The principal stiffnesses show that this holds for all directions: stiffer screws are better than
# stiffer bearings by 15 % in each of them, because all legs are equal and nearly of the same
# length.

stiffness = {kind: rs.stiffness(robot, pose) for kind, robot in designs.items()}
axes = rs.plot.comparison(
    stiffness["bearings"], stiffness["screws"], names=("stiffer bearings", "stiffer screws")
)

# %%
# **Answer:** the screws. They store 54 % of the energy, so screws that are twice as stiff reduce
# the deflection by 27 %, bearings by 16 %.

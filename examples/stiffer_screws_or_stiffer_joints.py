"""
Stiffer screws or stiffer joints
================================

**A hexapod gives way too much under the cutting force. What should be made twice as stiff?** The
ball screws of its legs, or the bearings of its joints? Two designs are one parameter apart each.
"""

import numpy as np

import robostiff as rs

pose = [0.06, 0.02, 0.9, 0, np.radians(10), 0]  # m, rotation vector
load = [300, 100, -200, 0, 0, 0]  # N, N m
now = rs.deflection(rs.load("hexapod"), pose, load)
print(f"now: {1e6 * np.linalg.norm(now.twist[:3]):.1f} um")

# %%
# Ask first who bends. The elastic energy of each part is its share in the deflection along the
# load:

axes = rs.plot.energy_shares(now)

shares = {"screws": 0.0, "bearings": 0.0, "tubes": 0.0}
for part in now.parts:
    kind = "bearings" if "bearings" in part.part else "tubes" if "beam" in part.part else "screws"
    shares[kind] += part.share
for kind, share in shares.items():
    print(f"{kind:9} {share:.0%}")

# %%
# A part that is twice as stiff bends half as much under the same load. In this hexapod the load on
# a leg does not depend on stiffness, so that the shares foretell the gain:

designs = {
    "screws": rs.load("hexapod", {"k_screw": "240 N/um"}),
    "bearings": rs.load("hexapod", {"k_joint": "800 N/um"}),
}
bent = {kind: rs.deflection(robot, pose, load) for kind, robot in designs.items()}
for kind, answer in bent.items():
    print(
        f"stiffer {kind:9} {1e6 * np.linalg.norm(answer.twist[:3]):.1f} um,"
        f" energy {answer.energy / now.energy - 1:+.1%} (foretold {-shares[kind] / 2:+.1%})"
    )

# %%
# Is that so for this load alone? The principal stiffnesses answer for all directions: screws beat
# bearings by 15 % in each of them, since all legs are alike and nearly of one length.

stiffness = {kind: rs.stiffness(robot, pose) for kind, robot in designs.items()}
axes = rs.plot.comparison(
    stiffness["bearings"], stiffness["screws"], names=("stiffer bearings", "stiffer screws")
)

# %%
# **Answer:** the screws. They hold 54 % of the energy, so that screws twice as stiff take 27 % of
# the deflection away, bearings 16 %.

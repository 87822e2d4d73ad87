"""
Redundant joints break the inverse
==================================

**How stiff is a rod between two ball joints?** Its stiffness is EA/L along the rod, and zero in all
other directions. The rod can spin about its own axis by either ball joint: of six joint coordinates
only five are independent. One joint is redundant, and the matrix of eq. (7), which the textbook
method inverts, is singular.
"""

import numpy as np
from matplotlib import pyplot as plt
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import beam_compliance
from robostiff.spatial import Screw, block_rotation

L, section, steel = 0.5, rs.tube(0.030, 0.020), rs.material("steel")
EA_L = steel.E * section.A / L
OBLIQUE = np.array([1, 2, 3]) / np.sqrt(14)


def rod(angle):
    """Compliance at the tip, joint twists, and direction of the rod, turned by an angle."""
    R = Rotation.from_rotvec(angle * OBLIQUE).as_matrix()
    along = R[:, 0]
    turn = block_rotation(R)
    base, tip = np.zeros(3), L * along
    balls = [Screw(axis, point, 0.0).twist(tip) for point in (base, tip) for axis in np.eye(3)]
    return turn @ beam_compliance(L, steel, section) @ turn.T, np.transpose(balls), along


def inverted(C, J_q):
    """Upper left of the inverse of eq. (7), without a check of the rank of the joints."""
    try:
        return np.linalg.inv(np.block([[C, J_q], [J_q.T, np.zeros((6, 6))]]))[:6, :6]
    except np.linalg.LinAlgError:
        return np.full((6, 6), np.nan)


# %%
# The rod is turned in steps of half a degree, about an oblique axis. Its axial stiffness should not
# change.

angles = np.radians(np.arange(0, 90.1, 0.5))
rods = [rod(angle) for angle in angles]
answers = [rs.chain_stiffness(C, J_q) for C, J_q, _ in rods]
ours = np.array([u @ a.K[:3, :3] @ u for a, (_, _, u) in zip(answers, rods, strict=True)]) / EA_L
theirs = np.array([u @ inverted(C, J)[:3, :3] @ u for C, J, u in rods]) / EA_L

figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.plot(np.degrees(angles), theirs, ".", color="C1", label="inverse of eq. (7)")
axes.plot(np.degrees(angles), ours, color="C0", label="robostiff")
axes.set(xlabel="rod turned by [deg]", ylabel="stiffness along the rod / (EA/L)")
_ = axes.legend()

# %%
# The result of the inverse depends on rounding: in some directions NumPy raises an error because
# the matrix is singular, in the others it returns a wrong number without a warning.

found = np.isfinite(theirs)
wrong = np.abs(theirs[found] - 1) > 0.01
print(f"inverse of eq. (7): {found.sum()} of {len(angles)} directions answered")
print(f"                    {wrong.sum()} of them wrong by more than 1 %")
print(f"robostiff:          {len(angles)} answered, largest error {np.abs(ours - 1).max():.0e}")
print(f"                    rank {answers[7].rank}, status {answers[7].status}")

# %%
# robostiff finds the wrenches that the joints transmit, here a single one, and uses their
# compliance alone. A redundant joint does not change the result. It is reported by the status,
# because the spin of the rod may be unintended.
#
# **Answer:** EA/L, in every direction, with a status that reports the redundant joint.

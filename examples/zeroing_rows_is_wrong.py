"""
Zeroing rows is wrong
=====================

**May the rows of a stiffness matrix be set to zero where a joint is free?** A hinge carries no
moment, so its row of K must vanish, and by symmetry its column. The shortcut keeps all other
entries as they were. :doc:`/why-zeroing-rows-is-wrong` explains why this is wrong. The example
computes the error for a steel bar, clamped at its base, 500 mm long and 20 mm thick, with a hinge
at its tip.
"""

import numpy as np
from matplotlib import pyplot as plt

import robostiff as rs
from robostiff.elasticity import beam_stiffness
from robostiff.elastostatics import aggregate_matrices, eliminate_index
from robostiff.spatial import rotate_stiffness

L, section, steel = 0.5, rs.circle(0.020), rs.material("steel")
clamped = beam_stiffness(L, steel, section)


def zeroed(K, *rows):
    """The shortcut: rows and columns set to zero, all other entries left as they were."""
    K = K.copy()
    K[list(rows), :] = 0
    K[:, list(rows)] = 0
    return K


def eliminated(K, *rows):
    """One joint after the other, eq. (19)."""
    for row in rows:
        K = eliminate_index(K, row)
    return K


right, shortcut = eliminated(clamped, 5), zeroed(clamped, 5)  # a hinge about z
print("lateral stiffness K[Fy, dy] [N/mm]")
print(f"  beam formula 3EI/L^3       {3e-3 * steel.E * section.Iz / L**3:8.2f}")
print(f"  joint eliminated, eq. (19) {1e-3 * right[1, 1]:8.2f}")
print(f"  row and column zeroed      {1e-3 * shortcut[1, 1]:8.2f}")

# %%
# In the shortcut the tip takes no moment, but the bar bends as if its tip could not turn:

force = 10.0  # N
x = np.linspace(0, L, 100)
free = force * x**2 * (3 * L - x) / (6 * steel.E * section.Iz)
guided = force * x**2 * (3 * L - 2 * x) / (12 * steel.E * section.Iz)

figure, axes = plt.subplots(figsize=(6, 2.8), layout="constrained")
axes.plot(1e3 * x, 1e3 * free, label="hinged tip: it turns")
axes.plot(1e3 * x, 1e3 * guided, "--", label="guided tip: the shortcut")
tips = [force / right[1, 1], force / shortcut[1, 1]]
axes.plot([1e3 * L] * 2, [1e3 * tip for tip in tips], "ko", label="10 N divided by K")
axes.set(xlabel="along the bar [mm]", ylabel="deflection under 10 N [mm]")
_ = axes.legend()

# %%
# In a robot only some directions show the error. The example is a table on three such bars,
# upright, with a ball joint on each:

upright = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # the bar's own x points up
column = rotate_stiffness(clamped, upright)
to_centre = [-0.2 * np.array([np.cos(a), np.sin(a), 0]) for a in np.radians([90, 210, 330])]
table = aggregate_matrices([eliminated(column, 3, 4, 5)] * 3, to_centre)
wrong = aggregate_matrices([zeroed(column, 3, 4, 5)] * 3, to_centre)
factors = np.diag(wrong) / np.diag(table)
for name, factor in zip(("Fx, dx", "Fz, dz", "Mz, rz"), factors[[0, 2, 5]], strict=True):
    print(f"K[{name}] too stiff by a factor of {factor:.2f}")

# %%
# **Answer:** no. The hinged bar is computed four times too stiff, 158 instead of 40 N/mm, and so is
# the table wherever its columns bend. Its axial stiffness is right, so axial tests miss the error.

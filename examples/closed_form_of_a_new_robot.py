"""
Closed form of a new robot
==========================

**What is the stiffness of a new robot as a formula?** Three slides, tangential to a circle, push a
table by rigid rods. Ten lines describe the legs:

.. literalinclude:: ../../examples/three-slides.yaml
   :language: yaml
   :start-at: legs
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

import robostiff as rs
from robostiff.analytic.export import derivation_text

model = Path(sys.argv[0]).with_name("three-slides.yaml")  # beside this file
axes = rs.plot.robot(rs.load(model), backend=rs.plot.Matplotlib(width=rs.plot.Width.HALF))

# %%
# `rs.derive` derives the matrix, with all parameters of the file as symbols. Here is its last part:

derivation = rs.derive(model)
text = derivation_text(derivation)
print(text[text.index("K_C = 3") : text.index("Nomenclature")].rstrip())

# %%
# The table is as stiff along x as along y, nothing is coupled, and
#
# .. math::
#
#    K_{xx} = \frac{3k}{2}\left(1 + \frac{(R - r)^2}{a^2}\right), \qquad K_{zz} = 3 k r^2 .
#
# The rotational stiffness does not depend on the offset *a* of the slides, while the horizontal
# stiffness grows without bound as the rods become radial: the load on the drives vanishes, as in a
# toggle press.
#
# The comparison with the numerical result at other offsets checks the formula:

offsets = np.linspace(0.02, 0.2, 10)  # m
numbers = [rs.stiffness(rs.load(model, {"a": float(a)})).K for a in offsets]
formula = derivation.lambdify("R", "a", "k", "r")(0.3, offsets, 2e7, 0.1)
print(f"largest difference: {np.max(np.abs(np.subtract(formula, numbers)) / np.max(numbers)):.0e}")

# %%

fine = np.linspace(0.02, 0.2, 200)
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.plot(1e3 * fine, 30 * (1 + (0.2 / fine) ** 2), label="formula")
axes.plot(1e3 * offsets, [K[0, 0] / 1e6 for K in numbers], "o", label="numbers")
axes.set(xlabel="offset a of the slides [mm]", ylabel="K[Fx, dx] [N/µm]", yscale="log")
_ = axes.legend()

# %%
# **Answer:** 1.5 k (1 + (R - r)²/a²) for horizontal forces, and 3 k r² for rotation.

K = rs.stiffness(rs.load(model)).K
print(f"at a = 80 mm: {K[0, 0] / 1e6:.1f} N/um sideways, {K[2, 2] / 1e3:.0f} kN m/rad")

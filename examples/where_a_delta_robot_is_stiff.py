"""
Where a delta robot is stiff
============================

**A delta robot is to press parts into place as well as pick them. At which height should it
press?** The worst deflection is the largest displacement for a force of 1 N in any direction. A map
computes it at many poses, here in the vertical plane through one of the three arms.
"""

import robostiff as rs

robot = rs.load("delta")
grid = rs.Grid(x=rs.Axis(-0.4, 0.4, 41), z=rs.Axis(-0.9, -0.34, 29))
found = rs.stiffness_map(robot, grid, [rs.Quantity.WORST_DEFLECTION])
worst = 1e6 * found.worst_deflection  # um/N

axes = rs.plot.map_slice(
    found, "worst_deflection", x="x", y="z", isolines=[4e-6, 6e-6, 8e-6, 12e-6]
)

# %%
# Hatched poses are out of reach: they have no stiffness, and no colour. At lower poses the platform
# deflects more: with steep rods, a small rotation of the motors causes a larger horizontal motion.

for z in (-0.5, -0.6, -0.7, -0.8, -0.9):
    level = worst.sel(z=z, method="nearest")
    centre, edge = float(level.sel(x=0, method="nearest")), float(level.max())
    print(f"z = {z:.1f} m: {centre:4.1f} um/N in the middle, at most {edge:4.1f} within 400 mm")

# %%
# The elastic energy shows which part deflects under a force downwards and a force sideways:

for way, wrench in {"down": [0, 0, -100, 0, 0, 0], "sideways": [100, 0, 0, 0, 0, 0]}.items():
    bent = rs.deflection(robot, [0, 0, -0.7, 0, 0, 0], wrench)
    shares: dict[str, float] = {}
    for part in bent.parts:
        shares[part.part] = shares.get(part.part, 0.0) + part.share
    most = max(shares, key=shares.__getitem__)
    size = 1e6 * abs(bent.twist[:3]).max()
    print(f"100 N {way:8}: {size:.0f} um, {shares[most]:.0%} of the energy in the {most}s")

# %%
# **Answer:** as high as it reaches. In the middle the worst deflection is 2.4 µm/N at 500 mm below
# the base, and 11.4 µm/N at 900 mm. For both forces, the motors with their gears store most of the
# energy and should be made stiffer.

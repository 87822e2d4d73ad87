"""Model files of robots whose stiffness has a known form, for several tests."""

ARM_3R = """
robostiff: 1
name: 3r-arm
source: three slender links with elastic joints, the first turning about the vertical
parameters:
  {l1: 300 mm, l2: 500 mm, l3: 400 mm, E: 70 GPa, G: 26 GPa, A: 1e-3 m^2, I: 1e-7 m^4,
   I_t: 2e-7 m^4,
   k: 2e5 N m/rad}
materials: {alloy: {E: E, G: G}}
sections: {tube: {properties: {A: A, Iy: I, Iz: I, J: I_t}}}
legs:
  - name: arm
    chain:
      - {type: revolute, name: waist, axis: z, role: actuated, stiffness: k, home: 20 deg}
      - {type: beam, name: column, to: [0, 0, l1], material: alloy, section: tube}
      - {type: revolute, name: shoulder, axis: y, role: actuated, stiffness: k, home: -40 deg}
      - {type: beam, name: upper arm, to: [l2, 0, 0], material: alloy, section: tube}
      - {type: revolute, name: elbow, axis: y, role: actuated, stiffness: k, home: 70 deg}
      - {type: beam, name: forearm, to: [l3, 0, 0], material: alloy, section: tube}
"""

THREE_PUU = """
robostiff: 1
name: 3-puu
source: three vertical rails and rods, all of it symbols
parameters:
  {R: 500 mm, r: 150 mm, L: 700 mm, k_a: 2e7 N/m, E: 210 GPa, G: 80 GPa, A: 2e-4 m^2, I: 1.3e-8 m^4,
   I_t: 2.6e-8 m^4}
materials: {rod steel: {E: E, G: G}}
sections: {rod tube: {properties: {A: A, Iy: I, Iz: I, J: I_t}}}
home: {at: [0, 0, 0]}
coordinates: [x, y, z]
legs:
  repeat: [{name: leg1, phi: 0 deg}, {name: leg2, phi: 120 deg}, {name: leg3, phi: 240 deg}]
  base: {at: [R*cos(phi), R*sin(phi), 0], turn: [{z: phi}]}
  chain:
    - {type: prismatic, name: drive, axis: z, role: actuated, stiffness: k_a}
    - {type: universal, name: carriage joint, axes: [y, x], role: passive}
    - {type: beam, name: rod, to: [0, 0, -L], material: rod steel, section: rod tube}
    - {type: universal, name: platform joint, axes: [x, y], role: passive}
  platform: {at: [r*cos(phi), r*sin(phi), 0], turn: [{z: phi}]}
  elbow: plus
"""

# The six edges of a cube of side 2a that avoid two opposite corners.
CUBIC = """
robostiff: 1
name: cubic
source: a Stewart platform on the edges of a cube
parameters: {a: 200 mm, k: 1e7 N/m, h: 300 mm}
home: {at: [0, 0, HEIGHT]}
legs:
  repeat:
    - {name: leg1, ax: a, ay: -a, az: -a, bx: a, by: a, bz: -a, tx: -90 deg, ty: 0}
    - {name: leg2, ax: -a, ay: a, az: a, bx: -a, by: -a, bz: a, tx: 90 deg, ty: 0}
    - {name: leg3, ax: -a, ay: a, az: -a, bx: -a, by: a, bz: a, tx: 0, ty: 0}
    - {name: leg4, ax: a, ay: -a, az: a, bx: a, by: -a, bz: -a, tx: 180 deg, ty: 0}
    - {name: leg5, ax: -a, ay: a, az: -a, bx: a, by: a, bz: -a, tx: 0, ty: 90 deg}
    - {name: leg6, ax: a, ay: -a, az: a, bx: -a, by: -a, bz: a, tx: 0, ty: -90 deg}
  base: {at: [ax, ay, az], turn: [{x: tx}, {y: ty}]}
  chain:
    - {type: universal, name: base joint, axes: [x, y], role: passive}
    - {type: prismatic, name: actuator, axis: z, role: actuated, stiffness: k}
    - {type: spherical, name: platform joint, role: passive}
  platform: {at: [bx, by, bz - HEIGHT]}
"""

ARM_2R_OF_BEAMS = """
robostiff: 1
name: 2r-beams
source: a planar arm of two slender links with elastic joints
planar: true
parameters:
  {L1: 500 mm, L2: 400 mm, E: 210 GPa, A1: 1e-3 m^2, A2: 2e-3 m^2, I1: 1e-8 m^4, I2: 3e-8 m^4,
   k1: 2e5 N m/rad, k2: 1e5 N m/rad}
materials: {alloy: {E: E, poisson_ratio: 0.3}}
sections:
  first: {properties: {A: A1, Iy: I1, Iz: I1, J: 2*I1}}
  second: {properties: {A: A2, Iy: I2, Iz: I2, J: 2*I2}}
legs:
  - name: arm
    chain:
      - {type: revolute, name: shoulder, axis: z, role: actuated, stiffness: k1, home: 30 deg}
      - {type: beam, name: upper arm, to: [L1, 0, 0], y_axis: y, material: alloy, section: first}
      - {type: revolute, name: elbow, axis: z, role: actuated, stiffness: k2, home: 60 deg}
      - {type: beam, name: forearm, to: [L2, 0, 0], y_axis: y, material: alloy, section: second}
"""

"""A robot under load is the same robot in other units of length and force."""

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document

HEAD = """\
robostiff: 1
name: tilting head
source: a test
parameters: {size: 1, force: 1}
materials: {metal: {E: force*210 GPa, poisson_ratio: 0.3, density: 7850 kg/m^3}}
home: {at: [0, 0, size*500 mm]}
legs:
  - repeat: {count: 3, variable: i}
    let: {phi: i*120 deg}
    base: {at: [size*350 mm*cos(phi), size*350 mm*sin(phi), 0], turn: [{z: phi}]}
    chain:
      - {type: prismatic, axis: z, role: actuated, stiffness: force*size*1e8 N/m, home: size*100 mm}
      - type: beam
        to: [0, 0, size*50 mm]
        material: metal
        section: {tube: {outer_diameter: size*80 mm, inner_diameter: size*60 mm}}
      - {type: revolute, axis: y, role: passive, home: -0.38}
      - type: beam
        to: [0, 0, size*400 mm]
        material: metal
        section: {tube: {outer_diameter: size*60 mm, inner_diameter: size*40 mm}}
      - {type: spherical, role: passive, home: [0, 0.38, 0]}
    platform: {at: [size*200 mm*cos(phi), size*200 mm*sin(phi), 0], turn: [{z: phi}]}
"""
WRENCH = np.array([100.0, 40.0, -160.0, 6.0, 8.0, 4.0])


def head(s: float, f: float) -> Any:
    document = parse_document(HEAD, file="head.yaml")
    return model_from_document(document, {"size": str(s), "force": str(f)})


@pytest.mark.filterwarnings("ignore::robostiff.errors.PlausibilityWarning")
@pytest.mark.parametrize(("s", "f"), [(1e-4, 1e4), (1e-2, 1e-4), (30, 1), (1e3, 1e-4)])
def test_equilibria_and_modes(s, f):
    lengths, forces = np.repeat([s, 1.0], 3), f * np.repeat([s**2, s**3], 3)
    here = rs.equilibrium(head(1, 1), wrench=WRENCH)
    there = rs.equilibrium(head(s, f), wrench=forces * WRENCH)
    assert there.status is here.status is rs.Status.OK
    np.testing.assert_allclose(there.displacement / lengths, here.displacement, rtol=1e-7)
    assert there.margins == pytest.approx(here.margins, rel=1e-7)
    K = there.K / np.outer(forces, 1 / lengths)
    np.testing.assert_allclose(K, here.K, atol=1e-7 * np.max(here.K))
    here, there = rs.modes(head(1, 1)), rs.modes(head(s, f))
    frequencies = there.frequencies[:6] * s / np.sqrt(f)
    np.testing.assert_allclose(frequencies, here.frequencies[:6], rtol=1e-7)

"""Beams against the same bars meshed with solid elements, by CalculiX.

The bar is clamped over its foot and rigid at its tip, which holds its sections in shape there.
Both ends are so felt alike, whatever the length; what a length adds is that of the beam.
"""

from collections.abc import Sequence
from itertools import chain, product
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import beam_compliance
from tests.peers.test_calculix import twists_at

pytestmark = pytest.mark.needs("CalculiX")
WIDE, HIGH, E, NU = 0.06, 0.03, 210e9, 0.3
STEEL, SECTION = rs.Material("steel", E, E / (2 * (1 + NU))), rs.rectangle(WIDE, HIGH)
# Where the nodes of a brick of 20 nodes lie, in half sides: corners, then the middles of edges.
CORNERS = np.array([(0, 0), (2, 0), (2, 2), (0, 2)])
BRICK = [
    *((x, y, z) for z in (0, 2) for x, y in CORNERS),
    *((*(CORNERS[i] + CORNERS[(i + 1) % 4]) // 2, z) for z in (0, 2) for i in range(4)),
    *((x, y, 1) for x, y in CORNERS),
]


def solid_bar(L: float, bricks: tuple[int, int, int], size: Sequence[float], hollow: bool) -> str:
    """Input of a bar along x; nodes 1 and 2 are the place and the turning of its tip.

    A hollow one has a single brick through its walls.
    """
    halves = 2 * np.array(bricks)
    whole = [
        (i, j, k)
        for i, j, k in product(*map(range, bricks))
        if not hollow or j in (0, bricks[1] - 1) or k in (0, bricks[2] - 1)
    ]
    owners = [[tuple(2 * np.array(at) + corner) for corner in BRICK] for at in whole]
    tags = {place: 3 + i for i, place in enumerate(sorted(set(chain.from_iterable(owners))))}
    sides, start = np.array([L, *size]), np.array([0, -size[0] / 2, -size[1] / 2])
    lines = ["*NODE", f"1, {L}, 0, 0", f"2, {L}, 0, 0"]
    lines += [
        f"{tag}, " + ", ".join(f"{x:.12g}" for x in start + sides * place / halves)
        for place, tag in tags.items()
    ]
    lines.append("*ELEMENT, TYPE=C3D20R, ELSET=BAR")
    for number, places in enumerate(owners, start=1):
        own = [tags[place] for place in places]
        lines += [", ".join(map(str, [number, *own[:15]])) + ",", ", ".join(map(str, own[15:]))]
    for name, x in (("FOOT", 0), ("TIP", halves[0])):
        lines += [
            f"*NSET, NSET={name}",
            *(str(tag) for place, tag in tags.items() if place[0] == x),
        ]
    lines += ["*NSET, NSET=ENDS", "1, 2", "*MATERIAL, NAME=STEEL", "*ELASTIC", f"{E}, {NU}"]
    lines += ["*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL", "*BOUNDARY", "FOOT, 1, 3"]
    lines += ["*RIGID BODY, NSET=TIP, REF NODE=1, ROT NODE=2"]
    for load in product((1, 2), (1, 2, 3)):
        lines += ["*STEP", "*STATIC", "*CLOAD, OP=NEW", f"{load[0]}, {load[1]}, 1.0"]
        lines += ["*NODE PRINT, NSET=ENDS", "U", "*END STEP"]
    return "\n".join(lines) + "\n"


def compliance_of_solid(
    path: Path,
    L: float,
    bricks: tuple[int, int, int],
    size: Sequence[float] = (WIDE, HIGH),
    hollow: bool = False,
) -> np.ndarray:
    path.write_text(solid_bar(L, bricks, size, hollow))
    return twists_at(path).T


def test_what_a_length_adds_stretches_twists_and_bends_as_a_beam(tmp_path):
    short = compliance_of_solid(tmp_path / "short.inp", 0.3, (9, 4, 4))
    long = compliance_of_solid(tmp_path / "long.inp", 0.6, (18, 4, 4))
    along = [0, 3, 4, 5]  # x, rx, ry, rz: in proportion to the length
    added = np.diagonal(long - short)[along]
    expected = np.diagonal(beam_compliance(0.3, STEEL, SECTION))[along]
    assert np.allclose(added, expected, rtol=2e-3, atol=0)
    # A force across turns the tip by the same as a couple moves it, with the same signs.
    beam = beam_compliance(0.6, STEEL, SECTION)
    assert np.allclose(
        long[[1, 5, 2, 4], [5, 1, 4, 2]], beam[[1, 5, 2, 4], [5, 1, 4, 2]], rtol=0.01, atol=0
    )
    assert np.allclose(long, long.T, rtol=0, atol=1e-5 * np.abs(long).max())


@pytest.mark.parametrize("slenderness", [2.5, 10])
def test_a_stubby_bar_needs_shear(tmp_path, slenderness):
    """The long side of the section across which it is bent; the ends take off the same of both."""
    L = slenderness * WIDE
    bricks = (max(6, int(2 * slenderness)), 4, 2)
    solid = compliance_of_solid(tmp_path / "bar.inp", L, bricks)
    # About the middle between force and couple: L^3/(12 E I) + L/(ky G A).
    found = solid[1, 1] - solid[1, 5] ** 2 / solid[5, 5]
    sheared, plain = (
        C[1, 1] - C[1, 5] ** 2 / C[5, 5]
        for C in (
            beam_compliance(L, STEEL, SECTION, theory)
            for theory in (rs.Timoshenko(), rs.EulerBernoulli())
        )
    )
    assert np.isclose(found, sheared, rtol=0.04, atol=0)
    assert found / plain - 1 > 0.5 * (sheared / plain - 1)


def test_what_a_length_of_a_box_with_thick_walls_adds(tmp_path):
    """A square box whose wall is a tenth of its side."""
    side, section = 0.05, rs.box(0.05, 0.05, 0.005)
    short = compliance_of_solid(tmp_path / "short.inp", 0.15, (9, 10, 10), (side, side), True)
    long = compliance_of_solid(tmp_path / "long.inp", 0.25, (15, 10, 10), (side, side), True)
    along = [0, 3, 4, 5]
    added = np.diagonal(long - short)[along]
    expected = np.diagonal(beam_compliance(0.1, STEEL, section))[along]
    ratio = expected / added
    assert np.allclose(ratio, 1, rtol=5e-3), ratio

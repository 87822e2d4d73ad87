"""How long networks take: lattices of beams, and trusses of rods between balls.

python benchmarks/network.py
"""

from __future__ import annotations

import time

import numpy as np

from robostiff.elasticity import circle, material
from robostiff.model import Passive, PlacedFreedom
from robostiff.network import JointElement, Network, Node, beam_between, condense

STEEL, BAR = material("steel"), circle(0.02)


def lattice(cells: int, *, hinged: bool) -> Network:
    """A cube of rods along the edges of cubes; each starts at a ball where hinged."""
    sites = [tuple(site) for site in np.ndindex(cells + 1, cells + 1, cells + 1)]
    at = {site: Node(str(site), 0.3 * np.array(site)) for site in sites}
    nodes, beams, joints = list(at.values()), [], []
    for site, start in at.items():
        for i in range(3):
            neighbour = tuple(np.array(site) + np.eye(3, dtype=int)[i])
            if neighbour not in at:
                continue
            name = f"{start.name} {i}"
            foot = start
            if hinged:
                foot = Node(name, start.point)
                nodes.append(foot)
                ball = tuple(
                    PlacedFreedom(axis, start.point, 0.0, "ball", Passive()) for axis in np.eye(3)
                )
                joints.append(JointElement(name, start.name, name, ball))
            beams.append(beam_between(foot, at[neighbour], STEEL, BAR, name=name))
    fixed = tuple(node.name for site, node in at.items() if site[2] == 0)
    tip = at[cells, cells, cells]
    return Network(
        "cube", tuple(nodes), fixed, tip.name, tip.point, tuple(beams), joints=tuple(joints)
    )


def main() -> None:
    """Print a table."""
    print(f"{'network':<10}{'beams':>7}{'joints':>8}{'s':>8}  status")
    for hinged, sizes in ((False, (3, 9, 14)), (True, (1, 3, 8))):
        for cells in sizes:
            network = lattice(cells, hinged=hinged)
            start = time.perf_counter()
            result = condense(network).whole
            seconds = time.perf_counter() - start
            kind = "hinged" if hinged else "welded"
            counts = f"{len(network.beams):>7}{len(network.joints):>8}"
            print(f"{kind:<10}{counts}{seconds:>8.2f}  {result.status}")


if __name__ == "__main__":
    main()

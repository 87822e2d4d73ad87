"""How long networks take: boxes of beams, and trusses of rods between balls.

python benchmarks/network.py
"""

from __future__ import annotations

import time

import numpy as np
from timed_rows import largest_memory

from robostiff.elasticity import circle, material
from robostiff.model import Passive, PlacedFreedom
from robostiff.network import JointElement, Network, Node, beam_between, condense

STEEL, BAR = material("steel"), circle(0.02)


def lattice(cells: tuple[int, int, int], *, hinged: bool) -> Network:
    """A box of rods along the edges of cubes; each starts at a ball where hinged."""
    nx, ny, nz = cells
    sites = [tuple(reversed(site)) for site in np.ndindex(nz + 1, ny + 1, nx + 1)]
    at = {site: Node("{} {} {}".format(*site), 0.3 * np.array(site)) for site in sites}
    nodes, beams, joints = list(at.values()), [], []
    for (x, y, z), start in at.items():
        for i, neighbour in enumerate(((x + 1, y, z), (x, y + 1, z), (x, y, z + 1))):
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
    tip = at[cells]
    return Network(
        "box", tuple(nodes), fixed, tip.name, tip.point, tuple(beams), joints=tuple(joints)
    )


# A slab and a tower grow along one or two sides, a cube along all three: its factors fill in more.
BOXES = {
    "cube": ((8, 8, 8), (15, 15, 13)),
    "slab": ((13, 13, 1), (44, 44, 1), (140, 140, 1)),
    "tower": ((7, 7, 5), (7, 7, 56), (7, 7, 560)),
    "hinged": ((1, 1, 1), (3, 3, 3), (8, 8, 8)),
}


def main() -> None:
    """Print a table: seconds of the processor, and the exponent of growth."""
    print(f"{'network':<8}{'beams':>7}{'build':>8}{'K':>8}{'MB':>7}{'exponent':>10}  status")
    for kind, sizes in BOXES.items():
        before = None
        for cells in sizes:
            start = time.process_time()
            network = lattice(cells, hinged=kind == "hinged")
            built = time.process_time()
            result = condense(network)
            end = time.process_time()
            now = len(network.beams), end - start
            growth = before and np.log(now[1] / before[1]) / np.log(now[0] / before[0])
            largest = largest_memory()
            print(
                f"{kind:<8}{now[0]:>7}{built - start:>8.2f}{end - built:>8.2f}{largest:>7.0f}"
                f"{(growth and round(growth, 2)) or '':>10}  {result.status}"
            )
            before = now


if __name__ == "__main__":
    main()

"""Natural frequencies of a frame of beams with masses at its corners, by OpenSees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tests.peers.opensees import opensees


def frequencies(
    points: Mapping[str, Sequence[float]],
    fixed: Sequence[str],
    beams: Sequence[tuple[str, str]],
    masses: Mapping[str, float],
    section: tuple[float, float, float, float, float, float],
    count: int,
) -> np.ndarray:
    """The lowest of them [Hz]; a section is A, E, G, J, Iy, Iz."""
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    tags = {name: i for i, name in enumerate(points, start=1)}
    for name, tag in tags.items():
        ops.node(tag, *map(float, points[name]))
    for name in fixed:
        ops.fix(tags[name], 1, 1, 1, 1, 1, 1)
    for name, m in masses.items():
        ops.mass(tags[name], m, m, m, 0.0, 0.0, 0.0)
    for i, (a, b) in enumerate(beams, start=1):
        along = np.subtract(points[b], points[a])
        ops.geomTransf("Linear", i, *np.eye(3)[np.argmin(np.abs(along))].tolist())
        ops.element("elasticBeamColumn", i, tags[a], tags[b], *section, i)
    squares = ops.eigen("-fullGenLapack", count)
    return np.sqrt(np.array(squares)) / (2 * np.pi)

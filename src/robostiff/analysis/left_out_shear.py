"""How much softer a machine would be with the shear that beams of no chosen theory leave out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import is_dataclass
from typing import Any

import numpy as np

from robostiff.elasticity import (
    BeamSegment,
    Elasticity,
    Timoshenko,
    beam_compliance,
    shear_compliance,
)
from robostiff.errors import RobostiffError
from robostiff.frozen import replace
from robostiff.model import Telescope
from robostiff.model.batched import names_of
from robostiff.model.entries import with_entries

# Of the bending of a beam by a force: shear that can be a tenth where both ends are clamped.
_STUBBY = 0.025


def softer_by_shear(machine: Any) -> float:
    """Largest relative compliance that shear left out of beams would add at home.

    ``max over F of F^T (C' - C) F / F^T C F``, C' with shear in these beams. Zero where no beam is
    stubby, and where the machine of numbers has no stiffness at home.
    """
    sheared: dict[int, Any] = {}
    for part in _parts(machine, set()):
        if isinstance(part, Elasticity):
            C, shear = part.compliance, part.shear_left_out
            if shear is not None and _is_stubby(C, shear):
                more = C + np.diag([0.0, *shear, 0.0, 0.0, 0.0])
                sheared[id(part)] = replace(part, compliance=more, beam=None)
        elif isinstance(part, Telescope):
            for beam in part.beams:
                length = beam.fixed + beam.share * part.home
                shear = shear_compliance([BeamSegment(length, beam.material, beam.section)])
                is_known = beam.theory is None and shear is not None and length > 0
                if is_known and _is_stubby(
                    beam_compliance(length, beam.material, beam.section), shear
                ):
                    sheared[id(beam)] = replace(beam, theory=Timoshenko())
    if not sheared:
        return 0.0
    from scipy import linalg

    from robostiff.analysis.posed_stiffness import stiffness

    try:
        before, after = (
            stiffness(m) for m in (machine, with_entries(machine, lambda x: x, sheared))
        )
        K, K_sheared, rank = before.K, after.K, int(before.rank)
    except RobostiffError:
        return 0.0
    if rank == 0 or rank != after.rank:
        return 0.0
    carried = linalg.eigh(K)[1][:, -rank:] if rank < len(K) else np.eye(len(K))
    ratios = linalg.eigh(
        carried.T @ K_sheared @ carried, carried.T @ K @ carried, eigvals_only=True
    )
    return float(1.0 / ratios[0] - 1.0)


def _is_stubby(C: np.ndarray, shear: Any) -> bool:
    return bool(np.any(shear > _STUBBY * np.diagonal(C)[1:3]))


def _parts(part: Any, seen: set[int]) -> Iterator[Any]:
    if isinstance(part, tuple):
        for member in part:
            yield from _parts(member, seen)
    elif is_dataclass(part) and id(part) not in seen:
        seen.add(id(part))
        yield part
        for name in names_of(type(part)):
            yield from _parts(getattr(part, name), seen)

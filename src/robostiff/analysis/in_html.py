"""Results in HTML, as notebooks show them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robostiff.analysis.result_tables import (
    displacement_table,
    energy_table,
    free_motion_table,
    stiffness_matrix,
)
from robostiff.elastostatics import Status
from robostiff.markup import Block, Bullets, Words, block_html, element, escaped, row

if TYPE_CHECKING:
    from robostiff.analysis.deflection_under_load import Deflection
    from robostiff.analysis.result import RobotStiffness

_MOST_PARTS = 10


def stiffness_html(result: RobotStiffness) -> str:
    """K with labels and units, rank, free motions and advice; of a batch, how many have K."""
    if result.batch_shape:
        return element("p", escaped(repr(result)))
    blocks: list[Block | None] = []
    if np.all(result.answered):
        blocks.append(stiffness_matrix(result))
    if Status.UNREACHABLE not in result.status:
        blocks.append(Words(f"rank {int(result.rank)} of {result.space.size}"))
        blocks.append(free_motion_table(result))
    blocks.append(Bullets(tuple(result.advice)))
    return element("div", _head(result, result.status) + _written(blocks))


def deflection_html(result: Deflection) -> str:
    """Displacement under the load, and the parts that bend most."""
    blocks: list[Block | None] = []
    if result.has_answer:
        blocks.append(displacement_table(result))
        if result.energy > 0:
            blocks.append(energy_table(result, _MOST_PARTS))
    blocks.append(Bullets(tuple(result.advice)))
    return element("div", _head(result.stiffness, result.status) + _written(blocks))


def _written(blocks: list[Block | None]) -> str:
    return "".join(block_html(block) for block in blocks if block is not None)


def _head(result: RobotStiffness, status: Status) -> str:
    """Name, where it holds, and status."""
    place = f"about ({row(result.reference_point)}) m, world axes"
    if result.pose is not None:
        place = f"pose [{row(result.pose)}] (m, rad) {place}"
    name = element("b", escaped(result.name))
    return element("p", f"{name}, {escaped(place)}; status {element('b', escaped(status))}")

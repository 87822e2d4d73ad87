"""Wrenches that circulate in loops of chains, as ways to hold a platform, on recorded entries.

The platform is loaded against the base, which closes one more loop. Wrenches in equilibrium
circulate: every chain outside of a spanning tree has wrenches of its own, as the leg of a robot
has, and chains of the tree carry sums of these, which their passive joints restrict. K follows from
the energy of the other wrenches. So do legs on a flexible platform, whose parts are chains, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.frozen import frozen
from robostiff.kinematics.formula import FormulaPose, PlacedFormula
from robostiff.kinematics.spanning_tree import spanning_tree
from robostiff.model import FlexiblePlatform, PlacedLeg, PlacedSpring, Robot
from robostiff.record import Entry
from robostiff.recorded.elimination import (
    Carried,
    Column,
    LocalLeg,
    WorkingFrame,
    add_energy_in_shares,
    carried_by,
    dot,
    ends_of,
    energy_of,
    from_world,
    local_leg,
    made_conjugate,
    to_world,
    transmitted_by,
    wrench_size,
)
from robostiff.recorded.leg import LegRecorder, RecordedLeg

_LOAD = "the load of the platform"  # closes one more loop, as a chain of base and platform


@frozen
class BodyChain:
    """A chain of joints and springs from one body to another."""

    name: str
    a: str
    b: str
    parts: PlacedLeg | LocalLeg  # placed in the world, or in the frame of the tree


@frozen
class _Flow:
    """Wrenches of a chain, about the reference point in world axes, and their energy."""

    wrenches: list[Column]
    in_frame: list[Column]  # the same in the frame of the tree
    carried: Carried


def circulating(
    name: str,
    chains: Sequence[BodyChain],
    base: str,
    platform: str,
    recorder: LegRecorder,
    frame: WorkingFrame,
) -> RecordedLeg:
    """All ways to hold the platform, as those of one leg from base to platform.

    Parameters
    ----------
    name : str
        Of the whole.
    chains : sequence of BodyChain
        Those that come first become the tree: chains with few passive joints, without blocks.
    base, platform : str
        Bodies.
    recorder : LegRecorder
    frame : WorkingFrame
        In which the energy of the tree is written down.

    Raises
    ------
    InputError
        When a transmitted wrench meets no compliance.
    """
    # A load leads from the base to the platform, along the first edge of the tree.
    load = BodyChain(_LOAD, base, platform, LocalLeg([], [], []))
    tree = spanning_tree(base, (load, *chains))
    flows = [_flow(cut, recorder, frame) for cut in tree.cuts]
    signs = [{c.name: sign for c, sign in tree.around(cut)[1:]} for cut in tree.cuts]
    count = sum(len(flow.wrenches) for flow in flows)
    rows, record, length = recorder.space.rows, recorder.record, recorder.length
    n = len(rows)
    scale = [1.0 if row < 3 else length for row in rows]
    columns: list[Column] = []
    for flow, sign in zip(flows, signs, strict=True):
        for w in flow.wrenches:
            # What the loop carries over the load's edge is the opposite of the load.
            end = [x * int(-sign[_LOAD]) for x in w] if _LOAD in sign else [0] * n
            columns.append([*end, *(int(len(columns) == i) for i in range(count))])
    inner = {
        chain.name: chain.parts
        if isinstance(chain.parts, LocalLeg)
        else local_leg(chain.parts, frame, record, length)
        for chain in chains
        if chain not in tree.cuts
    }
    over = {
        name: [
            [x * int(sign[name]) for x in w] if name in sign else [0] * n
            for flow, sign in zip(flows, signs, strict=True)
            for w in flow.in_frame
        ]
        for name in inner
    }
    conditions = [
        [*[0] * n, *(dot([twist[row] for row in rows], w) for w in over[name])]
        for name, local in inner.items()
        for twist in local.twists
    ]
    scale += [1.0 / wrench_size(w, scale) for flow in flows for w in flow.wrenches]
    found = transmitted_by(conditions, columns, scale)
    shares = [way[n:] for way in found.wrenches]
    energy: list[list[Any]] = [[0] * len(shares) for _ in shares]
    add_energy_in_shares(energy, shares, [flow.carried for flow in flows])
    for chain, local in inner.items():
        sums = [[dot(share, row) for row in zip(*over[chain], strict=True)] for share in shares]
        each = zip(energy, energy_of(local, sums, rows), strict=True)
        energy = [[x + y for x, y in zip(*pair, strict=True)] for pair in each]
    ways = ends_of(found.wrenches, n, scale)  # what they hold the platform by
    conjugate = made_conjugate(ways, energy, name)
    return RecordedLeg(
        name=name,
        wrenches=conjugate.wrenches,
        mu=conjugate.mu,
        losses=[
            *(loss for flow in flows for loss in flow.carried.losses),
            *found.losses,
            *conjugate.losses,
            *recorder.near_rigid(conjugate.mu),
        ],
        redundant=(*(r for flow in flows for r in flow.carried.redundant), *found.redundant),
        alone=(*(x for flow in flows for x in flow.carried.alone), *found.alone),
        frame=0,
        basis=ways,
        energy=energy,
    )


def _flow(chain: BodyChain, recorder: LegRecorder, frame: WorkingFrame) -> _Flow:
    """A chain that closes a loop, its wrenches in the frame in which these are shortest."""
    tried: list[tuple[Any, ...]] = []
    rows, about = recorder.space.rows, recorder.reference
    if isinstance(chain.parts, LocalLeg):
        carried = carried_by(chain.parts, rows, recorder.length)
        wrenches = [to_world(w, frame, about, rows) for w in carried.wrenches]
        return _Flow(wrenches, carried.wrenches, carried)
    for _, working, local in recorder.promising(chain.parts):
        carried = carried_by(local, rows, recorder.length)
        wrenches = [to_world(w, working, about, rows) for w in carried.wrenches]
        entries = [x for row in (*wrenches, *carried.energy) for x in row]
        cost = recorder.record.cost(x.step for x in entries if isinstance(x, Entry))
        tried.append((cost, len(tried), wrenches, carried))
    _, _, wrenches, carried = min(tried)
    return _Flow(wrenches, [from_world(w, frame, about, rows) for w in wrenches], carried)


_BASE = "base"


def legs_on_platform(
    robot: Robot,
    platform: FlexiblePlatform,
    recorder: LegRecorder,
    pose: FormulaPose,
    placed: Sequence[PlacedFormula],
) -> RecordedLeg:
    """All ways to hold the tool, as those of one leg, K = H (diag(c) + p)^-1 H^T.

    Every leg has its wrenches, and each part of the platform carries the sum of those that come in
    beyond it; parts that close loops have wrenches of their own. The energy of the parts is written
    down in platform axes, in which they are the same at all poses.

    Raises InputError when a transmitted wrench meets no compliance.
    """
    origin = WorkingFrame(np.eye(3, dtype=int).astype(object), np.zeros(3, dtype=int))
    parts = []
    for part in platform.parts:  # about the origin of the platform
        spring = PlacedSpring(part.name, part.point, part.axes, part.elasticity)
        leg = PlacedLeg(part.name, (spring,), part.point)
        local = local_leg(leg, origin, recorder.record, recorder.length)
        parts.append(BodyChain(f"part {part.name}", _node(part.a), _node(part.b), local))
    legs = (
        BodyChain(f"leg {leg.name}", _BASE, _node(name), formula.leg)
        for leg, name, formula in zip(robot.legs, robot.holds, placed, strict=True)
    )
    frame = WorkingFrame(pose.R, pose.p)
    tool = _node(platform.tool)
    return circulating(robot.name, (*parts, *legs), _BASE, tool, recorder, frame)


def _node(name: str) -> str:
    return f"node {name}"

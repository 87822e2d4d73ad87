"""What is said of each leg of a derivation beside its formulas."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import sympy as sp

from robostiff.analytic.exact.definition import Definition, used_definitions
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry
from robostiff.recorded import RecordedLeg, RecordedRobot


def passive_freedoms(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the passive freedoms of a leg, those of its springs and blocks included.

    Blocks after the first add one for what they leave free together with it.
    """
    names = []
    for element in leg.own_parts:
        if isinstance(element, PlacedFreedom):
            if element.is_passive:
                names.append(element.name)
        else:
            count = element.elasticity.freedoms.shape[1]
            names += [f"{element.name}.free[{i}]" for i in range(count)]
    for block in leg.blocks:
        for branch in block.branches:
            names += passive_freedoms(branch)
    return (*names, *(f"{block.name}.free" for block in leg.blocks[1:]))


def elastic_parts(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the springs and of the drives with a stiffness."""
    return tuple(
        part.name
        for part in leg.parts
        if isinstance(part, PlacedSpring) or part.stiffness is not None
    )


def shared_out(
    definitions: Sequence[Definition], parts: Sequence[Iterable[sp.Expr]]
) -> list[tuple[Definition, ...]]:
    """For each part the definitions that it is the first to need, in order.

    Examples
    --------
    >>> a, b, c = sp.symbols("a b c")
    >>> definitions = (Definition(b, a + 1), Definition(c, b**2))
    >>> [[str(d.symbol) for d in own] for own in shared_out(definitions, [[b], [c], [a]])]
    [['b'], ['c'], []]
    """
    shared: list[tuple[Definition, ...]] = []
    for results in parts:
        before = {d.symbol for own in shared for d in own}
        own = used_definitions(definitions, results)
        shared.append(tuple(d for d in own if d.symbol not in before))
    return shared


def give_names(leg: RecordedLeg, number: int) -> None:
    """Names for wrenches w and compliances c."""
    several = len(leg.wrenches) > 1
    for k, (w, mu) in enumerate(zip(leg.wrenches, leg.mu, strict=True), start=1):
        own = f"{number}_{k}" if several else f"{number}"
        if isinstance(mu, Entry):
            mu.named(f"c_{own}")
        for i, x in enumerate(w, start=1):
            if isinstance(x, Entry):
                x.named(f"w_{own}_{i}")


def facts_of(placed: PlacedLeg, redundant: Sequence[bool]) -> dict[str, Any]:
    """Names of a leg, its passive freedoms, which of them are redundant, and its elastic parts."""
    return _facts(placed.name, passive_freedoms(placed), redundant, elastic_parts(placed))


def facts_of_robot(placed: PlacedRobot, recorded: RecordedRobot) -> list[dict[str, Any]]:
    """Facts of each leg; of legs on a flexible platform together with its parts."""
    legs = [own.leg for own in placed.legs]
    if placed.robot.platform is None:
        return [facts_of(leg, own.redundant) for leg, own in zip(legs, recorded.legs, strict=True)]
    (whole,) = recorded.legs
    joints = tuple(f"{leg.name}/{joint}" for leg in legs for joint in passive_freedoms(leg))
    parts = [f"platform/{part.name}" for part in placed.robot.platform.parts]
    elastic = (f"{leg.name}/{part}" for leg in legs for part in elastic_parts(leg))
    name = "all legs, on the flexible platform"
    return [_facts(name, joints, whole.redundant, (*elastic, *parts))]


def _facts(
    name: str, joints: tuple[str, ...], redundant: Sequence[bool], elastic: tuple[str, ...]
) -> dict[str, Any]:
    lost = tuple(joint for joint, own in zip(joints, redundant, strict=True) if own)
    return {"name": name, "joints": joints, "redundant": lost, "elastic": elastic}

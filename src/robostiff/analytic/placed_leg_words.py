"""What a placed leg consists of, in names."""

from __future__ import annotations

from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring


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

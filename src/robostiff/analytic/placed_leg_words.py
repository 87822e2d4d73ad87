"""What a placed leg consists of, in names."""

from __future__ import annotations

from robostiff.model import PlacedFreedom, PlacedLeg


def passive_freedoms(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the passive freedoms of a leg, those of its springs included."""
    names = []
    for element in leg.elements:
        if isinstance(element, PlacedFreedom):
            if element.is_passive:
                names.append(element.name)
        else:
            count = element.elasticity.freedoms.shape[1]
            names += [f"{element.name}.free[{i}]" for i in range(count)]
    return tuple(names)


def elastic_parts(leg: PlacedLeg) -> tuple[str, ...]:
    """Names of the springs and of the drives with a stiffness."""
    return tuple(
        element.name
        for element in leg.elements
        if not isinstance(element, PlacedFreedom) or element.stiffness is not None
    )

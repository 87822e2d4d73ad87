"""From written legs, repeated ones too, to legs of the model."""

from __future__ import annotations

from robostiff.io.model_file.build_chain import build_chain
from robostiff.io.model_file.build_copies import named_copies
from robostiff.io.model_file.build_platform import build_attachment
from robostiff.io.model_file.geometry import transform
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.stock import Stock
from robostiff.io.model_file.written_robot import WrittenLeg, WrittenLegBody, WrittenPattern
from robostiff.io.suggest import Words
from robostiff.model import Elbow, Leg

MOST_LEGS = 200


def build_legs(
    place: Place, written: list[WrittenLeg | WrittenPattern] | WrittenPattern, stock: Stock
) -> list[tuple[Place, Leg]]:
    """The legs that are written at a place, each with its own place."""
    if isinstance(written, WrittenPattern):
        parts = [(place, written)]
    else:
        parts = [(place / i, part) for i, part in enumerate(written)]
    built: dict[str, tuple[Place, Leg]] = {}
    for where, part in parts:
        for name, named_at, here in named_copies(where, part):
            if name in built:
                raise named_at.error("name of a leg", got=name, expected="each name once")
            if len(built) == MOST_LEGS:
                raise here.error(
                    "legs", got=Words(f"more than {MOST_LEGS}"), expected=f"at most {MOST_LEGS}"
                )
            built[name] = here, build_leg(here, part, name, stock)
    return list(built.values())


def build_leg(place: Place, written: WrittenLegBody, name: str, stock: Stock) -> Leg:
    """The leg that is written at a place."""
    chain = build_chain(place / "chain", written.chain, stock)
    base = transform(place / "base", written.base)
    attachment, node = build_attachment(place / "platform", written.platform)
    with (place / "chain").complaints():
        return Leg(name, base, chain, attachment, Elbow(written.elbow), node)

"""Springs between bodies and the legs that they hold together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np

from robostiff.errors import InputError
from robostiff.model import PlacedBodySpring, Snapshot
from robostiff.model.body_spring import BASE, PLATFORM
from robostiff.statics.chains.body_springs import Anchor, FiniteBodySpring
from robostiff.statics.chains.legs import LegGroup


def joined_legs(groups: Iterable[set[int]]) -> list[list[int]]:
    """Groups of legs, those that have legs in common as one; by their first legs."""
    found: list[set[int]] = []
    for own in groups:
        common = [other for other in found if other & own]
        found = [*(other for other in found if other not in common), own.union(*common)]
    return sorted(map(sorted, found))


@dataclass(frozen=True)
class HeldSprings:
    """The springs between bodies of a snapshot."""

    springs: tuple[PlacedBodySpring, ...]
    places: Mapping[str, tuple[int, int]]  # leg and chain of every ``leg/part``
    # legs that springs hold together; a spring between base and platform is with the first leg
    groups: tuple[tuple[int, ...], ...]

    @staticmethod
    def of(snapshot: Snapshot, places: Mapping[str, tuple[int, int]]) -> HeldSprings:
        """The springs of a snapshot at one pose.

        Raises
        ------
        InputError
            When a spring names no body.
        """
        # a flexible platform holds all legs together
        groups = [] if snapshot.platform is None else [set(range(len(snapshot.legs)))]
        for spring in snapshot.springs:
            legs = set()
            for name in spring.bodies:
                if name in places:
                    legs.add(places[name][0])
                elif name not in (BASE, PLATFORM):
                    near = get_close_matches(str(name), places, n=3) or list(places)[:3]
                    raise InputError(
                        f"body of spring {spring.name!r}",
                        got=name,
                        expected=f"{BASE}, {PLATFORM} or leg/part, such as "
                        + ", ".join(map(repr, near)),
                    )
            groups.append(legs or {0})
        return HeldSprings(snapshot.springs, places, tuple(map(tuple, joined_legs(groups))))

    def on_chain(self, leg: int, chain: int) -> list[tuple[str, np.ndarray]]:
        """Bodies behind parts of a chain that hold springs, and where (3,), end by end."""
        return [
            (name, np.asarray(point, dtype=float))
            for spring in self.springs
            for name, point in zip(spring.bodies, spring.points, strict=True)
            if self.places.get(name) == (leg, chain)
        ]

    def group_of(self, leg: int) -> int:
        """Which legs a leg is with: those of a group, -1 where it has no springs."""
        return next((i for i, group in enumerate(self.groups) if leg in group), -1)

    def joined(self, groups: Sequence[LegGroup]) -> tuple[LegGroup, ...]:
        """The legs, those that springs hold together in one group of them all."""
        found, held = [], {}
        for group in groups:
            i = self.group_of(group.indices[0])
            if i < 0:
                found.append(group)
            else:
                held.setdefault(i, []).append(group)
        return (*found, *(self._joined(i, legs) for i, legs in held.items()))

    def _joined(self, number: int, groups: Sequence[LegGroup]) -> LegGroup:
        legs = sorted(groups, key=lambda group: group.indices)
        first = legs[0]
        chains, points, owners, couplings = [], [], [], []
        offsets: dict[int, int] = {}
        for i, leg in enumerate(legs):
            shift, offsets[leg.indices[0]] = len(points), len(chains)
            couplings += [own.shifted(len(chains)) for own in leg.couplings]
            chains += [
                replace(
                    chain,
                    start=None if chain.start is None else chain.start + shift,
                    end=None if chain.end is None else chain.end + shift,
                )
                for chain in leg.chains
            ]
            points += leg.points
            owners += [i] * len(leg.chains)
        return replace(
            first,
            indices=tuple(leg.indices[0] for leg in legs),
            names=tuple(leg.names[0] for leg in legs),
            chains=tuple(chains),
            points=tuple(points),
            owners=tuple(owners) if len(legs) > 1 else (),
            springs=self._finite(number, offsets),
            couplings=tuple(couplings),
        )

    def _finite(self, number: int, offsets: Mapping[int, int]) -> tuple[FiniteBodySpring, ...]:
        """The springs of one group, whose chains begin at an offset for each leg."""
        counts: dict[int, int] = {}
        found = []
        for spring in self.springs:
            legs = {self.places[name][0] for name in spring.bodies if name in self.places}
            if self.group_of(min(legs or {0})) != number:
                continue
            ends = []
            for name, at in zip(spring.bodies, spring.points, strict=True):
                point = np.asarray(at, dtype=float)
                if name not in self.places:
                    ends.append(Anchor(point, on_platform=name == PLATFORM))
                    continue
                leg, own = self.places[name]
                chain = offsets[leg] + own
                ends.append(Anchor(point, chain, counts.get(chain, 0)))
                counts[chain] = counts.get(chain, 0) + 1
            length = float(np.linalg.norm(ends[1].point - ends[0].point))
            tension = spring.tension + spring.stiffness * (length - spring.length)
            found.append(
                FiniteBodySpring(spring.name, (ends[0], ends[1]), spring.stiffness, length, tension)
            )
        return tuple(found)

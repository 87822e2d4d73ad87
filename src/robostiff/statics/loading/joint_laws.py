"""Force laws of joints: which follow one, given or as the robot has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches

from robostiff.errors import InputError
from robostiff.model import ForceLaw, Snapshot
from robostiff.statics.chains.element import FiniteJoint
from robostiff.statics.chains.legs import LegGroup

Laws = Mapping[str, ForceLaw]
# Of the stiffness of a drive: how far that of its law without motion may be off.
_ALIKE = 1e-6


def check_own_laws(laws: Laws, snapshot: Snapshot) -> None:
    """Raise unless the laws of a robot go with the stiffness of its joints.

    Raises
    ------
    InputError
        When a name is no joint, or a law has another stiffness without motion than its drive.
    """
    joints = {f"{leg.name}/{own.name}": own for leg in snapshot.legs for own in leg.freedoms}
    for name, law in laws.items():
        joint = joints.get(name)
        if joint is None:
            raise _unknown(name, list(joints))
        k = 0.0 if joint.stiffness is None else float(joint.stiffness)
        own = law.tangent(0.0)
        if abs(own - k) > _ALIKE * max(abs(own), abs(k)):
            raise InputError(
                f"law of {name!r}",
                got=f"a slope of {own:.8g} without motion",
                expected="the stiffness of its drive, " + (f"{k:.8g}" if k else "which is rigid"),
                hint=f"small loads meet that of the drive: write stiffness: {own:.8g} there",
            )


def with_laws(groups: tuple[LegGroup, ...], laws: Laws) -> tuple[LegGroup, ...]:
    """Legs whose joints follow laws of their own, by ``leg/joint``.

    Raises
    ------
    InputError
        When a name is no passive joint or elastic drive.
    """
    left, found, known = dict(laws), [], []
    for group in groups:
        chains, couplings = [], []
        for coupling in group.couplings:
            legs = [leg for _, _, leg in group.rows_of(coupling.place[0])]
            names = [f"{leg}/{e}" for leg, e in zip(legs, coupling.drive.names, strict=True)]
            if not coupling.is_rigid:
                known += names
                drive = coupling.drive.under([left.pop(name, None) for name in names])
                couplings.append(replace(coupling, drive=drive))
            else:
                couplings.append(coupling)
        for c, chain in enumerate(group.chains):
            legs = [leg for _, _, leg in group.rows_of(c)]
            elements = []
            for element in chain.elements:
                own = element
                if isinstance(own, FiniteJoint):
                    names = [f"{leg}/{e}" for leg, e in zip(legs, own.names, strict=True)]
                    known += names
                    own = own.under([left.pop(name, None) for name in names])
                elements.append(own)
            chains.append(replace(chain, elements=tuple(elements)))
        found.append(replace(group, chains=tuple(chains), couplings=tuple(couplings)))
    for name in left:
        raise _unknown(name, known)
    return tuple(found)


def _unknown(name: str, known: list[str]) -> InputError:
    near = get_close_matches(str(name), known, n=3) or known[:3]
    return InputError("laws", got=name, expected=f"leg/joint, such as {', '.join(map(repr, near))}")

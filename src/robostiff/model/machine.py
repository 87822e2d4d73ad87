"""What a machine of any kind says of itself."""

from __future__ import annotations

from typing import ClassVar, Self


class Machine:
    """A robot, a linkage, a cable robot, a snapshot or a network."""

    #: In words.
    kind: ClassVar[str]
    #: Whether it stands still, at the pose that it was made at.
    is_frozen: ClassVar[bool] = False

    @property
    def numeric(self) -> Self:
        """The same with all symbols at their nominal values."""
        return self


class FrozenMachine(Machine):
    """A machine at one pose, or at some, that was written down or placed there."""

    is_frozen: ClassVar[bool] = True
    #: A model file names where its values come from; these name that in their description.
    source: ClassVar[str] = ""
    description: str

    @property
    def title(self) -> str:
        """What it is."""
        return self.description

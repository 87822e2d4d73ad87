"""How large a document may be. Files come from strangers: everything is bounded."""

from __future__ import annotations

from dataclasses import dataclass

from robostiff.errors import FileError, Location
from robostiff.io.suggest import Words


@dataclass(frozen=True)
class Limits:
    """Bounds on a document.

    Parameters
    ----------
    size : int
        Of the file [bytes].
    depth : int
        Of lists and mappings inside each other.
    nodes : int
        Values in all.
    """

    size: int = 4_000_000
    depth: int = 64
    nodes: int = 200_000

    def too_large(self, file: str, size: int | None = None) -> FileError:
        """The complaint about the size of a file."""
        came = f"{size} bytes" if size is not None else f"more than {self.size} bytes"
        return FileError(
            Location(file), "file too large", got=Words(came), expected=f"at most {self.size} bytes"
        )

    def too_deep(self, place: Location) -> FileError:
        """The complaint about nesting."""
        return FileError(
            place,
            "nesting too deep",
            got=Words(f"more than {self.depth} levels"),
            expected=f"at most {self.depth}",
        )

    def too_many(self, place: Location) -> FileError:
        """The complaint about the number of values."""
        return FileError(
            place,
            "too many values",
            got=Words(f"more than {self.nodes}"),
            expected=f"at most {self.nodes}",
        )

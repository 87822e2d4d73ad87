"""Limits on the size of a document, because files may come from unknown sources."""

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
    keys : int
        Of one mapping.
    yaml_size, yaml_marks : int
        Size of a YAML text [bytes], and line ends and commas in it: YAML takes a hundred
        times as long to read as JSON.
    """

    size: int = 4_000_000
    depth: int = 64
    nodes: int = 200_000
    keys: int = 10_000
    yaml_size: int = 1_000_000
    yaml_marks: int = 20_000

    def too_large(self, file: str, size: int | None = None) -> FileError:
        """The error for a file that is too large."""
        came = f"{size} bytes" if size is not None else f"more than {self.size} bytes"
        return FileError(
            Location(file), "file too large", got=Words(came), expected=f"at most {self.size} bytes"
        )

    def too_deep(self, place: Location) -> FileError:
        """The error for too deep nesting."""
        return _over(place, "nesting too deep", f"{self.depth} levels", f"{self.depth}")

    def too_many(self, place: Location) -> FileError:
        """The error for too many values."""
        return _over(place, "too many values", f"{self.nodes}", f"{self.nodes}")

    def too_many_keys(self, place: Location) -> FileError:
        """The error for too many keys in a mapping."""
        return _over(place, "too many keys", f"{self.keys}", f"{self.keys} in a mapping")

    def check_yaml(self, text: str, file: str) -> None:
        """Raise for a YAML text that would take long to read.

        Raises
        ------
        FileError
            When it is.
        """
        marks = text.count("\n") + text.count(",")
        for subject, count, words, most in (
            ("YAML file too large", len(text), "characters", self.yaml_size),
            ("too many values in YAML", marks, "lines and commas", self.yaml_marks),
        ):
            if count > most:
                raise FileError(
                    Location(file),
                    subject,
                    got=Words(f"{count} {words}"),
                    expected=f"at most {most}",
                    hint="write a file of that size as JSON",
                )


def _over(place: Location, subject: str, most: str, allowed: str) -> FileError:
    return FileError(place, subject, got=Words(f"more than {most}"), expected=f"at most {allowed}")

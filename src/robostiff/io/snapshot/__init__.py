"""Snapshot files: a robot frozen at a pose, in world coordinates; JSON or YAML."""

from robostiff.io.snapshot.read import is_snapshot, read_snapshot, snapshot_from_document
from robostiff.io.snapshot.schema import snapshot_schema
from robostiff.io.snapshot.write import snapshot_to_data

__all__ = [
    "is_snapshot",
    "read_snapshot",
    "snapshot_from_document",
    "snapshot_schema",
    "snapshot_to_data",
]

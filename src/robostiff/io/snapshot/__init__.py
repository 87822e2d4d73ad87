"""Snapshot files: a robot frozen at a pose, in world coordinates; JSON or YAML."""

from robostiff.io.snapshot.read import (
    is_graph,
    is_snapshot,
    read_snapshot,
    snapshot_from_document,
)
from robostiff.io.snapshot.read_graph import network_from_document, read_network
from robostiff.io.snapshot.schema import network_schema, snapshot_schema
from robostiff.io.snapshot.write import network_to_data, snapshot_to_data

__all__ = [
    "is_graph",
    "is_snapshot",
    "network_from_document",
    "network_schema",
    "network_to_data",
    "read_network",
    "read_snapshot",
    "snapshot_from_document",
    "snapshot_schema",
    "snapshot_to_data",
]

"""Snapshot files: a robot frozen at a pose, in world coordinates; JSON or YAML."""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from robostiff.io.snapshot.elements import FileHead
from robostiff.io.snapshot.graph import NetworkFile
from robostiff.io.snapshot.graph import network_from_document as network_from_document
from robostiff.io.snapshot.graph import network_to_data as network_to_data
from robostiff.io.snapshot.legs import SnapshotFile
from robostiff.io.snapshot.legs import is_graph as is_graph
from robostiff.io.snapshot.legs import is_snapshot as is_snapshot
from robostiff.io.snapshot.legs import read_snapshot as read_snapshot
from robostiff.io.snapshot.legs import snapshot_from_document as snapshot_from_document
from robostiff.io.snapshot.legs import snapshot_to_data as snapshot_to_data
from robostiff.io.validation import WithoutTitles


def snapshot_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of the snapshot file, for editors and other programs.

    It checks keys, types and shapes; `read_snapshot` also checks values.
    """
    return _schema(SnapshotFile, "robostiff snapshot")


def network_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of the snapshot file in its graph form.

    It checks keys, types and shapes; `robostiff.load` also checks values and names.
    """
    return _schema(NetworkFile, "robostiff network")


def _schema(file: type[FileHead], title: str) -> dict[str, Any]:
    schema = file.model_json_schema(schema_generator=WithoutTitles)
    return {"$schema": GenerateJsonSchema.schema_dialect, **schema, "title": title}

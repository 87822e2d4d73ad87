"""Failures as files that `robostiff.load` reads."""

from __future__ import annotations

import json
from pathlib import Path

from robostiff.errors import InputError
from robostiff.model import Snapshot
from tests.campaign.posed import Posed
from tests.campaign.ways import written
from tests.generators.documents import model_data


def save_snapshot(path: Path, snapshot: Snapshot) -> str:
    """A snapshot file, a graph where the platform bends; where it cannot be said, its repr."""
    try:
        file = path.with_suffix(".json")
        file.write_text(written(snapshot))
    except InputError as error:
        path.with_suffix(".repr").write_text(repr(snapshot))
        return f"{path.name}.repr, for the format cannot say it: {error}"
    return file.name


def save_posed(path: Path, posed: Posed) -> str:
    """A model file in JSON, which is YAML; of a shipped robot its name and parameters."""
    kind = "JointCoordinates" if posed.by_joints else "poses"
    rows = f"{kind} {json.dumps(posed.rows.tolist())}"
    if posed.shipped:
        return f"load({posed.shipped!r}, {dict(posed.parameters)}), {rows}"
    file = path.with_suffix(".yaml")
    file.write_text(json.dumps(model_data(posed.robot), indent=1))
    return f"{file.name}, {rows}"

"""What a flexible platform consists of."""

from __future__ import annotations

from typing import Any

from robostiff.model import Robot


def platform_facts(robot: Robot) -> dict[str, Any]:
    """Nodes, parts, tool, and the node that holds each leg; nothing for a rigid platform."""
    platform = robot.platform
    if platform is None:
        return {}
    names = [leg.name for leg in robot.legs]
    return {
        "nodes": [node.name for node in platform.nodes],
        "parts": [part.name for part in platform.parts],
        "tool": platform.tool,
        "legs": dict(zip(names, robot.holds, strict=True)),
    }

"""The command ``verify``."""

from __future__ import annotations

from typing import Any

from robostiff.analysis.verification import Comparison, Verification, verify
from robostiff.cli.command import BAD_STATUS
from robostiff.cli.options import Answer, Model, Place
from robostiff.cli.output import show
from robostiff.cli.written_arguments import near_from, pose_from
from robostiff.io.results.plain_data import picked, plain
from robostiff.io.results.text import about
from robostiff.markup import text_of
from robostiff.version import __version__


def print_verification(model: Model, place: Place, answer: Answer) -> int:
    """Print the distances between the methods at a pose; 1 when they disagree."""
    robot = model.load()
    result = verify(robot, pose_from(robot, place), near=near_from(robot, place))
    show(_data(result) if answer.as_json else _text(result))
    return 0 if result.agree else BAD_STATUS


def _text(result: Verification) -> str:
    reference = result.reference
    lines = [
        f"{reference.name}, {about(reference)}",
        f"status: {reference.status}, rank {int(reference.rank)} of {reference.space.size}",
        f"compared with: {reference.method.name}, {reference.method.equation}",
        "",
        f"{'method':<14}{'distance':>10}  outcome",
    ]
    lines += [_line(comparison) for comparison in result.comparisons]
    verdict = "agree" if result.agree else "DISAGREE"
    lines += ["", f"methods {verdict} (largest distance allowed {result.agreement:g})"]
    return text_of(lines)


def _line(comparison: Comparison) -> str:
    distance = "-" if comparison.distance is None else f"{comparison.distance:.1e}"
    reason = f": {comparison.reason}" if comparison.reason else ""
    return f"{comparison.method:<14}{distance:>10}  {comparison.outcome.value}{reason}"


def _data(result: Verification) -> dict[str, Any]:
    reference = result.reference
    return {
        "robot": reference.name,
        "pose": plain(reference.pose),
        "status": str(reference.status),
        "rank": int(reference.rank),
        "compared_with": reference.method.name,
        "comparisons": [
            {**own, "outcome": own["outcome"].value}
            for own in picked(result.comparisons, "method outcome distance rank reason")
        ],
        "agreement": result.agreement,
        "agree": result.agree,
        "robostiff": __version__,
    }

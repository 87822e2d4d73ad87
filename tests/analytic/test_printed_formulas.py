"""The formulas of all shipped robots as they are printed, with their operations and lines.

A change of a formula or of a word shows as a difference from ``printed_formulas.txt``. After a
change that is meant, ``python -m tests.analytic.test_printed_formulas`` writes the file anew.
"""

import re
from pathlib import Path

import pytest

import robostiff as rs
from robostiff.analytic.exact.definition import different_entries, operations_of
from robostiff.analytic.export import derivation_text
from robostiff.errors import InputError
from tests.analytic.formulas import derived

PAGE = Path(__file__).parent / "data" / "printed_formulas.txt"
POSES = {"home": rs.AtHome(), "symbolic": rs.AtSymbols()}
QUICK = ("3-rpr", "3-rrr", "delta", "gough-stewart-b", "planar-link", "two-link-arm")
WIDTH = 88


def printed(name, pose):
    """Operations and lines of K and of its names, and the text."""
    try:
        derivation = derived(name, POSES[pose])
    except InputError as error:
        return f"refused\n\n{error}\n"
    own = derivation.named or derivation
    entries = different_entries(own.K.flat())
    lines = len(entries) + sum(1 for d in own.definitions if d.expression.free_symbols)
    count = f"{operations_of(entries, own.definitions)} operations, {lines} lines"
    return f"{count}\n\n{derivation_text(derivation, width=WIDTH)}"


def kept():
    parts = re.split(r"^#### (.*), (home|symbolic): ", PAGE.read_text(encoding="utf-8"), flags=re.M)
    each = zip(parts[1::3], parts[2::3], parts[3::3], strict=True)
    return {(name, pose): text for name, pose, text in each}


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize(
    "name",
    [pytest.param(x, marks=[] if x in QUICK else pytest.mark.slow) for x in rs.shipped_robots()],
)
def test_the_printed_formula_is_the_one_on_file(name, pose):
    assert printed(name, pose) + "\n" == kept()[name, pose]


if __name__ == "__main__":
    PAGE.write_text(
        "".join(
            f"#### {name}, {pose}: {printed(name, pose)}\n"
            for name in rs.shipped_robots()
            for pose in POSES
        ),
        encoding="utf-8",
    )

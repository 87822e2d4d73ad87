"""What the documents say a command or script prints is what it prints."""

import pytest

from tests.project.shown_output import (
    DOCUMENTS,
    ROOT,
    Shown,
    first_difference,
    produced_output,
    shown_outputs,
)

SHOWN = [shown for document in DOCUMENTS for shown in shown_outputs(document)]


@pytest.mark.parametrize("shown", SHOWN, ids=str)
def test_shown_output_is_what_is_printed(shown: Shown):
    difference = first_difference(shown.output, produced_output(shown))
    assert difference is None, f"{difference}\n\n'make outputs' writes shown output again"


def test_readme_shows_the_library_and_every_command():
    of_readme = [shown.command for shown in SHOWN if shown.document == ROOT / "README.md"]
    commands = {words[1] for words in of_readme if words[0] == "robostiff"}
    assert commands >= {"robots", "check", "stiffness", "deflection"}
    assert any(words[:2] == ("python", "-c") for words in of_readme)


def test_readme_begins_with_its_picture_and_two_commands():
    first_screen = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()[:30]
    assert any("docs/_static/gough-stewart-a.png" in line for line in first_screen)
    assert "make demo" in "\n".join(first_screen)
    assert "make test" in "\n".join(first_screen)


@pytest.mark.parametrize(
    ("shown", "produced", "same"),
    [
        ("rank 6 of 6", "rank 6 of 6", True),
        ("rank 6 of 6", "rank 5 of 6", False),
        ("Fx 1.2345e+07  0", "Fx 1.2346e+07 3.1e-17", True),
        ("Fx 1.2345e+07", "Fx 1.2445e+07", False),
        ("about 12 um", "about 12 mm", False),
        ("one line", "one line\nand another", False),
    ],
)
def test_differences_are_found_beyond_the_last_digits(shown: str, produced: str, same: bool):
    assert (first_difference(shown, produced) is None) is same

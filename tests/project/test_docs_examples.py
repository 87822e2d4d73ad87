"""The ``pycon`` blocks of the documents, run in order, one session a document."""

import doctest
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.project.shown_output import DOCUMENTS

_PYCON = re.compile(r"^```pycon\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL

WITH_EXAMPLES = [path for path in DOCUMENTS if "```pycon" in path.read_text(encoding="utf-8")]


@pytest.fixture(scope="module", autouse=True)
def identified_once():
    """Four documents identify the arm of one campaign: the same answer for each."""
    identify, known = rs.identify, {}

    def identify_once(robot: Any, campaign: Any, parameters: Any, **options: Any) -> Any:
        key = robot.name, campaign.values.tobytes(), tuple(parameters), repr(options)
        if key not in known:
            known[key] = identify(robot, campaign, parameters, **options)
        return known[key]

    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(rs, "identify", identify_once)
        yield


@pytest.mark.parametrize("document", WITH_EXAMPLES, ids=lambda path: path.name)
def test_examples_of_a_document(document: Path):
    text = document.read_text(encoding="utf-8")
    runner = doctest.DocTestRunner(optionflags=_OPTIONS)
    session: dict[str, object] = {}
    complaints: list[str] = []
    with np.printoptions():  # which a document may set for itself
        for block in _PYCON.finditer(text):
            first_line = text[: block.start(1)].count("\n")
            test = doctest.DocTestParser().get_doctest(
                block[1], session, document.name, str(document), first_line
            )
            runner.run(test, out=complaints.append, clear_globs=False)
            session = test.globs
    assert runner.summarize(verbose=False).failed == 0, "".join(complaints)


def test_the_pages_that_need_examples_have_them():
    names = {path.name for path in WITH_EXAMPLES}
    assert names >= {"conventions.md", "getting-started.md", "theory.md", "status.md"}

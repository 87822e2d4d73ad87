"""The pictures of the page on plots, drawn by the code that the page shows.

python docs/make_plots.py
"""

import re
from doctest import DocTestParser
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parent / "plots.md"
_PART = re.compile(
    r"^```pycon\n(?P<code>.*?)^```$|^```\{image\} (?P<picture>\S+)$", re.MULTILINE | re.DOTALL
)


def main() -> None:
    session: dict[str, Any] = {}
    for part in _PART.finditer(PAGE.read_text(encoding="utf-8")):
        if part["picture"]:
            path = PAGE.parent / part["picture"]
            path.parent.mkdir(parents=True, exist_ok=True)
            session["axes"].figure.savefig(path, dpi=130, metadata={"Software": None})
            continue
        for example in DocTestParser().get_examples(part["code"]):
            if not example.options:  # those that are skipped write files
                exec(example.source, session)  # noqa: S102


if __name__ == "__main__":
    main()

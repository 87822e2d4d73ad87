"""Files, lines, code and docstrings of each package of ``src``, counted by Python's own parser.

Lines of code are those that are neither blank nor a comment nor part of a docstring.

    python benchmarks/size.py
"""

from __future__ import annotations

import ast
from collections.abc import Iterable
from dataclasses import astuple, dataclass
from pathlib import Path

SOURCE = Path(__file__).parent.parent / "src" / "robostiff"


@dataclass(frozen=True)
class Size:
    """How much there is of some files."""

    files: int = 0
    lines: int = 0
    code: int = 0
    docstrings: int = 0

    @staticmethod
    def total(parts: Iterable[Size]) -> Size:
        return Size(*map(sum, zip(*map(astuple, parts), strict=True)))


def size_of(file: Path) -> Size:
    text = file.read_text(encoding="utf-8")
    words = {line for first, last in docstrings(ast.parse(text)) for line in range(first, last + 1)}
    code = [
        number
        for number, line in enumerate(text.splitlines(), 1)
        if number not in words and line.strip() and not line.lstrip().startswith("#")
    ]
    return Size(1, text.count("\n"), len(code), len(words))


def docstrings(tree: ast.Module) -> Iterable[tuple[int, int]]:
    """First and last line of every text that stands alone."""
    for node in ast.walk(tree):
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            yield value.lineno, value.end_lineno or value.lineno


def sizes() -> dict[str, Size]:
    """Size of each package by name, modules beside them together, the largest first."""
    files: dict[str, list[Path]] = {}
    for file in SOURCE.rglob("*.py"):
        inside = file.relative_to(SOURCE).parts
        files.setdefault(inside[0] if len(inside) > 1 else "robostiff", []).append(file)
    found = {name: Size.total(map(size_of, own)) for name, own in files.items()}
    return dict(sorted(found.items(), key=lambda pair: -pair[1].lines))


def main() -> None:
    found = sizes()
    print(f"{'package':16}{'files':>8}{'lines':>10}{'code':>10}{'docstrings':>12}")
    for name, own in {**found, "in all": Size.total(found.values())}.items():
        print(f"{name:16}{own.files:8}{own.lines:10,}{own.code:10,}{own.docstrings:12,}")


if __name__ == "__main__":
    main()

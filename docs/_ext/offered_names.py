"""What a package offers: names that it imports as themselves, and those that it defines.

Sphinx documents the members that `__all__` lists; packages list each name once, where they import
it.
"""

import ast
from importlib import import_module
from pathlib import Path
from typing import Any

import robostiff


def offered(file: Path) -> list[str]:
    """Names that a package offers, in the order of its file."""
    names = []
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            names += [name.name for name in node.names if name.asname == name.name]
        elif isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            names.append(node.name)
    return names


def setup(app: Any) -> dict[str, bool]:
    del app
    source = Path(robostiff.__file__).parent
    for file in source.rglob("__init__.py"):
        module = import_module(".".join(("robostiff", *file.parent.relative_to(source).parts)))
        if not hasattr(module, "__all__") and (names := offered(file)):
            module.__all__ = names
    return {"parallel_read_safe": True}

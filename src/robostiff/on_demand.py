"""Names of a package that are imported when they are first used.

A package lists them once, in its ``__init__.pyi``, where type checkers read them as well.
"""

from __future__ import annotations

import ast
import inspect
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from robostiff.argument_kinds import names_other_kinds


class _Package(ModuleType):
    """A package whose names come from its modules."""

    _homes: dict[str, tuple[str, str]]

    def __getattr__(self, name: str) -> Any:
        if name not in self._homes:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        home, own_name = self._homes[name]
        if home == self.__name__:  # a package inside this one
            value = import_module(f"{home}.{own_name}")
        else:
            value = getattr(import_module(home), own_name)
            public = sys.modules["robostiff"]._homes.values()
            if (home, own_name) in public or (self.__name__, name) in public:
                # a public function, or a class by its constructor, names arguments of other kinds
                if inspect.isfunction(value):
                    value = names_other_kinds(value)
                    setattr(import_module(home), own_name, value)
                elif inspect.isclass(value) and inspect.isfunction(value.__init__):
                    value.__init__ = names_other_kinds(value.__init__)
        super().__setattr__(name, value)
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        # A module does not hide the function of the same name.
        if not (name in self._homes and isinstance(value, ModuleType)):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._homes})


def import_on_demand(package: str) -> None:
    """Let a package import the names of its ``__init__.pyi`` when they are used.

    Examples
    --------
    >>> import robostiff.network
    >>> "Network" in dir(robostiff.network)
    True
    """
    module = sys.modules[package]
    stub = ast.parse(Path(str(module.__file__)).with_suffix(".pyi").read_text(encoding="utf-8"))
    homes = {
        name.asname or name.name: (str(node.module), name.name)
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for name in node.names
    }
    listed = sorted(name for name, (home, _) in homes.items() if home != package)
    module.__dict__.update(_homes=homes, __all__=listed)
    module.__class__ = _Package

"""What other distributions add: commands, readers and writers, found by their entry points.

An entry point of the group ``robostiff.commands`` has the name of a command and is a class like
those of `robostiff.cli`. One of ``robostiff.readers`` has the ending of a file, such as ``.mjcf``,
or the class of an object, such as ``mujoco.MjModel``, and is a `robostiff.io.rigid_tree.Reader`.
One of ``robostiff.writers`` has a word of ``robostiff convert --to`` and is a `Writer`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from robostiff.errors import InputError
from robostiff.frozen import frozen

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from robostiff.network import Network

COMMANDS, READERS, WRITERS = (f"robostiff.{kind}" for kind in ("commands", "readers", "writers"))


@frozen
class Writer:
    """Writes networks for another program.

    Attributes
    ----------
    endings : tuple of str
        Of its files: ``(".tcl", ".py")``.
    text : callable
        From a network and one of the endings, which is empty for standard output, to the text.
    """

    endings: tuple[str, ...]
    text: Callable[[Network, str], str]


# Where the extras of this repository are: said of one that is not installed.
_INTEROP, _VIEW = "robostiff-interop", "robostiff-view"
_OFFERED = {
    COMMANDS: {"view": ("views", _VIEW)},
    READERS: {
        **dict.fromkeys((".mjcf", ".xml"), ("MJCF files", _INTEROP)),
        "mujoco.MjModel": ("models of MuJoCo", _INTEROP),
        "pinocchio.Model": ("models of Pinocchio", _INTEROP),
    },
    WRITERS: {
        "opensees": ("models for OpenSees", _INTEROP),
        "calculix": ("models for CalculiX", _INTEROP),
    },
}


@cache
def entry_points_of(group: str) -> Mapping[str, EntryPoint]:
    """Entry points of a group by their names; none of them is loaded."""
    from importlib.metadata import entry_points

    return {entry.name: entry for entry in entry_points(group=group)}


def is_offered(group: str, name: str) -> bool:
    """Whether a name is one of an entry point, or of an extra that is not installed."""
    return name in _OFFERED[group] or name in entry_points_of(group)


def load_extra(group: str, name: str) -> Any:
    """The object of an entry point.

    Raises
    ------
    InputError
        When its distribution is not installed, with what to install.
    """
    if name in entry_points_of(group):
        return entry_points_of(group)[name].load()
    what, distribution = _OFFERED[group][name]
    raise InputError(
        f"{what} need {distribution!r}, which is not installed",
        hint=f"write pip install ./extras/{distribution} in a checkout of robostiff",
    )

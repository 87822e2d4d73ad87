"""A MuJoCo model without shapes, from a file of a stranger."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robostiff.errors import FileError, InputError, Location
from robostiff.io.rigid_tree.xml_text import XmlElement, XmlLimits, parse_xml, read_bytes
from robostiff.io.suggest import Words

_LIMITS = XmlLimits()
# Whatever draws, touches, senses or drives: none of it tells where bodies and joints are, and some
# of it would open other files.
_SUPERFLUOUS = (
    "sensors",
    "keys",
    "pairs",
    "excludes",
    "skins",
    "tuples",
    "actuators",
    "tendons",
    "cameras",
    "lights",
    "geoms",
    "flexes",
    "meshes",
    "hfields",
    "materials",
    "textures",
)


def compiled_model(source: Path | str) -> tuple[Any, frozenset[str]]:
    """The MuJoCo model of a file without its shapes, and the joints that actuators drive.

    Raises
    ------
    FileError
        When the file cannot be read, is too large, or MuJoCo refuses it.
    InputError
        When mujoco is not installed.
    """
    file = str(source)
    _check_size(parse_xml(read_bytes(source, _LIMITS), file, _LIMITS))
    mujoco = _mujoco()
    try:
        spec = mujoco.MjSpec.from_file(file)
        on_joints = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
        driven = frozenset(a.target for a in spec.actuators if a.trntype in on_joints)
        for kind in _SUPERFLUOUS:
            for element in list(getattr(spec, kind, ())):
                spec.delete(element)
        # Bodies have lost the shapes that gave them mass.
        spec.compiler.boundmass = spec.compiler.boundinertia = 1.0
        return spec.compile(), driven
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise FileError(
            Location(file),
            "MJCF",
            got=Words(" ".join(str(error).split())),
            expected="a model that MuJoCo can compile",
        ) from None


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError:
        raise InputError(
            "MJCF",
            got=Words("no mujoco, which reads it"),
            expected="the extra mjcf",
            hint="pip install 'robostiff[mjcf]'",
        ) from None
    return mujoco


def _check_size(root: XmlElement) -> None:
    if root.tag != "mujoco":
        raise FileError(
            root.location, "MJCF", got=Words(f"<{root.tag}>"), expected="<mujoco> at the top"
        )
    if _unfolded(root) > _LIMITS.elements:
        raise FileError(
            root.location,
            "MJCF",
            got=Words("more elements than that, once replicate is carried out"),
            expected=f"at most {_LIMITS.elements}",
        )


def _unfolded(root: XmlElement) -> int:
    """Number of elements once those in ``replicate`` are copied, or one beyond the limit."""
    total, waiting = 0, [(root, 1)]
    while waiting and total <= _LIMITS.elements:
        element, times = waiting.pop()
        count = element.attributes.get("count", "1").split()
        if element.tag in ("replicate", "composite", "flexcomp"):
            for word in count:
                times *= max(1, int(word)) if word.lstrip("+-").isdecimal() else 1
        total += times
        waiting += [(child, times) for child in element.children]
    return total

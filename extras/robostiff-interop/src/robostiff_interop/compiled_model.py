"""What describes bodies, joints, loops and drives in an MJCF file, as MuJoCo compiles it.

Elements for graphics, contact and sensors do not position bodies and joints. They are left out
before MuJoCo sees the file, as some of it takes memory by the number written there, and some opens
other files. Tendons, plugins and flexible bodies, which may hold a robot, are named in a warning.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from robostiff.errors import FileError, Location, Words
from robostiff.io.child_process import answer_of
from robostiff.io.rigid_tree import XmlElement, XmlLimits, read_xml, warn_of_parts_not_read

_LIMITS = XmlLimits()
_COMPILE = Path(__file__).with_name("compile_mjcf.py")
MOST_ELEMENTS = 4_000
"""Bodies, joints and sites of a description, copies counted; five times as many shapes."""
_DEEPEST_INCLUDE = 16
_LARGEST = 1e30

_IN_BODIES = frozenset(("camera", "light", "plugin", "flexcomp"))
_AT_TOP = frozenset(
    (
        *("asset", "contact", "custom", "deformable", "extension", "keyframe", "option"),
        *("sensor", "size", "statistic", "tendon", "visual"),
    )
)
_IN_DEFAULTS = frozenset(
    ("mesh", "material", "camera", "light", "pair", "tendon", "flex", "plugin")
)
_LEFT_OUT = {
    **dict.fromkeys(("worldbody", "body", "frame", "replicate"), _IN_BODIES),
    "mujoco": _AT_TOP,
    "default": _IN_DEFAULTS,
    "composite": frozenset(("skin", "plugin")),
    "compiler": frozenset(("lengthrange",)),
    "geom": frozenset(("plugin",)),
}
_ATTRIBUTES_LEFT_OUT = {
    "compiler": (
        *("alignfree", "assetdir", "discardvisual", "exactmeshinertia", "fitaabb", "fusestatic"),
        *("meshdir", "saveinertial", "strippath", "texturedir", "usethread"),
    ),
    "site": ("user", "material"),
    "joint": ("user",),
    "body": ("user",),
    "geom": ("user", "material"),
}
_COPYING = ("replicate", "composite")
_DRIVEN = ("joint", "jointinparent")
# What of a drive decides its stiffness, or that of a servo that has it by default as its gain.
_SERVOS = {
    "position": frozenset(("kp",)),
    "intvelocity": frozenset(("kp", "actrange", "actlimited")),
    "general": frozenset(("gaintype", "gainprm", "biastype", "biasprm")),
    "cylinder": frozenset(("bias", "area", "diameter")),
    "velocity": frozenset(("kv",)),
}
# Without a stiffness that is read; they become motors.
_MOTORS = ("motor", "damper", "muscle", "adhesion", "dcmotor", "pid", "orientation", "plugin")
_WITHOUT_FORCE_OF_POSITION = frozenset(("motor", "velocity", "damper", "dcmotor"))
_OF_POSITION = frozenset(("controller", "cogging"))  # of a dcmotor
_AFFINE = frozenset(("none", "fixed", "affine"))
_FLEXIBLE = frozenset(("flexcomp", "flex"))
_DISABLED, _GROUPS = "options that switch off springs, drives or loops,", "actuatorgroupdisable"
_OF_LOOPS, _OF_PARTS = ("constraint", "equality"), ("passive", "spring", "actuation")
_NO_LOOPS = ("tendon", "flex", "flexvert", "flexstrain")


def kinematic_part(source: Path | str) -> tuple[list[tuple[str, Location]], tuple[str, ...]]:
    """What describes bodies and joints in an MJCF file and those that it includes: tags, places.

    Behind them the names of keyframes, which are not read.
    """
    root = read_xml(source)
    if root.tag != "mujoco":
        raise root.error("MJCF", got=Words(f"<{root.tag}>"), expected="<mujoco> at the top")
    _Includes(Path(source)).resolve(root)
    warn_of_parts_not_read(_parts_not_read(root))
    keys = [own.attributes.get("name", "") for own in _all(root) if own.tag == "key"][::-1]
    _keep_kinematics(root)
    _check_number_of_elements(root)
    names = {element.attributes.get(key) for element in _all(root) for key in ("name", "class")}
    for element in _all(root):  # MuJoCo may not terminate at numbers that are not finite
        for key, text in element.attributes.items():
            if text not in names and not all(map(_is_harmless, text.split())):
                raise element.error(
                    f"{key} of <{element.tag}>",
                    got=text,
                    expected=f"finite numbers up to {_LARGEST:g}",
                )
    return list(_lines(root)), tuple(keys)


class _Includes:
    """Replaces ``<include file="..."/>`` by what is in the file, as MuJoCo does."""

    def __init__(self, first: Path) -> None:
        self.first = first
        self.elements = 0

    def resolve(self, element: XmlElement, chain: tuple[Path, ...] = ()) -> None:
        """Resolve those below an element of the last file of a chain of includes."""
        waiting = [element]
        while waiting:
            here = waiting.pop()
            children: list[XmlElement] = []
            for child in here.children:
                children += self._included(child, chain) if child.tag == "include" else [child]
            waiting += [child for child in here.children if child.tag != "include"]
            here.children = children

    def _included(self, element: XmlElement, chain: tuple[Path, ...]) -> list[XmlElement]:
        written = element.attributes.get("file", "")
        file = self._found(element, written, chain)
        again = file.resolve() in [before.resolve() for before in (self.first, *chain)]
        if again or len(chain) >= _DEEPEST_INCLUDE:
            raise element.error(
                "file of an include",
                got=written,
                expected="a file that does not include itself"
                if again
                else f"at most {_DEEPEST_INCLUDE} files inside each other",
            )
        root = read_xml(file)
        self.elements += sum(1 for _ in _all(root))
        if self.elements > _LIMITS.elements:
            raise element.error(
                "included files",
                got=Words(f"more than {_LIMITS.elements} elements"),
                expected=f"at most {_LIMITS.elements}",
            )
        self.resolve(root, (*chain, file))
        return root.children

    def _found(self, element: XmlElement, written: str, chain: tuple[Path, ...]) -> Path:
        """The path relative to the first file, or to the one that includes it."""
        folders = [self.first.parent, *(file.parent for file in chain[-1:])]
        for folder in folders:
            if written and (folder / written).is_file():
                return folder / written
        raise element.error(
            "file of an include",
            got=written or Words("none"),
            expected="a file, relative to the first one or to this one",
        )


def _all(root: XmlElement) -> Iterator[XmlElement]:
    waiting = [root]
    while waiting:
        element = waiting.pop()
        yield element
        waiting += element.children


def _keep_kinematics(root: XmlElement) -> None:
    for element in _all(root):
        left_out = _LEFT_OUT.get(element.tag, frozenset())
        for child in element.children:
            if child.tag == "attach":
                raise child.error(
                    "attach",
                    got=Words("a body of another model"),
                    expected="bodies written here, or in a file that is included",
                    hint="save the model as one file with MuJoCo: compile it, then mj_saveLastXML",
                )
        element.children = [child for child in element.children if child.tag not in left_out]
        if element.tag == "equality":
            _keep_loops(element)
        if element.tag == "actuator":
            element.children = [
                _kept_servo(own)
                for own in element.children
                if not set(_DRIVEN).isdisjoint(own.attributes)
            ]
        elif element.tag == "default":
            kept = [_kept_servo(own) for own in element.children]
            motors = [own for own in kept if own.tag == "motor"]
            for own in motors[1:]:  # of other kinds, as one
                motors[0].attributes.update(own.attributes)
            element.children = [own for own in kept if own not in motors[1:]]
        for name in _ATTRIBUTES_LEFT_OUT.get(element.tag, ()):
            element.attributes.pop(name, None)


def _kept_servo(drive: XmlElement) -> XmlElement:
    """A drive with what decides its stiffness alone; drives of all kinds have the same defaults."""
    if drive.tag not in {*_SERVOS, *_MOTORS}:
        return drive
    attributes = drive.attributes
    read = {"class", "gear", "armature", *_DRIVEN, *_SERVOS.get(drive.tag, ())}
    read -= {key for key in ("gaintype", "biastype") if attributes.get(key, "none") not in _AFFINE}
    kept = {key: text for key, text in attributes.items() if key in read}
    tag = "motor" if drive.tag in _MOTORS else drive.tag
    return XmlElement(tag, kept, drive.location, [])


def _pulls(gravity: list[str]) -> bool:
    """Whether gravity is another than none, as here, and than the one of MuJoCo."""
    numbers = [number.strip("0. ") for number in gravity]
    return any(numbers) and numbers != ["", "", "-9.81"]


def _parts_not_read(root: XmlElement) -> dict[str, list[tuple[str, Location]]]:
    """What moves or bends and is not read, by its kind: names and places."""
    options = [own for own in _all(root) if own.tag == "option"]
    written = [(own.attributes.get("gravity", ""), own.location) for own in options]
    found = {"tendons": [], "gravity": [own for own in written if _pulls(own[0].split())]}
    has_loops = any(own.tag == "equality" and own.children for own in _all(root))
    flags = _OF_PARTS + _OF_LOOPS * has_loops
    found[_DISABLED] = [
        (key, flag.location)
        for option in options
        for flag in (option, *option.all("flag"))
        for key, text in flag.attributes.items()
        if key == _GROUPS or (key in flags and text == "disable")
    ]
    tendons: list[XmlElement] = []
    pulled: set[str | None] = set()
    sprung = False  # by a class of defaults

    def add(what: str, own: XmlElement, name: str = "name") -> None:
        found.setdefault(what, []).append((own.attributes.get(name, ""), own.location))

    for element in _all(root):
        for child in element.children:
            holds = not {"stiffness", "limited", "range"}.isdisjoint(child.attributes)
            if element.tag == "tendon":
                tendons.append(child)
            elif element.tag == "default" and child.tag == "tendon":
                sprung = sprung or holds
            elif child.tag in _FLEXIBLE:
                add("flexible bodies", child)
            elif child.tag == "body" and child.attributes.get("gravcomp", "0").strip("0. "):
                add("lifts of weights (gravcomp)", child)
            elif child.tag == "plugin" and element.tag in ("body", "composite", "actuator"):
                add("plugins", child, "plugin")
            elif element.tag == "actuator" and "tendon" in child.attributes:
                pulled.add(child.attributes["tendon"])
            elif element.tag == "actuator" and set(_DRIVEN).isdisjoint(child.attributes):
                add("drives of sites or bodies", child)
            elif element.tag == "actuator" and (
                child.tag not in {*_SERVOS, *_WITHOUT_FORCE_OF_POSITION}
                or not _OF_POSITION.isdisjoint(child.attributes)
                or child.attributes.get("biastype", "none") not in _AFFINE
            ):
                add("forces that a drive has by its position", child)
    for own in tendons:
        holds = not {"stiffness", "limited", "range"}.isdisjoint(own.attributes)
        if sprung or holds or own.attributes.get("name") in pulled:
            add("tendons", own)
    return found


def _keep_loops(equality: XmlElement) -> None:
    kept = []
    for child in equality.children:
        if child.tag not in _NO_LOOPS:
            kept.append(child)
        elif child.attributes.get("active", "true") != "false":
            raise child.error(
                f"equality {child.attributes.get('name', '')}".strip(),
                got=Words("a constraint on tendons or deformable parts"),
                expected="connect, weld or joint",
            )
    equality.children = kept


def _check_number_of_elements(root: XmlElement) -> None:
    """Bound the number of elements once those in ``replicate`` are copied."""
    total, waiting = 0, [(root, 1)]
    while waiting:
        element, times = waiting.pop()
        if element.tag in _COPYING:
            for word in element.attributes.get("count", "1").split():
                times *= max(1, abs(_whole(word)))
        total += times * (0.2 if element.tag == "geom" else 1)
        if total > MOST_ELEMENTS:
            raise element.error(
                "MJCF",
                got=Words("more elements after replicate"),
                expected=f"at most {MOST_ELEMENTS} bodies, joints and sites in all",
            )
        waiting += [(child, times) for child in reversed(element.children)]


def _whole(word: str) -> int:
    """The whole number that a word begins with, or one too large when it is no number."""
    try:
        return int(min(abs(float(word)), MOST_ELEMENTS + 1))
    except ValueError:
        return MOST_ELEMENTS + 1


def _is_harmless(word: str) -> bool:
    try:
        return abs(float(word)) <= _LARGEST
    except ValueError:
        return not word.casefold().lstrip("+-").startswith(("nan(", "0x"))


def _lines(element: XmlElement) -> Iterator[tuple[str, Location]]:
    """The tags below an element, without recursion, each with its place."""
    waiting: list[XmlElement | str] = [element]
    places = [element.location]
    while waiting:
        here = waiting.pop()
        if isinstance(here, str):
            yield f"</{here}>", places.pop()
            continue
        written = "".join(f" {key}={quoteattr(text)}" for key, text in here.attributes.items())
        if not here.children:
            yield f"<{here.tag}{written}/>", here.location
            continue
        yield f"<{here.tag}{written}>", here.location
        places.append(here.location)
        waiting.append(here.tag)
        waiting += reversed(here.children)


_LINE = re.compile(r",? line (\d+)")

_REAL = frozenset(
    (
        *("body_pos", "body_quat", "site_pos", "site_quat", "jnt_pos", "jnt_axis", "jnt_range"),
        *("jnt_stiffness", "jnt_stiffnesspoly", "qpos0", "qpos_spring", "eq_data"),
        *("actuator_biasprm", "actuator_gear"),
        *("body_mass", "body_ipos", "body_iquat", "body_inertia", "dof_armature"),
    )
)

NOTHING = 1e-12
"""Mass and moments of a body without any, as MuJoCo compiles no other [kg], [kg m^2]."""


@dataclass(frozen=True)
class CompiledModel:
    """The compiled model of a file."""

    name: str
    # their names, empty where they have none
    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    sites: tuple[str, ...]
    equalities: tuple[str, ...]
    arrays: dict[str, np.ndarray]  # those of MuJoCo's own model, by the same names
    keyframes: tuple[str, ...] = ()

    def __getattr__(self, key: str) -> np.ndarray:
        """An array of MuJoCo's model."""
        try:
            return self.__dict__["arrays"][key]
        except KeyError:
            raise AttributeError(key) from None


def compiled_model(source: Path | str) -> CompiledModel:
    """The MuJoCo model of a file without what is seen or touched, and the shapes of other files."""
    lines, keys = kinematic_part(source)
    try:
        compiled = _compiled("\n".join(tag for tag, _ in lines), str(source))
        return replace(compiled, keyframes=keys)
    except FileError as error:
        found = _LINE.search(str(error.got))
        if error.location.line is not None or not found or not 0 < int(found[1]) <= len(lines):
            raise
        # At the location of the file to which MuJoCo's line number belongs.
        place, words = lines[int(found[1]) - 1][1], Words(_LINE.sub("", str(error.got)).strip())
        raise FileError(place, error.subject, got=words, expected=error.expected) from None


@lru_cache(maxsize=64)
def _compiled(text: str, file: str) -> CompiledModel:
    place, request = Location(file), {"text": text, "nothing": NOTHING}
    return _from_data(answer_of(_COMPILE, request, place, "MJCF", "MuJoCo"), place)


def read_model(model: Any) -> CompiledModel:
    """Names and arrays of an ``mujoco.MjModel``."""
    from robostiff_interop.compile_mjcf import mujoco, names_and_arrays

    data = names_and_arrays(model)
    place = Location(f"model of MuJoCo {data['name']!r}")
    kinds = model.actuator_trntype
    drives = np.array([model.actuator(i).name or str(i) for i in range(len(kinds))])
    by_position = np.isin(kinds, ON_JOINTS) & (model.actuator_biastype > AFFINE)
    amounts = model.actuator_gainprm[:, 4], model.actuator_biasprm[:, 0]  # controller and cogging
    by_position &= (model.actuator_biastype != _OF_DCMOTOR) | np.any(amounts, axis=0)
    gravity = [f"{acceleration:g}" for acceleration in model.opt.gravity]
    moving = {
        "gravity": [" ".join(gravity)] * _pulls(gravity),
        _DISABLED: [
            key
            for key in _OF_PARTS + _OF_LOOPS * bool(model.neq)
            if model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{key.upper()}", 0)
        ]
        + [_GROUPS] * bool(model.opt.disableactuator),
        "tendons": [
            model.tendon(i).name or str(i)
            for i in range(model.ntendon)
            if np.any(model.tendon_stiffness[i])
            or model.tendon_limited[i]
            or i in model.actuator_trnid[kinds == _ON_TENDONS, 0]
        ],
        "drives of sites or bodies": drives[~np.isin(kinds, (*ON_JOINTS, _ON_TENDONS))].tolist(),
        "forces that a drive has by its position": drives[by_position].tolist(),
        "plugins": [str(i) for i in range(model.nplugin)],
        "flexible bodies": [str(i) for i in range(model.nflex)],
        "lifts of weights (gravcomp)": [
            model.body(i).name or str(i) for i in np.flatnonzero(model.body_gravcomp)
        ],
    }
    warn_of_parts_not_read({kind: [(n, place) for n in names] for kind, names in moving.items()})
    keys = tuple(model.key(i).name for i in range(model.nkey))
    return replace(_from_data(data, place), keyframes=keys)


ON_JOINTS, _ON_TENDONS = (0, 1), 3
"""Kinds of transmission, as of ``mujoco.mjtTrn``."""
AFFINE, _OF_DCMOTOR = 1, 3
"""Kinds of force, as of ``mujoco.mjtBias``."""


def _from_data(data: dict[str, Any], place: Location) -> CompiledModel:
    names = {key: data.pop(key) for key in ("bodies", "joints", "sites", "equalities")}
    name, without = data.pop("name"), data.pop("without_mass", [])
    unread = {"the masses of meshes of": [(body, place) for body in without]}
    warn_of_parts_not_read(unread, "bodies have those of other shapes")
    arrays = {key: _array(key, values, place) for key, values in data.items()}
    return CompiledModel(
        name, **{key: tuple(map(str, listed)) for key, listed in names.items()}, arrays=arrays
    )


def _array(key: str, values: Any, place: Location) -> np.ndarray:
    array = np.array(values, dtype=float if key in _REAL else np.int64)
    if not np.isfinite(array).all():
        raise FileError(
            place,
            "MJCF",
            got=Words(f"a model with a {key} that is no number"),
            expected="finite places, axes and coordinates",
        )
    array.setflags(write=False)
    return array

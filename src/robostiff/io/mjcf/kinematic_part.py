"""What describes bodies, joints, sites, loops and drives of joints in an MJCF file.

Elements for graphics, contact and sensors do not position bodies and joints. They are left out
before MuJoCo sees the file, as some of it takes memory by the number written there, and some opens
other files. Tendons, plugins and flexible bodies, which may hold a robot, are named in a warning.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

from robostiff.errors import Location
from robostiff.io.plausibility import warn_of_parts_not_read
from robostiff.io.rigid_tree.xml_text import XmlElement, XmlLimits, read_xml
from robostiff.io.suggest import Words

_LIMITS = XmlLimits()
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
    (
        *("mesh", "material", "camera", "light", "pair", "tendon", "flex"),
        *("motor", "velocity", "damper", "muscle", "adhesion", "dcmotor", "pid", "orientation"),
        "plugin",
    )
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
# What of a drive decides its stiffness.
_SERVOS = {
    "position": frozenset(("kp",)),
    "intvelocity": frozenset(("kp", "actrange", "actlimited")),
    "general": frozenset(("biastype", "biasprm")),
    "cylinder": frozenset(("bias",)),
}
_WITHOUT_FORCE_OF_POSITION = frozenset(("motor", "velocity", "damper", "dcmotor"))
_AFFINE = frozenset(("none", "affine"))
_FLEXIBLE = frozenset(("flexcomp", "flex"))
_NO_LOOPS = ("tendon", "flex", "flexvert", "flexstrain")


def kinematic_part(source: Path | str) -> list[tuple[str, Location]]:
    """What describes bodies and joints in an MJCF file and those that it includes: tags, places."""
    root = read_xml(source)
    if root.tag != "mujoco":
        raise root.error("MJCF", got=Words(f"<{root.tag}>"), expected="<mujoco> at the top")
    _Includes(Path(source)).resolve(root)
    warn_of_parts_not_read(_parts_not_read(root))
    _keep_kinematics(root)
    _check_number_of_elements(root)
    _check_numbers(root)
    return list(_lines(root))


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
            element.children = [own for own in map(_kept_drive, element.children) if own]
        elif element.tag == "default":
            element.children = [
                _kept_servo(own) if own.tag in _SERVOS else own for own in element.children
            ]
        for name in _ATTRIBUTES_LEFT_OUT.get(element.tag, ()):
            element.attributes.pop(name, None)


def _kept_servo(drive: XmlElement) -> XmlElement:
    """A drive with what decides its stiffness alone."""
    attributes = drive.attributes
    read = {"class", "gear", *_DRIVEN, *_SERVOS[drive.tag]}
    if attributes.get("biastype", "none") not in _AFFINE:
        read -= {"biastype"}
    kept = {key: text for key, text in attributes.items() if key in read}
    return XmlElement(drive.tag, kept, drive.location, [])


def _kept_drive(drive: XmlElement) -> XmlElement | None:
    """A drive of a joint; any other is None, one without a stiffness a motor."""
    driven = {key: text for key, text in drive.attributes.items() if key in _DRIVEN}
    if not driven:
        return None
    if drive.tag in _SERVOS:
        return _kept_servo(drive)
    return XmlElement("motor", driven, drive.location, [])


def _parts_not_read(root: XmlElement) -> dict[str, list[tuple[str, Location]]]:
    """What moves or bends and is not read, by its kind: names and places."""
    found: dict[str, list[tuple[str, Location]]] = {"tendons": []}
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
            elif child.tag == "plugin" and element.tag in ("body", "composite", "actuator"):
                add("plugins", child, "plugin")
            elif element.tag == "actuator" and "tendon" in child.attributes:
                pulled.add(child.attributes["tendon"])
            elif element.tag == "actuator" and set(_DRIVEN).isdisjoint(child.attributes):
                add("drives of sites or bodies", child)
            elif element.tag == "actuator" and (
                child.tag not in {*_SERVOS, *_WITHOUT_FORCE_OF_POSITION}
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


def _check_numbers(root: XmlElement) -> None:
    """Refuse numbers that are not finite, at which MuJoCo may not terminate."""
    names = {element.attributes.get(key) for element in _all(root) for key in ("name", "class")}
    for element in _all(root):
        for key, text in element.attributes.items():
            if text not in names and not all(map(_is_harmless, text.split())):
                raise element.error(
                    f"{key} of <{element.tag}>",
                    got=text,
                    expected=f"finite numbers up to {_LARGEST:g}",
                )


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

"""Random mutations of files: of the tree of values, of XML elements, of lines, of bytes."""

from __future__ import annotations

import copy
import random
import re
from typing import Any
from xml.etree import ElementTree

Path = tuple[Any, ...]

NUMBERS = (
    0,
    -0.0,
    1,
    -1,
    2,
    1e-320,
    1e-100,
    1e-12,
    1e12,
    1e30,
    1e100,
    1e308,
    -1e308,
    10**18,
    10**40,
)
NO_NUMBERS = (float("nan"), float("inf"), -float("inf"))
TEXTS = (
    *("", " ", "nan", "inf", "-inf", "NaN", "1e999", "1e-999 mm", "0x10", "1_000", "١٢"),
    *("300 mm", "-5 deg", "1 N/m", "2 m m", "10 GPa^2", "sqrt(-1)", "1/0", "asin(2)", "0^-1"),
    *("x", "-z", "home", "R", "L", "pi", "steel", "leg1", "revolute", "passive", "true", "null"),
    *("../../etc/passwd", "\u202e", "\x1b[31m", "\ud83d\ude00", "a" * 5000, "(" * 300, "1+" * 400),
    *("${1}", "{x}", "%s", "<a/>", "&a;", "__import__('os')", "=1+1", "*", "?", "[a-z]*"),
)
OTHERS: tuple[Any, ...] = (
    None,
    True,
    False,
    [],
    {},
    [[]],
    [1],
    [1, 2, 3],
    [0, 0, 0],
    {"at": [0, 0, 0]},
)


def _strange(random_: random.Random) -> Any:
    return random_.choice(random_.choice((NUMBERS, NO_NUMBERS, TEXTS, TEXTS, OTHERS)))


def _paths(data: Any, path: Path = ()) -> list[Path]:
    """Of everything inside."""
    found = []
    items: Any = ()
    if isinstance(data, dict):
        items = data.items()
    elif isinstance(data, list):
        items = enumerate(data)
    for key, value in items:
        found += [(*path, key), *_paths(value, (*path, key))]
    return found


def _at(data: Any, path: Path) -> Any:
    for step in path:
        data = data[step]
    return data


def mutated_tree(data: Any, random_: random.Random) -> Any:
    """A copy of plain data with one thing changed."""
    data = copy.deepcopy(data)
    paths = _paths(data)
    if not paths:
        return _strange(random_)
    path = random_.choice(paths)
    holder, key = _at(data, path[:-1]), path[-1]
    value = holder[key]
    kind = random_.randrange(9)
    if kind == 0:
        holder[key] = _strange(random_)
    elif kind == 1:
        holder[key] = _changed(value, random_)
    elif kind == 2:
        del holder[key]
    elif kind == 3 and isinstance(holder, dict):
        name = random_.choice((_misspelt(str(key), random_), str(_strange(random_))))
        holder[name] = holder.pop(key)
    elif kind == 4:
        holder[key] = copy.deepcopy(_at(data, random_.choice(paths)))
    elif kind == 5:
        other = random_.choice(paths)
        theirs, at = _at(data, other[:-1]), other[-1]
        if path[: len(other)] != other and other[: len(path)] != path:
            holder[key], theirs[at] = theirs[at], holder[key]
    elif kind == 6 and isinstance(holder, list):
        holder.insert(key, copy.deepcopy(value))
        if random_.random() < 0.2:
            holder *= random_.choice((2, 30))
    elif kind == 7:
        holder[key] = [value] if random_.random() < 0.5 else {str(key): value}
    else:
        for _ in range(random_.choice((1, 10, 70))):
            holder[key] = [holder[key]]
    return data


def _changed(value: Any, random_: random.Random) -> Any:
    """Another value like this one."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        factor = random_.choice((-1, 0, 1e-3, 1e3, 1e-9, 1e9, 1 + 1e-9, 0.5, 2))
        return random_.choice((value * factor, str(value), [value], int(value), value + 1))
    if isinstance(value, str):
        return random_.choice(
            (
                _misspelt(value, random_),
                value * random_.choice((2, 50)),
                f"-({value})",
                f"{value} mm",
                f"{value}^3",
                re.sub(r"\d+", str(random_.choice(NUMBERS)), value),
                value.upper(),
            )
        )
    if isinstance(value, list):
        return random_.choice(
            (value[::-1], value[1:], value * 2, value[:1], dict.fromkeys("ab", value))
        )
    if isinstance(value, dict):
        return random_.choice((list(value.values()), list(value), dict(reversed(value.items()))))
    return value


def _misspelt(word: str, random_: random.Random) -> str:
    if not word:
        return "x"
    at = random_.randrange(len(word))
    return random_.choice(
        (word[:at] + word[at + 1 :], word[:at] + random_.choice("aeZ0_ ") + word[at:], word[:at])
    )


def mutated_xml(text: str, random_: random.Random) -> str:
    """A text in XML with one element or attribute changed."""
    try:
        root = ElementTree.fromstring(text)  # noqa: S314 - a file of ours
    except (ElementTree.ParseError, ValueError, RecursionError):
        return mutated_text(text, random_)
    elements = list(root.iter())
    parents = {child: parent for parent in elements for child in parent}
    element = random_.choice(elements)
    other = random_.choice(elements)
    kind = random_.randrange(8)
    keys = list(element.attrib)
    if kind <= 2 and keys:
        key = random_.choice(keys)
        value = random_.choice((str(_strange(random_)), str(_changed(element.get(key), random_))))
        words = str(element.get(key)).split()
        if len(words) > 1 and random_.random() < 0.5:
            words[random_.randrange(len(words))] = value
            value = " ".join(words)
        element.set(key, value)
    elif kind == 3 and keys:
        key = random_.choice(keys)
        value = element.attrib.pop(key)
        if random_.random() < 0.5:
            element.set(re.sub(r"\W", "", _misspelt(key, random_)) or "x", value)
    elif kind == 4 and element in parents:
        parents[element].remove(element)
    elif kind == 5:
        other.append(copy.deepcopy(element))
    elif kind == 6:
        element.tag = other.tag
    else:
        element.text, element.attrib = other.text, dict(other.attrib)
    try:
        return ElementTree.tostring(root, encoding="unicode")
    except (ValueError, TypeError, RecursionError):
        return text


def mutated_text(text: str, random_: random.Random) -> str:
    """A text with one of its lines, words or characters changed."""
    lines = text.split("\n")
    at = random_.randrange(len(lines))
    kind = random_.randrange(7)
    if kind == 0:
        lines.insert(random_.randrange(len(lines)), lines[at])
    elif kind == 1:
        del lines[at]
    elif kind == 2:
        lines[at] = random_.choice(("  ", " ", "\t", "- ", "# ")) + lines[at]
    elif kind == 3:
        words = re.findall(r"\w+|\W+", lines[at])
        if words:
            words[random_.randrange(len(words))] = str(_strange(random_))
            lines[at] = "".join(words)
    elif kind == 4:
        return text[: random_.randrange(len(text) + 1)]
    elif kind == 5:
        place = random_.randrange(len(text) + 1)
        return text[:place] + random_.choice("{}[]:,&*!|>'\"%@`\\\0\t\n#-?/\ufeff") + text[place:]
    else:
        lines[at] = _misspelt(lines[at], random_)
    return "\n".join(lines)


def mutated_bytes(content: bytes, random_: random.Random) -> bytes:
    """Bytes of which one is changed, or a piece left out or written twice."""
    if not content:
        return b"\xff"
    at = random_.randrange(len(content))
    end = min(len(content), at + random_.randrange(1, 40))
    return random_.choice(
        (
            content[:at] + bytes([random_.randrange(256)]) + content[at + 1 :],
            content[:at] + content[end:],
            content[:end] + content[at:],
        )
    )

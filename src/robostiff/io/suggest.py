"""Words for messages: lists, the nearest allowed word, and values as they were written."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import islice
from types import MappingProxyType
from typing import Any

from robostiff.errors import Words

#: what came, what was expected, subject, hint
Phrase = tuple[Any, str | None, str, str | None]


def as_in_a_file(value: Any) -> Any:
    """A value as it is written in a file."""
    match value:
        case None:
            return Words("null")
        case bool():
            return Words(str(value).lower())
        case dict():
            return Words("a mapping")
        case list():
            return Words(f"a list of {values(len(value))}")
    return value


#: What was expected, by the ``type`` of an entry of ``ValidationError.errors()``.
_EXPECTED: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(
            ("model_type", "model_attributes_type", "dict_type", "mapping_type"), "a mapping"
        ),
        **dict.fromkeys(("list_type", "tuple_type"), "a list"),
        **dict.fromkeys(("float_type", "float_parsing"), "a number"),
        "finite_number": "a finite number",
        **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), "a whole number"),
        "string_type": "a text",
        **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
        "none_required": "null",
        "greater_than": "a number above {gt:g}",
        "greater_than_equal": "a number of at least {ge:g}",
        "less_than": "a number below {lt:g}",
        "less_than_equal": "a number of at most {le:g}",
        "string_too_short": "a text of at least {min_length} character",
        "string_too_long": "a text of at most {max_length} character",
        "string_pattern_mismatch": "a text of the form {pattern}",
    }
)
# Of what may be written in two ways, by its tag in the model of the file.
_OF_TAGS = {
    "count": "a list of copies, or a mapping with their count",
    "mapping": "a name, or a mapping",
    "repeated": "a list, or one mapping with repeat",
    "vector": "an axis, such as -z, or a list of 3 values",
}
_LENGTHS = {"too_short": ("min_length", "at least"), "too_long": ("max_length", "at most")}


def phrase(
    kind: str, value: Any, context: Mapping[str, Any], metadata: Sequence[Any]
) -> Phrase | None:
    """Words for an error of pydantic by its type; None for one that has none here.

    `context` has the bounds that are broken, `metadata` all those of the type.
    """
    if kind in _LENGTHS:
        key, words = _LENGTHS[kind]
        bounds = [getattr(bound, name, None) for bound in metadata for name, _ in _LENGTHS.values()]
        exactly = bounds.count(context[key]) > 1 or context.get("field_type") == "Tuple"
        wanted = values(context[key])
        expected = wanted if exactly else f"{words} {wanted}"
        return Words(values(len(value))), expected, "wrong length", None
    if kind not in _EXPECTED:
        return None
    ways = (_OF_TAGS.get(getattr(x, "tag", "")) for x in metadata)
    expected = next(filter(None, ways), _EXPECTED[kind].format_map(context))
    if kind == "greater_than" and context["gt"] == 0:
        expected = "a positive number"
    if expected.endswith("character") and not expected.endswith(" 1 character"):
        expected += "s"
    hint = None
    if "number" in expected and isinstance(value, str):
        with suppress(ValueError):
            float(value)
            hint = "write it without quotes"
    return as_in_a_file(value), expected, "wrong value", hint


def values(number: int) -> str:
    """A number of values as text."""
    return f"{number} value{'s' * (number != 1)}"


#: Words that people write for those of files, which may be spelt more like others of them.
_SAME_MEANING = {
    **dict.fromkeys(("active", "driven", "drive", "motor", "motorised"), ("actuated",)),
    **{"free": ("passive",), "fixed": ("locked", "rigid"), "weld": ("rigid",)},
    **dict.fromkeys(("r", "hinge", "pin", "rotational", "continuous"), ("revolute",)),
    **dict.fromkeys(("p", "slider", "linear", "translational", "sliding"), ("prismatic",)),
    **dict.fromkeys(("u", "cardan", "hooke"), ("universal",)),
    **dict.fromkeys(("s", "ball", "ball joint"), ("spherical",)),
    **dict.fromkeys(("xyz", "position", "origin", "point"), ("at",)),
    **dict.fromkeys(("rotation", "rpy", "rotate", "angles"), ("turn",)),
    **{"c": ("cylindrical",), "k": ("stiffness",), "nu": ("poisson_ratio",)},
}
_LONGEST_WORD = 60
_MOST_CANDIDATES = 1000
_SHORTEST_BEGINNING = 3


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """The allowed word that is most similar to `word`, or None if none is similar."""
    candidates = list(islice(allowed, _MOST_CANDIDATES))
    if len(word) > _LONGEST_WORD:
        return None
    folded = word.casefold()
    close = [name for name in candidates if name.casefold() == folded]
    close += [name for name in candidates if name.casefold().endswith(f"/{folded}")]
    close += [name for name in _SAME_MEANING.get(folded, ()) if name in candidates]
    close += difflib.get_close_matches(word, candidates, n=1)
    if len(word) >= _SHORTEST_BEGINNING:
        close += [name for name in candidates if name.casefold().startswith(folded)]
    return close[0] if close else None


def nearest_first(word: str, allowed: Sequence[str]) -> list[str]:
    """The allowed words, the one most similar to `word` before the others."""
    first = nearest(word, allowed)
    return sorted(allowed, key=lambda other: other != first)


def did_you_mean(word: str, allowed: Iterable[str]) -> str | None:
    """The hint that names the nearest allowed word, or None if none is similar."""
    word = nearest(word, allowed) or ""
    return f"did you mean {word}?" if word else None


def listing(words: Sequence[str], limit: int = 60) -> str:
    """The words as a list in a sentence, shortened when they are many."""
    if len(words) <= limit:
        return ", ".join(words)
    return ", ".join([*words[:limit], f"... ({len(words)} in all)"])


def free_names(names: Sequence[str | None], kinds: Sequence[str]) -> list[str]:
    """The names; in place of none the kind and the next number that makes a free one."""
    count: Counter[str] = Counter()
    filled = []
    for name, kind in zip(names, kinds, strict=True):
        candidate = name
        while candidate is None or (name is None and candidate in names):
            count[kind] += 1
            candidate = f"{kind}{count[kind]}"
        filled.append(candidate)
    return filled


def distinct(names: Iterable[str]) -> list[str]:
    """The names, with a number behind those that are taken already."""
    unique: list[str] = []
    for name in names:
        candidate, number = name or "part", 2
        while candidate in unique:
            candidate, number = f"{name or 'part'} ({number})", number + 1
        unique.append(candidate)
    return unique

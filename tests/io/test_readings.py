"""What is read of expressions, quantities, scalars, places and parts is in ``readings.txt``.

A line there is what is read. ``python -m tests.io.test_readings`` writes the values anew.
"""

import json
from ast import literal_eval
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robostiff.io.document import parse_document
from robostiff.io.expression import exact_mathematics, parameter_values, parse
from robostiff.io.snapshot import snapshot_from_document
from robostiff.io.units import Dimension, parse_quantities, parse_quantity, to_si
from tests.cables import test_cable_files
from tests.files import text_of
from tests.io import test_model_file, test_units
from tests.said import indented, now, on_file, write

PAGE = Path(__file__).parent / "readings.txt"
YAML = parse_document(text_of("mixed-styles.yaml"), file="f")
JSON = parse_document(text_of("tabs-and-escapes.json"), file="f.json")


def value(text: str) -> str:
    quantity = parse(literal_eval(f'"{text}"')).evaluate(test_units.ENVIRONMENT)
    return f"{quantity.magnitude:.12g} SI, {quantity}"


def exact(text: str) -> str:
    environment = test_units.IN_SYMBOLS
    return str(parse(text).evaluate(environment, exact_mathematics()).magnitude)


def place(document: Any) -> Callable[[str], str]:
    """Line and column of a value, and of its key."""

    def of(path: str) -> str:
        steps = literal_eval(path)
        places = document.location(steps), document.key_location(steps)
        return ", key at ".join(f"{own.line}:{own.column}" for own in places)

    return of


def several(dimensions: Any, names: Any) -> Callable[[str], str]:
    return lambda text: " ".join(f"{x:.12g}" for x in parse_quantities(text, dimensions, names, ""))


def quantity(kind: str) -> Callable[[str], str]:
    return lambda text: f"{to_si(text, Dimension[kind]):.12g}"


def parameters(text: str) -> str:
    found = parameter_values(*literal_eval(f"({text},)"))
    return "\n".join(f"{name} = {own.magnitude:.12g}, {own}" for name, own in found.items())


def described(own: Any) -> str:
    """A part of a machine: all that it says of itself, but what is empty."""
    if isinstance(own, np.ndarray):
        near = np.where(np.abs(own) < 1e-13 * np.max(np.abs(own), initial=0), 0, own) + 0.0
        if own.ndim < 2:
            return " ".join(f"{x:.10g}" for x in near)
        diagonal = np.diag(near)
        if np.array_equal(near, np.diag(diagonal)):
            return f"diagonal {described(diagonal)}"
        return ", ".join(map(described, near))
    if isinstance(own, tuple):
        return "; ".join(map(described, own))
    if is_dataclass(own):
        return f"{type(own).__name__}({', '.join(parts_of(own))})"
    if isinstance(own, Enum):
        return own.name.lower()
    return f"{own:.10g}" if isinstance(own, float) else str(own)


def parts_of(own: Any) -> Iterator[str]:
    for field in fields(own):
        value = getattr(own, field.name)
        if value is not None and not (isinstance(value, tuple | np.ndarray) and not np.size(value)):
            yield f"{field.name} {described(value)}"


def elements_of_a_snapshot(text: str) -> str:
    chain = [*literal_eval(f"({text},)")]
    leg = {"name": "leg", "end": [0.5, 0, 0], "chain": chain}
    data = {"name": "arm", "reference_point": [0.5, 0.1, 0], "legs": [leg]}
    (own,) = snapshot_from_document(parse_document(json.dumps(data), file="arm.json")).legs
    return "\n".join(map(described, own.elements))


READERS: dict[str, Callable[[str], str]] = {
    "expression": value,
    "exact expression": exact,
    "scalar of YAML": (lambda text: repr(parse_document(f"a: {text}").data["a"])),
    "YAML": lambda text: repr(parse_document(literal_eval(text)).data),
    "file in YAML": lambda name: repr(parse_document(text_of(name)).data),
    "parameters": parameters,
    "element of a leg": (
        lambda text: "\n".join(map(described, test_model_file.chain_of(*text.split("  ;  "))[:-1]))
    ),
    "element of a snapshot": elements_of_a_snapshot,
    "cable robot": lambda text: "\n".join(parts_of(test_cable_files.built(literal_eval(text)))),
    "places in YAML": place(YAML),
    "places in JSON": place(JSON),
    "pose": several(test_units.POSE, test_units.POSE_NAMES),
    "wrench": several(test_units.WRENCH, test_units.WRENCH_NAMES),
    "quantity of any kind": lambda text: str(parse_quantity(text)),
    **{own.name: quantity(own.name) for own in Dimension},
}


def say(kind: str, text: str) -> str:
    return indented(READERS[kind](text))


@pytest.mark.parametrize("kind", on_file(PAGE))
def test_what_is_read_is_what_is_on_file(kind):
    told = {kind: on_file(PAGE)[kind]}
    assert now(told, say) == told


if __name__ == "__main__":
    write(PAGE, now(on_file(PAGE), say))

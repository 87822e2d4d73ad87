"""What is read of expressions, quantities, scalars and places is on file in ``readings.txt``.

A line there is what is read. ``python -m tests.io.test_readings`` writes the values anew.
"""

from ast import literal_eval
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from robostiff.io.document import parse_document
from robostiff.io.expression import exact_mathematics, parse
from robostiff.io.units import Dimension, parse_quantities, parse_quantity, to_si
from tests.files import text_of
from tests.io import test_exact_expression, test_expression, test_units
from tests.said import indented, now, on_file, write

PAGE = Path(__file__).parent / "readings.txt"
YAML = parse_document(text_of("mixed-styles.yaml"), file="f")
JSON = parse_document(text_of("tabs-and-escapes.json"), file="f.json")


def value(text: str) -> str:
    quantity = parse(literal_eval(f'"{text}"')).evaluate(test_expression.ENVIRONMENT)
    return f"{quantity.magnitude:.12g} SI, {quantity}"


def exact(text: str) -> str:
    environment = test_exact_expression.ENVIRONMENT
    return str(parse(text).evaluate(environment, exact_mathematics()).magnitude)


def scalar(text: str) -> str:
    return repr(parse_document(f"a: {text}").data["a"])


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


READERS: dict[str, Callable[[str], str]] = {
    "expression": value,
    "exact expression": exact,
    "scalar of YAML": scalar,
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

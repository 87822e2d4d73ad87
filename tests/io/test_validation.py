"""Errors of file models in words, with their places: the cases that no single format has."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Discriminator, Field, RootModel, Tag, field_validator

from robostiff.errors import FileError, InputError, Location
from robostiff.io.document import parse_document
from robostiff.io.validation import validate


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class Colour(Enum):
    RED = "red"
    BLUE = "blue"


class Tube(Part):
    shape: Literal["tube"]
    outer_diameter: float = Field(alias="outer diameter", gt=0, lt=10, description="in metres")
    colour: Annotated[Colour, Field(strict=False)] = Colour.RED


class Bar(Part):
    shape: Literal["bar", "rod"]
    width: float | str
    count: int = Field(1, ge=1, le=4)

    @field_validator("width")
    @classmethod
    def _measured(cls, width: float | str) -> float | str:
        if width == "wide":
            raise InputError("width", got=width, expected="a number or a name", hint="measure it")
        if width == "odd":
            raise FileError(Location("other.yaml", 7), "width", got=width)
        if width == "plain":
            raise ValueError("too plain")
        return width


Section = Annotated[Tube | Bar, Field(discriminator="shape")]


class Names(RootModel):
    root: list[Annotated[str, Field(min_length=2, pattern="^[a-z]+$")]]


class Group(Part):
    sections: list[Section] = []
    groups: list[Group] | None = None
    pair: Annotated[tuple[float, float] | None, Field(strict=False)] = None
    table: dict[str, Bar] = {}
    names: Names | None = None
    either: Tube | float | None = None
    chosen: (
        Annotated[
            Annotated[Bar, Tag("bar")] | Annotated[Group, Tag("group")],
            Discriminator(lambda value: "bar" if "shape" in value else "group"),
        ]
        | None
    ) = None


def complaint(text: str, model: type[BaseModel] = Group) -> str:
    with pytest.raises(FileError) as caught:
        validate(model, parse_document(text, file="f.yaml"))
    return str(caught.value)


ONE_BAR = "shape: bar, width: 1"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "sections: [{shape: tube, outer diameter: 0}]",
            '1:42: sections[0]["outer diameter"]: wrong value: got 0, expected a positive number',
        ),
        (
            "sections: [{shape: tube, outer diameter: 12}]",
            '1:42: sections[0]["outer diameter"]: wrong value: got 12, expected a number below 10',
        ),
        (
            "sections: [{shape: tube}]",
            '1:12: sections[0]["outer diameter"]: missing key; outer diameter is in metres',
        ),
        (
            "sections: [{shape: tube, outer_diameter: 1}]",
            "1:26: sections[0].outer_diameter: unknown key: expected one of shape, outer diameter, "
            "colour; did you mean outer diameter?",
        ),
        (
            "sections: [{shape: tube, outer diameter: 1, colour: bleu}]",
            "1:53: sections[0].colour: unknown word: got 'bleu', expected 'red' or 'blue'; "
            "did you mean blue?",
        ),
        (
            "sections: [{shape: bra, width: 1}]",
            "1:20: sections[0].shape: unknown word: got 'bra', expected 'tube' or 'bar' or 'rod'; "
            "did you mean bar?",
        ),
        (
            "sections: [{width: 1}]",
            "1:12: sections[0].shape: missing key: expected one of tube, bar, rod",
        ),
        ("sections: [4]", "1:12: sections[0]: wrong value: got 4, expected a mapping"),
        (
            "sections: [{shape: bar, width: true}]",
            "1:32: sections[0].width: wrong value: got true, expected a number or a text",
        ),
        (
            "sections: [{shape: bar, width: wide}]",
            "1:32: sections[0].width: width: got 'wide', expected a number or a name; measure it",
        ),
        (
            "sections: [{shape: bar, width: plain}]",
            "1:32: sections[0].width: too plain: got 'plain'",
        ),
        (
            f"sections: [{{{ONE_BAR}, count: 0}}]",
            "1:42: sections[0].count: wrong value: got 0, expected a number of at least 1",
        ),
        (
            f"sections: [{{{ONE_BAR}, count: 5}}]",
            "1:42: sections[0].count: wrong value: got 5, expected a number of at most 4",
        ),
        (
            f"sections: [{{{ONE_BAR}, count: 1.5}}]",
            "1:42: sections[0].count: wrong value: got 1.5, expected a whole number",
        ),
        (
            "groups:\n- groups:\n  - sections: []\n  - groups: [{sectoins: []}]",
            "4:15: groups[0].groups[1].groups[0].sectoins: unknown key: expected one of sections, "
            "groups, pair, table, names, either, chosen; did you mean sections?",
        ),
        ("pair: [1]", "1:7: pair: wrong length: got 1 value, expected 2 values"),
        ("pair: [1, 2, 3]", "1:7: pair: wrong length: got 3 values, expected 2 values"),
        ("pair: [1, x]", "1:11: pair[1]: wrong value: got 'x', expected a number"),
        (
            "table:\n  tube: {shape: bar, width: 1, bar: 2}",
            "2:32: table.tube.bar: unknown key: expected one of shape, width, count",
        ),
        (
            "names: [ab, c]",
            "1:13: names[1]: wrong value: got 'c', expected a text of at least 2 characters",
        ),
        (
            "names: [AB]",
            "1:9: names[0]: wrong value: got 'AB', expected a text of the form ^[a-z]+$",
        ),
        (
            "either: {shape: tube, outer diameter: 1, color: red}",
            "1:42: either.color: unknown key: expected one of shape, outer diameter, colour; "
            "did you mean colour?",
        ),
        ("either: wide", "1:9: either: wrong value: got 'wide', expected a mapping or a number"),
        (
            "chosen: {shape: bar, width: 1, count: 9}",
            "1:39: chosen.count: wrong value: got 9, expected a number of at most 4",
        ),
        ("chosen: {pair: 2}", "1:16: chosen.pair: wrong value: got 2, expected a list"),
    ],
)
def test_message_and_place(text, message):
    assert complaint(text) == f"f.yaml:{message}"


def test_a_file_error_of_a_validator_keeps_its_place():
    assert complaint("sections: [{shape: bar, width: odd}]") == "other.yaml:7: width: got 'odd'"


def test_what_is_right_is_read():
    group = validate(Group, parse_document(f"sections: [{{{ONE_BAR}}}]\npair: [1, 2]"))
    assert group.pair == (1, 2)
    assert isinstance(group.sections[0], Bar)


def test_the_unknown_key_comes_first_and_the_others_follow():
    text = "pair: [1]\nsections:\n- {shape: bar, widht: 1}\n- {shape: tube}\n"
    first, *others = complaint(text).splitlines()
    assert first == (
        "f.yaml:3:16: sections[0].widht: unknown key: expected one of shape, width, count; "
        "did you mean width?"
    )
    assert [other.split(" ")[:2] for other in others] == [
        ["f.yaml:1:7:", "pair:"],
        ["f.yaml:4:3:", 'sections[1]["outer'],
    ]
    both = complaint("pair: [x, y]").splitlines()
    assert [line.split(" ")[1] for line in both] == ["pair[0]:", "pair[1]:"]

"""Reading documents: plain data, exact places, and refusal of harmful ones."""

import io
import json
import math
import os
import sys
import time
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robostiff.errors import FileError
from robostiff.io.document import Limits, parse_document, read_document
from tests.calls import calls_of
from tests.files import text_of

ROBOT = text_of("mixed-styles.yaml")


def refusal(text, file="robot.yaml", **kwargs):
    with pytest.raises(FileError) as caught:
        parse_document(text, file=file, **kwargs)
    return str(caught.value)


# --- what is read ---------------------------------------------------------------------------------


def test_integers_beyond_the_machine_become_floats():
    digits = "1" * 5000
    assert parse_document(f"a: {digits}").data["a"] == math.inf
    assert parse_document(f'{{"a": {digits}}}').data["a"] == math.inf
    assert parse_document(f"a: 1{'0' * 30}").data["a"] == 1e30


def test_windows_files_bom_and_other_alphabets(tmp_path):
    path = tmp_path / "r\u00f6b\u00f6t.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + "größe: 5 mm\r\nname: Štefan\r\nn: {x: 1}\r\n".encode())
    document = read_document(path)
    assert document.data == {"größe": "5 mm", "name": "Štefan", "n": {"x": 1}}
    assert str(document.location(["n", "x"])) == f"{path}:3:8: n.x"
    assert str(document.location(["größe"])) == f"{path}:1:8: größe"


def test_standard_input(monkeypatch):
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(b"a: 1")))
    document = read_document("-")
    assert document.data == {"a": 1}
    assert str(document.location(["a"])) == "<stdin>:1:4: a"


def test_standard_input_is_read_no_further_than_the_limit(monkeypatch):
    stream = io.BytesIO(b"# " + b"x" * 10_000)
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=stream))
    with pytest.raises(FileError) as caught:
        read_document("-", Limits(size=100))
    assert (
        str(caught.value)
        == "<stdin>: file too large: got more than 100 bytes, expected at most 100 bytes"
    )
    assert stream.tell() == 101


# --- places ---------------------------------------------------------------------------------------


def test_path_is_rendered_and_missing_values_point_to_the_nearest_ancestor():
    document = parse_document(ROBOT, file="robot.yaml")
    assert str(document.location(["legs", 0, "chain", 1, "axis"])) == (
        "robot.yaml:7:11: legs[0].chain[1].axis"
    )
    assert str(document.key_location(["legs", 7, "chain"])) == "robot.yaml:4:3: legs[7].chain"
    assert str(document.location(["robostiff", "x", 0])) == "robot.yaml:1:12: robostiff.x[0]"
    assert document.location(["legs", -1]).line == 4


scalars = st.none() | st.booleans() | st.integers(-(10**9), 10**9) | st.text(max_size=8)
trees = st.recursive(
    scalars,
    lambda t: st.lists(t, max_size=4) | st.dictionaries(st.text(max_size=6), t, max_size=4),
    max_leaves=20,
)


@given(
    tree=st.dictionaries(st.text(max_size=6), trees, max_size=4), indent=st.sampled_from([None, 2])
)
def test_json_marks_have_the_shape_of_the_data(tree, indent):
    text = json.dumps(tree, indent=indent)
    document = parse_document(text, file="x.json")
    assert document.data == tree
    lines = text.split("\n")

    def check(value, path):
        place = document.location(path)
        assert place.line is not None
        assert place.column is not None
        begins = lines[place.line - 1][place.column - 1]
        assert begins == json.dumps(value)[0]
        children = value.items() if isinstance(value, dict) else ()
        children = enumerate(value) if isinstance(value, list) else children
        for step, child in children:
            check(child, [*path, step])

    check(tree, [])


def test_thirty_kilobytes_of_json_are_fast():
    text = json.dumps({"legs": [{"axis": [0.1, 0.2, 0.3], "n": str(i)} for i in range(800)]})
    assert len(text) > 25_000
    parse_document(text)
    assert calls_of(lambda: parse_document(text)) < len(text)


# --- refusals -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        "a: " + "[" * 990_000,
        "{" * 100_000,
        "a: " + "[" * 5000,
        '{"a": ' + "[" * 5000,
        "- " * 5000,
    ],
)
def test_deep_nesting_is_refused_quickly(text):
    start = time.process_time()
    message = refusal(text)
    assert "nesting too deep: got more than 64 levels, expected at most 64" in message
    assert time.process_time() - start < 0.5


def test_depth_and_node_limits_are_exact():
    assert parse_document("[" * 64 + "]" * 64).data
    assert "nesting too deep" in refusal("[" * 65 + "]" * 65)
    assert len(parse_document("[1, 1]", limits=Limits(nodes=3)).data) == 2
    message = "robot.yaml:1:8: [2]: too many values: got more than 3, expected at most 3"
    assert refusal("[1, 1, 1]", limits=Limits(nodes=3)) == message
    assert "too many values" in refusal('{"a": [1, 1, 1]}', limits=Limits(nodes=3))


def test_word_that_the_yaml_scanner_would_read_for_minutes():
    message = "robot.yaml:2:1: tag: got a word of more than 1000 characters that begins with !, "
    message += "expected a value without a tag; remove the word that begins with !"
    assert refusal("# x\n" + "!" * 3_000_000) == message


def test_huge_file_is_refused_without_reading(tmp_path, monkeypatch):
    path = tmp_path / "huge.yaml"
    with path.open("wb") as stream:
        stream.truncate(100_000_000)

    def no_open(*args, **kwargs):
        raise AssertionError("opened")

    monkeypatch.setattr("builtins.open", no_open)
    with pytest.raises(FileError) as caught:
        read_document(path)
    assert str(caught.value) == (
        f"{path}: file too large: got 100000000 bytes, expected at most 4000000 bytes"
    )


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="no endless device here")
def test_endless_device_is_read_no_further_than_the_limit():
    with pytest.raises(FileError, match="file too large: got more than 4000000 bytes"):
        read_document("/dev/zero")


def test_files_that_cannot_be_read(tmp_path):
    for source, message in [
        (tmp_path, f"{tmp_path}: a folder: expected a YAML or JSON file"),
        (
            tmp_path / "no.yaml",
            f"{tmp_path}/no.yaml: cannot read the file: got No such file or directory, "
            "expected a readable file",
        ),
    ]:
        with pytest.raises(FileError) as caught:
            read_document(source)
        assert str(caught.value) == message
    with pytest.raises(FileError, match="cannot read the file"):
        read_document("a\0b")


def test_file_that_is_no_utf8(tmp_path):
    path = tmp_path / "latin.yaml"
    path.write_bytes("a: 1\nname: Größe\n".encode("latin-1"))
    with pytest.raises(FileError) as caught:
        read_document(path)
    assert str(caught.value) == (
        f"{path}:2:9: not UTF-8: got the byte 0xf6, expected a YAML or JSON text in UTF-8; "
        "save the file as UTF-8"
    )


# --- noise ----------------------------------------------------------------------------------------


def read_or_refuse(content):
    try:
        text = content.decode()
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    for name in ("x.yaml", "x.json"):
        try:
            document = parse_document(text, file=name)
        except FileError as error:
            message = str(error)
        else:
            message = name
            document.location(["a", 0])
        assert message.startswith(name)
        assert "\n" not in message


@settings(max_examples=100)
@given(st.text(alphabet="ab1 \n\t-:?,[]{}#&*!|>'\"%@`\\ux0.é~<=\r", max_size=40))
def test_random_yaml_punctuation(text):
    read_or_refuse(text.encode())


@pytest.mark.parametrize("text", [ROBOT, text_of("tabs-and-escapes.json")])
def test_truncated_files(text):
    for end in range(len(text)):
        read_or_refuse(text[:end].encode())

"""A snapshot file is read, or refused with its place; the words are in `slips.txt`."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.errors import FileError
from robostiff.io.document import parse_document
from robostiff.io.snapshot import snapshot_from_document
from tests.files import text_of

# One element a line, so that lines can be counted.
TEXT = text_of("arm-snapshot.json")


PLANAR = """{"name": "arm", "planar": true, "reference_point": [0, 0, 0],
"legs": [{"name": "leg", "end": [0, 0, 0], "chain": [
{"type": "spring", "kind": "R", "point": [0, 0, 9], "axis": [0, 0, 1], "k": 9},
"""


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["type", "kind", "point", "axis", "k", "K"]), inner)
    ),
    max_leaves=8,
)
PATHS = [
    (),
    ("name",),
    ("legs",),
    ("legs", 0),
    ("legs", 0, "end"),
    ("legs", 0, "chain"),
    *(("legs", 0, "chain", i) for i in range(4)),
    ("legs", 0, "chain", 0, "type"),
    ("legs", 0, "chain", 0, "axis"),
    ("legs", 0, "chain", 1, "y_axis"),
    ("legs", 0, "chain", 1, "E"),
    ("legs", 0, "chain", 1, "start", 0),
    ("legs", 0, "chain", 3, "rotation", 1),
    ("legs", 0, "chain", 3, "compliance", 4, 4),
    ("legs", 0, "chain", 3, "compliance", 1, 4),
]


@pytest.mark.filterwarnings("ignore::robostiff.errors.PlausibilityWarning")
@given(st.sampled_from(PATHS), values)
def test_anything_anywhere_is_read_or_refused_with_its_place(path, value):
    data = {"top": json.loads(TEXT)}
    *parents, last = ("top", *path)
    inside = data
    for step in parents:
        inside = inside[step]
    inside[last] = value
    document = parse_document(json.dumps(data["top"]), file="arm.json")
    error = None
    try:
        snapshot_from_document(document)
    except FileError as caught:
        error = caught
    if error is not None:
        assert error.location.file == "arm.json"
        assert error.location.line == 1
        for line in str(error).splitlines():
            assert line.strip().startswith("arm.json:1:")

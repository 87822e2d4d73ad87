"""`schema`, `new` and `convert`."""

import json
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import robostiff as rs
from robostiff.cli.files import templates
from robostiff.io.document import parse_document, read_document
from robostiff.io.model_file.schema import _MEANINGS, model_file_schema
from robostiff.io.snapshot import network_schema, network_to_data, snapshot_schema
from robostiff.robots import robot_file
from tests.cli.running import Running
from tests.files import text_of

ROOT = Path(__file__).parents[2]
MODELS = [
    *(robot_file(name) for name in (*rs.shipped_robots(), *rs.shipped_cable_robots())),
    *(ROOT / "src/robostiff/robots/templates").glob("*.yaml"),
    ROOT / "examples/ur5-dh.yaml",
    ROOT / "examples/rocking-table.yaml",
    ROOT / "examples/tricept-with-head.yaml",
    ROOT / "examples/exechon.yaml",
    ROOT / "docs/star-platform.yaml",
]


pytestmark = pytest.mark.usefixtures("in_a_folder")
run = Running()


def refused(*arguments: str, status: int = 2) -> str:
    outcome = run(*arguments)
    assert outcome.exit_code == status, outcome.output
    return outcome.stderr


@pytest.fixture(scope="module")
def validator():
    return Draft202012Validator(model_file_schema())


@pytest.mark.parametrize("file", MODELS, ids=lambda file: file.stem)
def test_models_fit_the_schema(validator, file):
    assert list(validator.iter_errors(read_document(file).data)) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("alpha: -90 deg", "alfa: -90 deg"),
        ("convention: standard", "convention: craig"),
        ("a: 500 mm", "a: [1, 2]"),
        ("source:", "sauce:"),
    ],
)
def test_slips_do_not_fit_the_schema(validator, old, new):
    text = (ROOT / "src/robostiff/robots/templates/arm.yaml").read_text()
    assert old in text
    assert list(validator.iter_errors(parse_document(text.replace(old, new)).data))


def test_schema_explains_keys_and_each_explanation_is_used():
    schema = model_file_schema()
    Draft202012Validator.check_schema(schema)
    parts = schema["$defs"]
    assert "rigid if left out" in parts["OneAxisJoint"]["properties"]["stiffness"]["description"]
    assert "6 x 6" in parts["Link"]["properties"]["stiffness"]["description"]
    used = {own.get("description") for p in parts.values() for own in p["properties"].values()}
    assert set(_MEANINGS.values()) <= used
    assert "Written" not in json.dumps(schema)


@pytest.mark.parametrize(
    ("form", "schema"),
    [("model", model_file_schema), ("snapshot", snapshot_schema), ("graph", network_schema)],
)
def test_schema_is_printed_and_written(form, schema):
    assert json.loads(run("schema", form).stdout) == schema()
    assert run("schema", form, "-o", "schema.json").stdout == "schema.json\n"
    assert json.loads(Path("schema.json").read_text()) == schema()
    assert "write --overwrite" in refused("schema", form, "-o", "schema.json")


@pytest.mark.parametrize("template", templates())
def test_templates_can_be_used_as_they_are(template):
    assert run("new", "my robot", "--template", template).stdout == "my robot.yaml\n"
    outcome = run("check", "my robot.yaml", "--json")
    facts = json.loads(outcome.stdout)
    assert facts["name"] == "my robot"
    assert facts["home"]["status"] in {"ok", "rigid-directions"}
    assert "warnings" not in facts
    assert outcome.stderr == ""


def test_new_robot_like_a_shipped_one():
    run.done("new", "mine.yml", "--template", "delta")
    mine, delta = rs.load("mine.yml"), rs.load("delta")
    assert mine.name == "mine"
    np.testing.assert_array_equal(rs.stiffness(mine).K, rs.stiffness(delta).K)


def test_a_new_robot_that_is_called_like_a_shipped_one_has_a_warning():
    assert "delta alone is the shipped robot: write delta.yaml" in run("new", "delta").stderr
    assert run("new", "my-delta").stderr == ""


@pytest.mark.parametrize("name", ["no", "12", "1e8", "0o17", 'a"b', "x: y", "#1", "ümlaut"])
def test_any_name_stays_a_text(name):
    run.done("new", name)
    assert rs.load(f"{name}.yaml").name == name
    run.done("convert", f"{name}.yaml", "-o", "snapshot.yaml")
    assert rs.load("snapshot.yaml").name == name


def test_new_replaces_nothing():
    Path("arm.yaml").write_text("mine")
    Path("link.yaml").symlink_to("nowhere")
    for name in ("arm", "arm.yaml", "link"):
        assert "expected a new file; take another name" in refused("new", name)
    assert Path("arm.yaml").read_text() == "mine"
    assert sorted(path.name for path in Path().iterdir()) == ["arm.yaml", "link.yaml"]


POSE = "0.02 0.01 0.85 0 0.1 0"


@pytest.mark.parametrize("form", ["snapshot", "graph"])
def test_converted_robot_is_as_stiff(form):
    run("convert", "hexapod", "--pose", POSE, "--to", form, "-o", "hexapod.json")
    expected = rs.stiffness(rs.load("hexapod"), list(map(float, POSE.split())))
    found = rs.stiffness(rs.load("hexapod.json"))
    np.testing.assert_allclose(found.K, expected.K, rtol=1e-9, atol=1e-3)
    printed = run("convert", "hexapod", "--pose", POSE, "--to", form).stdout
    assert json.loads(printed) == json.loads(Path("hexapod.json").read_text())


@pytest.mark.parametrize("form", ["snapshot", "graph"])
def test_the_same_data_as_yaml(form):
    run("convert", "hexapod", "--pose", POSE, "--to", form, "-o", "hexapod.json")
    run("convert", "hexapod", "--pose", POSE, "--to", form, "-o", "hexapod.yaml")
    assert Path("hexapod.yaml").read_text().startswith("name: hexapod\n")
    found = read_document(Path("hexapod.yaml")).data
    assert found == json.loads(Path("hexapod.json").read_text())


def test_rows_of_a_file_stand_in_a_line_each():
    graph = json.loads((ROOT / "examples/portal.json").read_text())
    text = json.dumps(graph).replace("left foot", "left,  [1,\\n 2] foot")
    Path("portal.json").write_text(text)
    run("convert", "portal.json", "--to", "graph", "-o", "graph.json")
    written = Path("graph.json").read_text()
    assert '"reference_point": [1.0, 0.0, 0.8],\n' in written
    assert json.loads(written) == network_to_data(rs.load("portal.json"))
    run("convert", "hexapod", "-o", "hexapod.json")
    assert len(Path("hexapod.json").read_text().splitlines()) < 900  # 2380, a number in a line


def test_what_cannot_be_converted():
    message = refused("convert", "3-puu", "--pose", "1 0 0.3 0 0 0", status=1)
    assert "error: no snapshot of '3-puu': " in message
    run.done("convert", "double-pantograph", "--to", "graph")


def test_a_linkage_is_converted_where_its_joints_are_moved_and_for_all_their_values():
    name, joints = "double-pantograph", "screw=-50 mm"
    linkage = rs.load_linkage(name)
    expected = rs.stiffness(linkage, {"screw": -0.05}).K
    run.done("convert", name, "--joints", joints, "--to", "graph", "-o", "a.json")
    found = rs.stiffness(rs.load("a.json")).K
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    far = refused("convert", name, "--joints", "screw=-900 mm", "--to", "graph", status=1)
    assert "do not close" in far
    assert "--near" in refused("convert", name, "--near", "1", "--to", "graph")
    assert run("convert", name, "--to", "c").stdout == rs.compile(linkage).source(
        rs.SourceLanguage.C
    )


SPRING = """
springs:
  - name: counterbalance
    between: [{body: base, at: [0, 0, 0.9]}, {body: arm/link, at: [0.3, 0, 0]}]
    stiffness: 1.2 kN/m
    free_length: 100 mm
"""
LAW = "laws: {arm/hinge: 1e4 N m/rad*q + 1e9 N m/rad^3*q^3}"
ARM = text_of("arm-with-a-screw.yaml")


def test_a_converted_robot_does_not_lose_springs_and_laws_in_silence():
    """Its file is read back under finite loads, where they act."""
    number, law = "1e5 N/m", "1e5 N/m*(1 + q/(4 m))"
    Path("plain.yaml").write_text(ARM.replace("KQ", number))
    Path("spring.yaml").write_text(ARM.replace("KQ", number) + SPRING)
    Path("law.yaml").write_text(ARM.replace("KQ", number) + LAW)
    Path("screw.yaml").write_text(ARM.replace("KQ", law))
    for form in ("snapshot", "graph", "opensees", "calculix"):
        assert "counterbalance" in refused("convert", "spring.yaml", "--to", form)
    for form in ("snapshot", "graph"):
        assert run("convert", "plain.yaml", "--to", form).stderr == ""
        for file, drive in (("law.yaml", "arm/hinge"), ("screw.yaml", "arm/screw")):
            outcome = run.done("convert", file, "--to", form)
            assert f"the stiffness of {drive} at this pose" in outcome.stderr
    assert run("convert", "screw.yaml", "--to", "calculix").stderr == ""


def test_a_law_of_a_drive_that_moves_a_sum_of_joints_is_not_lost_in_silence():
    text = (ROOT / "examples/bevel-wrist.yaml").read_text()
    law = "role: actuated, limits: [-3 rad, 3 rad], stiffness: 6e3 N m/rad*(1 + q/(9 rad))"
    text = text.replace("  k_left: 6e3 N m/rad ", "  #")
    Path("wrist.yaml").write_text(text.replace("role: actuated, stiffness: k_left", law))
    assert rs.load("wrist.yaml").drives_with_laws == ("arm/left motor",)
    message = run("convert", "wrist.yaml", "--to", "snapshot").stderr
    assert "the stiffness of arm/left motor at this pose" in message


def test_a_converted_robot_is_printed_where_no_file_is_asked_for():
    printed = run("convert", "hexapod", "-o", "-").stdout
    assert json.loads(printed)["name"] == "hexapod"
    assert not list(Path().iterdir())


def test_a_kernel_is_written_for_all_poses():
    run("convert", "3-rpr", "--to", "c", "-o", "k.c")
    assert Path("k.c").read_text() == rs.compile(rs.load("3-rpr")).source(rs.SourceLanguage.C)
    assert "__global__ void stiffness(" in run("convert", "3-rpr", "--to", "cuda").stdout


def test_a_file_that_is_replaced_keeps_its_permissions_and_links():
    Path("private.json").write_text("{}")
    Path("private.json").chmod(0o600)
    Path("link.json").symlink_to("private.json")
    run.done("convert", "planar-link", "-o", "link.json", "--overwrite")
    assert Path("link.json").is_symlink()
    assert json.loads(Path("private.json").read_text())["name"] == "planar-link"
    assert Path("private.json").stat().st_mode & 0o777 == 0o600
    assert [path.name for path in Path().iterdir()] in (
        ["private.json", "link.json"],
        ["link.json", "private.json"],
    )


@pytest.mark.parametrize("output", ["arm.yaml", "./arm.yaml", "link.yaml"])
def test_a_file_that_is_read_is_not_replaced(output):
    text = robot_file("planar-link").read_text()
    Path("arm.yaml").write_text(text)
    Path("link.yaml").symlink_to("arm.yaml")
    for command in (("convert", "--to", "snapshot"), ("derive", "--format", "text")):
        message = refused(*command, "arm.yaml", "-o", output, "--overwrite")
        assert "expected another file than those that are read" in message
    assert Path("arm.yaml").read_text() == text


def test_names_of_files_may_have_255_bytes():
    run.done("convert", "planar-link", "-o", "a" * 250 + ".json")
    assert json.loads(Path("a" * 250 + ".json").read_text())["name"] == "planar-link"
    long_ending = "b." + "c" * 253
    run.done("derive", "planar-link", "--format", "text", "-o", long_ending)
    assert Path(long_ending).is_file()
    assert "--output: got" in refused("convert", "planar-link", "-o", "d" * 256)


def test_a_folder_that_cannot_be_written_is_named_before_anything_is_computed(monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)
    words = "--output: got 'K.tex', expected a file in a folder that can be written"
    assert words in refused("derive", "planar-link", "-o", "K.tex")
    assert words.replace("K.tex", "robot.yaml").replace("--output", "NAME") in refused(
        "new", "robot"
    )


def test_an_error_while_a_file_is_written_has_its_name(monkeypatch):
    def full(path: Path, *_: object, **_more: object) -> int:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(Path, "write_text", full)
    message = refused("schema", "model", "-o", "schema.json")
    assert message == (
        "robostiff: error: could not read or write 'schema.json': No space left on device\n"
    )

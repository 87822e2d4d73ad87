"""Records on disk: the same answers to the last bit, and nothing that is damaged or of others."""

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import replace
from pkgutil import resolve_name
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis import compiled_stiffness
from robostiff.record import Program, Record, least, sine
from tests.analysis.kernels.cases import around_home, model
from tests.linkage.test_compiled_linkages import FOUR_BAR

RECORDED = "robostiff.analysis.recording.recorded_parts"
UNDER_LOAD = "robostiff.statics.kernels.compile.record_loading"


@pytest.fixture(autouse=True)
def cache(monkeypatch, tmp_path):
    folder = tmp_path / "cache"
    monkeypatch.setenv("ROBOSTIFF_CACHE", str(folder))
    return folder


def compiled(robot, outputs=None, **options):
    return rs.compile(
        robot, outputs or [rs.StiffnessMatrix()], backend=rs.Backend.ARRAYS, **options
    )


def must_not_record(monkeypatch):
    monkeypatch.setattr(RECORDED, lambda *_: pytest.fail("recorded again"))


@pytest.mark.parametrize("name", ["hexapod", "3-prs", "six-joint-arm", "gough-stewart-a"])
def test_answers_are_the_same_to_the_last_bit(name, monkeypatch):
    """In closed form, by steps, of an arm by its joints and poses, near singular poses."""
    robot = model(name)
    poses = around_home(robot, 300)
    first = compiled(robot)
    must_not_record(monkeypatch)
    again = compiled(model(name))
    assert again == first
    assert again.taken == first.taken
    one, other = first.evaluate(poses), again.evaluate(poses)
    np.testing.assert_array_equal(one.matrix, other.matrix)
    np.testing.assert_array_equal(one.status_codes, other.status_codes)
    np.testing.assert_array_equal(one.rank, other.rank)


def test_linkages_and_other_outputs_are_kept_too(monkeypatch):
    linkage = rs.load_linkage(FOUR_BAR)
    outputs = [rs.PrincipalStiffness(), rs.TotalMass()]
    legs = rs.load("gough-stewart-b", symbols=("R",))
    rates = [rs.Derivative(rs.StiffnessMatrix(), "R"), rs.DeflectionUnder([1, 2, 3, 4, 5, 6])]
    first = compiled(linkage)
    others = compiled(model("hexapod"), outputs), compiled(legs, rates, parameters=("R",))
    must_not_record(monkeypatch)
    again = compiled(rs.load_linkage(FOUR_BAR))
    drives = np.full((2, len(first.inputs)), [[0.1], [0.2]])
    np.testing.assert_array_equal(first.evaluate(drives).matrix, again.evaluate(drives).matrix)
    assert compiled(model("hexapod"), outputs).kernel == others[0].kernel
    assert compiled(legs, rates, parameters=("R",)).kernel == others[1].kernel


def test_calls_read_what_was_recorded_before(monkeypatch):
    compiled(model("3-rpr"))
    compiled(rs.load_linkage(FOUR_BAR))
    must_not_record(monkeypatch)
    assert rs.stiffness(model("3-rpr")).recorded is not None
    assert rs.stiffness(rs.load_linkage(FOUR_BAR), {"crank": 0.1}).recorded is not None


def test_a_record_is_read_at_the_second_call_without_what_makes_records():
    compiled(model("3-rpr"))
    code = (
        "import sys, robostiff as rs; robot = rs.load('3-rpr'); "
        "found = [rs.stiffness(robot).recorded is not None for _ in range(2)]; "
        "heavy = ('sympy', 'scipy', 'robostiff.recorded', 'robostiff.linkage'); "
        "print(found, [name for name in heavy if name in sys.modules])"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["[False,", "True]", "[]"]


def test_another_robot_or_output_is_recorded_for_itself(cache):
    robot = model("3-rpr")
    compiled(robot)
    compiled(robot, [rs.PrincipalStiffness()])
    compiled(robot, [rs.DeflectionUnder([1, 2, 3])])
    compiled(robot, [rs.DeflectionUnder([1, 2, 4])])
    compiled(replace(robot, reference_point=np.array([0.0, 0.01, 0.0])))
    assert len(list(cache.iterdir())) == 5


def test_the_cache_can_be_off_and_outputs_of_others_are_not_kept(cache, monkeypatch):
    class Stiffest(rs.StiffnessMatrix):
        name = "stiffest"

    compiled(model("3-rpr"), [Stiffest()])
    compiled(model("3-rpr"), [rs.EntryOf(Stiffest(), (0, 0))])
    monkeypatch.setenv("ROBOSTIFF_CACHE", "off")
    compiled(model("3-rpr"))
    assert not cache.exists()


def _with_another_record(path):
    """A whole file of another program, with a checksum that agrees."""
    body = json.dumps({"rank": 2}).encode()
    checksum = hashlib.sha256(body).hexdigest().encode()
    path.write_bytes(b"robostiff record 1\n" + checksum + b"\n" + body)


def _of_other_outputs(path):
    made = compiled(model("3-rpr"), [rs.PrincipalStiffness()])
    parts = made.rank, made.status, made.verified, made.kernel, made.joint_kernel, made.ranks
    compiled_stiffness.RecordFile(path).write(parts)


def _link(path):
    other = path.parent.parent / "other"
    path.rename(other)
    path.symlink_to(other)


HARM = {
    "shorter": lambda path: path.write_bytes(path.read_bytes()[:-20]),
    "another number": lambda path: path.write_bytes(
        path.read_bytes().replace(b"\n[3, ", b"\n[2, ")
    ),
    "another record": _with_another_record,
    "nothing": lambda path: path.write_bytes(b""),
    "other outputs": _of_other_outputs,
    "other kinds": lambda path: compiled_stiffness.RecordFile(path).write(
        (3, 4, 5, [6, 7], (), None)
    ),
}
if os.name != "nt":
    HARM |= {"writable for others": lambda path: path.chmod(0o666)}
    HARM |= {"folder writable for others": lambda path: path.parent.chmod(0o777), "link": _link}


@pytest.mark.parametrize("harm", HARM.values(), ids=HARM)
def test_what_is_damaged_or_of_others_is_recorded_again(harm, cache, monkeypatch):
    robot, made = model("3-rpr"), []
    first = compiled(robot)
    (path,) = cache.iterdir()
    harm(path)
    made.clear()
    record = resolve_name(RECORDED)
    monkeypatch.setattr(RECORDED, lambda *own: made.append(own) or record(*own))
    again = compiled(robot)
    assert len(made) == 1
    assert again == first
    assert first.rank == 3


def test_a_folder_that_takes_nothing_is_no_error(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("ROBOSTIFF_CACHE", str(tmp_path / "file" / "cache"))
    assert compiled(model("3-rpr")).rank == 3


def test_the_oldest_files_go(cache, monkeypatch):
    monkeypatch.setattr("robostiff.analysis.record_file._MOST_FILES", 2)
    robot = model("3-rpr")
    compiled(robot)
    (first,) = cache.iterdir()
    os.utime(first, (1, 1))
    for load in (1, 2):
        compiled(robot, [rs.DeflectionUnder([1, 2, load])])
    assert len(list(cache.iterdir())) == 2
    assert not first.exists()


def _program():
    record = Record({"x": [0.3], "y": [0.6]})
    x, y = record.input("x"), record.input("y")
    product = (x * y).named("xy")
    return Program.of(record, [product + sine(x), least(-x, product), 2.5])


@pytest.mark.parametrize(
    ("name", "place", "value"),
    [
        *(("a", 2, 2), ("a", 2, 99), ("a", 2, -1), ("a", 0, 1), ("b", 2, 7), ("b", 2, -1)),
        *(("b", 3, 0), ("a", 2, 2**31 - 1), ("outputs", 0, -1), ("outputs", 0, 50)),
    ],
)
def test_a_step_works_only_on_steps_before_it(name, place, value):
    program = _program()
    owner: Any = program if name == "outputs" else program.steps
    changed = [value if k == place else own for k, own in enumerate(getattr(owner, name))]
    owner = replace(owner, **{name: changed})
    data = (owner if name == "outputs" else replace(program, steps=owner)).as_data()
    with pytest.raises(ValueError, match="a program whose steps work on others"):
        Program.from_data(data)


def test_records_under_load_are_kept_with_all_that_acts(cache, monkeypatch):
    """Closed by the record or before, with parameters, drives, and what acts beside the wrench."""
    cases = [
        ("3-rpr", {}, {"drives": True, "preload": {"leg1/actuator": 5.0}}),
        (
            "3-rrr",
            {"symbols": ("k",)},
            {
                **{"parameters": ("k",), "platforms": True, "beams": rs.Linear()},
                **{"loads": {"platform": rs.Mass(20.0)}, "gravity": "-y"},
            },
        ),
        ("two-link-arm", {}, {"sites": [("arm/forearm", (0.1, 0.0, 0.0))]}),
    ]

    def all_of_them():
        return [
            rs.compile_loaded(rs.load(name, **symbols), backend=rs.Backend.ARRAYS, **given)
            for name, symbols, given in cases
        ]

    first = all_of_them()
    assert len(list(cache.iterdir())) == len(cases)
    monkeypatch.setattr(UNDER_LOAD, lambda *_: pytest.fail("recorded again"))
    for one, other in zip(first, all_of_them(), strict=True):
        assert (one.kernel, one.closure, one.general) == (
            other.kernel,
            other.closure,
            other.general,
        )
        assert (one.status, one.has_arms, one.drives) == (
            other.status,
            other.has_arms,
            other.drives,
        )
        poses, wrench = around_home(one.robot, 5), np.ones(one.robot.space.size)
        found, again = one.evaluate(poses, wrench), other.evaluate(poses, wrench)
        np.testing.assert_array_equal(np.ma.getdata(found.K), np.ma.getdata(again.K))
        assert not np.all(again.guarded)


def test_equilibria_are_answered_by_a_record_on_disk_from_the_third_on_or_for_twenty_wrenches():
    robot, wrench = rs.load("3-rpr"), [10.0, -5.0, 0.1]
    wrenches = np.linspace(-1e-2, 1e-2, 20)[:, None] * np.array(wrench)
    without = rs.equilibrium(rs.load("3-rpr"), None, wrenches)
    assert not without.known
    rs.compile_loaded(model("3-rpr"), backend=rs.Backend.ARRAYS)
    assert not rs.equilibrium(rs.load("3-rpr"), None, wrenches[:19]).known
    read = rs.equilibrium(rs.load("3-rpr"), None, wrenches)
    assert read.known
    for name in ("displacement", "pose"):
        many, expected = getattr(read, name), getattr(without, name)
        np.testing.assert_allclose(many, expected, rtol=1e-7, atol=1e-12, err_msg=name)
    np.testing.assert_allclose(read[[3, 0]].pose, read.pose[[3, 0]], rtol=1e-12)
    found = [rs.equilibrium(robot, [1e-3 * k, 0, 0], wrench) for k in range(4)]
    assert [bool(one.known) for one in found] == [False, False, True, True]
    direct = rs.equilibrium(model("3-rpr"), [3e-3, 0, 0], wrench)
    assert not direct.known
    for name in ("displacement", "pose", "K", "K_total", "wrench", "margin"):
        np.testing.assert_allclose(
            getattr(found[3], name), getattr(direct, name), rtol=1e-9, atol=1e-12, err_msg=name
        )
    assert (found[3].status, found[3].stable) == (direct.status, direct.stable)
    assert [part.part for part in found[3].parts] == [part.part for part in direct.parts]
    with pytest.raises(rs.InputError, match="gravity"):
        rs.equilibrium(robot, None, wrench, gravity=[0, "down", 1])


@pytest.mark.parametrize("name", ["six-joint-arm", "two-link-arm", "hexapod"])
def test_poses_one_by_one_are_answered_as_many_are(name):
    """By numbers, and, once they are many, by a function; slips of units are named as before."""
    robot = model(name)
    poses = around_home(robot, 220)
    together = rs.stiffness(model(name), poses)
    by_joints = isinstance(poses, rs.JointCoordinates)
    rows = np.asarray(poses.values if by_joints else poses)
    rs.compile(robot, backend=rs.Backend.ARRAYS)
    for k, row in enumerate(rows):
        one = rs.stiffness(robot, rs.JointCoordinates(row) if by_joints else row)
        size = np.sqrt(np.abs(np.diag(together.K[k])))
        assert np.max(np.abs(one.K - together.K[k]) / np.outer(size, size)) < 1e-9
        assert (one.rank, one.status) == (together.rank[k], together[k].status)
    slip = 1e3 * rows[0]
    with pytest.warns(rs.PlausibilityWarning):
        rs.stiffness(robot, rs.JointCoordinates(slip) if by_joints else slip)


def test_a_record_does_not_answer_at_a_pose_that_its_coordinates_do_not_tell():
    """All six coordinates of a robot with three free ones, whose legs decide the others."""
    robot, wrench = rs.load("3-prs"), [0, 0, -10.0, 0, 0, 0]
    rs.compile_loaded(robot, backend=rs.Backend.ARRAYS)
    there = np.array(rs.stiffness(robot).pose)
    aside = there + np.array([0.05, 0, 0, 0, 0, 0])
    for _ in range(4):
        assert rs.equilibrium(robot, there, wrench).has_answer
        assert rs.equilibrium(robot, aside, wrench).status == rs.Status.UNREACHABLE

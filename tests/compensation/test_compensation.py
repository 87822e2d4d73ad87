"""Compensation of paths: commands, files, and references in other arithmetic."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from tests.cli.running import Running

STRAIGHT = np.tile([0, 0, 0.9, 0.05, 0, 0.1], (7, 1))
STRAIGHT[:, 0] = np.linspace(-0.1, 0.1, 7)


@pytest.fixture(scope="module")
def hexapod() -> rs.Robot:
    return rs.load("hexapod")


@pytest.fixture(scope="module")
def arm() -> rs.Robot:
    return rs.load("scara")


FREE = [0, 1, 2, 5]  # coordinates of its tool


def loaded_pose(robot: rs.Robot, command: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Where `equilibrium` says that the platform is (6,)."""
    moved = rs.equilibrium(robot, command, wrench=wrench).displacement
    turned = Rotation.from_rotvec(moved[3:]) * Rotation.from_rotvec(command[3:])
    return np.concatenate([command[:3] + moved[:3], turned.as_rotvec()])


def test_equilibrium_is_on_the_path(hexapod):
    path = STRAIGHT[::3]
    wrenches = np.array([[500.0, -300 * k, -2000, 0, 5, 0] for k in range(3)])
    found = rs.compensate(hexapod, path, wrenches)
    for command, target, wrench in zip(found.commanded, path, wrenches, strict=True):
        np.testing.assert_allclose(loaded_pose(hexapod, command, wrench), target, atol=1e-11)
    assert np.max(np.linalg.norm(found.deviation[:, :3], axis=1)) > 1e-5


def test_a_robot_of_few_freedoms_is_corrected_where_it_can_be():
    robot = rs.load("3-prs")
    home = rs.find_posture(robot).pose[:, robot.coordinate_places]
    path = home + np.linspace(0, 0.01, 4)[:, None]
    found = rs.compensate(robot, path, [10.0, -5, -20, 0, 0, 0])
    free = robot.coordinate_places
    assert np.max(np.abs(found.residual[:, free])) < 1e-12
    assert np.max(np.abs(found.deviation[:, free])) > 1e-8
    stiff = [k for k in range(6) if k not in free]
    # But for what the corrected coordinates take along.
    np.testing.assert_allclose(
        found.residual[:, stiff], found.deviation[:, stiff], rtol=1e-2, atol=2e-9
    )


def test_points_without_an_answer_have_a_status_and_the_others_their_commands():
    robot = rs.load("3-rrr")
    home = rs.find_posture(robot).pose[:, robot.coordinate_places]
    path = home + np.linspace(0, 0.02, 7)[:, None]
    path[2, 0] = 5.0
    found = rs.compensate(robot, path, [0, -10.0, 0])
    assert found.answered.tolist() == [True, True, False, True, True, True, True]
    assert rs.Status(int(found.status_codes[2])) & rs.Status.UNREACHABLE
    assert np.isnan(found.commanded[2]).all()
    assert np.max(np.abs(np.delete(found.residual, 2, axis=0))) < 1e-12


def test_an_arm_has_no_command_for_what_is_too_far(arm):
    path = np.array([[0.35, 0.4, 0.1, 0, 0, 1.4], [1.9, 0.4, 0.1, 0, 0, 1.4]])
    found = rs.compensate(arm, path, [0, 0, -100, 0, 0, 0], gravity="-z")
    assert found.status_codes.tolist() == [0, int(rs.Status.UNREACHABLE)]
    lacking = found.commanded, found.drives, found.deviation, found.residual
    assert all(np.isnan(each[1]).all() for each in lacking)
    assert np.abs(found.residual[0, FREE]).max() < 1e-12  # is followed as if it were alone


@pytest.mark.parametrize("name", ["gough-stewart-b", "six-joint-arm"])
def test_the_reference_point_of_a_tool_arrives_with_the_platform(name):
    robot = replace(rs.load(name), reference_point=np.array([0.1, 0.05, 0.3]))
    pose, wrench = [0.5, 0.1, 0.6, 0.3, 0, 0], np.array([50.0, 0, -200, 0, 5, 0])
    found = rs.compensate(robot, [pose], wrench)
    (command,) = found.coordinates
    given = rs.JointCoordinates(command) if robot.is_serial else command
    off = rs.equilibrium(robot, given, wrench).pose - pose
    np.testing.assert_allclose(off, 0, atol=1e-12)
    moved = rs.equilibrium(robot, pose, wrench).displacement  # of the reference point
    np.testing.assert_allclose(found.deviation, [-moved], rtol=1e-9, atol=1e-13)


@pytest.mark.parametrize("length", [-0.25, -3.0])
def test_a_long_tool_arrives_though_the_platform_turns_as_it_moves(length):
    robot = replace(rs.load("examples/tricept.yaml"), reference_point=np.array([0, 0, length]))
    home, wrench = rs.find_posture(robot).pose[0], [200.0, 300, -100, 0, 0, 0]
    path = home[robot.coordinate_places] + np.array([[0.05, 0.05, 0.05], [-0.1, 0.1, 0]])
    found = rs.compensate(robot, path, wrench)
    for command, pose in zip(found.coordinates, found.target, strict=True):
        answer = rs.equilibrium(robot, command, wrench)
        wanted = pose[:3] + Rotation.from_rotvec(pose[3:]).apply(robot.reference_point)
        np.testing.assert_allclose(answer.point, wanted, atol=1e-12)


def test_a_hybrid_machine_is_corrected_in_its_free_coordinates():
    robot = rs.load("examples/tricept-with-head.yaml")
    path = np.array([[0.1, 0, -1.6, 0.1, 0.2], [0.1, 0.1, -1.6, 0.2, -0.1]])
    found = rs.compensate(robot, path, [200.0, 10, -30, 1, 2, 3])
    assert found.drives.shape == (2, 5)
    assert np.abs(found.residual[:, robot.coordinate_places]).max() < 1e-12
    for command, target, missing in zip(found.commanded, found.target, found.residual, strict=True):
        off = loaded_pose(robot, command, np.array([200.0, 10, -30, 1, 2, 3])) - target
        np.testing.assert_allclose(off[:3], -missing[:3], atol=1e-12)


def test_six_coordinates_that_the_legs_do_not_allow_are_out_of_reach():
    robot = rs.load("3-prs")
    home = rs.find_posture(robot).pose
    path = home + np.array([[0.0] * 6, [0.05, 0, 0, 0, 0, 0]])
    found = rs.compensate(robot, path, [0, 0, -20.0, 0, 0, 0])
    assert found.status_codes.tolist() == [0, int(rs.Status.UNREACHABLE)]
    assert np.isnan(found.commanded[1]).all()


def test_drives_beyond_their_limits_are_said(hexapod):
    limits = [leg.chain.roles for leg in hexapod.legs]
    assert limits
    high = STRAIGHT[:1].copy()
    for z in np.linspace(0.9, 1.4, 60):
        high[0, 2] = z
        posture = rs.find_posture(hexapod, high)
        if posture.reached.all() and not posture.within_limits.all():
            break
    else:
        pytest.skip("no limits within reach")
    found = rs.compensate(hexapod, high, [0, 0, -1000.0, 0, 0, 0])
    assert found.status & rs.Status.BEYOND_LIMITS
    assert np.isfinite(found.commanded).all()


def test_axes_of_the_process_force(hexapod):
    R = Rotation.from_rotvec(STRAIGHT[0, 3:]).as_matrix()
    world = np.concatenate([R @ [0, 0, -800.0], R @ [0, 3.0, 0]])
    one = rs.compensate(hexapod, STRAIGHT, world)
    two = rs.compensate(hexapod, STRAIGHT, [0, 0, -800.0, 0, 3.0, 0], axes=rs.Axes.TOOL)
    np.testing.assert_allclose(one.commanded, two.commanded, atol=1e-14)
    z = R[:, 2]
    y = np.cross(z, [1.0, 0, 0]) / np.linalg.norm(np.cross(z, [1.0, 0, 0]))
    along = np.concatenate([300.0 * np.array([1.0, 0, 0]) + 40.0 * y, np.zeros(3)])
    one = rs.compensate(hexapod, STRAIGHT, along)
    two = rs.compensate(hexapod, STRAIGHT, [300.0, 40.0, 0, 0, 0, 0], axes=rs.Axes.PATH)
    np.testing.assert_allclose(one.commanded, two.commanded, atol=1e-14)


def test_a_step_of_the_force_is_a_jump_of_the_correction(hexapod):
    path = np.repeat(STRAIGHT[:1], 40, axis=0)
    path[:, 0] = np.linspace(-0.1, 0.1, 40)
    wrenches = np.zeros((40, 6))
    wrenches[:, 2] = np.where(np.arange(40) < 25, -1000.0, -3000.0)
    assert rs.compensate(hexapod, path, wrenches).jumps == (25,)
    assert rs.compensate(hexapod, path, wrenches[0]).jumps == ()


TEXT = """# milling, 1 mm a tooth
N;x [mm];z [mm];rz [deg];Fx [N];Fz [kN];comment;depth [mm]
10;-50,5;900;3;500;-2;cut;1

# the other side
20;50,5;900;3;500;-2;"cut; fast";1
"""


def test_a_file_keeps_its_lines(hexapod, tmp_path):
    file = tmp_path / "path.csv"
    file.write_text(TEXT.replace('"cut; fast"', "cut fast"))
    with pytest.warns(rs.PlausibilityWarning, match="is not read") as warned:
        program = rs.read_program(hexapod, file)
    assert [str(own.message).removeprefix(str(file)) for own in warned] == [
        ":2:49: column 'depth' is not read"
    ]
    assert isinstance(program.poses, np.ndarray)
    np.testing.assert_allclose(program.poses[:, 0], [-0.0505, 0.0505])
    np.testing.assert_allclose(program.poses[:, 5], np.radians(3.0))
    np.testing.assert_allclose(program.wrenches, [[500, 0, -2000, 0, 0, 0]] * 2)
    found = rs.compensate(hexapod, program.poses, program.wrenches)
    out = tmp_path / "out.csv"
    rs.write_program(program, found, out)
    before, after = file.read_text().splitlines(), out.read_text().splitlines()
    assert all(new.startswith(old) for old, new in zip(before, after, strict=True))
    assert [after[k] == before[k] for k in range(6)] == [True, False, False, True, True, False]
    headings = after[1].split(";")
    last = dict(zip(headings, after[5].split(";"), strict=True))
    x = 1e-3 * float(last["x_cmd [mm]"].replace(",", "."))
    assert x == pytest.approx(found.commanded[1, 0], abs=1e-12)
    assert float(last["ry_cmd [rad]"].replace(",", ".")) == pytest.approx(found.commanded[1, 4])
    assert last["status"] == "ok"
    assert not re.search(r"\de[-+]\d", out.read_text())  # controls read no exponents


def test_fields_may_stand_in_quotes(hexapod, tmp_path):
    plain, quoted = tmp_path / "plain.csv", tmp_path / "quoted.csv"
    plain.write_text(text := "x [mm],z [mm],Fz [N]\n-20,900,-800\n")
    quoted.write_text("\n".join(f'"{line}"'.replace(",", '","') for line in text.splitlines()))
    wanted, found = (rs.read_program(hexapod, file) for file in (plain, quoted))
    np.testing.assert_array_equal(found.poses, wanted.poses)
    np.testing.assert_array_equal(found.wrenches, wanted.wrenches)
    quoted.write_text('"a; note",x [mm],z [mm],Fz [N]\n"left, 5"" side",-20,"900",-800\n')
    np.testing.assert_array_equal(rs.read_program(hexapod, quoted).poses, wanted.poses)
    quoted.write_text('a note,x [mm],z [mm],Fz [N]\n5" side,-20,900,-800\n')
    np.testing.assert_array_equal(rs.read_program(hexapod, quoted).poses, wanted.poses)
    quoted.write_bytes(f"# Fräsen\n{text}".encode("latin-1"))
    np.testing.assert_array_equal(rs.read_program(hexapod, quoted).poses, wanted.poses)
    quoted.write_text(text, encoding="utf-16")
    np.testing.assert_array_equal(rs.read_program(hexapod, quoted).poses, wanted.poses)
    plain.write_text(text.replace("900", "9_00"))
    with pytest.raises(rs.FileError, match="2:5: z: value: got '9_00', expected a finite number"):
        rs.read_program(hexapod, plain)


@pytest.mark.parametrize("order", ["zyx", "ZYX", "XYZ", "yxz"])
def test_euler_angles_in_and_out(hexapod, tmp_path, order):
    angles = {"rx": 4.0, "ry": -3.0, "rz": 7.0}
    heads = ", ".join(f"{name} [deg]" for name in angles)
    row = ", ".join(map(str, angles.values()))
    file = tmp_path / "path.csv"
    file.write_text(f"x [mm], z [mm], {heads}, Fz [N]\n10, 900, {row}, 0\n")
    program = rs.read_program(hexapod, file, angles=order)
    assert isinstance(program.poses, np.ndarray)
    given = [angles[f"r{axis}"] for axis in order.lower()]
    expected = Rotation.from_euler(order, given, degrees=True).as_rotvec()
    np.testing.assert_allclose(program.poses[0, 3:], expected, atol=1e-15)
    lines = program.with_commands(rs.compensate(hexapod, program.poses, program.wrenches))
    last = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    for name, value in angles.items():
        assert float(last[f"{name}_cmd [deg]"]) == pytest.approx(value, abs=1e-9)


def test_free_coordinates_of_a_robot_of_few_freedoms_from_a_file(tmp_path):
    robot, file = rs.load("3-prs"), tmp_path / "path.csv"
    file.write_text("z [mm],rx [deg],ry [deg],x [mm],Fz [N]\n500,5,10,3,-50\n520,0,5,0,-50\n")
    with pytest.warns(rs.PlausibilityWarning, match="'x' is not read: it is no free coordinate"):
        program = rs.read_program(robot, file)
    assert isinstance(program.poses, np.ndarray)
    np.testing.assert_allclose(
        program.poses, [[0.5, *np.radians([5, 10])], [0.52, 0, np.radians(5)]]
    )
    found = rs.compensate(robot, program.poses, program.wrenches)
    assert not found.status_codes.any()
    with pytest.warns(rs.PlausibilityWarning, match="not read"):
        turned = rs.read_program(robot, file, angles="xyz")
    assert isinstance(turned.poses, np.ndarray)
    wanted = Rotation.from_euler("xyz", [[5, 10, 0], [0, 5, 0]], degrees=True).as_rotvec()[:, :2]
    np.testing.assert_allclose(turned.poses[:, 1:], wanted)


def test_joints_of_an_arm_from_a_file(arm, tmp_path):
    names = arm.legs[0].chain.coordinate_names
    file = tmp_path / "path.csv"
    units = ["deg", "deg", "deg", "mm"]
    heads = [f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)]
    file.write_text(",".join([*heads, "Fz [N]\n20,40,5,90,-50\n25,45,0,95,-50\n"]))
    program = rs.read_program(arm, file)
    assert isinstance(program.poses, rs.JointCoordinates)
    found = rs.compensate(arm, program.poses, program.wrenches, gravity="-z")
    assert np.max(np.abs(found.residual[:, FREE])) < 1e-11
    lines = program.with_commands(found)
    behind = [head.replace(" ", "_cmd ") for head in heads]  # joints are drives, which come once
    assert lines[0].split(",")[5:] == [*behind, "residual [um]", "residual turn [urad]", "status"]
    written = [float(own) for own in lines[2].split(",")[5:9]]
    sizes = [*[180 / np.pi] * 3, 1e3]
    np.testing.assert_allclose(written, sizes * found.drives[1], rtol=1e-10, atol=1e-9)
    file.write_text("\n".join(lines))
    with pytest.warns(rs.PlausibilityWarning) as warned:
        again = rs.read_program(arm, file)
    assert len(warned) == 6
    assert "column 'shoulder_cmd' is not read" in str(warned[0].message)
    assert isinstance(again.poses, rs.JointCoordinates)
    np.testing.assert_array_equal(again.poses.values, program.poses.values)


compensate = Running("compensate")


def test_the_command(tmp_path):
    file, out, picture = (tmp_path / name for name in ("path.csv", "out.csv", "path.svg"))
    file.write_text("x [mm],z [mm],Fz [N]\n-20,900,-800\n0,900,-800\n20,900,-800\n")
    words = "hexapod", file, "-o", out, "--plot", picture
    outcome = compensate.done(*words)
    assert "hexapod, 3 points of a path" in outcome.stdout
    assert "without correction" in outcome.stdout
    assert len(out.read_text().splitlines()) == 4
    assert picture.read_text().startswith("<?xml")
    assert "--overwrite" in compensate.done(*words, status=2).stderr


def test_a_path_without_any_command(tmp_path):
    (file := tmp_path / "path.csv").write_text("x [m],y [m],rz [rad],Fx [N]\n3,0,0.3,-800\n")
    shown, data = (
        compensate.done("3-rrr", file, "--quiet", *more, status=1) for more in ([], ["--json"])
    )
    assert re.search(r"with correction +none +none\n", shown.stdout)
    assert json.loads(data.stdout)["commanded"] == [[None] * 6]


@pytest.mark.parametrize(
    ("columns", "more", "is_warned"),
    [("", [], True), (", Fz [N]", [], False), ("", ["--gravity=-z"], False)],
)
def test_a_path_without_any_load_has_a_warning(tmp_path, columns, more, is_warned):
    file = tmp_path / "path.csv"
    file.write_text(f"x [mm]{columns}\n10{', -100' * bool(columns)}\n", encoding="utf-8")
    outcome = compensate("hexapod", file, *more)
    assert outcome.exit_code == 0, outcome.stderr
    assert ("no load, in columns Fx Fy Fz Mx My Mz or as --gravity" in outcome.stderr) is is_warned


def test_a_point_is_corrected_whatever_becomes_of_the_others():
    """One whose correction does not converge ended that of all points."""
    robot = rs.load("3-rpr")
    poses = np.asarray(rs.random_postures(robot, 6, 1))
    random = np.random.default_rng(3)
    random.uniform(size=18)
    F = random.uniform(-1, 1, (6, 3)) * [200.0, 200, 20]
    several = rs.compensate(robot, poses, F)
    for k, status in enumerate(several.status_codes):
        alone = rs.compensate(robot, poses[k : k + 1], F[k : k + 1])
        assert alone.status_codes[0] == status
        np.testing.assert_allclose(several.coordinates[k], alone.coordinates[0], atol=1e-12)
        np.testing.assert_allclose(several.residual[k], alone.residual[0], atol=1e-11)


CASES = json.loads((Path(__file__).parent / "data" / "commands.json").read_text("utf-8"))


def column(machine: str, key: str) -> np.ndarray:
    return np.array([point[key] for point in CASES[machine]["points"]], dtype=float)


@pytest.fixture(scope="module")
def models(tmp_path_factory) -> dict[str, rs.Robot]:
    folder, found = tmp_path_factory.mktemp("models"), {}
    for machine, key in (("arm", "arm_yaml"), ("hexapod", "model_yaml")):
        file = folder / f"{machine}.yaml"
        file.write_text(CASES[machine][key])
        found[machine] = rs.load(file)
    return found


METHODS = {"exact": rs.Exact(), "mirror": rs.Mirror()}


@pytest.mark.parametrize("name", METHODS)
def test_commands_of_a_hexapod(models, name):
    wrenches = column("hexapod", "wrench_dead_about_reference")
    target = column("hexapod", "target_pose")
    found = rs.compensate(models["hexapod"], target, wrenches, METHODS[name])
    expected = column("hexapod", "uncompensated_displacement")
    np.testing.assert_allclose(-found.deviation, expected, atol=1e-13)
    np.testing.assert_allclose(found.commanded, column("hexapod", f"{name}_pose"), atol=1e-12)
    assert not found.status
    if name == "exact":
        assert np.max(np.abs(found.residual)) < 1e-13
        lengths = column("hexapod", "exact_strut_lengths")
        home = rs.find_posture(models["hexapod"], found.commanded).snapshot
        assert np.ptp(found.drives - lengths, axis=0).max() < 1e-12  # but for the home lengths
        assert home is not None
    else:
        for part, key in ((slice(3), "mirror_residual_m"), (slice(3, 6), "mirror_residual_rad")):
            left = np.linalg.norm(found.residual[:, part], axis=1)
            np.testing.assert_allclose(left, column("hexapod", key), atol=1e-13)


@pytest.mark.parametrize("name", METHODS)
def test_commands_of_an_arm(models, name):
    joints = rs.JointCoordinates(column("arm", "target_joints"))
    wrenches = column("arm", "wrench_dead_about_tip")
    found = rs.compensate(models["arm"], joints, wrenches, METHODS[name])
    np.testing.assert_allclose(found.target, column("arm", "target_pose"), atol=1e-13)
    expected = column("arm", "uncompensated_displacement")
    np.testing.assert_allclose(-found.deviation, expected, atol=1e-13)
    np.testing.assert_allclose(found.coordinates, column("arm", f"{name}_joints"), atol=1e-12)
    np.testing.assert_allclose(found.drives, found.coordinates)
    if name == "mirror":
        left = np.linalg.norm(found.residual[:, :3], axis=1)
        np.testing.assert_allclose(left, column("arm", "mirror_residual_m"), atol=1e-13)


@pytest.mark.parametrize("path", [np.zeros((1, 0)), np.array([[0, 0, 0.05, 0, 0, 0]])])
def test_a_structure_takes_no_commands(path):
    stage = rs.load("examples/flexure-stage.yaml")
    with pytest.raises(rs.InputError, match="'flexure stage': got a robot without drives"):
        rs.compensate(stage, path, [8, 0, 0, 0, 0, 0])

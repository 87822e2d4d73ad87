"""``robostiff map`` as a user types it."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

import robostiff as rs
from tests.cli.running import Running
from tests.files import text_of

pytestmark = pytest.mark.usefixtures("in_a_folder")
run = Running("map")


GRID = ("3-rpr", "--x", "-20 mm, 20 mm, 5", "--rz", "0 10 deg 3")


def test_a_grid_with_units():
    run.done(*GRID, "-o", "map.nc")
    with xarray.open_dataset("map.nc") as found:
        np.testing.assert_allclose(found.x, [-0.02, -0.01, 0, 0.01, 0.02], atol=1e-17)
        np.testing.assert_allclose(found.rz, np.radians([0, 5, 10]))
        x, rz = float(found.x[1]), float(found.rz[2])
        y = found.attrs["home_pose"][1]
        K = rs.stiffness(rs.load("3-rpr"), [x, y, rz]).K
        np.testing.assert_allclose(found.rotational_stiffness[1, 2, 0], K[2, 2], rtol=1e-6)


def test_the_greatest_displacement_is_that_of_the_magnitude():
    """Signed components have no common range; the default picture is of the magnitude, too."""
    grid = ("hexapod", "--x", "-0.2 0.2 5", "--wrench", "300 -200 -500 N 0 0 0")
    outcome = run.done(
        *grid, "--quantity", "deflection", "-o", "map.nc", "--json", "--plot", "map.svg"
    )
    facts = json.loads(outcome.stdout)
    wrench, places = [300, -200, -500, 0, 0, 0], np.linspace(-0.2, 0.2, 5)
    twists = [rs.deflection(rs.load("hexapod"), [x, 0, 0.9, 0, 0, 0], wrench).twist for x in places]
    for name, part in (("displacement", slice(3)), ("rotation", slice(3, 6))):
        sizes = [float(np.linalg.norm(twist[part])) for twist in twists]
        low, high, _ = facts["ranges"][f"{name}_magnitude"]
        np.testing.assert_allclose([low, high], [min(sizes), max(sizes)], rtol=1e-6)
        greatest = facts["extremes"][f"{name}_magnitude"]["greatest"]["pose"]["x"]
        assert greatest == pytest.approx(places[np.argmax(sizes)])
        assert name not in facts["ranges"]
    assert "displacement magnitude" in Path("map.svg").read_text(encoding="utf-8")


def test_the_greatest_load_names_its_actuator_and_a_rotation_in_the_plane_its_sign():
    load = ("--wrench", "100 -50 3", "--quantity", "actuator-forces", "--quantity", "deflection")
    facts = run.answer("3-rrr", "--x", "-0.02 0.02 3", *load, "-o", "map.nc")
    with xarray.open_dataset("map.nc") as found:
        forces, rotation = found.actuator_force.load(), found.rotation.load()
    for end, index in (("least", forces.argmin(...)), ("greatest", forces.argmax(...))):
        here, said = forces.isel(index), facts["extremes"]["actuator_force"][end]
        assert said["of"] == str(here.actuator.values)
        assert said["pose"]["x"] == pytest.approx(float(here.x))
    assert facts["ranges"]["rotation"][:2] == [float(rotation.min()), float(rotation.max())]
    assert "rotation_magnitude" not in facts["ranges"]


@pytest.mark.parametrize("output", ["map.zarr", "map.nc"])
def test_both_files_say_the_same(output):
    facts = run.answer(*GRID, "-o", output)
    assert facts["dimensions"] == {"x": 5, "rz": 3}
    assert facts["poses"] == facts["poses_computed"] == facts["poses_reachable"] == 15
    assert facts["statuses"] == {"ok": 15}
    low, high, unit = facts["ranges"]["translational_stiffness"]
    assert 0 < low < high
    assert unit == "N/m"
    weakest = facts["extremes"]["translational_stiffness"]["least"]
    home = rs.load("3-rpr").home
    assert home is not None
    pose = [weakest["pose"]["x"], home.p[1], weakest["pose"]["rz"]]
    K = rs.stiffness(rs.load("3-rpr"), pose).K
    np.testing.assert_allclose(np.linalg.eigvalsh(K[:2, :2])[0], low, rtol=1e-6)
    assert weakest["status"] == "ok"
    again = run.done(*GRID, "-o", output, status=2)
    if output == "map.zarr":
        assert "a path where nothing is yet" in again.stderr
        refused = run(*GRID, "-o", output, "--overwrite")
        assert refused.exit_code == 2
        assert "a store is never replaced" in refused.stderr
    else:
        assert "write --overwrite to replace it" in again.stderr
        assert run(*GRID, "-o", output, "--overwrite").exit_code == 0


def test_poses_from_a_file_and_a_load():
    Path("path.csv").write_text("time, z [mm]\n0, 900\n1, 910\n")
    arguments = ("--quantity", "deflection", "--wrench", "0 0 -1 kN 0 0 0", "-o", "bent.nc")
    run.done("hexapod", "--poses", "path.csv", *arguments)
    with xarray.open_dataset("bent.nc") as found:
        row = found.isel(pose=1).load()
    bent = rs.deflection(rs.load("hexapod"), [0, 0, 0.91, 0, 0, 0], [0, 0, -1000, 0, 0, 0])
    displacement = row.displacement.sel(displacement_axis="dz")
    assert float(displacement) == pytest.approx(bent.twist[2], rel=1e-6)
    assert float(row.time) == 1


def test_joints_random_poses_and_other_options():
    arguments = ("--random", "50", "--seed", "3", "--joint", "elbow -90 deg 90 deg")
    more = ("--quantity", "indices", "--length", "500 mm", "--threads", "1", "-o", "map.zarr")
    outcome = run.done("two-link-arm", *arguments, *more)
    found = xarray.open_zarr("map.zarr", consolidated=False)
    assert found.attrs["characteristic_length"] == 0.5
    assert found.elbow.shape == (50,)
    assert abs(found.elbow).max() <= np.pi / 2
    again = run.done("two-link-arm", *arguments, *more, "--resume")
    assert again.stdout == outcome.stdout


ARM = text_of("arm-with-a-slide-x.yaml")


def test_a_joint_with_the_name_of_a_pose_coordinate_is_that_joint():
    """It was the coordinate of the platform, also for --joint and in files of poses."""
    Path("arm.yaml").write_text(ARM.replace("HOME", ""))
    K = rs.stiffness(rs.load("arm.yaml"), rs.JointCoordinates([0, 0.3])).K
    Path("path.csv").write_text("x [mm]\n300\n")
    for given in (("--joint", "x 300 mm 300 mm 1"), ("--poses", "path.csv")):
        run.done("arm.yaml", *given, "--quantity", "stiffness", "-o", "map.nc", "--overwrite")
        np.testing.assert_allclose(xarray.open_dataset("map.nc").K[0], K, rtol=1e-12)
    outcome = run.done("arm.yaml", "--x", "0 0.3 2", "-o", "-", status=2)
    assert "expected --joint, as a joint is called x" in outcome.stderr
    outcome = run("arm.yaml", "--joint", "x 0 0.3 2", "--z", "0 0 1", "-o", "-")
    assert "expected --joint alone" in outcome.stderr
    Path("arm.yaml").write_text(ARM.replace("HOME", "home: {at: [0, 0, 0]}"))
    outcome = run.done("arm.yaml", "--joint", "x 0 0.3 2", "-o", "-", status=2)
    assert "rename the joint" in outcome.stderr


def test_large_maps_have_a_kernel_unless_asked_otherwise():
    many = ("3-rpr", "--x", "-20 mm, 20 mm, 300", "--y", "-20 mm, 20 mm, 200", "-o", "map.zarr")
    run.done(*many)
    assert xarray.open_zarr("map.zarr", consolidated=False).attrs["method"].startswith("compiled")
    run.done(*GRID, "--batched", "-o", "other.zarr")
    assert (
        xarray.open_zarr("other.zarr", consolidated=False).attrs["method"]
        == "wrench-basis, batched"
    )
    # Another method is another map.
    assert run(*many, "--batched", "--resume").exit_code == 2


REDUCED = (
    *("3-rpr", "--random", "2000", "--x", "-0.1 0.1", "--rz", "-0.2 0.2"),
    *("--reduce", "extremes", "--reduce", "quantiles 0.05 0.5"),
    *("--reduce", "above translational_stiffness 1e5 1e6"),
    *("--reduce", "histogram rotational_stiffness 0 1e4 1e6"),
)


def test_reductions_are_printed_and_can_go_on():
    poses = rs.RandomPoses(2000, {"x": (-0.1, 0.1), "rz": (-0.2, 0.2)})
    whole = rs.stiffness_map(rs.load("3-rpr"), poses)
    found = run.answer(*REDUCED, "-o", "map.npz")["reductions"]
    extremes = found["translational_stiffness_extreme"]
    assert extremes["labels"][0] == ["least", "greatest"]
    assert extremes["units"] == "N/m"
    assert found["translational_stiffness_at"]["units"] == "m, rad"
    assert extremes["values"][0] == whole.translational_stiffness.min("pose").values.tolist()
    assert sum(row[0] for row in found["rotational_stiffness_count"]["values"]) == 2000
    again = run.done(*REDUCED, "-o", "map.npz", "--resume")
    assert "translational_stiffness_extreme [N/m]" in again.stdout
    assert [path.name for path in Path().iterdir()] == ["map.npz"]
    assert run(*REDUCED, "-o", "-").stdout == again.stdout.replace(" in map.npz", "")

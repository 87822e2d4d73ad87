"""Poses from CSV; maps as NetCDF, and back."""

import re

import numpy as np
import pytest
import xarray

import robostiff as rs
from robostiff.io import map_files
from robostiff.io.map_files import read_map, read_poses, write_map_netcdf
from tests.campaign import stores


@pytest.fixture(scope="module")
def found():
    return rs.stiffness_map(
        rs.load("3-puu"),
        rs.Grid(x=rs.Axis(-0.9, 0.9, 4), z=rs.Axis(0.2, 0.3, 2)),
        [q for q in rs.Quantity if q is not rs.Quantity.TENSIONS],
        wrench=[10, 0, -20, 0, 1, 0],
    )


def test_netcdf_keeps_everything(found, tmp_path):
    write_map_netcdf(found, tmp_path / "map.nc")
    with xarray.open_dataset(tmp_path / "map.nc") as again:
        xarray.testing.assert_equal(again.load(), found)
        for name in found.variables:
            assert again[name].dtype == found[name].dtype or found[name].dtype.kind == "U"
            assert set(again[name].attrs) == set(found[name].attrs)
        assert again.status.attrs["flag_masks"].dtype == again.status.dtype
        assert again.attrs["statuses"] == found.attrs["statuses"]
    assert [path.name for path in tmp_path.iterdir()] == ["map.nc"]


def written(tmp_path, text):
    path = tmp_path / "poses.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_units_comments_and_time_of_a_trajectory(tmp_path):
    text = "# path of today\n\ntime [ms]; x [mm]; rz (deg)\n0; 10; 0\n# half way\n500;20;90\n"
    poses = read_poses(rs.load("hexapod"), written(tmp_path, text))
    assert isinstance(poses, rs.PoseList)
    assert poses.names == ("x", "rz")
    np.testing.assert_allclose(
        poses.values((slice(None),)), [[0.01, 0.02], [0, np.pi / 2]], rtol=1e-14
    )
    parameter = poses.parameter()
    assert parameter is not None
    assert parameter[:2] == ("time", "s")
    np.testing.assert_allclose(parameter[2], [0, 0.5])


def test_columns_may_be_joints(tmp_path):
    poses = read_poses(rs.load("two-link-arm"), written(tmp_path, "s,elbow [deg]\n0,180\n1,90\n"))
    np.testing.assert_allclose(poses.values((slice(None),)), [[np.pi, np.pi / 2]])
    parameter = poses.parameter()
    assert parameter is not None
    assert parameter[:2] == ("s", "m")


def test_a_mark_of_byte_order_is_no_name(tmp_path):
    assert read_poses(rs.load("hexapod"), written(tmp_path, "\ufeffx\r\n1\r\n")).names == ("x",)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(rs.InputError, match="a readable file"):
        read_poses(rs.load("hexapod"), tmp_path / "poses.csv")


def test_a_file_of_another_kind_is_no_map(tmp_path):
    written(tmp_path, "x, y\n").rename(tmp_path / "map.nc")
    with pytest.raises(rs.InputError, match="contents that HDF5 cannot read"):
        read_map(tmp_path / "map.nc")


def test_damaged_maps_are_refused_or_read_as_they_were_written(tmp_path):
    whole, kinds = stores.originals(tmp_path), stores.KINDS
    found = {stores.check(whole, kinds[i % len(kinds)], 3 + i) for i in range(15)}
    assert "refused" in found


def test_a_damaged_chunk_is_named_when_it_is_read(tmp_path):
    path = tmp_path / "map.zarr"
    grid = rs.Grid(x=rs.Axis(-0.9, 0.9, 4), z=rs.Axis(0.2, 0.3, 2))
    rs.stiffness_map(rs.load("3-puu"), grid, [rs.Quantity.STIFFNESS], store=path)
    chunk = next(file for file in (path / "K" / "c").rglob("*") if file.is_file())
    content = bytearray(chunk.read_bytes())
    content[len(content) // 2] ^= 4
    chunk.write_bytes(bytes(content))
    found = read_map(path)  # nothing of K is read yet
    with pytest.raises(
        rs.InputError, match=r"map\.zarr' is damaged: it has K/c/\S+ that cannot be read"
    ):
        found.K.load()
    chunk.unlink()
    with pytest.raises(rs.InputError, match=r"it has no K/c/"):
        read_map(path).K.load()


def test_a_changed_description_is_named(tmp_path):
    """Of the store and of each array: one letter of a unit, a title or a shape."""
    path = tmp_path / "map.zarr"
    rs.stiffness_map(rs.load("3-puu"), rs.Grid(x=rs.Axis(-0.1, 0.1, 4)), store=path)
    described = sorted(path.rglob("zarr.json"))
    assert len(described) > 5
    for file in described:
        whole = file.read_text(encoding="utf-8")
        for old, new in (("N/m", "N/n"), ("3-puu", "3-pus"), ('"shape": [', '"shape": [1')):
            file.write_text(whole.replace(old, new), encoding="utf-8")
            name = re.escape(file.relative_to(path).as_posix())
            if old in whole:
                with pytest.raises(rs.InputError, match=rf"is damaged: it has a {name} that was"):
                    read_map(path)
        file.write_text(whole, encoding="utf-8")
    assert read_map(path).attrs["poses"] == 4


def test_maps_of_other_programs_are_read_where_they_are_maps(found, tmp_path):
    found.isel(x=slice(2)).to_netcdf(tmp_path / "part.nc", engine="h5netcdf")
    xarray.testing.assert_equal(read_map(tmp_path / "part.nc"), found.isel(x=slice(2)))
    found.drop_vars("rank").to_netcdf(tmp_path / "less.nc", engine="h5netcdf")
    with pytest.raises(rs.InputError, match="without the variables status and rank"):
        read_map(tmp_path / "less.nc")


def test_what_hdf5_does_not_end_with_is_stopped(found, tmp_path, monkeypatch):
    path = tmp_path / "map.nc"
    write_map_netcdf(found, path)
    endless = tmp_path / "endless.py"
    endless.write_text("while True: pass")
    monkeypatch.setattr(map_files, "READ_HDF5", endless)
    monkeypatch.setattr(map_files, "_SECONDS", 1)
    with pytest.raises(rs.InputError, match=r"HDF5 cannot read .*more than 1 s"):
        read_map(path)
    endless.write_text("import os; os.abort()")
    with pytest.raises(rs.InputError, match="contents that HDF5 cannot read"):
        read_map(path)

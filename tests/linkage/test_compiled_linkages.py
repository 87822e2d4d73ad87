"""Kernels of linkages, and their maps."""

import pickle
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.maps import Batched, Compiled
from robostiff.analysis.maps import map as maps
from robostiff.analysis.record_file import plain
from robostiff.compiled import Backend, MachineCode, machine_code_is_available
from robostiff.elastostatics import Status
from robostiff.io.map_files import read_poses
from robostiff.model import Passive, prismatic
from robostiff.robots import robot_file
from tests.files import written

FOUR_BAR = Path(__file__).parents[2] / "examples" / "four-bar.xml"
ARRAYS = rs.Backend.ARRAYS


@cache
def _compiled(source):
    """The linkage, and its kernel of K on arrays."""
    linkage = rs.load_linkage(source)
    return linkage, rs.compile(linkage, backend=ARRAYS)


def _agrees(fast, linkage, row, K, status, rank):
    values = dict(zip(fast.inputs, row.tolist(), strict=True))
    own = rs.stiffness(rs.network_at(linkage, values))
    assert int(own.status) == status
    assert int(own.rank) == rank
    size = np.sqrt(np.maximum(np.diag(own.matrix), 0.0))
    size = np.maximum(size, 1e-4 * size.max())  # free motions: zero but for rounding
    np.testing.assert_array_less(np.abs(K - own.matrix), 1e-9 * np.outer(size, size))


@pytest.mark.parametrize(
    ("source", "low", "high"), [("double-pantograph", -0.2, 0.05), (FOUR_BAR, -0.5, 0.5)]
)
def test_a_kernel_gives_what_the_network_gives(source, low, high):
    linkage, fast = _compiled(source)
    assert fast.verified
    rows = np.linspace(low, high, 7)[:, None]
    answer = fast.evaluate(rows, again=False)
    assert answer.guarded_share < 0.5
    again = pickle.loads(pickle.dumps(fast)).evaluate(rows, again=False)  # noqa: S301
    assert np.array_equal(again.values["K"], answer.values["K"], equal_nan=True)
    for k in np.flatnonzero(~answer.guarded):
        given = answer.values["K"][k], answer.status_codes[k], answer.rank[k]
        _agrees(fast, linkage, rows[k], *given)


def test_far_from_home_the_straight_way_is_gone_in_parts():
    """A parallelogram, driven to 1 rad: no six steps lead there at once, and its coupler is level.

    Machine code and NumPy go the same way.
    """
    linkage, fast = _compiled(FOUR_BAR)
    pin = rs.network_at(linkage).reference_point
    rows = np.linspace(-1.0, 1.0, 600)[:, None]
    kernels = (fast, replace(fast, kernel=fast.kernel.by(MachineCode)))
    answers = [
        kernel.evaluate(rows, again=False) for kernel in kernels[: 1 + machine_code_is_available()]
    ]
    for answer in answers:
        assert not answer.guarded.any()
    K, other = answers[0].values["K"], answers[-1].values["K"]
    np.testing.assert_allclose(K, other, rtol=1e-9, atol=1e-9 * np.abs(K).max())
    own = rs.stiffness(rs.network_at(linkage, {"crank": 1.0}))
    assert np.linalg.norm(own.reference_point - pin) > 0.1
    np.testing.assert_allclose(K[-1], own.K, rtol=1e-9, atol=1e-9 * own.K.max())


def test_free_motions_are_those_of_the_network():
    given = rs.load_linkage("double-pantograph")
    loose = prismatic([1, 0, 0], Passive(), name="screw")
    connections = (replace(c, element=loose) if c.name == "screw" else c for c in given.connections)
    linkage = replace(given, connections=tuple(connections))
    fast = rs.compile(linkage, joints=("screw",), backend=ARRAYS)
    answer = fast.evaluate({"screw": [-0.1, 0.03]})
    assert (answer.rank == 5).all()
    assert (answer.status_codes == Status.FREE_MOTIONS).all()
    _agrees(fast, linkage, np.array([-0.1]), answer.values["K"][0], Status.FREE_MOTIONS, 5)


@pytest.mark.parametrize(("name", "h"), [("screw", 1e-5), ("k", 1e3)])
def test_rates_by_a_drive_and_by_a_parameter_are_differences(name, h):
    linkage = rs.load_linkage("double-pantograph", symbols=("k",))
    rate = rs.Derivative(rs.StiffnessMatrix(), name)
    fast = rs.compile(linkage, [rs.StiffnessMatrix(), rate], parameters=("k",), backend=ARRAYS)
    at = {"screw": np.full(3, -0.05), "k": np.full(3, 1e6)}
    at[name] += [-h, 0, h]
    values = fast.evaluate(at["screw"][:, None], parameters={"k": at["k"]}, again=False).values
    apart = np.abs(values[rate.name][1] - (values["K"][2] - values["K"][0]) / (2 * h))
    size = np.sqrt(np.abs(np.diag(values["K" if name == "screw" else rate.name][1])))
    size = np.maximum(size, 1e-3 * size.max())
    np.testing.assert_array_less(apart, 1e-5 * np.outer(size, size))


def pantograph(folder: Path, name: str) -> Path:
    """The double pantograph with the modulus of its bars among the parameters."""
    side = robot_file("double-pantograph")
    text = side.read_text().replace("{E: 70 GPa,", "{E: E,")
    text = text.replace("  k: 1e6 N/m", "  E: 70 GPa\n  k: 1e6 N/m")
    path = written(folder / name, text)
    (folder / "double-pantograph.xml").write_bytes(side.with_suffix(".xml").read_bytes())
    return path


def test_stiffnesses_may_be_inputs(tmp_path):
    """Of a drive and of a material, a value a pose; also where the network answers."""
    path = pantograph(tmp_path, "lift.yaml")
    linkage = rs.load_linkage(path, symbols=("k", "E"))
    assert [str(symbol) for symbol in linkage.symbols] == ["E", "k"]
    fast = rs.compile(linkage, parameters=("k", "E"), backend=Backend.ARRAYS)
    assert fast.verified
    assert (fast.inputs, fast.parameters) == (("screw",), ("E", "k"))
    screw, k, E = np.array([-0.15, 0.02, 0.05]), np.array([2e5, 1e6, 7e6]), 1.1e11
    answers = [fast.evaluate({"screw": screw}, parameters={"k": k, "E": E})]
    networks = replace(fast, verified=False)
    answers.append(networks.evaluate({"screw": screw}, parameters={"k": k, "E": E}))
    assert not answers[0].guarded.any()
    assert answers[1].guarded.all()
    with pytest.raises(rs.InputError, match=r"parameter E of 'double-pantograph' in row 1"):
        fast.evaluate({"screw": screw}, parameters={"E": [E, 0.0, E]})
    for i in range(3):
        own = rs.load_linkage(path, {"k": float(k[i]), "E": E})
        K = rs.stiffness(rs.network_at(own, {"screw": float(screw[i])})).K
        for answer in answers:
            assert np.allclose(answer.values["K"][i], K, rtol=0, atol=1e-11 * K.max())
    at_nominal = fast.evaluate({"screw": screw}).values["K"]
    plain = rs.compile(linkage, backend=Backend.ARRAYS).evaluate({"screw": screw}).values["K"]
    assert np.allclose(at_nominal, plain, rtol=0, atol=1e-12 * plain.max())


QUANTITIES = [
    rs.Quantity.STIFFNESS,
    rs.Quantity.PRINCIPAL_STIFFNESS,
    rs.Quantity.WORST_DEFLECTION,
    rs.Quantity.INDICES,
    rs.Quantity.DEFLECTION,
]
F = [1.0, 2, 3, 0, 0, 0]
GRID = rs.Grid(crank=rs.Axis(-1.0, 3.0, 5))


@pytest.fixture(scope="module")
def four_bar():
    return rs.load_linkage(FOUR_BAR)


def test_kernel_and_networks_give_one_map_with_a_status_at_each_pose(four_bar):
    compiled = Compiled(rs.Backend.ARRAYS)
    fast, slow = (
        rs.stiffness_map(four_bar, GRID, QUANTITIES, wrench=F, method=method)
        for method in (compiled, Batched())
    )
    assert fast.status.values.tolist() == [0, 0, 0, 64, 64]
    assert fast["rank"].values.tolist() == [6, 6, 6, -1, -1]
    assert "networks" in fast.attrs["method"]
    for name, values in slow.data_vars.items():
        scale = np.nanmax(np.abs(values))
        rtol = 1e-9 if values.dtype == np.float64 else 1e-6
        np.testing.assert_allclose(fast[name], values, atol=rtol * scale, rtol=rtol)
    assert fast.crank.attrs["units"] == "rad"
    own = rs.stiffness(rs.network_at(four_bar, {"crank": -1.0})).K
    np.testing.assert_allclose(slow.K[0], own, rtol=1e-9, atol=1e-9 * own.max())
    bent = rs.deflection(rs.network_at(four_bar, {"crank": 1.0}), None, F)
    np.testing.assert_allclose(slow.displacement[2], bent.twist[:3], rtol=1e-6)


def test_many_poses_take_the_kernel_and_few_the_networks(four_bar, monkeypatch):
    def methods(count):
        poses = rs.Grid(crank=rs.Axis(0, 0.1, count))
        return maps.checked_job(four_bar, poses, QUANTITIES[:1], length=1.0).evaluator.method

    assert methods(3) == "networks"
    monkeypatch.setattr(maps, "_LINKAGE_PAYS", 3)
    assert "compiled" in methods(3)


def test_a_map_is_resumed_from_its_store(four_bar, tmp_path):
    poses = rs.PoseList(["crank"], [[0.1], [0.2]])
    store = tmp_path / "map.zarr"
    first = rs.stiffness_map(four_bar, poses, store=store)
    again = rs.stiffness_map(rs.load_linkage(FOUR_BAR), poses, store=store, resume=True)
    assert np.array_equal(first.translational_stiffness, again.translational_stiffness)
    other = replace(four_bar, held=frozenset())
    with pytest.raises(rs.InputError, match="robot"):
        rs.stiffness_map(other, poses, store=store, resume=True)


def test_a_linkage_is_sent_to_workers_without_its_records(four_bar):
    rs.stiffness(four_bar, {"crank": 0.1})
    again = pickle.loads(pickle.dumps(four_bar))  # noqa: S301
    driven = vars(four_bar)["_kept robostiff.linkage.driven.driven_by"].values()
    assert any("_kept robostiff.analysis.posed_stiffness.record_of" in vars(own) for own in driven)
    assert not any(name.startswith("_kept") for name in vars(again))
    assert plain(again) == plain(four_bar)


def test_poses_of_joints_are_read_from_files(four_bar, tmp_path):
    found = read_poses(four_bar, written(tmp_path / "poses.csv", "crank [deg]\n0\n90\n"))
    np.testing.assert_allclose(found.values((slice(0, 2),)), [[0, np.pi / 2]])

"""Maps whose quantities are those of equilibria, pose by pose, under wrenches and their factors."""

import json
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.maps.variables import status_words
from tests.cli.running import Running

ALL = [
    rs.Quantity.STIFFNESS,
    rs.Quantity.PRINCIPAL_STIFFNESS,
    rs.Quantity.WORST_DEFLECTION,
    rs.Quantity.DEFLECTION,
]
equilibrium: Any = rs.equilibrium
WRENCH = np.array([0, 0, -7.2e7, 1e5, 0, 2e5])


def test_every_pose_has_its_equilibrium_and_its_status():
    robot = rs.load("gough-stewart-b")
    grid = rs.Grid(x=rs.Axis(0, 0, 1), factor=rs.Axis(0, 1.2, 3))
    found = rs.stiffness_map(robot, grid, ALL, wrench=WRENCH, method=rs.UnderLoad())
    home = rs.find_posture(robot).pose[0]
    words = set()
    for x in found.x.values:
        for factor in found.factor.values:
            one = equilibrium(robot, home + x * np.eye(6)[0], factor * WRENCH)
            here = found.sel(x=x, factor=factor)
            words.add(status_words(int(here.status)))
            assert status_words(int(here.status)) == str(one.status)
            if not one.has_answer:
                assert np.isnan(here.K).all()
                assert int(here["rank"]) == -1
                continue
            assert np.allclose(here.K, one.K, rtol=1e-12, atol=1e-9 * np.abs(one.K).max())
            moved = np.concatenate([here.displacement, here.rotation])
            assert np.allclose(moved, one.displacement, rtol=1e-6, atol=1e-12)
            block = np.linalg.eigvalsh(one.K_sym[:3, :3])
            assert np.allclose(here.translational_stiffness, block, rtol=1e-6)
            worst = np.linalg.norm(np.linalg.inv(one.K_total)[:3, :3], 2)
            assert float(here.worst_deflection) == pytest.approx(worst, rel=1e-6)
    assert "ok" in words
    assert any("beyond-critical-load" in own for own in words)
    assert sum(json.loads(found.attrs["statuses"]).values()) == 3


def test_a_kernel_gives_the_same_map_and_recomputes_what_is_near_the_critical_load():
    robot = rs.load("gough-stewart-b")
    random = np.random.default_rng(4)
    rows = np.column_stack([random.uniform(-0.05, 0.05, 6), -7e7 * np.linspace(0.1, 0.95, 6)])
    poses = rs.PoseList(["x", "Fz"], rows)
    by = rs.Compiled(rs.Backend.ARRAYS)
    fast, slow = (
        rs.stiffness_map(robot, poses, ALL, method=rs.UnderLoad(by=own))
        for own in (by, rs.Batched())
    )
    assert 0 < fast.attrs["poses_guarded"] < 6
    assert np.array_equal(fast.status, slow.status)
    for name in ("K", "translational_stiffness", "worst_deflection", "displacement"):
        size = float(np.nanmax(np.abs(slow[name])))
        assert np.allclose(fast[name], slow[name], rtol=2e-6, atol=1e-10 * size, equal_nan=True)


def test_a_kernel_has_the_weights_and_the_preloads_of_a_map():
    arm = rs.load("six-joint-arm")
    joints = [joint.name for joint, _ in arm.legs[0].chain.moving]
    home = np.array(arm.legs[0].chain.home)
    shifts = 0.2 * np.random.default_rng(6).uniform(-1, 1, (3, len(joints)))
    poses = rs.PoseList([*joints, "factor"], np.column_stack([home + shifts, [0.0, 0.5, 1.0]]))
    loads, preload = {"platform": rs.Mass(6.0, [0.3, 0.2, 0.9])}, {"arm/joint2": 25.0}
    wrench = np.array([40.0, 0, -100, 0, 3, 0])
    fast, slow = (
        rs.stiffness_map(
            arm, poses, ALL, wrench=wrench, method=rs.UnderLoad(loads, "-z", preload, by=own)
        )
        for own in (rs.Compiled(rs.Backend.ARRAYS), rs.Batched())
    )
    assert fast.attrs["poses_guarded"] == 0
    assert "compiled" in fast.attrs["method"]
    for name in ("K", "translational_stiffness", "worst_deflection", "displacement"):
        size = float(np.abs(slow[name]).max())
        assert np.allclose(fast[name], slow[name], rtol=2e-6, atol=1e-10 * size)
    q = rs.JointCoordinates((home + shifts)[1])
    one = equilibrium(arm, q, 0.5 * wrench, loads=loads, gravity="-z", preload=preload)
    assert np.allclose(slow.displacement[1], one.displacement[:3], rtol=1e-6)


def test_the_command_takes_factors_and_gravity():
    words = ["map", "gough-stewart-b", "--wrench", "0 0 -50 MN 0 0 0", "--quantity", "deflection"]
    run = Running()
    told = run(*words, "--under-load", "--factor", "0 2 3", "-o", "-", "--json")
    facts = json.loads(told.stdout)
    assert facts["dimensions"] == {"factor": 3}
    assert facts["statuses"] == {"ok": 2, "unstable+beyond-critical-load": 1}
    assert facts["extremes"]["displacement_magnitude"]["least"]["pose"]["factor"] == 0
    refused = run(*words, "--factor", "0 2 3", "-o", "-")
    assert refused.exit_code == 2
    assert "--under-load beside it" in refused.stderr

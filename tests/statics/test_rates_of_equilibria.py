"""Places of loaded platforms and their rates with parameters, against differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.identification.campaigns import column, model_file


def _loads(count: int) -> tuple[np.ndarray, np.ndarray]:
    forces = np.tile(column("arm", "dead_forces_at_hook"), (count // 3, 1))
    arm = column("arm", "hook_platform")
    return np.hstack([forces, 0.3 * forces]), arm[:, None] * forces[:, None, :]


@pytest.mark.parametrize(("name", "step"), [("c2", 1e-8), ("o2", 1e-4), ("upper", 1e-4)])
def test_rates_of_an_arm(tmp_path, name, step):
    names = ("c2", "o2", "upper")
    robot = rs.load(model_file("arm", tmp_path), symbols=names)
    fast = rs.compile_loaded(robot, parameters=names, platforms=True, backend=rs.Backend.ARRAYS)
    q = np.repeat(column("arm", "joint_coordinates"), 3, axis=0)
    wrenches, hooks = _loads(len(q))

    def platforms(shift: float):
        values = {name: robot.nominal[name] + shift}
        answer = fast.evaluate(rs.JointCoordinates(q), wrenches, hooks=hooks, parameters=values)
        assert not answer.guarded.any()
        assert answer.platforms is not None
        return answer.platforms

    before, here, after = platforms(-step), platforms(0.0), platforms(step)
    k = fast.parameters.index(name)
    rate = (after.points - before.points) / (2 * step)
    size = np.abs(rate).max()
    np.testing.assert_allclose(here.rates[:, :3, k], rate, atol=1e-7 * size)
    turned = (after.axes - before.axes) @ np.swapaxes(here.axes, 1, 2) / (2 * step)
    spin = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1)
    np.testing.assert_allclose(here.rates[:, 3:, k], spin, atol=1e-7 * np.abs(spin).max())


def test_what_drives_carry_and_its_rates(tmp_path):
    """Deflections are those of a spring under its load; rates are those of differences."""
    names, steps = ("c2", "upper"), (1e-8, 1e-4)
    robot = rs.load(model_file("arm", tmp_path), symbols=names)
    fast = rs.compile_loaded(robot, parameters=names, drives=True, backend=rs.Backend.ARRAYS)
    assert fast.drives == tuple(f"arm/joint{k}" for k in range(1, 7))
    q = column("arm", "joint_coordinates")
    wrench = [100.0, -300, -900, 20, 30, 40]

    def drives(name: str, shift: float) -> Any:
        values = {name: robot.nominal[name] + shift}
        return fast.evaluate(rs.JointCoordinates(q), wrench, parameters=values).platforms

    for name, step in zip(names, steps, strict=True):
        before, here, after = (drives(name, x) for x in (-step, 0.0, step))
        rate = (after.drives - before.drives) / (2 * step)
        own = here.drive_rates[..., fast.parameters.index(name)]
        for k in range(2):
            np.testing.assert_allclose(own[:, k], rate[:, k], atol=1e-7 * np.abs(rate[:, k]).max())
        np.testing.assert_allclose(here.drives[:, 0, 1], 2e-6 * here.drives[:, 1, 1], rtol=1e-12)


def test_hooks_turn_with_the_platform(tmp_path):
    """A force at a hook is a `Weight` of `equilibrium`."""
    robot = rs.load(model_file("arm", tmp_path))
    fast = rs.compile_loaded(robot, platforms=True, backend=rs.Backend.ARRAYS)
    q = column("arm", "joint_coordinates")[:1]
    force, hook = np.array([600.0, -300, -900]), column("arm", "hook_platform")
    answer = fast.evaluate(rs.JointCoordinates(q), [*force, 0, 0, 0], hooks=np.outer(hook, force))
    assert answer.platforms is not None
    weight = [rs.Weight(force, hook)]
    sure = rs.equilibrium(robot, rs.JointCoordinates(q[0]), loads={"platform": weight})
    np.testing.assert_allclose(answer.displacement[0], sure.displacement, atol=1e-12)
    pose = np.asarray(sure.pose)
    np.testing.assert_allclose(answer.platforms.points[0], pose[:3], atol=1e-12)


def test_places_beside_singular_postures_are_computed_again(tmp_path):
    """A stretched wrist has no stiffness; the place under load is that of `equilibrium`."""
    robot = rs.load(model_file("arm", tmp_path))
    fast = rs.compile_loaded(robot, platforms=True, backend=rs.Backend.ARRAYS)
    q = np.array([[0.2, 0.4, 0.3, 0.1, 0.0, 0.3]])
    force, hook = np.array([60.0, -30, -900]), column("arm", "hook_platform")
    answer = fast.evaluate(rs.JointCoordinates(q), [*force, 0, 0, 0], hooks=np.outer(hook, force))
    assert answer.platforms is not None
    sure = rs.equilibrium(
        robot, rs.JointCoordinates(q[0]), loads={"platform": [rs.Weight(force, hook)]}
    )
    assert answer.guarded.all()
    np.testing.assert_allclose(answer.platforms.points[0], np.asarray(sure.pose)[:3], atol=1e-9)

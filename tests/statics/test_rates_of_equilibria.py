"""Places of loaded platforms, what drives carry, and their rates with parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.identification.campaigns import column, model_file

STEPS = {"c2": 1e-8, "o2": 1e-4, "upper": 1e-4}


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory) -> rs.CompiledLoading:
    robot = rs.load(model_file("arm", tmp_path_factory.mktemp("arm")), symbols=tuple(STEPS))
    return rs.compile_loaded(
        robot, parameters=tuple(STEPS), platforms=True, drives=True, backend=rs.Backend.ARRAYS
    )


def evaluated(fast: rs.CompiledLoading, q: np.ndarray, *given: Any, **more: Any) -> Any:
    answer = fast.evaluate(rs.JointCoordinates(q), *given, **more)
    return answer, answer.platforms


@pytest.mark.parametrize("name", STEPS)
def test_rates_are_those_of_differences(fast: rs.CompiledLoading, name: str):
    """Of places under forces at a hook; deflections of drives are of a spring under its load."""
    q = np.repeat(column("arm", "joint_coordinates"), 3, axis=0)
    forces = np.tile(column("arm", "dead_forces_at_hook"), (len(q) // 3, 1))
    wrenches = np.hstack([forces, 0.3 * forces])
    hooks = column("arm", "hook_platform")[:, None] * forces[:, None, :]
    step, k = STEPS[name], fast.parameters.index(name)
    found = []
    for shift in (-step, 0.0, step):
        values = {name: fast.robot.nominal[name] + shift}
        answer, platforms = evaluated(fast, q, wrenches, hooks=hooks, parameters=values)
        assert not answer.guarded.any()
        found.append(platforms)
    before, here, after = found
    rate = (after.points - before.points) / (2 * step)
    np.testing.assert_allclose(here.rates[:, :3, k], rate, atol=1e-7 * np.abs(rate).max())
    turned = (after.axes - before.axes) @ np.swapaxes(here.axes, 1, 2) / (2 * step)
    spin = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1)
    np.testing.assert_allclose(here.rates[:, 3:, k], spin, atol=1e-7 * np.abs(spin).max())
    assert fast.drives == tuple(f"arm/joint{i}" for i in range(1, 7))
    rate = (after.drives - before.drives) / (2 * step)
    for i in range(2):
        size = np.abs(rate[:, i]).max()
        np.testing.assert_allclose(here.drive_rates[:, i, :, k], rate[:, i], atol=1e-7 * size)
    np.testing.assert_allclose(here.drives[:, 0, 1], 2e-6 * here.drives[:, 1, 1], rtol=1e-12)


@pytest.mark.parametrize(
    ("machine", "names"),
    [("3-rps", ("R", "r")), ("us-ups", ("r", "top")), ("examples/rocking-table.yaml", ("a", "b"))],
)
def test_joints_move_with_lengths_while_the_platform_is_at_its_pose(
    machine: str, names: tuple[str, ...]
):
    """Legs that close by iteration: a pose is held, and not their joints."""
    robot = rs.load(machine, symbols=names)
    parts = {"platforms": True, "drives": True, "backend": rs.Backend.ARRAYS}
    fast = rs.compile_loaded(robot, parameters=names, **parts)
    pose, force = rs.random_postures(robot.numeric, 1, 3), np.array([100.0, -60, 200])
    hook, F = np.outer([0.1, 0.05, 0.1], force), [*force, 6, 4, 8]
    here = fast.evaluate(pose, F, hooks=hook).platforms
    for k, name in enumerate(fast.parameters):
        value = robot.nominal[name]
        values = value + 1e-4 * value * np.array([1.0, -1.0])
        given = {"hooks": hook, "parameters": {name: values}}
        ends = fast.evaluate(np.repeat(pose, 2, axis=0), F, **given).platforms
        moved = np.subtract(*ends.points) / np.subtract(*values)
        turned = np.subtract(*ends.axes) @ here.axes[0].T / np.subtract(*values)
        rate = np.concatenate([moved, [turned[2, 1], turned[0, 2], turned[1, 0]]])
        np.testing.assert_allclose(here.rates[0, :, k], rate, atol=1e-6 * np.abs(rate).max())
        for of_joints, drives in zip(here.drive_rates[0, :, :, k], range(2), strict=True):
            rate = np.subtract(*ends.drives[:, drives]) / np.subtract(*values)
            np.testing.assert_allclose(of_joints, rate, atol=1e-6 * np.abs(rate).max())


@pytest.mark.parametrize("is_stretched", [False, True])
def test_hooks_turn_with_the_platform(fast: rs.CompiledLoading, is_stretched: bool):
    """A force at a hook is a `Weight` of `equilibrium`; a stretched wrist is computed again."""
    q = column("arm", "joint_coordinates")[:1]
    if is_stretched:
        q = np.array([[0.2, 0.4, 0.3, 0.1, 0.0, 0.3]])
    force, hook = np.array([60.0, -30, -900]), column("arm", "hook_platform")
    answer, platforms = evaluated(fast, q, [*force, 0, 0, 0], hooks=np.outer(hook, force))
    assert answer.guarded.all() == is_stretched
    given = {"platform": [rs.Weight(force, hook)]}
    sure: Any = rs.equilibrium(fast.robot.numeric, rs.JointCoordinates(q[0]), loads=given)
    limit = 1e-9 if is_stretched else 1e-12
    np.testing.assert_allclose(platforms.points[0], sure.pose[:3], atol=limit)
    np.testing.assert_allclose(answer.displacement[0], sure.displacement, atol=limit)

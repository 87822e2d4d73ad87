"""Maps of cable robots: pose by pose the answers of single poses, and of independent methods."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import linprog

import robostiff as rs
from robostiff.cables import structure_matrix
from robostiff.spatial import Frame, Space
from robostiff.spatial.rotation import matrix_of_rotation
from tests.cables.machines import random_robot


def planar_robot(seed: int, cables: int) -> rs.CableRobot:
    """Cables from a circle to a small platform in the plane."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(0, 2 * np.pi, cables)
    return rs.CableRobot(
        "planar",
        tuple(
            rs.Cable(
                f"cable{i}",
                [2 * np.cos(a), 2 * np.sin(a), 0],
                [*rng.uniform(-0.3, 0.3, 2), 0],
                EA=rng.uniform(0.5e5, 2e5),
                least_tension=rng.uniform(0, 20),
                greatest_tension=rng.uniform(500, 900),
            )
            for i, a in enumerate(turns)
        ),
        home=Frame.identity(),
        weight=rs.Weight([0, -80.0, 0], [*rng.uniform(-0.2, 0.2, 2), 0]),
        reference_point=[*rng.uniform(-0.2, 0.2, 2), 0],
        space=Space.PLANAR,
    )


@cache
def random_machines() -> list[rs.CableRobot]:
    """More cables than freedoms need, as many, and fewer; given tensions; a singular plane."""
    spatial = [random_robot(seed, cables) for seed, cables in ((1, 12), (2, 8), (3, 7), (4, 6))]
    hung = [random_robot(seed, cables) for seed, cables in ((5, 3), (6, 1))]
    loose = [replace(c, least_tension=0.0, greatest_tension=np.inf) for c in spatial[0].cables]
    given = [replace(c, tension=60.0) for c in spatial[1].cables]
    flat = [
        replace(c, exit_point=[*c.exit_point[:2], 0], attachment=[*c.attachment[:2], 0])
        for c in random_robot(7, 8, weight=False).cables
    ]
    return [
        *spatial,
        *hung,
        replace(spatial[0], cables=tuple(loose)),
        replace(spatial[1], cables=tuple(given)),
        replace(random_robot(7, 8, weight=False), cables=tuple(flat)),
        *(planar_robot(seed, cables) for seed, cables in enumerate((2, 3, 4, 5, 7), 11)),
    ]


def poses_of(robot: rs.CableRobot, count: int = 12, seed: int = 0) -> rs.RandomPoses:
    names = [own.value for own in robot.coordinates]
    return rs.RandomPoses(count, dict.fromkeys(names, (-0.6, 0.6)), seed)


def rows_of(found, robot: rs.CableRobot):
    """Poses of a map and its part at each."""
    names = [own.value for own in robot.coordinates]
    flat = found.stack(at=found["status"].dims, create_index=False)
    values = {n: np.broadcast_to(flat[n].values, flat.sizes["at"]) for n in names if n in flat}
    values |= {n: np.zeros(flat.sizes["at"]) for n in names if n not in flat}
    home = np.concatenate([robot.home.p, np.zeros(3)])
    for k, n in enumerate(["x", "y", "z", "rx", "ry", "rz"]):
        if n in names and n not in flat.coords:
            values[n] = values[n] + home[k]
    for i in range(flat.sizes["at"]):
        yield np.array([values[n][i] for n in names]), flat.isel(at=i)


def assert_same(robot: rs.CableRobot, found, wrench: np.ndarray) -> None:
    length = found.attrs["characteristic_length"]
    n, d = robot.space.size, robot.space.translations
    scale = np.array([1.0] * d + [length] * (n - d))
    for pose, here in rows_of(found, robot):
        one = rs.stiffness(robot, pose)
        plain = rs.Status(int(here.status)) & ~(rs.Status.SLACK | rs.Status.BEYOND_LIMITS)
        assert plain == one.status & ~rs.Status.BEYOND_LIMITS
        assert int(here["rank"]) == one.rank
        if not one.answered:
            assert int(here.status) == int(one.status)
            assert np.isnan(here.K).all()
            assert np.isnan(here.tension).all()
            assert np.isnan(here.displacement).all()
            continue
        np.testing.assert_allclose(here.K, one.K, rtol=1e-11, atol=1e-12 * np.abs(one.K).max())
        np.testing.assert_allclose(here.tension, one.tensions, rtol=1e-6)
        assert float(here.least_tension) == pytest.approx(one.tensions.min(), rel=1e-6)
        assert float(here.greatest_tension) == pytest.approx(one.tensions.max(), rel=1e-6)
        values = np.linalg.eigvalsh(one.K[:d, :d])
        close = {"rtol": 1e-6, "atol": 1e-7 * np.abs(values).max()}
        np.testing.assert_allclose(here.translational_stiffness, values, **close)
        values = np.linalg.eigvalsh(one.K[d:, d:])
        close = {"rtol": 1e-6, "atol": 1e-7 * np.abs(values).max()}
        np.testing.assert_allclose(here.rotational_stiffness, values, **close)
        values = np.linalg.eigvalsh(one.K / np.outer(scale, scale))
        assert float(here.largest_eigenvalue) == pytest.approx(values[-1], rel=1e-6)
        least = float(here.smallest_eigenvalue)
        assert least == pytest.approx(values[0], rel=1e-6, abs=1e-9 * values[-1])
        if one.rank < n or rs.Status.UNSTABLE in one.status:
            assert np.isnan(here.worst_deflection)
            assert np.isnan(here.displacement).all()
            continue
        C = np.linalg.inv(one.K)
        if rs.Status.ILL_CONDITIONED not in one.status:
            worst = np.linalg.eigvalsh(C[:d, :d])[-1]
            assert float(here.worst_deflection) == pytest.approx(worst, rel=1e-5)
        x = C @ wrench
        # Unstrained lengths stay; each cable is a spring.
        under = one.tensions - one.axial * (structure_matrix(one.placed).T @ x)
        assert (rs.Status.SLACK in rs.Status(int(here.status))) == bool(np.any(under < -1e-9))
        if np.any(under < -1e-9):
            assert np.isnan(here.displacement).all()
            continue
        moved = np.concatenate([here.displacement, here.rotation])
        close = {"rtol": 1e-5, "atol": 1e-6 * np.abs(x).max()}
        np.testing.assert_allclose(moved, x, **close)
        np.testing.assert_allclose(here.actuator_force, under, rtol=1e-5, atol=1e-3)


def small_wrench(robot: rs.CableRobot) -> np.ndarray:
    return np.array([0.3, -0.5, 0.2, 0.02, 0.01, -0.03])[list(robot.space.rows)]


@pytest.mark.parametrize("i", range(14))
def test_each_pose_of_random_robots_is_that_of_the_single_pose(i):
    robot = random_machines()[i]
    F = small_wrench(robot)
    assert_same(robot, rs.stiffness_map(robot, poses_of(robot), rs.Quantity, wrench=F), F)


@pytest.mark.parametrize("i", range(14))
def test_feasible_poses_are_those_of_a_linear_program(i):
    """Built here from exit points and attachments alone, with the wrench in the balance."""
    robot = random_machines()[i]
    if robot.given_tensions is not None:
        return
    F = 300 * small_wrench(robot)
    poses = poses_of(robot, 40, seed=i)
    found = rs.stiffness_map(robot, poses, [rs.Quantity.TENSIONS], wrench=F, method=rs.UnderLoad())
    six = np.zeros((40, 6))
    for name, column in zip(("x", "y", "z", "rx", "ry", "rz"), six.T, strict=True):
        if name in found:
            column[:] = found[name].values
    least, greatest = robot.tension_limits
    for k, pose in enumerate(six):
        R, p = matrix_of_rotation(pose[3:]), pose[:3]
        point = p + R @ robot.reference_point
        rows, load = [], np.concatenate([np.zeros(6)])
        load[list(robot.space.rows)] += F
        for cable in robot.cables:
            b = p + R @ cable.attachment
            u = (cable.exit_point - b) / np.linalg.norm(cable.exit_point - b)
            rows.append([*u, *np.cross(b - point, u)])
        if robot.weight is not None:
            f = np.asarray(robot.weight.force)
            load += [*f, *np.cross(p + R @ robot.weight.point - point, f)]
        A = np.array(rows).T[list(robot.space.rows)]
        load = load[list(robot.space.rows)]
        bounds = [(a, b if np.isfinite(b) else None) for a, b in zip(least, greatest, strict=True)]
        lp = linprog(np.zeros(len(bounds)), A_eq=A, b_eq=-load, bounds=bounds)
        status = rs.Status(int(found.status[k]))
        assert (rs.Status.INFEASIBLE in status) == (lp.status == 2)
        if lp.status == 0:
            t = found.tension[k].values.astype(float)
            np.testing.assert_allclose(A @ t, -load, atol=1e-4 * np.abs(t).max())
            assert np.all((t >= least * (1 - 1e-6)) & (t <= greatest * (1 + 1e-6)))
            level = least + robot.tension_level * (np.where(greatest < np.inf, greatest, 0) - least)
            aim = least if robot.tension_level == 0 else level
            # Nearest to the aim: no tensions between it and another solution are nearer.
            other = np.asarray(lp.x)
            assert (other - t) @ (t - aim) >= -1e-4 * np.abs(t).max() ** 2


def test_a_load_that_makes_a_cable_slack_is_said_to():
    robot = rs.load("cable-8")
    grid = rs.Grid(x=rs.Axis(0, 0.5, 3))
    F = [0, 0, -400.0, 0, 0, 0]
    quantities = [rs.Quantity.DEFLECTION, rs.Quantity.ACTUATOR_FORCES]
    found = rs.stiffness_map(robot, grid, quantities, wrench=F)
    for x, here in zip(grid.axis_values()["x"], found.status.values, strict=True):
        assert rs.cable_response(robot, [x, 0, 1, 0, 0, 0], F).slack
        status = rs.Status(int(here))
        assert rs.Status.SLACK in status
        assert "slack under the load" in status.advice[-1]
    assert found.displacement.isnull().all()
    assert found.actuator_force.isnull().all()


def test_the_share_of_the_workspace_and_loads_as_coordinates():
    robot = rs.load("cable-8")
    grid = rs.Grid(z=rs.Axis(0.5, 1.5, 3), factor=rs.Axis(0, 200, 3), Fx=rs.Axis(0, 50, 2))
    found = rs.stiffness_map(robot, grid, [rs.Quantity.TENSIONS], method=rs.UnderLoad())
    assert found.status.dims == ("z", "factor", "Fx")
    count = 0
    for z in found.z.values:
        for factor in found.factor.values:
            for force in found.Fx.values:
                one = rs.cable_tensions(robot, [0, 0, z, 0, 0, 0], [factor * force, 0, 0, 0, 0, 0])
                here = found.sel(z=z, factor=factor, Fx=force)
                assert int(here.status) == int(one.status)
                count += bool(one.feasible)
                if one.feasible:
                    np.testing.assert_allclose(here.tension, one.tensions, rtol=1e-6)
    assert found.attrs["poses_reachable"] == count
    assert 0 < count < 18
    assert sum(json.loads(found.attrs["statuses"]).values()) == 18


def test_an_unstable_pose_without_full_rank_has_its_negative_eigenvalue():
    """A bar whose cables cross: unstable in rotation, free sideways by the ratio of its lengths."""
    ends = {"left": ([-1, 0, 0], [0.2, 0, 0]), "right": ([1, 0, 0], [-0.2, 0, 0])}
    cables = tuple(rs.Cable(n, *points, EA=1e5, least_tension=100) for n, points in ends.items())
    robot = rs.CableRobot("bar", cables, Frame.identity(), space=Space.PLANAR)
    found = rs.stiffness_map(robot, rs.Grid(y=rs.Axis(0, 0, 1)), rs.Quantity, wrench=[0, 0, 0])
    assert rs.Status.UNSTABLE in rs.Status(int(found.status[0]))
    assert float(found.rotational_stiffness[0, 0]) < 0
    assert float(found.smallest_eigenvalue[0]) < 0
    assert np.isnan(found.worst_deflection).all()


def test_maps_by_a_kernel_are_those_of_the_batched_form():
    """Poses without tensions, and symmetric ones that the kernel leaves, among them."""
    robot = rs.load("cable-8")
    names = ("x", "y", "z", "rx", "ry", "rz")
    grid = rs.Grid(**{n: rs.Axis(*(0.3, 1.9, 6) if n == "z" else (-0.5, 0.5, 3)) for n in names})
    quantities = [
        own
        for own in rs.Quantity
        if own not in (rs.Quantity.DEFLECTION, rs.Quantity.ACTUATOR_FORCES)
    ]
    by_kernel, batched = (
        rs.stiffness_map(robot, grid, quantities, method=method)
        for method in (rs.Compiled(rs.Backend.ARRAYS), rs.Batched())
    )
    assert by_kernel.attrs["method"] == "compiled record, cables where it is unsafe"
    assert np.array_equal(by_kernel.status, batched.status)
    assert len(set(batched.status.values.ravel().tolist())) > 1
    for name in batched.data_vars:
        own, other = by_kernel[name].values, batched[name].values
        size = np.nanmax(np.abs(other))
        np.testing.assert_allclose(own, other, rtol=1e-9, atol=1e-10 * size, err_msg=str(name))

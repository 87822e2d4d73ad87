"""Poses, torques and joints behind gears, play, and loads in other axes, of simulated machines.

Truth is `equilibrium` of the true robot; where joints alone are elastic, the joints at its loaded
pose are those behind the gears.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics.turn import turn_by_vector
from robostiff.markup import page_text
from robostiff.model import Joint
from robostiff.page import page_of
from robostiff.spatial.rotation import vector_of_rotation
from tests.identification.campaigns import arm_campaign, arm_frames, column, machine

TRUE = {"c2": 1.7e-6, "c3": 3.9e-6, "c5": 2.3e-5}
ASKED = ["arm/joint2", "arm/joint3", "arm/joint5"]
LOADS = np.array([[0, 0, 0, 0, 0, 0], [400.0, -300, -900, 20, 0, 30], [0, 500, 800, 0, 40, 0]])


@pytest.fixture(scope="module")
def nominal():
    return machine("arm")


def postures() -> np.ndarray:
    return np.repeat(column("arm", "joint_coordinates"), len(LOADS), axis=0)


def loads() -> np.ndarray:
    return np.tile(LOADS, (len(postures()) // len(LOADS), 1))


def compliant(robot: rs.Robot, values: dict[str, float]) -> rs.Robot:
    """The arm with other compliances of some of its drives."""
    (leg,) = robot.legs
    elements = [
        replace(own, role=replace(own.role, stiffness=1 / values[f"c{own.name[5:]}"]))
        if f"c{own.name[5:]}" in values and isinstance(own, Joint) else own
        for own in leg.chain.elements
    ]  # fmt: skip
    return replace(robot, legs=(replace(leg, chain=rs.Chain(tuple(elements))),))


def loaded(robot: rs.Robot, q: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
    """Poses (N, 6) under load."""
    found: Any = rs.equilibrium(robot, rs.JointCoordinates(q), wrenches)
    return np.array([own.pose for own in found])


@pytest.fixture(scope="module")
def truth(nominal):
    """Poses under load, and the joints there."""
    robot = compliant(nominal, TRUE)
    poses = loaded(robot, postures(), loads())
    joints = np.array([
        rs.find_posture(robot, pose, near=q).coordinates[0][0]
        for pose, q in zip(poses, postures(), strict=True)
    ])  # fmt: skip
    return poses, joints


def assert_true(found: rs.Identified, rtol: float = 1e-6) -> None:
    for name, value in zip(ASKED, TRUE.values(), strict=True):
        assert found.values[name] == pytest.approx(value, rel=rtol), name


def test_poses_with_unknown_frames(nominal, truth):
    """A target that is turned on the flange, read by an instrument that is turned, too."""
    poses, _ = truth
    R, b = turn_by_vector(np.array([0.1, -0.2, 3.1])), np.array([2.0, -1, 0.4])
    M, m = turn_by_vector(np.array([2.0, 1.5, -0.3])), np.array([0.05, 0.02, 0.1])
    A = turn_by_vector(poses[:, 3:])
    points = (poses[:, :3] + A @ m - b) @ R.T
    values = np.hstack([points, vector_of_rotation(R @ A @ M)])
    measured = rs.Measurements(
        rs.JointCoordinates(postures()), values, wrenches=loads(), kinds=rs.Reading.POSE,
        markers="target", sigma=np.tile([1e-6] * 3 + [1e-6] * 3, (len(values), 1)),
    )  # fmt: skip
    found = rs.identify(nominal, measured, ASKED)
    assert_true(found)
    turn = [found.values[f"target turn {a}"] for a in "xyz"]
    np.testing.assert_allclose(turn_by_vector(np.array(turn)), M, atol=1e-8)
    known = rs.KnownFrames({"target": m}, [*b, 0.1, -0.2, 3.1], {"target": [2.0, 1.5, -0.3]})
    again = rs.identify(nominal, measured, ASKED, frames=known)
    assert_true(again)
    assert again.names == tuple(ASKED)
    assert again.std["arm/joint2"] < found.std["arm/joint2"]


def test_postures_whose_points_alone_were_read(nominal, truth):
    """Some of the readings of poses and points are points: other postures, and parts of folds."""
    poses, _ = truth
    kinds = [rs.Reading.POSE] * 6 + [rs.Reading.POINT] * 6
    measured = rs.Measurements(
        rs.JointCoordinates(postures()), poses, wrenches=loads(), kinds=kinds,
        markers="target", sigma=np.full((12, 6), 1e-6),
    )  # fmt: skip
    points = measured.chosen(range(6, 12))
    assert points.values.shape == points.sigma.shape == (6, 3)
    frames = rs.KnownFrames({"target": [0, 0, 0]}, turns={"target": [0, 0, 0]})
    found = rs.identify(nominal, measured, ASKED, frames=frames)
    assert_true(found)
    assert found.predict(points)[0] == pytest.approx(poses[6:, :3], abs=1e-9)
    unseen = found.cross_validated(4).errors
    assert np.isnan(unseen).sum() == 18
    assert np.nanmax(np.abs(unseen)) < 1e-8
    with pytest.raises(rs.InputError, match=r"folds: got 2\.5, expected 2 to 4"):
        found.cross_validated(2.5)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [rs.Reading.TORQUE, rs.Reading.JOINT])
def test_drives_alone_need_no_frames(nominal, truth, kind):
    _, joints = truth
    q, k = postures(), 1 / np.array(list(TRUE.values()))
    moved = (joints - q)[:, [1, 2, 4]]
    values = joints[:, [1, 2, 4]] if kind is rs.Reading.JOINT else -moved * k
    count = len(q)
    measured = rs.Measurements(
        rs.JointCoordinates(np.repeat(q, 3, axis=0)),
        np.column_stack([values.ravel(), np.full((3 * count, 2), np.nan)]),
        wrenches=np.repeat(loads(), 3, axis=0), kinds=kind, sigma=1e-6,
        drives=["joint2", "arm/joint3", "joint5"] * count,
    )  # fmt: skip
    assert repr(measured) == "<Measurements: 36 readings of 3 drives at 4 postures>"
    found = rs.identify(nominal, measured, ASKED)
    assert_true(found, 1e-5)


@pytest.mark.parametrize("beside", [False, True])
def test_a_page_has_torques_in_their_own_unit(nominal, truth, beside):
    """Loading less unloading, and the standard deviation that torques alone tell."""
    q, count = postures(), len(postures())
    torques = (truth[1] - q)[:, 1] / -TRUE["c2"]
    values = np.full((2 * count, 3), np.nan)
    values[:, 0] = np.concatenate([torques + 0.25, torques - 0.25])
    kinds, sigma = [rs.Reading.TORQUE] * 2 * count, None
    if beside:
        places = truth[0][0, :3] + np.array([[4e-6], [0.0]])
        values, kinds = np.vstack([values, places]), [*kinds, *[rs.Reading.POINT] * 2]
        sigma = np.ones(values.shape)
    rows = [*range(count), *range(count), *[0] * (len(values) - 2 * count)]
    measured = rs.Measurements(
        rs.JointCoordinates(q[rows]), values, loads()[rows], kinds=kinds, drives="joint2",
        sigma=sigma, directions=[1] * count + [-1] * count + [1, -1] * beside,
    )  # fmt: skip
    found = rs.identify(nominal, measured, ASKED[:1], frames=rs.KnownFrames({"marker": [0, 0, 0]}))
    lines = page_text(page_of(found)).splitlines()
    told = {" ".join(words): number for *words, number in (s.split() for s in lines if s)}
    floor = "loading less unloading, root mean square"
    assert float(told[f"{floor} [SI]"]) == pytest.approx(0.5, rel=1e-4)
    assert (f"{floor} [µm]" in told) == beside
    if beside:
        assert float(told[f"{floor} [µm]"]) == pytest.approx(4.0, rel=1e-4)
    else:
        told_sigma = float(told["standard deviation of a coordinate [SI]"])
        assert told_sigma == pytest.approx(found.sigma, rel=1e-4)


def test_play_follows_the_torque(nominal, truth):
    """Each joint with play is turned by half of it, on the side to which it is strained."""
    robot, play = compliant(nominal, TRUE), 4e-4
    moved = truth[1] - postures()
    side = np.sign(moved[:, 1])
    assert {-1.0, 1.0} <= set(side)
    q = postures()
    q[:, 1] += 0.5 * play * side
    poses = loaded(robot, q, loads())
    marks = {"a": np.array([0.1, 0, 0]), "b": np.array([0, 0.1, 0.1])}
    values = np.vstack([poses[:, :3] + turn_by_vector(poses[:, 3:]) @ m for m in marks.values()])
    measured = rs.Measurements(
        rs.JointCoordinates(np.tile(postures(), (2, 1))), values, wrenches=np.tile(loads(), (2, 1)),
        markers=["a"] * len(q) + ["b"] * len(q), sigma=1e-6,
    )  # fmt: skip
    found = rs.identify(
        nominal, measured, [*ASKED, "arm/joint2.play"], frames=rs.KnownFrames(marks)
    )
    assert found.values["arm/joint2.play"] == pytest.approx(play, rel=1e-6)
    assert_true(found)
    assert rs.equilibrium(found.robot, rs.JointCoordinates(q[1]), loads()[1]).pose == pytest.approx(
        poses[1], abs=1e-9
    )
    one = measured.chosen([k for k in range(len(q)) if side[k] > 0])
    with pytest.raises(rs.InputError, match=r"loads for arm/joint2\.play: got torques of one sign"):
        rs.identify(nominal, one, [*ASKED, "arm/joint2.play"], frames=rs.KnownFrames(marks))


@pytest.mark.parametrize("axes", [rs.LoadAxes.PLATFORM, rs.LoadAxes.INSTRUMENT])
def test_loads_in_other_axes(nominal, axes):
    """The same campaign, its loads written in axes of the platform or of the instrument."""
    world = arm_campaign()
    R = turn_by_vector(np.asarray(arm_frames().instrument)[3:])
    turn = np.broadcast_to(R, (len(world), 3, 3))
    if axes is rs.LoadAxes.PLATFORM:
        pose = rs.find_posture(nominal, world.postures).pose
        turn = np.swapaxes(turn_by_vector(pose[:, 3:]), 1, 2)
    turned = replace(world, forces=np.einsum("nij,nj->ni", turn, world.forces), axes=axes)
    before = rs.identify(nominal, world, ["arm/joint*"])
    after = rs.identify(nominal, turned, ["arm/joint*"])
    # the found turn of the instrument, by which loads are turned, differs from the true one
    off = 1e-9 if axes is rs.LoadAxes.PLATFORM else 0.05
    for name, d in before.std.items():
        if name.startswith("arm"):
            assert abs(after.values[name] - before.values[name]) < off * d


def test_uncertain_loads_add_to_errors(nominal):
    """Of a small load the deflection is C F: a part of the load is that part of the deflection."""
    robot = rs.load("hexapod")
    marks = {"m": np.zeros(3)}
    wrench = np.array([300.0, 0, 0, 0, 0, 0])
    measured = rs.Measurements(
        np.tile([[0, 0, 0.9, 0, 0, 0]], (2, 1)), [[1e-6, 0, 0], [1e-6, 0, 0]], sigma=1e-9,
        wrenches=[wrench, -wrench], kinds=rs.Reading.DISPLACEMENT, markers="m",
        sigma_wrench=[3.0, 0, 0, 0, 0, 0],
    )  # fmt: skip
    asked = {"parameters": ["leg*/strut"], "shared": True, "frames": rs.KnownFrames(marks)}
    found = rs.identify(robot, measured, **asked)
    C = rs.compliance(robot)
    np.testing.assert_allclose(
        found.model.sigma[:3], np.hypot(1e-9, 3.0 * np.abs(C[:3, 0])), rtol=1e-9
    )
    finite = replace(measured, values=np.array([[0, 0, 0.9], [0, 0, 0.9]]), kinds=rs.Reading.POINT)
    sigma = rs.identify(robot, finite, **asked).model.sigma
    np.testing.assert_allclose(sigma[0], found.model.sigma[0], rtol=1e-3)
    with pytest.raises(rs.InputError, match="sigma: got none, or one for all"):
        replace(measured, sigma=None)


def test_uncertain_loads_add_to_errors_of_drives(nominal):
    """By equilibria under loads that are so much larger and smaller, of torques and joints."""
    q, sigma = postures()[:3], np.array([20.0, 10.0, 30.0, 1.0, 2.0, 3.0])
    measured = rs.Measurements(
        rs.JointCoordinates(np.tile(q, (2, 1))), np.tile([0.0, np.nan, np.nan], (6, 1)),
        np.tile(LOADS, (2, 1)), kinds=[rs.Reading.TORQUE] * 3 + [rs.Reading.JOINT] * 3,
        drives="joint3", sigma=np.full((6, 3), 1e-9), sigma_wrench=sigma,
    )  # fmt: skip
    found = rs.identify(nominal, measured, ["arm/joint3"])
    expected = np.full((2, 3), 1e-18)
    for k, own in np.ndindex(3, 6):
        read = []
        for shift in (sigma[own], -sigma[own]):
            wrench = LOADS[k] + shift * np.eye(6)[own]
            answer: Any = rs.equilibrium(nominal, rs.JointCoordinates(q[k]), wrench)
            (part,) = (one for one in answer.parts if one.part == "joint3")
            read.append((part.load, part.motion[0]))
        expected[:, k] += (0.5 * np.subtract(*read)) ** 2
    np.testing.assert_allclose(found.model.sigma, np.sqrt(expected.ravel()), rtol=1e-7)
    assert found.model.sigma.min() > 1e-7


@pytest.fixture(scope="module")
def hung_on_an_elbow(nominal):
    """Readings of the true arm under a force on its third body, and one on its platform."""
    q, at, force = postures(), np.array([0.1, 0.05, -0.2]), np.array([300.0, -200, -1200])
    robot, marks = compliant(nominal, TRUE), {"m": np.array([0.1, 0.05, 0.02])}
    on_body = np.arange(len(q)) % 2 == 1
    read = []
    for k, joints in enumerate(q):
        body, hook = ("arm/joint3", at) if on_body[k] else ("platform", marks["m"])
        one: Any = rs.equilibrium(
            robot, rs.JointCoordinates(joints), loads={body: rs.Weight(force, hook)}
        )
        read.append(one.pose[:3] + turn_by_vector(one.pose[3:]) @ marks["m"])
    measured = rs.Measurements(
        rs.JointCoordinates(q), read, forces=force,
        hooks=np.where(on_body[:, None], at, marks["m"]),
        bodies=["arm/joint3" if own else "" for own in on_body], sigma=2e-5,
    )  # fmt: skip
    return measured, rs.KnownFrames({"marker": marks["m"]})


def test_forces_at_hooks_of_bodies(nominal, hung_on_an_elbow):
    measured, frames = hung_on_an_elbow
    found = rs.identify(nominal, measured, ASKED, frames=frames)
    assert_true(found)
    on_body = measured.chosen([k for k, own in enumerate(measured.bodies) if own])
    values, std = found.predict(on_body)  # of other loads than before
    np.testing.assert_allclose(values, on_body.values, atol=1e-9)
    assert np.all(std > 0)
    wrong = replace(measured, bodies="arm/upper", lines=tuple(range(2, 14)), source="read.csv")
    with pytest.raises(rs.InputError, match=r"hook of read.csv:2: got 'arm/upper', .*'arm/joint"):
        rs.identify(nominal, wrong, ASKED, frames=frames)


def test_poses_under_forces_on_bodies(nominal):
    """A force on the third body strains the joints before it alone."""
    joints = rs.JointCoordinates(column("arm", "joint_coordinates"))
    asked = ["arm/joint2", "arm/joint5"]
    hung: dict[str, Any] = {"forces": [300.0, -200, -1200], "hook": [0.1, 0, 0], "repeats": True}
    markers = {"m": [0.1, 0.05, 0]}
    d = {
        body: rs.choose_poses(nominal, joints, 8, asked, markers, **hung, body=body).std
        for body in ("", "arm/joint3")
    }
    assert d["arm/joint3"]["arm/joint2"] < 3 * d[""]["arm/joint2"]
    assert d["arm/joint3"]["arm/joint5"] > 3 * d[""]["arm/joint5"]


def test_loading_and_unloading():
    measured = rs.Measurements(
        [[0, 0, 0.9, 0, 0, 0]] * 4, [[0, 0, 5e-6], [0, 0, 9e-6], [0, 0, 7e-6], [0, 0, 0]],
        wrenches=[[0, 0, -100, 0, 0, 0]] * 3 + [[0] * 6], directions=[1, -1, 1, 1],
        kinds=rs.Reading.DISPLACEMENT,
    )  # fmt: skip
    np.testing.assert_allclose(measured.branches, [[0, 0, -3e-6]], atol=1e-18)


@pytest.mark.parametrize("file", ["exechon", "tricept-with-head"])
def test_stiffness_parameters_of_legs_closed_by_iteration(file: str):
    """A stiffness that is a parameter is found as its reciprocal, poses as the postures."""
    name, pose = {
        "exechon": ("k", [[-1.2, 0.1, 0.05], [-1.25, -0.1, -0.05]]),
        "tricept-with-head": ("ka", [[0.1, 0.05, -1.6, 0.1, 0.2], [0, 0, -1.7, 0.3, 0.1]]),
    }[file]
    robot = rs.load(f"examples/{file}.yaml", symbols=(name,))
    true = robot.substituted({name: 0.6 * robot.nominal[name]})
    loads = np.array([[3000.0, 2000, -5000, 100, 50, -200], [-1000, 2000, 1000, -100, 300, 100]])
    poses: Any = rs.equilibrium(true, pose, loads)
    marks = {"m1": [0.08, 0.1, 0], "m2": [0.05, -0.09, 0.08]}
    A = turn_by_vector(np.array([own.pose[3:] for own in poses]))
    points = [own.pose[:3] + R @ m for own, R in zip(poses, A, strict=True) for m in marks.values()]
    measured = rs.Measurements(
        np.repeat(pose, 2, axis=0), points, wrenches=np.repeat(loads, 2, axis=0),
        markers=[*marks] * 2, sigma=1e-6,
    )  # fmt: skip
    found = rs.identify(robot, measured, [name], frames=rs.KnownFrames(marks))
    assert found.values == {f"1/{name}": pytest.approx(1 / (0.6 * robot.nominal[name]), rel=1e-6)}

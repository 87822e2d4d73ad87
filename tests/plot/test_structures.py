"""Networks and machines of all kinds, displaced and under load, as they are drawn."""

import pathlib

import numpy as np
import pytest

import robostiff as rs
from robostiff.network import Network
from robostiff.plot.displacement import STILL, end_key, finite_motions, motion_under, node_key
from robostiff.plot.picture import Arrow, Marks, Path
from robostiff.plot.posed_robot import picture_of_posed
from tests.plot.machines import robot, twist_about
from tests.statics.robots_under_load import loaded
from tests.statics.test_load_paths import LIMIT, shallow_truss

DATA = rs.plot.PictureData()


STAR = pathlib.Path(__file__).parents[2] / "docs" / "star-platform.yaml"


def motion_between(motions, element, point) -> np.ndarray:
    """Twist of the second body of an element against the first."""
    return twist_about(motions[element.b], point) - twist_about(motions[element.a], point)


@pytest.mark.parametrize("load", [(100, 0, 50, 0, 0, 0), (0, 20, -70, 3, -2, 1)])
def test_bodies_of_a_network_move_as_its_springs_and_joints_let_them(load):
    """The energy of the displacements of all springs is the work of the load; joints stay whole."""
    network = robot("double-pantograph")
    bent = rs.deflection(network, None, load)
    motions = motion_under(network, bent)
    tip = twist_about(motions[network.platform], network.reference_point)
    np.testing.assert_allclose(tip, bent.twist, rtol=1e-8, atol=1e-12)
    energy = 0.0
    for spring in network.springs:
        d, R = motion_between(motions, spring, spring.point), spring.rotation
        own = np.concatenate([R.T @ d[:3], R.T @ d[3:]])
        energy += 0.5 * own @ np.linalg.pinv(spring.elasticity.compliance, rcond=1e-13) @ own
    for joint in network.joints:
        point = joint.freedoms[0].point
        moved = motion_between(motions, joint, point)
        free = np.array([freedom.twist(point) for freedom in joint.freedoms]).T
        q = np.linalg.lstsq(free, moved, rcond=None)[0]
        assert np.abs(moved - free @ q).max() <= 1e-9 * np.abs(tip).max()
        stiffness = np.array([freedom.stiffness or 0.0 for freedom in joint.freedoms])
        energy += 0.5 * float(stiffness @ q**2)
    assert energy == pytest.approx(bent.energy, rel=1e-6)


def test_a_flexible_platform_bends_and_keeps_the_legs_together():
    star = rs.load(STAR)
    bent = rs.deflection(star, None, [500, 0, -1000, 0, 0, 20])
    snapshot = rs.find_posture(star).snapshot.one(0)
    motions = motion_under(snapshot, bent)
    placed = snapshot.platform
    assert placed is not None
    for i, leg in enumerate(snapshot.legs):
        assert end_key(snapshot, i) == node_key(placed.holds[i])
        end = motions[end_key(snapshot, i)].displacement(leg.end)
        last = motions[f"{leg.name}/{leg.elements[-1].name}"]
        np.testing.assert_allclose(last.displacement(leg.end), end, atol=1e-12)
    energy = 0.0
    for part in placed.platform.parts:
        point, R = placed.in_world(part.point), placed.rotation @ part.axes
        a, b = (twist_about(motions[node_key(name)], point) for name in (part.a, part.b))
        d = b - a
        own = np.concatenate([R.T @ d[:3], R.T @ d[3:]])
        energy += 0.5 * own @ np.linalg.solve(part.elasticity.compliance, own)
    felt = sum(part.energy for part in bent.parts if part.leg == "platform")
    assert energy == pytest.approx(felt, rel=1e-6)
    picture = picture_of_posed(snapshot, bent)
    paths = [one for one in picture.items if isinstance(one, Path)]
    (arm,) = (one for one in paths if one.about.startswith("platform/arm1"))
    assert len(arm.points) > 2
    assert picture.notes == ("displacements × 1000",)


def test_nodes_of_a_flexible_platform_rest_where_small_loads_move_them():
    star, load = rs.load(STAR), [0.5, 0, -1, 0, 0, 0.02]
    rest = rs.equilibrium(star, wrench=load)
    snapshot = rs.find_posture(star).snapshot.one(0)
    small = motion_under(snapshot, rs.deflection(star, None, load))
    finite = finite_motions(snapshot, rest.places)
    placed = snapshot.platform
    assert placed is not None
    for node in placed.platform.nodes:
        point = placed.in_world(placed.platform.point_of(node.name))
        moved = small[node_key(node.name)].displacement(point)
        found = finite[node_key(node.name)].displacement(point)
        np.testing.assert_allclose(found, moved, rtol=0, atol=2e-3 * abs(moved).max())
    for i, leg in enumerate(snapshot.legs):
        end = finite[end_key(snapshot, i)].displacement(leg.end)
        last = finite[f"{leg.name}/{leg.elements[-1].name}"]
        np.testing.assert_allclose(last.displacement(leg.end), end, rtol=0, atol=1e-12)
    bent = [one for one in rs.plot.equilibrium(rest, backend=DATA).items if isinstance(one, Path)]
    assert any(one.about.startswith("platform/arm1") and len(one.points) > 2 for one in bent)
    heavy = rs.modes(star, masses={"platform": 5.0})
    assert rs.plot.mode(heavy, backend=DATA).items


def test_a_loaded_cable_robot_is_drawn_where_it_rests():
    known = robot("cable-8")
    found = rs.cable_response(known, None, [300, 0, 200, 0, 0, 0])
    scene = rs.plot.robot(known, None, deflection=found, exaggeration=1.0, backend=DATA)
    assert found.after is not None
    lines = [one for one in scene.items if isinstance(one, Path)]
    drawn = {one.about.partition(":")[0]: one for one in lines if one.about}
    for name, end in zip(found.after.cable_names, found.after.placed.attachments, strict=True):
        np.testing.assert_allclose(drawn[name].points[1], end)
        assert drawn[name].dashed == (name in found.slack)
    assert sum(not one.about for one in lines) == 8  # the cables without load


@pytest.mark.parametrize(
    ("name", "pose", "load"),
    [
        ("cable-8", [0.1, 0.05, 1.1, 0, 0.1, 0], [100, 0, -250, 0, 0, 0]),
        ("cable-4-planar", [0.9, 0.7, 0.1], [10, -100, 0]),
    ],
)
def test_a_cable_robot_in_equilibrium_is_drawn_as_its_response_is(name, pose, load):
    known = robot(name)
    rest = rs.equilibrium(known, pose, load)
    found = rs.cable_response(known, pose, load)
    assert found.slack
    for times in (1.0, 20.0):
        one = rs.plot.equilibrium(rest, exaggeration=times, backend=DATA)
        other = rs.plot.robot(known, pose, deflection=found, exaggeration=times, backend=DATA)
        assert one.title == f"{name} under load"
        ways = [[own for own in scene.items if isinstance(own, Path)] for scene in (one, other)]
        for a, b in zip(*ways, strict=True):
            np.testing.assert_allclose(a.points, b.points, atol=1e-8)
            assert (a.dashed, a.about) == (b.dashed, b.about)


@pytest.mark.parametrize("name", ["3-puu", "h4", "double-pantograph", "cable-8"])
def test_rounding_of_places_is_not_drawn_without_a_load(name):
    rest = rs.equilibrium(robot(name))
    assert rs.plot.equilibrium(rest, backend=DATA).notes == ()


def test_a_mode_of_a_cable_robot_swings_about_its_rest():
    known = robot("cable-8")
    modes = rs.modes(known, masses={"platform": rs.Mass(5, inertia=[0.1, 0.1, 0.1])})
    rest = {cable.name: cable.attachment + known.home.p for cable in known.cables}
    for number in (1, 4):
        ends = []
        for side in (1.0, -1.0):
            items = rs.plot.mode(modes, number, side, backend=DATA).items
            lines = [own for own in items if isinstance(own, Path) and own.about]
            ends.append({own.about: own.points[1] for own in lines})
        for name, at in rest.items():
            np.testing.assert_allclose((ends[0][name] + ends[1][name]) / 2, at, atol=1e-9)
        moved = np.array([ends[0][name] - at for name, at in rest.items()])
        twist = modes[number - 1].twist
        arms = np.array([at - known.home.p for at in rest.values()])
        wanted = twist[:3] + np.cross(twist[3:], arms)
        wanted *= np.linalg.norm(moved) / np.linalg.norm(wanted)
        np.testing.assert_allclose(moved, wanted, atol=2e-3 * np.abs(wanted).max())


@pytest.mark.parametrize("name", ["cable-4-planar", "cable-8", "double-pantograph"])
def test_results_of_them_are_drawn(name):
    result = rs.stiffness(robot(name))
    assert rs.plot.matrix(result).get_title() == f"{name}: stiffness"
    for drawn in (rs.plot.ellipsoid, rs.plot.free_motions):
        assert drawn(result, within=robot(name)).get_title().startswith(f"{name}: ")


STRUCTURES = ("double-pantograph", "examples/portal.json")
LOAD = np.array([20.0, 10, -30, 1, 2, 3])


@pytest.mark.parametrize("name", STRUCTURES)
def test_bodies_move_as_in_the_linear_answer_when_loads_are_small(name):
    robot, F = rs.load(name), 1e-4 * LOAD
    answer = loaded(robot, wrench=F)
    assert isinstance(answer.posed, Network)
    network = answer.posed
    finite, linear = (
        finite_motions(network, answer.places),
        motion_under(network, rs.deflection(robot, wrench=F)),
    )
    assert set(finite) == set(linear) - set(network.fixed)
    points = np.array([node.point for node in network.nodes])
    for body in linear:
        expected = np.array([linear[body].displacement(p) for p in points])
        found = [finite.get(body, STILL).displacement(p) for p in points]
        np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max() + 1e-13)


@pytest.mark.parametrize("name", STRUCTURES)
def test_the_platform_is_drawn_where_it_comes_to_rest(name):
    answer = loaded(rs.load(name), wrench=LOAD)
    true, rest = (
        rs.plot.equilibrium(answer, exaggeration=times, backend=DATA) for times in (1.0, 0.0)
    )
    at = [
        next(
            own for own in scene.items if isinstance(own, Marks) and own.label == "reference point"
        )
        for scene in (true, rest)
    ]
    unit = 1e3 if "mm" in true.axes[0] else 1.0
    moved = (at[0].points[0] - at[1].points[0]) / unit
    np.testing.assert_allclose(moved, answer.displacement[:3], atol=1e-12)
    assert any(isinstance(own, Arrow) for own in true.items)
    dashed = [own for own in true.items if isinstance(own, Path) and own.dashed]
    assert dashed
    assert dashed[0].label == "without load"


def test_both_ends_of_a_mode_lie_on_opposite_sides_of_rest():
    modes = rs.modes(rs.load("double-pantograph"), masses={"platform": 10})
    one, other = (rs.plot.mode(modes, 1, side, backend=DATA) for side in (1.0, -1.0))
    assert one.title.startswith("double-pantograph, mode 1: ")
    lines = [[own.points for own in scene.items if isinstance(own, Path)] for scene in (one, other)]
    rest = [own.points for own in one.items if isinstance(own, Path) and own.dashed]
    beams = [
        [own.points for own in scene.items if isinstance(own, Path) and "lower" in own.about]
        for scene in (one, other)
    ]
    assert len(lines[0]) == len(lines[1])
    middles = [0.5 * (a[[0, -1]] + b[[0, -1]]) for a, b in zip(*beams, strict=True)]
    assert middles
    for middle in middles:
        nearest = min(np.abs(line[[0, -1]] - middle).max() for line in rest if len(line) > 1)
        assert nearest < 1e-9 * 600


@pytest.fixture(scope="module")
def curve():
    return rs.load_path(shallow_truss(), None, [0, -LIMIT, 0], [0.25, 0.5, 1.5])


def test_stable_and_unstable_parts_of_a_path(curve):
    picture = rs.plot.load_curve(curve, backend=DATA)
    stable, unstable, asked = picture.curves
    assert (picture.x_label, stable.name, unstable.name) == ("dy [mm]", "stable", "unstable")
    assert unstable.is_dashed
    along = 1e3 * curve.path_displacement.sel(twist="dy").values
    assert np.allclose(stable.x[curve.path_stable.values], along[curve.path_stable.values])
    assert np.isnan(stable.x[~curve.path_stable.values]).all()
    assert np.array_equal(np.isfinite(asked.x), curve.stable.values)
    met = np.isfinite(stable.x) & np.isfinite(unstable.x)
    assert met.sum() == 1  # the dashed line begins where the other ends


def test_matplotlib_draws_it(curve):
    axes = rs.plot.load_curve(curve, "dx")
    assert axes.get_xlabel().startswith("dx")
    styles = [line.get_linestyle() for line in axes.get_lines()]
    assert styles == ["-", "--", "None"]  # equilibria at the given loads are marks alone

"""Units never change an answer: quantities give what their SI numbers give, or an error."""
# pyright: reportArgumentType=false
# pyright: reportInvalidTypeForm=false
# pyright: reportCallIssue=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportOperatorIssue=false
# pyright: reportIndexIssue=false

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pint
import pytest

import robostiff as rs
from robostiff.errors import InputError
from robostiff.io.units import make_quantity, make_unit
from robostiff.network import compliance_between
from robostiff.spatial import as_floats, holds_quantities, move_stiffness, move_twist, move_wrench


def Q(number: Any, unit: str | None = None) -> Any:
    """A quantity of the one registry of all tests, which is read where one is needed first."""
    return pint.get_application_registry().Quantity(number, unit)


ALIKE = {
    "m": ("m", "mm", "um", "km", "inch", "ft"),
    "rad": ("rad", "deg", "mrad", "turn", "arcmin"),
    "N": ("N", "kN", "mN", "lbf", "kg * m / s ** 2"),
    "N m": ("N * m", "N * mm", "kN * m", "J", "lbf * inch"),
    "s": ("s", "ms", "minute"),
    "Pa": ("Pa", "GPa", "psi", "N / mm ** 2"),
    "N/m": ("N / m", "kN / mm", "N / um"),
}
POSE = ("m", "m", "m", "rad", "rad", "rad")
WRENCH = ("N", "N", "N", "N m", "N m", "N m")
AT = np.array([0.02, -0.01, 0.8, 0.01, -0.02, 0.1])
LOAD = np.array([100.0, -20.0, 30.0, 4.0, 5.0, -6.0])


@pytest.fixture(autouse=True)
def stripped_units_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "llvmlite is not installed")
        yield


def of_any_units(rng: np.random.Generator, numbers: np.ndarray, units) -> list:
    """Numbers as a list of quantities, each in a unit of its own."""
    return [
        Q(float(x), u.replace(" ", " * ")).to(str(rng.choice(ALIKE[u])))
        for x, u in zip(numbers, units, strict=True)
    ]


@pytest.fixture(scope="module")
def robot() -> rs.Robot:
    return rs.load("gough-stewart-b")


#: Each takes six coordinates of a pose, or a load, and answers with numbers.
POSES: dict[str, Callable[[rs.Robot, Any], Any]] = {
    "stiffness": lambda robot, pose: rs.stiffness(robot, pose).K,
    "compliance": rs.compliance,
    "find_posture": lambda robot, pose: np.concatenate(rs.find_posture(robot, pose).coordinates),
    "deflection": lambda robot, pose: rs.deflection(robot, pose, LOAD).twist,
    "verify": lambda robot, pose: rs.verify(robot, pose).reference.K,
}
LOADS: dict[str, Callable[[rs.Robot, Any], Any]] = {
    "deflection": lambda robot, wrench: rs.deflection(robot, AT, wrench).twist,
    "kernel": lambda _, wrench: np.array(rs.DeflectionUnder(wrench).wrench),
    "map": lambda robot, wrench: (
        rs.stiffness_map(
            robot, rs.PoseList(["x"], [[0.01]]), [rs.Quantity.DEFLECTION], wrench=wrench
        )["displacement"].values
    ),
    "cables": lambda _, wrench: rs.cable_tensions(rs.load("cable-8"), wrench=wrench).tensions,
    "load of cables": lambda _, load: rs.cable_response(rs.load("cable-8"), None, load).tensions,
}


def check_units(robot, ask, given, units, wrong_unit, says):
    """Any units of the right kind give the same answer; a wrong one in any place is an error."""
    rng = np.random.default_rng(1)
    expected = ask(robot, given)
    for _ in range(3):
        found = ask(robot, of_any_units(rng, given, units))
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    for place in range(6):
        wrong = list(given)
        wrong[place] = Q(float(given[place]), wrong_unit(place))
        with pytest.raises(InputError, match=says(place)):
            ask(robot, wrong)


@pytest.mark.parametrize("ask", POSES.values(), ids=POSES)
def test_poses(robot, ask):
    check_units(robot, ask, AT, POSE, lambda _: "kg", lambda place: rf"entry \[{place}\]")


@pytest.mark.parametrize("ask", LOADS.values(), ids=LOADS)
def test_loads(robot, ask):
    other = "N * m", "N"
    kinds = "a force", "a moment"
    check_units(robot, ask, LOAD, WRENCH, lambda k: other[k // 3], lambda k: kinds[k // 3])


FORCE = np.array([0.5, 0, 0, 0, 0, 0])


def test_an_array_with_one_unit_fits_where_the_rest_is_zero(robot):
    """The same load to the last bit; another way may compute its deflection by then."""
    expected, found = (rs.deflection(robot, AT, F) for F in (1e3 * FORCE, Q(FORCE, "kN")))
    assert found.wrench.tolist() == expected.wrench.tolist()
    np.testing.assert_allclose(found.twist, expected.twist, rtol=1e-12, atol=1e-18)
    moment = rs.deflection(robot, AT, Q([0, 0, 0, 0, 0, 2000.0], "N * mm"))
    assert moment.wrench.tolist() == [0, 0, 0, 0, 0, 2.0]
    above = Q(np.array([[0, 0, 800.0, 0, 0, 0], [10, 0, 810, 0, 0, 0]]), "mm")
    metres = [[0, 0, 0.8, 0, 0, 0], [0.01, 0, 0.81, 0, 0, 0]]
    assert rs.stiffness(robot, above).pose.tolist() == metres


def double_pantograph(at: Any, unit: str) -> np.ndarray:
    network = rs.load("double-pantograph")
    place = at * np.asarray(network.reference_point)
    return compliance_between(network, [(network.platform, Q(place, unit) if unit else place)])


def test_points_and_lengths(robot):
    expected = rs.stiffness(robot, AT, at=[0.1, 0.2, 0.9])
    found = rs.stiffness(robot, AT, at=Q([100, 200, 900], "mm"))
    np.testing.assert_allclose(found.K, expected.K, rtol=1e-12)
    moved = rs.stiffness(robot, AT).about([Q(100, "mm"), Q(0.2, "m"), 0.9])
    np.testing.assert_allclose(moved.K, expected.K, rtol=1e-12)
    assert rs.indices(found, length=Q(20, "cm")).length == 0.2
    assert np.allclose(rs.stiffness(rs.load("cable-8"), at=Q([0, 0, 1], "m")).reference_point[2], 1)
    np.testing.assert_allclose(double_pantograph(1e3, "mm"), double_pantograph(1.0, ""), rtol=1e-9)


TURN, SLIDE = rs.Axis(Q(0, "deg"), Q(20, "deg"), 3), rs.Axis(Q(0, "mm"), Q(20, "mm"), 3)


def test_joint_coordinates():
    arm = rs.load("scara")
    q, units = np.array([0.3, 0.4, 0.05, 0.2]), ("rad", "rad", "rad", "m")
    q = q[[0, 1, 3, 2]]
    rng = np.random.default_rng(3)
    expected = rs.stiffness(arm, rs.JointCoordinates(q)).K
    for _ in range(3):
        given = of_any_units(rng, q, units)
        found = rs.stiffness(arm, rs.JointCoordinates(given)).K
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    kernel = rs.compile(arm, backend=rs.Backend.ARRAYS)
    found = kernel.evaluate(rs.JointCoordinates([of_any_units(rng, q, units)])).values["K"][0]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_poses_of_kernels_that_are_computed_again(robot):
    kernel = rs.compile(rs.load("gough-stewart-a"), backend=rs.Backend.ARRAYS)
    home = rs.find_posture(rs.load("gough-stewart-a")).pose[0]
    x, y, z = home[:3].tolist()
    answer = kernel.evaluate(Q([[x + 1e-12, y, z, 0, 0, 0]], "m").to("mm"))
    assert answer.guarded.all()
    assert answer.rank.tolist() == [3]


def test_sources_of_poses():
    grid = rs.Grid(x=rs.Axis(Q(-1, "cm"), Q(10, "mm"), 3), rz=rs.Axis(0, Q(90, "deg"), 2))
    assert grid.axis_values()["x"].tolist() == [-0.01, 0, 0.01]
    assert grid.axis_values()["rz"].tolist() == [0, np.pi / 2]
    rows = [[Q(10, "mm"), Q(180, "deg")], [0.02, 0]]
    poses = rs.PoseList(["x", "rz"], rows, time=Q([0, 500], "ms"))
    assert poses.values((slice(0, 2),)).tolist() == [[0.01, 0.02], [np.pi, 0]]
    parameter = poses.parameter()
    assert parameter is not None
    assert parameter[2].tolist() == [0, 0.5]
    path = rs.PoseList(["x"], Q([[1], [2]], "mm"), path_length=Q([0, 1], "mm"))
    assert path.values((slice(0, 2),)).tolist() == [[0.001, 0.002]]
    random = rs.RandomPoses(5, {"x": (Q(-1, "mm"), 0.001), "rz": Q([0, 180], "deg")})
    assert random.ranges == {"x": (-0.001, 0.001), "rz": (0, np.pi)}


def test_axes_of_maps_are_of_the_kind_of_their_coordinate():
    arm, turn, slide = rs.load("scara"), TURN, SLIDE
    names = arm.legs[0].chain.coordinate_names
    found = rs.stiffness_map(arm, rs.Grid({names[0]: turn, names[3]: slide}))
    expected = rs.stiffness_map(
        arm, rs.Grid({names[0]: rs.Axis(0, np.radians(20), 3), names[3]: rs.Axis(0, 0.02, 3)})
    )
    np.testing.assert_allclose(
        found.translational_stiffness, expected.translational_stiffness, rtol=1e-6
    )
    rows = [[Q(5, "deg"), Q(10, "mm")], [Q(0.1, "rad"), 0.02]]
    listed = rs.PoseList([names[0], names[3]], rows)
    assert rs.stiffness_map(arm, listed).sizes["pose"] == 2


def test_parameters_of_model_files():
    expected = rs.load("gough-stewart-b", {"h": 0.75, "k": 2e7})
    for h, k in ((Q(750, "mm"), Q(20, "N / um")), (Q(75, "cm"), Q(2e4, "kN / m"))):
        found = rs.load("gough-stewart-b", {"h": h, "k": k})
        np.testing.assert_allclose(rs.stiffness(found).K, rs.stiffness(expected).K, rtol=1e-12)


def test_parts_of_models():
    assert rs.circle(Q(20, "mm")) == rs.circle(0.02)
    assert rs.tube(Q(20, "mm"), Q(1, "cm")) == rs.tube(0.02, 0.01)
    steel = rs.Material("steel", Q(210, "GPa"), Q(80.0, "GPa"), "here")
    assert steel == rs.Material("steel", 210e9, 80e9, "here")
    assert np.array_equal(rs.Frame(np.eye(3), Q([0, 0, 500], "mm")).p, [0, 0, 0.5])
    spring = rs.translational_spring(Q(1, "N / um"), [0, 0, 1])
    assert np.isclose(spring.compliance[2, 2], 1e-6, rtol=1e-12, atol=0)
    tensions = rs.GivenTensions(Q(np.full(8, 0.1), "kN"))
    found = rs.cable_tensions(rs.load("cable-8"), tensions=tensions).tensions
    np.testing.assert_allclose(found, 100.0)


class ForeignArray(np.ndarray):
    """As those of astropy and unyt, whose units NumPy drops."""

    def to_value(self, unit: str) -> np.ndarray:
        return np.asarray(self)


def test_arrays_with_units_of_other_packages_are_refused(robot):
    load = LOAD.view(ForeignArray)
    with pytest.raises(InputError, match=r"write the number of SI units: quantity.to_value"):
        rs.deflection(robot, AT, load)


def test_labelled_arrays_around_quantities(robot):
    xarray = pytest.importorskip("xarray")
    load = xarray.DataArray(Q([0.1, 0, 0, 0, 0, 0], "kN"), dims="wrench")
    expected = rs.deflection(robot, AT, [100, 0, 0, 0, 0, 0]).twist
    np.testing.assert_allclose(rs.deflection(robot, AT, load).twist, expected)


def test_quantities_of_robostiff_itself():
    own = make_quantity(300.0, make_unit({"mm": 1}))
    assert as_floats("length", own, "a length", "m") == 0.3
    assert not holds_quantities([1.0, [2, 3]])
    assert holds_quantities([1.0, [2, own]])


def test_angles_and_numbers_are_not_the_same():
    assert as_floats("number", Q(30, "percent"), "a number", "") == 0.3
    assert as_floats("angle", Q(0.5, ""), "an angle", "rad") == 0.5
    for unit, quantity in (("", Q(10, "deg")), ("N m", Q(1, "N * m / rad")), ("m", Q(1, ""))):
        with pytest.raises(InputError):
            as_floats("value", quantity, "another kind", unit)


READ: Any = {"kinds": rs.Reading.DISPLACEMENT, "wrenches": [[0] * 6, [0, 0, -500, 0, 0, 0]]}
AT_TWICE = [[0, 0, 0.9, 0, 0, 0]] * 2


def test_loads_of_measurements():
    given = READ | {"wrenches": Q([[0] * 6, [0, 0, -0.5, 0, 0, 0]], "kN")}
    more: Any = {"forces": Q([0, 0, -1], "kN"), "hooks": Q([100, 0, 0], "mm")}
    read = rs.Measurements(AT_TWICE, np.zeros((2, 3)), **given, **more)
    assert np.array_equal(read.wrenches, READ["wrenches"])
    assert np.array_equal(read.forces[0], [0, 0, -1000])
    assert np.array_equal(read.hooks[0], [0.1, 0, 0])


def test_gravity_of_small_loads():
    arm, pull = rs.load("six-joint-arm"), [Q(0, "m/s^2"), Q(50, "cm/s^2"), Q(-9e3, "mm/s^2")]
    sunk = rs.deflection(arm, gravity=pull).twist
    assert np.array_equal(sunk, rs.deflection(arm, gravity=[0, 0.5, -9]).twist)


def test_transports_take_lists():
    v: Any = [2.0, 0, 0]
    turn, force = np.array([0, 0, 0, 0, 0, 0.1]), np.array([0, 10.0, 0, 0, 0, 0])
    assert move_twist(turn, v)[1] == pytest.approx(0.2)
    assert move_wrench(force, v)[5] == pytest.approx(-20)
    assert move_stiffness(np.diag(force), v)[5, 5] == pytest.approx(40)

"""Parameters as inputs of kernels: each value gives the robot that has it."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from tests.analysis.kernels.cases import BACKENDS, around_home, model, of_fourth_order, row
from tests.files import FILES, text_of, written

ROBOTS = {
    "hexapod": ("R", "alpha", "k_screw", "cylinder"), "3-rrr": ("l1", "l2", "k"),
    "gough-stewart-a": ("R", "k"), "two-link-arm": ("l1", "b"), "planar-link": ("L",),
    "3-rps": ("R", "r", "k"), "t3r1": ("l", "k"),
}  # fmt: skip


@pytest.mark.parametrize("name", ROBOTS)
def test_a_value_a_pose_is_a_robot_a_pose(name):
    robot = model(name, *ROBOTS[name])
    compiled = rs.compile(robot, parameters=ROBOTS[name], backend=rs.Backend.ARRAYS)
    assert compiled.verified
    pose, random = around_home(robot, 6), np.random.default_rng(1)
    values = {n: robot.nominal[n] * random.uniform(0.9, 1.1, 6) for n in ROBOTS[name]}
    answer = compiled.evaluate(pose, parameters=values)
    for i in range(6):
        own = robot.substituted({n: float(v[i]) for n, v in values.items()})
        one = direct_stiffness(own, row(pose, i))
        assert (answer.rank[i], answer.status_codes[i]) == (one.rank, int(one.status))
        np.testing.assert_allclose(
            answer.values["K"][i], one.K, rtol=1e-9, atol=1e-11 * np.abs(one.K).max()
        )


def test_left_out_parameters_are_nominal_and_other_symbols_stay_so():
    robot = model("gough-stewart-b", "R", "r", "k")
    compiled = rs.compile(robot, parameters=("R", "r"))
    assert compiled.parameters == ("R", "r")
    assert compiled.kernel.inputs[6:] == ("R", "r")
    pose = around_home(robot, 4)
    nominal, given = compiled.evaluate(pose), compiled.evaluate(pose, parameters={"r": 0.25})
    plain = model("gough-stewart-b")
    np.testing.assert_allclose(
        nominal.values["K"], direct_stiffness(plain, pose).K, rtol=1e-9, atol=1
    )
    other = robot.substituted({"R": 0.5, "r": 0.25, "k": 1e8})
    np.testing.assert_allclose(
        given.values["K"], direct_stiffness(other, pose).K, rtol=1e-9, atol=1
    )


def test_guarded_poses_are_computed_with_their_own_values():
    robot = model("gough-stewart-a", "R", "k")
    compiled = rs.compile(robot, parameters=("R", "k"), backend=rs.Backend.ARRAYS)
    pose = np.zeros((4, 6))
    pose[:, 2] = 1e-12  # the platform nearly in the base plane: the legs' forces lie in it
    pose[[0, 3]] = [[0.05, 0.02, 0.8, 0, 0.1, 0], [0.02, 0.05, 0.75, 0.1, 0, 0]]
    values = {"R": np.array([0.5, 0.5, 0.55, 0.5]), "k": np.array([1e8, 1e8, 2e8, 3e8])}
    answer = compiled.evaluate(pose, parameters=values)
    assert list(answer.guarded) == [False, True, True, False]
    for i in range(4):
        own = robot.substituted({n: float(v[i]) for n, v in values.items()})
        one = direct_stiffness(own, pose[i])
        assert answer.rank[i] == one.rank
        np.testing.assert_allclose(
            answer.values["K"][i], one.K, rtol=1e-9, atol=1e-9 * np.abs(one.K).max()
        )


@pytest.mark.parametrize(
    ("name", "by"),
    [("3-rrr", "l2"), ("tripteron", "l"), ("hexapod", "R"), ("3-rps", "R"), ("3-rps", "k")],
)
def test_derivatives_by_parameters_are_limits_of_differences(name, by):
    """Also of robots that are closed by iteration, and at other values than the nominal ones."""
    robot, rate = model(name, by), rs.Derivative(rs.StiffnessMatrix(), by)
    compiled = rs.compile(robot, [rate], parameters=(by,), backend=rs.Backend.ARRAYS)
    pose, value = around_home(robot, 5), 1.02 * robot.nominal[by]

    def K(shift):
        return direct_stiffness(robot.substituted({by: value + shift}), pose).K

    expected = of_fourth_order(K, 3e-4 * value)
    found = compiled.evaluate(pose, parameters={by: value}).values[rate.name]
    sizes = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(found - expected) <= 1e-8 * sizes)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_structure_has_one_pose_and_as_many_values_as_wanted(backend):
    robot = rs.load(FILES / "one-post.yaml", symbols=("h",))
    for parameters, heights in ((("h",), [0.4, 0.5, 0.7]), ((), [0.5])):
        outputs = [rs.StiffnessMatrix(), rs.ComplianceMatrix()]
        compiled = rs.compile(robot, outputs, parameters=parameters, backend=backend)
        given = {"h": np.array(heights)} if parameters else {}
        for pose in (np.zeros((len(heights), 0)), rs.JointCoordinates(np.zeros((len(heights), 0)))):
            found = compiled.evaluate(pose, parameters=given)
            for i, h in enumerate(heights):
                own = rs.stiffness(robot.substituted({"h": h}))
                assert found.status_codes[i] == 0
                np.testing.assert_allclose(found.values["K"][i], own.K, rtol=1e-10, atol=1e-4)
                C = found.values["compliance"][i]
                np.testing.assert_allclose(C, np.asarray(own.compliance), rtol=1e-10, atol=1e-18)
        with pytest.raises(rs.InputError, match=r"an array \(N, 0\): a structure has one pose"):
            compiled.evaluate(np.zeros((1, 6)), parameters=given)


def test_rates_of_an_arm_with_a_length_hold_its_joints_and_not_its_pose():
    """At poses of the platform they were those at the joints, 0.45 of what differences are."""
    robot, q = (
        rs.load("six-joint-arm", symbols=("fore",)),
        np.array([[0.1, 0.2, 0.15, 0.3, 0.2, 0.1]]),
    )
    rate = rs.Derivative(rs.StiffnessMatrix(), "fore")
    found = rs.compile(robot, [rate], parameters=("fore",), backend=rs.Backend.ARRAYS)

    def stiffness(fore):
        return direct_stiffness(robot.substituted({"fore": fore}), rs.JointCoordinates(q[0])).K

    at, step = robot.nominal["fore"], 1e-5
    slope = (stiffness(at + step) - stiffness(at - step)) / (2 * step)
    exact = found.evaluate(rs.JointCoordinates(q)).values["dK/dfore"][0]
    np.testing.assert_allclose(exact, slope, rtol=1e-7, atol=1e-8 * np.abs(slope).max())
    pose = rs.find_posture(robot.numeric, rs.JointCoordinates(q)).pose
    with pytest.raises(rs.InputError, match=r"dK/dfore of 'six-joint-arm': got poses"):
        found.evaluate(pose)
    of_joint = rs.compile(robot, [rs.Derivative(rs.StiffnessMatrix(), "q0")])
    assert np.isfinite(of_joint.evaluate(pose).values["dK/dq0"]).all()


ARM = text_of("arm-of-many-parameters.yaml")
MISSING_PARTS = {
    "wall": ({"w": [0.005, 0.03, 0.04]}, r"wall of the box of 'fore' in row 1.*w = 0.03.*half"),
    "tube": ({"d": [0.03, 0.04, 0.051]}, r"inner diameter .* of 'upper' in row 2.*got 0.051"),
    "for all": ({"D": 0.047}, r"inner diameter of the tube of 'upper' in row 0.*got 0.048"),
    "Poisson ratio": ({"nu": [0.5, 0.3, 0.6]}, r"Poisson ratio of 'fore' in row 0.*got 0.5"),
    "drive": ({"p": [0.2, 1.5, 0.3]}, r"stiffness of 'shoulder' in row 1.*got -500000"),
    "free drive": ({"p": [0.2, 0.3, 1.0]}, r"stiffness of 'shoulder' in row 2.*got 0.0"),
    "segment": ({"n": [0.6, 1.2, 0.5]}, r"length of a segment of 'fore' in row 1, n = 1.2: got -0"),
    "share": ({"o": [0.1, 1.0, 1.1]}, r"share of the extension of 'rod' in row 2, o = 1.1"),
    "mass": ({"load": [0.2, 0.3, 0.1]}, r"mass of 'fore' in row 2.*got -0.1"),
    "turned round": ({"v": [0.1, 0.6, 0.8]}, r"u - v of 'arm' in row 2.*a beam turns round"),
    "width": ({"b": [-0.06, 0.06, 0.06]}, r"parameter b of 'arm' in row 0.*got -0.06, .*positive"),
}  # fmt: skip


@pytest.mark.parametrize(("values", "message"), MISSING_PARTS.values(), ids=MISSING_PARTS.keys())
def test_values_of_which_a_part_does_not_exist_are_refused(values, message, arm_kernels):
    pose = rs.JointCoordinates(np.tile([0.1, 0.8, 0.2], (3, 1)))
    for kernel, wrench in arm_kernels:
        assert not kernel.evaluate(pose, *wrench).guarded.any()
        with pytest.raises(rs.InputError, match=message):
            kernel.evaluate(pose, *wrench, parameters=values)
    robot = arm_kernels[0][0].subject
    rows = [np.broadcast_to(values.get(str(s), robot.nominal[str(s)]), 3) for s in robot.symbols]
    row = int(message.split("in row ")[1][0])
    for k in range(row + 1):
        given = {str(s): float(own[k]) for s, own in zip(robot.symbols, rows, strict=True)}
        if k < row:
            assert rs.stiffness(robot.substituted(given), pose).answered.all()
        elif "turns" not in message:  # which is another robot
            with pytest.raises(rs.InputError):
                robot.substituted(given)


@pytest.fixture(scope="module")
def arm_kernels(tmp_path_factory):
    """Its thin tube leaves the samples of the parameters little room."""
    file = written(tmp_path_factory.mktemp("arm") / "arm.yaml", ARM)
    robot = rs.load(file, symbols=rs.ALL_PARAMETERS)
    names = [str(symbol) for symbol in robot.symbols]
    loaded = rs.compile_loaded(robot, parameters=names, backend=rs.Backend.ARRAYS)
    kernel = rs.compile(robot, parameters=names, backend=rs.Backend.ARRAYS)
    assert kernel.verified
    assert loaded.verified
    return (kernel, ()), (loaded, (np.zeros(6),))

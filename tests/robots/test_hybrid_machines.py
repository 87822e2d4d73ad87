"""Modules in series: the same machine as one nested leg, elastic feet, rails, and heads.

That compliances add at the tool is compared for each machine of modules in tests/campaign.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import Chain, Link, prismatic, revolute
from tests.cases.metric import apart

FEET = np.diag([1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-9])


def rigid(*to: float, name: str = "rigid") -> rs.Rigid:
    return rs.Rigid(rs.Frame(np.eye(3), np.array(to)), name)


def feet() -> rs.Module:
    return rs.Module("frame", Chain((Link(np.zeros(3), rs.Elasticity(FEET), np.eye(3), "feet"),)))


def test_free_motions_of_all_modules_are_carried():
    free = rs.load("gough-stewart-a")  # turns freely about a point
    slide = rs.Module("slide", Chain((prismatic([0, 0, 1], rs.Passive(), name="slide"),)))
    assert rs.stiffness(free).rank == 3
    machine = rs.hybrid_machine([slide, feet(), rs.Module("hexapod", free)])
    result = rs.stiffness(machine)
    assert result.rank == 2
    assert len(result.free_motions) == 4


def test_the_same_freedom_twice_is_redundant_and_free_once():
    pins = [
        rs.Module(name, Chain((revolute([0, 0, 1], rs.Passive(), name="pin"),))) for name in "ab"
    ]
    result = rs.stiffness(rs.hybrid_machine([feet(), *pins]))
    assert result.rank == 5
    assert rs.Status.REDUNDANT_JOINTS in result.status


def test_hexapod_on_a_rail():
    hexapod = rs.load("hexapod")
    slide = prismatic([1, 0, 0], rs.Actuated(2e8), name="slide")
    machine = rs.hybrid_machine(
        [rs.Module("rail", Chain((slide,))), rs.Module("hexapod", hexapod)], name="on a rail"
    )
    assert any("drives" in sentence for sentence in rs.stiffness(machine).advice)
    moved = rs.stiffness(machine, rs.ActuatorCoordinates({"rail/slide": 0.3}))
    home = rs.stiffness(hexapod)
    shift = np.asarray(moved.pose) - np.asarray(home.pose)
    np.testing.assert_allclose(shift, [0.3, 0, 0, 0, 0, 0], atol=1e-12)
    assert not moved.advice
    C = np.linalg.inv(home.K)
    C[0, 0] += 1 / 2e8
    assert apart(np.linalg.inv(moved.K), C) < 1e-9


def test_a_singular_home_leaves_drives_open_elsewhere_and_says_so():
    """A tilting table turns on as its robot tilts: away from home their axes are no longer one."""
    turns = [
        revolute(axis, rs.Actuated(1e5), name=name)
        for axis, name in (([1, 0, 0], "roll"), ([0, 1, 0], "pitch"))
    ]
    foot = Link(np.zeros(3), rs.Elasticity(FEET), np.eye(3), "foot")
    table = rs.Module("table", Chain((*turns, foot)))
    machine = rs.hybrid_machine([rs.Module("tripod", rs.load("3-rps")), table])
    free = [coordinate.value for coordinate in machine.coordinates]
    assert len(free) < 5  # drives
    at_home = np.asarray(rs.stiffness(machine).pose)[list(machine.coordinate_places)]
    found = rs.stiffness(machine, at_home + 0.02)
    assert found.status == rs.Status.OK
    (advice,) = found.advice
    assert f"the free coordinates {' '.join(free)} leave a motion of the drives open" in advice
    q = np.concatenate([*found.joint_coordinates.values()])
    near = rs.stiffness(machine, at_home + 0.02, near=[q + 0.02])
    assert near.advice == ()
    assert apart(near.K, found.K) > 1e-4
    assert rs.stiffness(machine, found.pose).advice == ()  # all of the pose is given


def test_machine_of_planar_modules_is_planar():
    arm = Chain((revolute([0, 0, 1], rs.Actuated(1e4), name="turn"), rigid(0.2, 0, 0, name="arm")))
    robot = rs.load("3-rpr")
    machine = rs.hybrid_machine([rs.Module("base", robot), rs.Module("arm", arm)])
    alone = rs.compliance(robot, at=[0.65, 0.35, 0])
    column = np.array([0, 0.2, 1.0])
    found = rs.stiffness(machine, rs.ActuatorCoordinates({}))
    assert found.K.shape == (3, 3)
    assert apart(np.linalg.inv(found.K), alone + np.outer(column, column) / 1e4) < 1e-9


def test_postures_of_modules_stay_those_of_their_legs():
    robot = rs.load("3-rrr").with_elbows(rs.Elbow.MINUS)
    machine = rs.hybrid_machine([rs.Module("base", robot)])
    assert apart(rs.stiffness(machine).K, rs.stiffness(robot).K) < 1e-9


def test_symbols_of_modules_stay_symbols():
    robot = rs.load("gough-stewart-b", symbols=("h",))
    tool = rs.Module("tool", Chain((rigid(0, 0, 1),)))
    machine = rs.hybrid_machine([rs.Module("robot", robot), tool])
    assert [str(symbol) for symbol in machine.symbols] == ["h"]
    assert machine.home is not None
    assert machine.home.p[2] - machine.symbols[0] == 1


def test_a_machine_of_symbols_stands_as_one_of_numbers():
    """Its modules were not closed at home: K was off by 0.7 percent."""
    found = []
    for symbols in ((), ("h",)):
        robot = rs.load("gough-stewart-b", symbols=symbols)
        modules = [rs.Module(name, robot) for name in ("lower", "upper")]
        found.append(rs.stiffness(rs.hybrid_machine(modules).numeric).K)
    assert apart(*found) < 1e-9


def test_masses_of_carrying_platforms_are_carried():
    load = rs.Mass(7.0, [0, 0, 0.1], name="motor")
    robot = replace(rs.load("hexapod"), platform_masses=(load,), gravity="-z")
    tool = rs.Module("tool", Chain((rigid(0, 0, 0.2),)))
    machine = rs.hybrid_machine([rs.Module("robot", robot), tool])
    assert machine.gravity.tolist() == robot.gravity.tolist()
    moved = rs.deflection(machine, gravity="-z").twist
    expected = rs.deflection(robot, gravity="-z", at=[0, 0, 1.1]).twist
    np.testing.assert_allclose(moved, expected, atol=1e-15)


@pytest.mark.parametrize("at", [[0, 0, 0], [0.1, 0.2, 0.03]])
def test_loops_whose_axes_all_meet_leave_their_freedoms(at):
    """Rates at which they would open are rounding, and hold nothing."""
    eye = rs.Module("eye", rs.load("agile-eye"), rs.Frame(np.eye(3), np.array(at)))
    slide = rs.Module("slide", Chain((prismatic([1, 0, 0], rs.Actuated(1e6), name="x"),)))
    machine = rs.hybrid_machine([eye, slide])
    assert [own.value for own in machine.coordinates] == ["x", "rx", "ry", "rz"]
    moved = rs.stiffness(machine, rs.ActuatorCoordinates([0.1, -0.05, 0.02, 0.03]))
    again = rs.stiffness(machine, moved.transform)
    np.testing.assert_allclose(again.K, moved.K, rtol=1e-9, atol=1e-9 * np.abs(moved.K).max())


HEAD = "robostiff: 1\nname: m\nsource: s\nmodules:\n  - name: a\n"


def test_a_module_is_a_robot_of_legs(tmp_path: Path):
    (tmp_path / "machine.yaml").write_text(HEAD + "    robot: cables.yaml\n")
    (tmp_path / "cables.yaml").write_text("robostiff: 1\nname: c\nsource: s\ncables: []\n")
    with pytest.raises(rs.FileError, match=r"modules\[0\].robot: .*a model file with legs"):
        rs.load(str(tmp_path / "machine.yaml"))


def test_parameters_of_a_module_are_expressions_of_the_machine(tmp_path: Path):
    text = HEAD.replace("modules:", "parameters: {e: 0.7 m}\nmodules:")
    own = "    robot: gough-stewart-b\n    parameters: {h: e+0.1 m}\n"
    (tmp_path / "m.yaml").write_text(text + own)
    machine = rs.load(str(tmp_path / "m.yaml"), {"e": "0.9 m"})
    assert float(machine.home.p[2]) == pytest.approx(1.0)
    exact = rs.load(str(tmp_path / "m.yaml"), symbols=("e",))
    assert str(exact.home.p[2]) == "e + 1/10"
    assert rs.stiffness(exact.numeric).status == rs.Status.OK


def test_legs_in_place(tmp_path: Path):
    text = HEAD + (
        "    home: {at: [0, 0, 1 m]}\n    legs:\n"
        "      - {name: b, chain: [{type: spring, compliance: [c, c, c, w, w, w]}, "
        "{type: rigid, to: [0, 0, 1 m]}]}\n"
        "parameters: {c: 1e-6 m/N, w: 1e-6 rad/(N m)}\n"
    )
    (tmp_path / "m.yaml").write_text(text)
    assert rs.stiffness(rs.load(str(tmp_path / "m.yaml"))).K[2, 2] == pytest.approx(1e6)


@pytest.mark.parametrize(
    "names", ["capaman capaman", "3-rpr capaman", "six-joint-arm gough-stewart-a 3-rpr"]
)
def test_a_kernel_knows_internal_stress_from_a_wrench_that_nothing_yields_to(names: str):
    modules = [rs.Module(f"m{i}", rs.load(name)) for i, name in enumerate(names.split())]
    machine = rs.hybrid_machine(modules)
    home = rs.stiffness(machine)
    free = [[*"xyz", "rx", "ry", "rz"].index(one.value) for one in machine.coordinates]
    kernel = rs.compile(machine, backend=rs.Backend.ARRAYS)
    pose = np.asarray(home.pose)[free] + np.linspace(-0.01, 0.01, len(free))
    answer, direct = kernel.evaluate(pose[None]), rs.stiffness(machine, pose)
    assert answer.guarded[0] == (direct.rank < 6)
    assert answer.rank[0] == direct.rank
    assert apart(answer.values["K"][0], direct.K) < 1e-11

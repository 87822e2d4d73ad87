"""Columns of all end conditions: Euler's loads by default, and what is said beyond them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import Elasticity, cantilever_compliance
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from robostiff.network import network_of_snapshot
from robostiff.spatial import Space
from tests.statics.robots_under_load import beam, joint, root

L, EI = 0.7, 35.0
EULER = np.pi**2 * EI / L**2
TIP = [L, 0.0, 0.0]
X, Y, Z = np.eye(3).tolist()
COLUMN = beam("rod", [0, 0, 0], TIP, 1e8, EI, EI)
DOWN = np.array([-1.0, 0, 0, 0, 0, 0])
TAN = (4.493409457909064 / np.pi) ** 2  # tan u = u


def hinges(at: list[float], name: str) -> tuple:
    return joint(name + "y", at, Y), joint(name + "z", at, Z)


def rail(turns: tuple = (), *, shifts: bool = False) -> PlacedLeg:
    """What guides the far end along x: it turns at some joints, and shifts across or does not."""
    across = None if shifts else 1e9
    parts = [joint("along", TIP, X, "P")]
    parts += [joint(name, TIP, a, "P", across) for name, a in (("y", Y), ("z", Z))]
    parts += [joint("r" + name, TIP, a, "R", 1e7) for name, a in zip("xyz", (X, Y, Z), strict=True)]
    return PlacedLeg("guide", (*parts, *turns), np.array(TIP))


def column(parts: tuple, guide: PlacedLeg | None, name: str = "column") -> Snapshot:
    legs = (PlacedLeg("column", parts, np.array(TIP)),)
    return Snapshot(name, legs if guide is None else (*legs, guide), np.array(TIP))


FOOT, HEAD = hinges([0, 0, 0], "foot"), hinges(TIP, "head")
FLEXURES = tuple(joint(f"flexure {n}", TIP, a, "R", 0.02) for n, a in (("y", Y), ("z", Z)))
# At 1.1 of Euler's load the column alone buckles, against what turns its head.
SOFT = tuple(joint(f"soft {n}", TIP, a, "R", 30.0) for n, a in (("y", Y), ("z", Z)))
COLUMNS = {
    "clamped, free": (column((COLUMN,), None), 0.25),
    "clamped, guided": (column((COLUMN,), rail(shifts=True)), 1.0),
    "hinged, guided": (column((*FOOT, COLUMN), rail(shifts=True)), 0.25),
    "hinged, hinged": (column((*FOOT, COLUMN, *HEAD), rail()), 1.0),
    "hinged, hinged by the guide": (column((*FOOT, COLUMN), rail(HEAD)), 1.0),
    "hinged, hinged behind soft joints": (column((*FOOT, COLUMN, *SOFT), rail(HEAD)), 1.0),
    "clamped, hinged": (column((COLUMN, *HEAD), rail()), TAN),
    "clamped, hinged by the guide": (column((COLUMN,), rail(HEAD)), TAN),
    "clamped, on flexures": (column((COLUMN, *FLEXURES), rail()), TAN),
    "clamped, clamped": (column((COLUMN,), rail()), 4.0),
}


@pytest.mark.parametrize("graph", [False, True], ids=["legs", "network"])
@pytest.mark.parametrize("name", COLUMNS)
def test_euler_loads_by_default(name: str, graph: bool):
    """Within 1 % by default, and some legs within 0.1 % with eight elements."""
    robot, factor = COLUMNS[name]
    subject = network_of_snapshot(robot) if graph else robot
    exact = factor * EULER
    found = rs.critical_load(subject, wrench=DOWN, up_to=10 * exact)
    assert -5e-4 < found.factor / exact - 1 < 8e-3
    if not graph and name in ("clamped, free", "hinged, hinged", "clamped, clamped"):
        fine = rs.critical_load(subject, wrench=DOWN, up_to=10 * exact, beams=rs.Bowing(8))
        assert abs(fine.factor / exact - 1) < 1e-3
    if name in ("clamped, clamped", "clamped, hinged"):
        assert "rod' of leg" in found.mode or "rod'" in found.mode.rpartition("most in")[2]


def least_load(foot: float, head: float | None) -> float:
    """Of ``y = A sin ax + B cos ax + C x + D`` on springs, its head held aside or free (None)."""

    def rows(u: float) -> np.ndarray:  # y and its derivatives times powers of L, at both ends
        c, s = np.cos(u), np.sin(u)
        start = [[0, 1, 0, 1], [u, 0, 1, 0], [0, -(u**2), 0, 0]]
        end = [[s, c, 1, 1], [u * c, -u * s, 1, 0], [-(u**2) * s, -(u**2) * c, 0, 0]]
        (y, turn, bend), (y_L, turn_L, bend_L) = np.array([start, end])
        free = [bend_L, np.array([0, 0, u**2, 0])]  # the force across is that of the load
        held = [y_L, bend_L + (head or 0.0) * L / EI * turn_L]
        return np.array([y, bend - foot * L / EI * turn, *(free if head is None else held)])

    def open_(u: float) -> float:
        return float(np.linalg.det(rows(u)) / u**2)

    grid = np.linspace(0.05, 6.0, 300)
    first = next(i for i in range(299) if open_(grid[i]) * open_(grid[i + 1]) < 0)
    return root(open_, grid[first], grid[first + 1]) ** 2 * EI / L**2


@pytest.mark.parametrize(
    ("foot", "head"), [((20.0, 90.0), (400.0, 50.0)), ((30.0, 300.0), None), ((0.0, 0.0), (70, 9))]
)
def test_columns_on_springs(foot: tuple[float, float], head: tuple[float, float] | None):
    """Stiffnesses against the turns across, other ones about y and z: the softer way decides."""

    def turns(k: tuple[float, float], at: list[float], name: str) -> tuple:
        pairs = zip("yz", (Y, Z), k, strict=True)
        return tuple(joint(name + n, at, axis, "R", own or None) for n, axis, own in pairs)

    exact = min(least_load(k, None if head is None else head[i]) for i, k in enumerate(foot))
    top = () if head is None else turns(head, TIP, "head")
    robot = column((*turns(foot, [0, 0, 0], "foot"), COLUMN, *top), rail() if head else None)
    found = rs.critical_load(robot, wrench=DOWN, up_to=10 * exact)
    assert -5e-4 < found.factor / exact - 1 < 8e-3
    bad = rs.Status.BEYOND_CRITICAL_LOAD | rs.Status.UNSTABLE | rs.Status.NO_EQUILIBRIUM
    below, beyond = (rs.equilibrium(robot, wrench=s * exact * DOWN) for s in (0.9, 1.1))
    assert beyond.status & bad
    assert not below.status & bad


@pytest.mark.parametrize("softness", [0.02, 0.2, 1.0])
def test_columns_soft_in_shear(softness: float):
    """Engesser: 1/P = 1/P_Euler + shear compliance of a length."""
    compliance = softness / EULER
    C = cantilever_compliance(L, 1.0, 1.0, 1e8, EI, EI, EI)
    C[1, 1] += compliance * L
    C[2, 2] += compliance * L
    soft = PlacedSpring("rod", np.array(TIP), np.eye(3), Elasticity(C, segments=()))
    for parts, guide, factor in (((soft,), rail(), 4.0), ((*FOOT, soft), rail(HEAD), 1.0)):
        exact = 1 / (1 / (factor * EULER) + compliance)
        found = rs.critical_load(column(parts, guide), wrench=DOWN, up_to=10 * exact)
        assert abs(found.factor / exact - 1) < 3e-3


def test_a_column_in_a_plane():
    """Its own axes turned about it by any angle; it buckles in the plane alone."""
    for angle in (0.0, 90.0, 37.0):
        turned = Rotation.from_euler("x", angle, degrees=True).as_matrix()
        rod = PlacedSpring("rod", np.array(TIP), turned, COLUMN.elasticity)
        guide = tuple(
            joint(name, TIP, a, kind, k)
            for name, a, kind, k in (("x", X, "P", None), ("y", Y, "P", 1e9), ("r", Z, "R", 1e7))
        )
        legs = [PlacedLeg("column", (rod,), np.array(TIP)), PlacedLeg("g", guide, np.array(TIP))]
        robot = Snapshot("plane", tuple(legs), np.array(TIP), Space.PLANAR)
        found = rs.critical_load(robot, wrench=[-1, 0, 0], up_to=1e5)
        assert 0 <= found.factor / (4 * EULER) - 1 < 1e-3


def guided_rod(tmp_path: Path, diameter: str) -> rs.Robot:
    """A clamped rod on a drive pushes a platform that a stiff slide guides."""
    stiff = (
        "{type: beam, to: [0, 0, -50 mm], material: steel, section: {circle: {diameter: 90 mm}}}"
    )
    text = f"""
robostiff: 1
name: press
source: made up for this test
home: {{at: [0, 0, 0]}}
coordinates: [z]
legs:
  - name: ram
    base: {{at: [0, 0, 1.2 m]}}
    chain:
      - {{type: prismatic, name: drive, axis: z, role: actuated, stiffness: 1e8 N/m, home: -0.2 m}}
      - type: beam
        name: rod
        to: [0, 0, -1 m]
        material: steel
        section: {{circle: {{diameter: {diameter}}}}}
  - name: guide
    base: {{at: [0.1 m, 0, 0.25 m]}}
    chain:
      - {{type: prismatic, name: slide, axis: z, role: passive, home: -0.2 m}}
      - {stiff}
    platform: {{at: [0.1 m, 0, 0]}}
"""
    file = tmp_path / "press.yaml"
    file.write_text(text)
    return rs.load(file)


def test_kernels_do_not_pass_over_the_buckling_of_a_clamped_rod(tmp_path: Path):
    """Before the critical load a kernel agrees with equilibrium; beyond it, it says so."""
    robot = guided_rod(tmp_path, "12 mm")
    critical = rs.critical_load(robot, wrench=[0, 0, 1, 0, 0, 0], up_to=1e9).factor
    C = rs.find_posture(robot).snapshot.one(0).legs[0].elements[1].elasticity.compliance  # pyright: ignore
    assert 0.96 < critical / (4 * np.pi**2 / C[5, 5]) < 1.002  # less what the guide gives way
    fast = rs.compile_loaded(robot, backend=rs.Backend.ARRAYS)
    parts = np.array([-1.0, 0.05, 0.6, 0.99, 1.01, 1.5, 3.0])
    F = parts[:, None] * critical * np.array([0, 0, 1.0, 0, 0, 0]) + [2.0, 1, 0, 0, 0, 0]
    answer = fast.evaluate(np.zeros((len(F), 1)), F)
    assert answer.stable.tolist() == [part < 1 for part in parts]
    assert not answer.guarded[:2].any()
    each = rs.equilibrium(robot, np.zeros((len(F), 1)), F)
    assert np.array_equal(each.stable, answer.stable)
    for own, sure in zip(answer.K[:4], each.K[:4], strict=True):
        assert np.allclose(own, sure, rtol=0, atol=1e-9 * np.abs(sure).max())


def test_rods_that_meet_in_a_point():
    """A tripod of clamped rods, to 1 nm: its size is that of its rods."""
    angles = 2 * np.pi / 3 * np.arange(3)
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    legs = []
    for i, (foot, head) in enumerate(zip(0.5 * ring, 1e-9 * ring + [0, 0, 0.8], strict=True)):
        rod = beam("rod", foot.tolist(), head.tolist(), 6e6, 13.4, 10.2)
        legs.append(PlacedLeg(f"leg{i + 1}", (rod,), head))
    tripod = Snapshot("tripod", tuple(legs), np.array([0, 0, 0.8]))
    assert 0.3 < float(tripod.characteristic_length) < 0.8
    assert rs.stiffness(tripod).status == rs.Status.OK
    down = np.array([0, 0, -1.0, 0, 0, 0])
    default, fine = (
        rs.critical_load(tripod, wrench=down, up_to=1e5, beams=own).factor
        for own in (rs.Bowing(), rs.Bowing(8))
    )
    assert abs(default / fine - 1) < 1e-3

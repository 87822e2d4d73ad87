"""Columns of all end conditions: Euler's loads by default, and what is said beyond them."""

from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Legendre
from numpy.polynomial import Polynomial as P
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.elasticity.cantilever import cantilever_compliance
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from robostiff.network import network_of_snapshot
from robostiff.spatial import Space
from robostiff.statics.chains.beam_bowing import bending, bending_planes
from robostiff.statics.chains.elements import BowingTerms
from robostiff.statics.equations.equilibrium_path import path
from robostiff.statics.equations.problem import LoadCase
from robostiff.statics.loading.given_loads import Acting
from robostiff.statics.loading.loaded_posture import postures_of
from tests.statics.robots_under_load import beam, joint, loaded

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
    """Within 1 % by default, and legs within 0.1 % with eight elements."""
    robot, factor = COLUMNS[name]
    subject = network_of_snapshot(robot) if graph else robot
    exact = factor * EULER
    found = rs.critical_load(subject, wrench=DOWN, up_to=10 * exact)
    assert -5e-4 < found.factor / exact - 1 < 8e-3
    if not graph:
        fine = rs.critical_load(subject, wrench=DOWN, up_to=10 * exact, beams=rs.Bowing(8))
        assert abs(fine.factor / exact - 1) < 1e-3
    if name in ("clamped, clamped", "clamped, hinged"):
        assert "rod' of leg" in found.mode or "rod'" in found.mode.rpartition("most in")[2]


def test_elements_of_columns_come_from_above():
    """With the fourth power of their number; one spring at its end has no lever between its ends.

    One element alone does not buckle between hinges that lie outside it.
    """
    free, between = COLUMNS["clamped, free"], COLUMNS["hinged, hinged"]
    for (robot, factor), elements, excess in (
        (free, 1, 8e-3),
        (free, 2, 5.6e-4),
        (between, 1, 0.22),
        (between, None, 8e-3),
    ):
        found = rs.critical_load(robot, wrench=DOWN, up_to=1e5, beams=rs.Bowing(elements))
        assert 0 < found.factor / (factor * EULER) - 1 < excess
        assert not found.is_limit
        assert (found.leg == "column" and "rod" in found.mode) == (robot is between[0])
    assert not rs.critical_load(free[0], wrench=DOWN, beams=rs.Linear()).is_found


@pytest.mark.parametrize("name", COLUMNS)
def test_beyond_euler_loads_columns_are_unstable(name: str):
    robot, factor = COLUMNS[name]
    assert loaded(robot, wrench=0.97 * factor * EULER * DOWN).stable
    for part in (1.02, 2.5):
        answer = loaded(robot, wrench=part * factor * EULER * DOWN)
        assert rs.Status.BEYOND_CRITICAL_LOAD in answer.status
        assert not answer.has_answer or rs.Status.UNSTABLE in answer.status


@pytest.mark.parametrize("part", [1e-2, 1e-6])
def test_close_below_a_bifurcation_columns_are_straight(part: float):
    """The path answers, and none of the branches that begin there."""
    for name in ("hinged, hinged", "clamped, guided", "clamped, clamped"):
        robot, _ = COLUMNS[name]
        critical = rs.critical_load(robot, wrench=DOWN, up_to=1e5).factor
        answer = loaded(robot, wrench=(1 - part) * critical * DOWN)
        if name == "clamped, clamped" and part < 1e-4:
            # of the rod between its ends and of the ends, the latter lose it 1e-5 before
            assert rs.Status.BEYOND_CRITICAL_LOAD in answer.status
            continue
        assert answer.stable
        assert np.abs(answer.displacement[1:]).max() < 1e-6 * L
        assert 0.1 * part < answer.margin < 10 * part


def test_the_equilibrium_at_a_load_between_two_of_a_path():
    """It is on the path, where Newton's method at the load itself leaps to the branch beside it."""
    robot, factor = COLUMNS["clamped, guided"]
    loaded_robot = postures_of(robot, None, None).loaded(0, Acting())
    problem = loaded_robot.problem
    loading = LoadCase(np.zeros(6), DOWN)
    wanted = (1 - 1e-5) * factor * EULER
    for point in path(problem, loading):
        if point.found.factor > wanted:
            found = point.at(wanted)
            assert found.converged
            assert found.factor == wanted
            assert np.abs(found.displacement[1:]).max() < 1e-6 * L
            break


def test_paths_and_frequencies_of_a_clamped_column():
    """The path has the critical load; the square of a frequency falls to zero there."""
    robot, factor = COLUMNS["clamped, hinged by the guide"]
    critical = rs.critical_load(robot, wrench=DOWN, up_to=1e5).factor
    assert np.isclose(critical, factor * EULER, rtol=1e-3)
    path = rs.load_path(robot, wrench=DOWN, factors=np.linspace(0, 1.2, 7) * critical)
    assert path.critical_factor.values == pytest.approx([critical], rel=1e-6)
    sheared = COLUMNS["clamped, guided"][0]
    slow = [
        rs.modes(sheared, masses={"platform": 3.0}, wrench=part * EULER * DOWN).frequencies[0]
        for part in (0.0, 0.5, 0.9)
    ]
    # of a guided column to first order: 1 - P/P_E is 1.5 % off at the most
    assert np.allclose(np.square(slow) / slow[0] ** 2, [1, 0.5, 0.1], atol=0.02)


@pytest.mark.parametrize("softness", [0.02, 0.2, 1.0])
def test_columns_soft_in_shear(softness: float):
    """Engesser: 1/P = 1/P_Euler + shear compliance of a length."""
    compliance = softness / EULER
    C = cantilever_compliance(L, 1.0, 1.0, 1e8, EI, EI, EI)
    C[1, 1] += compliance * L
    C[2, 2] += compliance * L
    soft = PlacedSpring("rod", np.array(TIP), np.eye(3), Elasticity(C))
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


@pytest.mark.parametrize("e", [0.0, 0.05])
def test_energy_under_an_axial_force_is_the_least_of_all_inner_modes(e: float):
    """By polynomials written out: cubics of the ends, and inner modes that vanish there."""
    C = cantilever_compliance(L, 1.0, 1.0, 1e8, EI, 2 * EI, EI)
    C[1, 1] += e * L**3 / (2 * EI)
    C[2, 2] += e * L**3 / EI
    planes = bending_planes(Space.SPATIAL, np.eye(3))
    bent = bending(np.eye(6), C, L, planes, inner=True)
    rng = np.random.default_rng(4)
    x, N, k = rng.uniform(-0.1, 0.1, 6), -1.7 * EULER, 1e8 / L
    s, least = P([0, 1]), 0.0
    for d, r, rigidity in ((x[1], x[5], 2 * EI), (x[2], -x[4], EI)):
        slopes, bends = [d * (6 * s - 6 * s**2) + L * r * (3 * s**2 - 2 * s)], []
        for n in (2, 3, 4):
            bend = Legendre.basis(n, [0, 1]).convert(kind=P) * (2 * n + 1) ** 0.5
            sheared = bend.deriv() - (bend(1) - bend(0))
            slopes.append(L * (bend.integ(lbnd=0) - e * sheared))
            bends.append((bend, sheared))
        S = [[(a * b).integ(lbnd=0)(1) / L for a in slopes] for b in slopes]
        K = [[(a * b + e * c * d).integ(lbnd=0)(1) for a, c in bends] for b, d in bends]
        both = N * np.array(S)
        both[1:, 1:] += rigidity / L * np.array(K)
        a = np.linalg.solve(both[1:, 1:], -both[1:, 0])
        least += 0.5 * (both[0, 0] + both[0, 1:] @ a)
    along = np.eye(6)[0]

    def terms(x: np.ndarray, N: float) -> BowingTerms:
        return bent.terms(x[None], np.array([N]), along[None], np.array([k]))

    assert np.isclose(terms(x, N).energy[0] + (N - k * x[0]) ** 2 / (2 * k), least, rtol=1e-12)

    def balanced(x: np.ndarray) -> float:
        own = N
        for _ in range(60):
            own = own + float(terms(x, own).missing[0])
        return own

    known, h = terms(x, balanced(x)), 1e-6
    ends = [[x + sign * step for sign in (1, -1)] for step in h * np.eye(6)]
    energies = [[float(terms(end, balanced(end)).energy[0]) for end in own] for own in ends]
    forces = [[balanced(end) for end in own] for own in ends]
    for found, own in ((known.gradient[0], energies), (known.rate[0], forces)):
        expected = -np.diff(own, axis=1)[:, 0] / (2 * h)
        assert np.allclose(found, expected, rtol=0, atol=1e-6 * np.max(np.abs(expected)))


def test_struts_of_a_hexapod_on_flexures_and_clamped():
    """By default as by eight elements a strut, which buckle below the load of clamped ends."""
    angles = np.radians([[0, 120, 120, 240, 240, 360], [60, 60, 180, 180, 300, 300]])
    radii, heights = np.array([0.5, 0.3]), np.array([0.0, 0.8])
    base, top = (
        np.stack([r * np.cos(a), r * np.sin(a), np.full(6, h)], axis=1)
        for r, a, h in zip(radii, angles, heights, strict=True)
    )
    length, rigidity = np.linalg.norm(top[0] - base[0]), 13.4
    strut = np.pi**2 * rigidity / length**2
    load = np.array([0, 0, -6 * strut * 0.8 / length, 0, 0, 0])
    for clamped, low, high in ((False, 1.1, 1.2), (True, 3.9, 4.01)):
        legs = []
        for i, (a, b) in enumerate(zip(base, top, strict=True)):
            rod = beam("rod", list(a), list(b), 6e6, rigidity, 10.0)
            ends = [
                joint(f"{end}{n}", at, axis, "R", 5.0)
                for end, at in (("foot", a), ("head", b))
                for n, axis in enumerate(rod.rotation.T[1:])
            ]
            parts = (rod,) if clamped else (*ends[:2], rod, *ends[2:])
            legs.append(PlacedLeg(f"leg{i}", parts, b))
        robot = Snapshot("hexapod", tuple(legs), np.array([0, 0, 0.8]))
        found, fine = (
            rs.critical_load(robot, wrench=load, beams=own).factor
            for own in (rs.Bowing(), rs.Bowing(8))
        )
        assert np.isclose(found, fine, rtol=1e-3)
        assert low < fine < high
        assert not loaded(robot, wrench=1.05 * fine * load).stable


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

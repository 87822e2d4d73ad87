"""Critical loads in closed form: Euler's columns, and graphs of pins, slides and springs."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import CrossSection, Elasticity, cantilever_compliance, circle
from robostiff.model import Actuated, Passive, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.network import JointElement, Network, Node, beam_between, network_of_snapshot
from robostiff.spatial import Space
from tests.files import FILES
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


@pytest.mark.parametrize(("elements", "most"), [(4, 0.07), (8, 0.017), (16, 0.0042)])
def test_a_strip_buckles_sideways_and_a_shaft_by_its_torque(elements: int, most: float):
    """Prandtl (1899) and Greenhill (1883); a torque keeps its direction in a guide that turns."""
    steel, wall, tip = rs.material("steel"), Node("wall", np.zeros(3)), Node("tip", np.array(TIP))
    thin = CrossSection(A=1e-4, Iy=1e-12, Iz=1e-8, J=2e-12)
    bar = beam_between(wall, tip, steel, thin, y_axis=Y)
    strip = Network("strip", (wall, tip), ("wall",), "tip", tip.point, (bar,))
    found = rs.critical_load(strip, wrench=[0, 0.1, 0, 0, 0, 0], beams=rs.Bowing(elements))
    exact = 4.0126 * np.sqrt(steel.E * thin.Iy * steel.G * thin.J) / L**2
    assert 0 < 0.1 * found.factor / exact - 1 < most
    bar = beam_between(wall, tip, steel, circle(1e-3))
    along = PlacedFreedom(np.array(X), tip.point, None, "along", Passive())
    turn = PlacedFreedom(np.array(X), tip.point, 0.0, "turn", Passive())
    guide = JointElement("guide", "wall", "tip", (along, turn))
    shaft = Network("shaft", (wall, tip), ("wall",), "tip", tip.point, (bar,), (), (guide,))
    found = rs.critical_load(shaft, wrench=[0, 0, 0, 1e-2, 0, 0], beams=rs.Bowing(elements))
    exact = 2 * 4.493409 * steel.E * circle(1e-3).Iy / L
    assert 0 < 1e-2 * found.factor / exact - 1 < most


def test_kernels_do_not_pass_over_the_buckling_of_a_clamped_rod():
    """A clamped rod on a drive pushes a platform that a stiff slide guides.

    Before the critical load a kernel agrees with equilibrium; beyond it, it says so.
    """
    robot = rs.load(FILES / "guided-press.yaml")
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


PUSHED = [0.0, -1, 0, 0, 0, 0]


def pin(name: str, a: str, b: str, at: tuple[float, float], k: float | None = None) -> JointElement:
    role = Passive() if k is None else Actuated(k)
    freedom = PlacedFreedom(np.array([0, 0, 1.0]), np.array([*at, 0.0]), 0.0, name, role)
    return JointElement(name, a, b, (freedom,))


def slide(name: str, a: str, b: str, along: tuple[float, float], k: float) -> JointElement:
    axis = np.array([*along, 0.0]) / np.hypot(*along)
    return JointElement(name, a, b, (PlacedFreedom(axis, np.zeros(3), None, name, Actuated(k)),))


def network(platform: str, point: tuple[float, float], *joints: JointElement) -> Network:
    at = np.array([*point, 0.0])
    names = dict.fromkeys(body for one in joints for body in (one.a, one.b))
    return Network(
        "plane", tuple(Node(name, at) for name in names), ("ground",), platform, at, joints=joints
    )


def pendulum(lengths: list[float], k: list[float]) -> Network:
    """Rigid bars upright on each other, springs in all pins."""
    heights = np.cumsum([0.0, *lengths[:-1]])
    bodies = ["ground", *(f"b{i}" for i in range(len(k)))]
    pins = [
        pin(f"p{i}", a, b, (0.0, float(h)), own)
        for i, (a, b, h, own) in enumerate(zip(bodies[:-1], bodies[1:], heights, k, strict=True))
    ]
    return network(bodies[-1], (0.0, sum(lengths)), *pins)


@pytest.mark.parametrize(
    ("count", "seed"),
    [
        *((1, 0), (2, 1), (4, 0)),
        *(
            pytest.param(*x, marks=pytest.mark.slow)
            for x in ((1, 1), (2, 0), (3, 0), (3, 1), (4, 1))
        ),
    ],
)
def test_pendulums_upright(count: int, seed: int):
    """``sum(k (t_i - t_i-1)^2) / 2 = P sum(l_i t_i^2) / 2`` with t the angles of the bars.

    Rigid parts carry the load: it does no work on how they fall, though none of it is left there.
    """
    random = np.random.default_rng(seed)
    lengths, k = random.uniform(0.3, 1, count), random.uniform(1, 40, count)
    D = np.eye(count) - np.eye(count, k=-1)
    exact = eigh(D.T @ np.diag(k) @ D, np.diag(lengths), eigvals_only=True)[0]
    robot = pendulum(lengths.tolist(), k.tolist())
    found = rs.critical_load(robot, wrench=PUSHED)
    assert np.isclose(found.factor, exact, rtol=1e-9, atol=0)
    assert not found.is_limit
    assert "buckles" in found.mode
    path = rs.load_path(robot, wrench=PUSHED, factors=[2 * exact])
    (turn,) = np.flatnonzero(np.diff(path.path_stable.values.astype(int)))
    assert np.isclose(path.path_factor.values[turn], exact, rtol=1e-3)
    assert np.all(path.path_factor.values[: turn + 1] < exact * (1 + 1e-9))


def truss(h: float, k: float, kx: float | None, ky: float | None) -> Network:
    """Two springs from (-1, 0) and (1, 0) to the apex (0, h), which other springs hold, too."""
    a, spring = 1.0, {"k": k}
    return network(
        "apex",
        (0.0, h),
        pin("left", "ground", "l1", (-a, 0.0)),
        slide("spring", "l1", "l2", (a, h), **spring),
        pin("left top", "l2", "apex", (0.0, h)),
        pin("right top", "apex", "r2", (0.0, h)),
        slide("other", "r2", "r1", (a, -h), **spring),
        pin("right", "r1", "ground", (a, 0.0)),
        # the apex turns with a soft spring, which does not matter
        JointElement(
            "upright",
            "ground",
            "apex",
            tuple(
                PlacedFreedom(np.array(axis), np.array([0, h, 0.0]), pitch, f"u{i}", role)
                for i, (axis, pitch, role) in enumerate(
                    [
                        ([1.0, 0, 0], None, Passive() if kx is None else Actuated(kx)),
                        ([0, 1.0, 0], None, Passive() if ky is None else Actuated(ky)),
                        ([0, 0, 1.0], 0.0, Actuated(1.0)),
                    ]
                )
            ),
        ),
    )


@pytest.mark.parametrize(
    "part", [0.95, *(pytest.param(own, marks=pytest.mark.slow) for own in (0.5, 1.5))]
)
def test_loads_that_act_throughout_are_followed_too(part: float):
    """A weight beyond the critical one has snapped the truss through before the wrench acts."""
    a, h, k = 1.0, 0.2, 500.0
    robot, length = truss(h, k, 1e3, None), np.hypot(1.0, 0.2)
    y = np.sqrt((length * a * a) ** (2 / 3) - a * a)
    exact = 2 * k * y * (length / np.hypot(a, y) - 1)
    weight = {"apex": [0, -part * exact, 0]}
    found = rs.critical_load(robot, wrench=PUSHED, loads=weight)
    assert found.is_limit
    assert np.isclose(found.factor, max(1 - part, 0.0) * exact, rtol=1e-7, atol=0)
    curve = rs.load_path(robot, wrench=PUSHED, factors=[0.04 * exact, 2 * exact], loads=weight)
    assert np.isclose(curve.critical_factor.values[0], found.factor, rtol=1e-6)
    codes = curve.status_code.values
    assert bool(codes[0] & rs.Status.BEYOND_CRITICAL_LOAD) == (part > 1)
    assert codes[1] & rs.Status.BEYOND_CRITICAL_LOAD


def test_a_chain_that_stiffens_is_followed_to_its_load():
    """What its platform moves bounds a step of the path, not the load."""
    bars = pendulum([0.4, 0.9, 0.8], [8.7, 6.8, 5.0])
    found = rs.critical_load(bars, wrench=[1.0, 0, 0, 0, 0, 0], up_to=5e3)
    assert not found.is_found
    assert found.searched_to == 5e3
    assert not found.status & rs.Status.NO_EQUILIBRIUM


def parallelogram(turn: float, k: list[float], point: str) -> Network:
    """Cranks of length 0.8 from x = 0 and 0.6, turned from the x-axis; springs in all pins."""
    x, y = 0.8 * np.cos(turn), 0.8 * np.sin(turn)
    return network(
        point,
        (x, y),
        pin("left", "ground", "crank", (0.0, 0.0), k[0]),
        pin("left top", "crank", "coupler", (x, y), k[1]),
        pin("right top", "coupler", "rocker", (0.6 + x, y), k[2]),
        pin("right", "rocker", "ground", (0.6, 0.0), k[3]),
    )


@pytest.mark.parametrize("point", ["crank", "coupler"])
@pytest.mark.parametrize("turn", [0.1, 0.4, 1.2])
def test_a_parallelogram_that_is_laid_flat_branches_there(turn: float, point: str):
    """All bars in line at ``P 0.8 = sum(k) turn``: a crossed parallelogram begins there."""
    k = [3.0, 11.0, 0.7, 5.0]
    robot = parallelogram(turn, k, point)
    exact = sum(k) * turn / 0.8
    found = rs.critical_load(robot, wrench=PUSHED)
    assert np.isclose(found.factor, exact, rtol=1e-7, atol=0)
    assert "singular posture" in found.mode
    assert not found.is_limit
    assert not rs.critical_load(robot, wrench=PUSHED, up_to=0.99 * exact).is_found
    before, beyond = (
        rs.equilibrium(robot, wrench=s * exact * np.array(PUSHED)) for s in (0.9, 1.1)
    )
    assert before.critical_factor is None
    assert np.isclose(beyond.critical_factor or 0.0, 1 / 1.1, rtol=1e-7, atol=0)
    assert rs.Status.BEYOND_CRITICAL_LOAD & beyond.status
    curve = rs.load_path(robot, wrench=PUSHED, factors=[0.9 * exact, 1.1 * exact])
    assert np.allclose(curve.critical_factor, [exact], rtol=1e-7, atol=0)
    assert "singular posture" in str(curve.critical_mode.values[0])
    passed = curve.path_status_code.values & rs.Status.BEYOND_CRITICAL_LOAD > 0
    assert np.array_equal(passed, curve.path_factor.values > exact)
    assert curve.path_stable.values.all()


@pytest.mark.parametrize("along", [1.0, -1.0])
def test_a_parallelogram_that_turns_upright_does_not_branch(along: float):
    """Pulled along the x-axis its cranks lie down, at no finite load flat, or turn over the top."""
    robot = parallelogram(1.2, [3.0, 11.0, 0.7, 5.0], "coupler")
    found = rs.critical_load(robot, wrench=[along, 0, 0, 0, 0, 0], up_to=300)
    assert not found.is_found
    assert found.searched_to == 300


@pytest.mark.parametrize("sizes", [(0.12, 29.0, 0.86, 0.07), (0.2, 19.0, 0.1, 1e-4)])
def test_struts_that_turn_over_stay_on_their_side(sizes: tuple[float, ...]):
    """An apex drawn far sideways comes down to a fork, all but symmetric, and stays above it.

    Along x, y follows from balance upright; the least curvature is positive and the force rises.
    """
    h, k, kx, ky = sizes
    feet, y, forces = np.array([[-1.0, 0.0], [1.0, 0.0]]), h, []
    g, H = np.zeros(2), np.eye(2)
    for x in np.linspace(0.0, -3.0, 1001):
        for _ in range(30):
            d = np.array([x, y]) - feet
            L = np.hypot(*d.T)
            u, T = d / L[:, None], k * (L - np.hypot(1.0, h))
            g = T @ u + [kx * x, ky * (y - h)]
            across = np.eye(2) - u[:, :, None] * u[:, None, :]
            H = np.diag([kx, ky]) + np.einsum("i,ijk->jk", T / L, across) + k * u.T @ u
            if abs(g[1]) < 1e-12 * k:
                break
            y -= g[1] / H[1, 1]
        assert np.linalg.eigvalsh(H)[0] > 0
        forces.append(-g[0])
    assert np.all(np.diff(forces) > 0)
    robot = truss(h, k, kx, ky)
    pull = np.array([-1.0, 0, 0, 0, 0, 0])
    found = rs.critical_load(robot, wrench=pull, up_to=forces[-1])
    assert not found.is_found
    assert found.searched_to == forces[-1]
    curve = rs.load_path(robot, wrench=forces[-1] * pull, factors=[1.0])
    assert bool(np.all(curve.path_stable))
    assert np.allclose(curve.path_displacement.values[-1, :2], [-3.0, y - h], rtol=0, atol=1e-8)

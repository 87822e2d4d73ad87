"""Critical loads of graphs of pins, slides and springs in a plane, in closed form."""

import numpy as np
import pytest
from scipy.linalg import eigh

import robostiff as rs
from robostiff.model import Actuated, Passive, PlacedFreedom
from robostiff.network import JointElement, Network, Node

DOWN = [0.0, -1, 0, 0, 0, 0]


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
    found = rs.critical_load(robot, wrench=DOWN)
    assert np.isclose(found.factor, exact, rtol=1e-9, atol=0)
    assert not found.is_limit
    assert "buckles" in found.mode
    path = rs.load_path(robot, wrench=DOWN, factors=[2 * exact])
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
    found = rs.critical_load(robot, wrench=DOWN, loads=weight)
    assert found.is_limit
    assert np.isclose(found.factor, max(1 - part, 0.0) * exact, rtol=1e-7, atol=0)
    curve = rs.load_path(robot, wrench=DOWN, factors=[0.04 * exact, 2 * exact], loads=weight)
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
    found = rs.critical_load(robot, wrench=DOWN)
    assert np.isclose(found.factor, exact, rtol=1e-7, atol=0)
    assert "singular posture" in found.mode
    assert not found.is_limit
    assert not rs.critical_load(robot, wrench=DOWN, up_to=0.99 * exact).is_found
    before, beyond = (rs.equilibrium(robot, wrench=s * exact * np.array(DOWN)) for s in (0.9, 1.1))
    assert before.critical_factor is None
    assert np.isclose(beyond.critical_factor or 0.0, 1 / 1.1, rtol=1e-7, atol=0)
    assert rs.Status.BEYOND_CRITICAL_LOAD & beyond.status
    curve = rs.load_path(robot, wrench=DOWN, factors=[0.9 * exact, 1.1 * exact])
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

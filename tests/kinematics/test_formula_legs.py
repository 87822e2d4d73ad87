"""Legs recorded at a pose: the same elasticity and freedoms as the leg closed in floats."""

from functools import cache

import numpy as np
import pytest

import robostiff as rs
from robostiff import InputError, load
from robostiff.kinematics import PostureFinder
from robostiff.kinematics.formula import FormulaPose, place_leg
from robostiff.model import Joint, Role
from tests.generators.elements import ROD, STEEL
from tests.generators.legs import (
    DRIVE,
    FREE,
    PLANAR,
    POSTS,
    RODS,
    SLIDING,
    STRUTS,
    LegCase,
    near_home,
    random_leg,
)
from tests.kinematics.recorded_legs import Pair, built_leg, difference, pair_of

SEEDS = range(3)


def poses_around(case: LegCase, rng: np.random.Generator, size: float = 1.0) -> np.ndarray:
    """Poses that the leg can take, and some that most legs cannot (12, 6)."""
    taken = np.array([case.pose_at(near_home(case, rng, size)) for _ in range(8)])
    return np.concatenate([taken, taken[:4] + 0.3 * rng.normal(size=(4, 6))])


def check(pair: Pair) -> int:
    """Compare where the leg is reached; the count of such poses."""
    reached = pair.reached & pair.long_enough
    for recorded, computed, counts in zip(pair.recorded, pair.computed, reached, strict=True):
        if counts:
            assert difference(recorded, computed) <= 1e-10
    return int(np.count_nonzero(reached))


@cache
def random_pair(kind: str, seed: int) -> Pair:
    """A random leg at poses around its home."""
    case = random_leg(kind, seed)
    return pair_of(case, poses_around(case, np.random.default_rng(seed)))


@pytest.mark.parametrize("kind", STRUTS + RODS + PLANAR + SLIDING + POSTS)
@pytest.mark.parametrize("seed", SEEDS)
def test_same_as_in_floats(kind: str, seed: int):
    assert check(random_pair(kind, seed)) >= 1


@pytest.mark.parametrize("kind", STRUTS + RODS + PLANAR + SLIDING + POSTS)
def test_the_gap_vanishes_where_the_leg_closes_and_only_there(kind: str):
    reached = []
    for seed in SEEDS:
        pair = random_pair(kind, seed)
        assert ((pair.largest_gap < 1e-14) == pair.reached).all()
        reached.extend(pair.reached)
    if kind in ("SPS", "SPU", "UCU"):
        assert all(reached)
    elif kind != "UPS":  # whose joint points nearly everywhere
        assert not all(reached)


def last_joint(letter: str, along: np.ndarray, rng: np.random.Generator, skewed: float) -> Joint:
    """A joint at the far end of a strut, its first axis across the strut unless skewed."""
    across = np.cross(along, rng.normal(size=3))
    across = across / np.linalg.norm(across) + skewed * along
    match letter:
        case "S":
            return rs.spherical(FREE, home=[0.2, -0.1, 0.3])
        case "R":
            return rs.revolute(across, FREE, home=[0.3])
        case _:
            return rs.universal(across, np.cross(across, along) + skewed * across, FREE)


@pytest.mark.parametrize("kind", ["SCS", "SCU", "SCR", "UCS", "UCR", "SPR", "UCU", "RPS", "RPU"])
@pytest.mark.parametrize("skewed", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_cylindrical_joints_and_struts_of_few_freedoms(kind: str, skewed: float, seed: int):
    rng = np.random.default_rng(seed)
    along = rng.normal(size=3)
    along /= np.linalg.norm(along)
    first = {
        "S": rs.spherical(FREE, home=[0.4, 0.1, -0.2]),
        "R": rs.revolute(np.cross(along, rng.normal(size=3)) + skewed * along, FREE, home=[0.2]),
        "U": last_joint("U", along, rng, skewed),
    }[kind[0]]
    if kind[0] == "U":
        axes = [freedom.axis for freedom in first.freedoms]
        first = rs.universal(axes[1], axes[0], FREE, home=[0.3, -0.2])
    slide = (
        rs.cylindrical(along, FREE, home=[0.7, 0.2])
        if kind[1] == "C"
        else rs.prismatic(along, DRIVE, home=[0.7])
    )
    near = rs.beam_link(0.2 * along, STEEL, ROD)
    far = rs.beam_link(0.3 * along, STEEL, ROD)
    case = built_leg([first, near, slide, far, last_joint(kind[2], along, rng, skewed)], seed)
    pair = pair_of(case, poses_around(case, rng, 0.6))
    assert check(pair) >= 1
    assert ((pair.largest_gap < 1e-14) == pair.reached).all()


@pytest.mark.parametrize("kind", ["PUS", "RUS", "RRR", "PRR", "UPU", "UPS", "RUU", "U", "R"])
def test_coordinates_of_joints_are_those_in_floats(kind: str):
    case = random_leg(kind, 2)
    pair = pair_of(case, poses_around(case, np.random.default_rng(2), 0.3))
    for place, freedom in enumerate(case.leg.chain.roles):
        if not isinstance(freedom, rs.Actuated):
            continue
        turn = pair.formula.coordinate(place).sample - pair.q[:, place]
        assert np.allclose(np.sin(turn[pair.reached] / 2), 0, atol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_limited_angles_of_a_universal_joint_are_those_nearer_to_home(seed: int):
    along = np.array([0.0, 0.0, 1.0])
    limited: Role = rs.Actuated(1e4, limits=(-1.0, 1.0))
    case = built_leg(
        [
            rs.universal([1, 0, 0], [0, 1, 0], limited, home=[0.3, -0.4]),
            rs.prismatic(along, FREE, home=[0.8]),
            rs.beam_link(0.1 * along, STEEL, ROD),
            rs.spherical(FREE),
        ],
        seed,
    )
    pair = pair_of(case, poses_around(case, np.random.default_rng(seed), 0.8))
    for place in (0, 1):
        turn = pair.formula.coordinate(place).sample
        assert np.allclose(turn[pair.reached], pair.q[pair.reached, place], atol=1e-10)


def test_a_ball_of_a_closed_leg_has_no_coordinates():
    case = random_leg("UPS", 0)
    pair = pair_of(case, poses_around(case, np.random.default_rng(0)))
    with pytest.raises(InputError, match="spherical joint of a leg in closed form"):
        pair.formula.coordinate(case.leg.chain.size - 1)


def test_a_leg_without_a_closed_form_is_refused():
    robot = load("six-joint-arm")
    pose = FormulaPose.of_coordinates(np.zeros(6))
    (solver,) = PostureFinder(robot).solvers
    with pytest.raises(InputError, match="place_leg_at_joints"):
        place_leg(robot.legs[0], pose, solver)

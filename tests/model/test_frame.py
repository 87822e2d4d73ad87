"""Frames: a group under composition, the same as SciPy's rigid transforms, exact with formulas."""

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import RigidTransform, Rotation

from robostiff.model import Actuated, Chain, Leg, Rigid, Robot, revolute
from robostiff.spatial import Frame

a, L = sp.Symbol("a", real=True), sp.Symbol("L", positive=True)


def random_transform(rng: np.random.Generator) -> RigidTransform:
    return RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))


def same(first: Frame, second: Frame, tolerance: float = 1e-14) -> bool:
    return bool(
        np.abs(first.R - second.R).max() < tolerance
        and np.abs(first.p - second.p).max() < 10 * tolerance
    )


def turned_about_z(angle: sp.Expr, x: sp.Expr) -> Frame:
    c, s = sp.cos(angle), sp.sin(angle)
    return Frame([[c, -s, 0], [s, c, 0], [0, 0, 1]], [x, 0, 0.5])  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("seed", range(3))
def test_composition_is_that_of_rigid_transforms(seed):
    rng = np.random.default_rng(seed)
    S, T = random_transform(rng), random_transform(rng)
    assert same(Frame.of(S) @ Frame.of(T), Frame.of(S * T))
    assert same(Frame.of(S).inverse, Frame.of(S.inv()))
    assert same(Frame.of(S) @ Frame.identity(), Frame.of(S))
    np.testing.assert_allclose(Frame.of(T).rigid_transform.as_matrix(), T.as_matrix(), atol=1e-15)
    assert isinstance(Rigid(T).transform, Frame)  # pyright: ignore[reportArgumentType]


def test_legs_and_robots_take_rigid_transforms():
    rng = np.random.default_rng(5)
    base, attachment, home = (random_transform(rng) for _ in range(3))
    chain = Chain((revolute([0, 0, 1], Actuated(1e5)),))
    leg = Leg("leg", base, chain, attachment)  # pyright: ignore[reportArgumentType]
    robot = Robot("robot", (leg,), home=home)  # pyright: ignore[reportArgumentType]
    assert robot.home is not None
    assert same(leg.base, Frame.of(base))
    assert same(leg.attachment, Frame.of(attachment))
    assert same(robot.home, Frame.of(home))


def test_formulas_compose_exactly():
    quarter = turned_about_z(sp.pi / 2, L)
    whole = quarter @ quarter @ quarter @ quarter
    assert (whole.R == np.eye(3, dtype=int)).all()
    assert whole.p.tolist() == [0, 0, 2]
    back = turned_about_z(a, L).inverse @ turned_about_z(a, L)
    assert all(sp.simplify(entry) == 0 for entry in back.p)


def test_no_float_enters_a_formula():
    moved = Frame.identity() @ Frame(np.eye(3), [L, 0.25, 0])  # pyright: ignore[reportArgumentType]
    assert moved.p.tolist() == [L, sp.Rational(1, 4), 0]
    assert not any(sp.sympify(entry).has(sp.Float) for entry in (*moved.R.flat, *moved.p))

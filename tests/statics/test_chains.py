"""The chain function against the potential of the whole chain, written in products of motions of
the unloaded posture and differentiated by the record."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity.cantilever import cantilever_compliance
from robostiff.record import Record, cosine, derivatives_along, sine
from robostiff.spatial import Space, skew
from robostiff.spatial.rotation import matrix_of_rotation
from robostiff.statics.chains.beam_bowing import bending, bending_planes
from robostiff.statics.chains.elements import (
    BodyLoad,
    Element,
    FiniteChain,
    FiniteJoint,
    FiniteSpring,
    Owner,
)
from robostiff.statics.chains.legs import Legs
from robostiff.statics.chains.moving_chain import FURTHEST_TURN, FiniteTurn
from tests.statics.robots_under_load import loaded


def _joint(random: np.random.Generator, *, turns: bool, slide: float) -> FiniteJoint:
    axis = random.normal(size=3)
    axis /= np.linalg.norm(axis)
    point, k, f = random.normal(size=3), random.uniform(5, 9), random.uniform(1, 2)
    return FiniteJoint("joint", point, axis, turns, slide, k, f)


def _beam(random: np.random.Generator) -> FiniteSpring:
    L, V = 0.4, np.eye(6)
    C = cantilever_compliance(L, 1.0, 1.0, 900.0, 2.0, 3.0, 4.0)
    bent = bending(V, C, L, bending_planes(Space.SPATIAL, np.eye(3)), inner=True)
    rotation, k = matrix_of_rotation(random.normal(size=3)), random.uniform(20, 30, 6)
    return FiniteSpring("beam", random.normal(size=3), rotation, V, k, 900 / L, bent)


def _chain(random: np.random.Generator) -> FiniteChain:
    elements: list[Element] = [
        _joint(random, turns=True, slide=0.3),
        _beam(random),
        _joint(random, turns=False, slide=1.0),
        _beam(random),
        _joint(random, turns=True, slide=0.0),
    ]
    loads = [BodyLoad(k, random.normal(size=3), random.normal(size=3)) for k in (1, 4, 4)]
    return FiniteChain(None, None, tuple(elements), tuple(loads), owner=Owner(0, "leg", 0))


def _motion(e: Element, y: Any) -> np.ndarray:
    """Motion (4, 4) behind an element from the unloaded posture."""
    M = np.eye(4, dtype=int).astype(object)
    c = e.point
    if isinstance(e, FiniteJoint):
        A, q = skew(e.axis), y[0]
        R = (
            np.eye(3)
            + A * (sine(q) if e.turns else 0)
            + A @ A * ((1 - cosine(q)) if e.turns else 0)
        )
        shift: Any = e.axis * (e.slide * q)
    else:
        own, th = e.rotation, e.modes @ y
        S = np.array([[0, -th[5], th[4]], [th[5], 0, -th[3]], [-th[4], th[3], 0]], dtype=object)
        power, R = np.eye(3), np.eye(3)
        for n in range(1, 16):
            power = power @ S
            R = R + power * (1 / math.factorial(n))
        R, shift = own @ R @ own.T, own @ th[:3]
    M[:3, :3], M[:3, 3] = R, c + shift - R @ c
    return M


def _potential(legs: Legs, x: np.ndarray, axial: np.ndarray, end: np.ndarray, W: np.ndarray) -> Any:
    """Energy less the work of loads, preloads and the end force; end motion (4, 4).

    Stationary in the axial forces of beams.
    """
    energy: Any = 0
    chain = legs.chains[0]
    forces = iter(axial.tolist())
    T, behind = np.eye(4), [np.eye(4)]
    for e, place in zip(chain.elements, legs.places.values(), strict=True):
        y = x[place]
        energy = energy + sum(e.stiffness * y * y) * 0.5
        if isinstance(e, FiniteJoint):
            energy = energy - e.preload * y[0]
        else:
            N, bent, k = next(forces), e.bending, e.axial
            z, stretch = bent.z @ y, N - k * (e.modes[0] @ y)
            h = bent.s * N - bent.b / (1 + N * bent.l) * (N * N)
            energy = energy + (h * z * z).sum() * 0.5 - stretch * stretch * (0.5 / k)
        T = T @ _motion(e, y)
        behind.append(T)
    for load in chain.loads:
        energy = energy - load.force @ (behind[load.after] @ np.append(load.point, 1))[:3]
    return energy - W[:3] @ (T @ np.append(end, 1))[:3], T


@pytest.mark.parametrize("on_entries", [False, True])
def test_gradient_and_second_derivatives_are_those_of_the_potential(on_entries: bool) -> None:
    random = np.random.default_rng(4)
    chain, end, W = _chain(random), random.normal(size=3), random.normal(size=6)
    at = random.uniform(-0.04, 0.04, chain.size)
    n, N = chain.size, np.array([-0.8, 1.3])
    names = [*(f"x{i}" for i in range(n)), "N0", "N1"]
    record = Record({name: [value] for name, value in zip(names, [*at, *N], strict=True)})
    unknowns = np.array([record.input(name) for name in names], dtype=object)
    x, axial = unknowns[:n], unknowns[n:]
    kind = object if on_entries else float
    legs = Legs((chain,), np.zeros((0, 3)).astype(kind), end.astype(kind), tuple(range(6)))
    potential, T = _potential(legs, x, axial, end, W)
    value = np.vectorize(lambda y: float(y.sample[0]) if hasattr(y, "sample") else float(y))
    # a moment m has the work of the constant matrix m x R / 2 on R, as far as it is symmetric
    of_moment = 0.5 * skew(W[3:]) @ value(T[:3, :3])
    potential = potential - (of_moment * T[:3, :3]).sum()
    rates = [derivatives_along(record, [potential], {name: 1})[0] for name in names]
    Q = value(np.array([derivatives_along(record, rates, {name: 1}) for name in names]))
    P = list((T @ np.append(end, 1))[:3])
    J = value(np.array([derivatives_along(record, P, {name: 1}) for name in names[:n]]))
    gradient = value(np.array(rates))
    missing, rate = (-np.linalg.solve(Q[n:, n:], own) for own in (gradient[n:], Q[n:, :n]))
    gradient, Q = gradient[:n] + Q[:n, n:] @ missing, Q[:n, :n] + Q[:n, n:] @ rate

    start = np.eye(3)[None].astype(kind), np.zeros((1, 3)).astype(kind)
    given = (x, axial) if on_entries else (at, N)
    terms = legs.arrays.terms(given[0], *start, W[None], given[1], 1.0)
    size, (a, b) = np.max(np.abs(Q)), legs.numbers.of_chains.pairs
    assert value(terms.gradient) == pytest.approx(gradient, abs=1e-12 * size)
    assert value(terms.tangent) == pytest.approx(Q[a, b], abs=1e-12 * size)
    assert value(terms.J[:, :3]) == pytest.approx(J, abs=1e-13)
    assert value(terms.P[0]) == pytest.approx(value(np.array(P)), abs=1e-14)
    assert value(terms.beams.missing) == pytest.approx(missing, rel=1e-12)
    beams = [legs.places[0, 1], legs.places[0, 3]]
    of_beams = np.array([own[place] for own, place in zip(rate, beams, strict=True)])
    assert value(terms.beams.rate) == pytest.approx(of_beams, abs=1e-12 * np.max(np.abs(rate)))


def test_legs_of_one_kind_are_numbered_once() -> None:
    """At all poses and under all wrenches; a load on a leg, or one mode less, is another kind."""
    robot = rs.load("3-prs")
    pose = rs.find_posture(robot).pose[0] + [0, 0, 0.01, 0, 0, 0]
    answers = [
        loaded(robot),
        loaded(robot, pose=pose, wrench=[1, 2, 3, 0, 0, 0]),
        loaded(robot, beams=rs.Bowing(elements=1)),
        loaded(robot, loads={"leg1/drive": [0, 0, -1]}),
    ]
    first, *others = (own.found.known.problem.legs.numbers for own in answers if own.found)
    assert [own is first for own in others] == [True, False, False]
    assert [own.total - first.total for own in others] == [0, 0, 0]


def test_turns_have_one_value_on_both_sides_of_where_series_end() -> None:
    axis = np.array([[0.36, 0.48, 0.8]])
    inside, outside = (axis * FURTHEST_TURN * (1 + s * 1e-13) for s in (-1, 1))
    near, far = FiniteTurn.of(inside), FiniteTurn.of(outside)
    assert near.factors == pytest.approx(far.factors, rel=1e-10)
    assert near.R == pytest.approx(matrix_of_rotation(inside), abs=1e-15)
    assert far.R == pytest.approx(matrix_of_rotation(outside), abs=1e-15)

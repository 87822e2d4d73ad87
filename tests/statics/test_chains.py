"""The chain function against the potential of the whole chain, written in products of motions of
the unloaded posture and differentiated by the record."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from robostiff.elasticity.cantilever import cantilever_compliance
from robostiff.record import Record, cosine, derivatives_along, sine
from robostiff.spatial import Space, skew
from robostiff.spatial.rotation import matrix_of_rotation
from robostiff.statics.chains.bending import bending, bending_planes
from robostiff.statics.chains.chain import (
    BodyLoad,
    Element,
    FiniteChain,
    FiniteJoint,
    FiniteSpring,
    Owner,
)
from robostiff.statics.chains.finite_turn import FURTHEST_TURN, FiniteTurn
from robostiff.statics.chains.legs import LegGroup

_ONE = np.ones(1)


def _joint(random: np.random.Generator, *, turns: bool, slide: float) -> FiniteJoint:
    axis = random.normal(size=(1, 3))
    axis /= np.linalg.norm(axis)
    point, k, f = random.normal(size=(1, 3)), random.uniform(5, 9, 1), random.uniform(1, 2, 1)
    return FiniteJoint(("joint",), point, axis, turns, slide * _ONE, k, f, (None,), 0 * _ONE)


def _beam(random: np.random.Generator) -> FiniteSpring:
    L, V = 0.4, np.eye(6)
    C = cantilever_compliance(L, 1.0, 1.0, 900.0, 2.0, 3.0, 4.0)
    bent = bending(V, C, L, bending_planes(Space.SPATIAL, np.eye(3)), inner=True)
    rotation, k = matrix_of_rotation(random.normal(size=3)), random.uniform(20, 30, 6)
    at, axial = random.normal(size=(1, 3)), np.array([900 / L])
    return FiniteSpring(("beam",), at, rotation[None], V[None], k[None], axial, bent)


def _chain(random: np.random.Generator) -> FiniteChain:
    elements: list[Element] = [
        _joint(random, turns=True, slide=0.3),
        _beam(random),
        _joint(random, turns=False, slide=1.0),
        _beam(random),
        _joint(random, turns=True, slide=0.0),
    ]
    loads = [BodyLoad(k, random.normal(size=(1, 3)), random.normal(size=(1, 3))) for k in (1, 4, 4)]
    owners = (Owner(0, "leg", 0),)
    return FiniteChain(None, None, tuple(elements), tuple(loads), owners=owners)


def _motion(e: Element, y: Any) -> np.ndarray:
    """Motion (4, 4) behind an element from the unloaded posture."""
    M = np.eye(4, dtype=int).astype(object)
    c = e.point[0]
    if isinstance(e, FiniteJoint):
        A, q = skew(e.axis[0]), y[0]
        R = (
            np.eye(3)
            + A * (sine(q) if e.turns else 0)
            + A @ A * ((1 - cosine(q)) if e.turns else 0)
        )
        shift: Any = e.axis[0] * (e.slide[0] * q)
    else:
        own, th = e.rotation[0], e.modes[0] @ y
        S = np.array([[0, -th[5], th[4]], [th[5], 0, -th[3]], [-th[4], th[3], 0]], dtype=object)
        power, R = np.eye(3), np.eye(3)
        for n in range(1, 16):
            power = power @ S
            R = R + power * (1 / math.factorial(n))
        R, shift = own @ R @ own.T, own @ th[:3]
    M[:3, :3], M[:3, 3] = R, c + shift - R @ c
    return M


def _potential(
    chain: FiniteChain, x: np.ndarray, axial: np.ndarray, end: np.ndarray, W: np.ndarray
) -> Any:
    """Energy less the work of loads, preloads and the end force; end motion (4, 4).

    Stationary in the axial forces of beams.
    """
    energy: Any = 0
    forces = iter(axial.tolist())
    T, behind = np.eye(4), [np.eye(4)]
    for e, place in zip(chain.elements, chain.places, strict=True):
        y = x[place]
        energy = energy + sum(e.stiffness.flat * y * y) * 0.5
        if isinstance(e, FiniteJoint):
            energy = energy - e.preload[0] * y[0]
        else:
            N, bent, k = next(forces), e.bending, e.axial[0]
            inner = sum(bent.b[0, :, i] / (1 + N * bent.l[0, :, i]) for i in range(2))
            z, stretch = bent.z[0] @ y, N - k * (e.modes[0, 0] @ y)
            h = bent.s[0] * N - inner * (N * N)
            energy = energy + (h * z * z).sum() * 0.5 - stretch * stretch * (0.5 / k)
        T = T @ _motion(e, y)
        behind.append(T)
    for load in chain.loads:
        energy = energy - load.force[0] @ (behind[load.after] @ np.append(load.point[0], 1))[:3]
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
    potential, T = _potential(chain, x, axial, end, W)
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

    kind = object if on_entries else float
    arrays = LegGroup((chain,), (), end.astype(kind), tuple(range(6))).family.arrays
    given = x[None] if on_entries else at[None]
    start = np.eye(3).astype(kind), np.zeros(3).astype(kind)
    forces = axial[None] if on_entries else N[None]
    terms = arrays.terms(given, *start, W[None], forces, 1.0)
    size = np.max(np.abs(Q))
    assert value(terms.gradient[0]) == pytest.approx(gradient, abs=1e-12 * size)
    assert value(terms.tangent[0]) == pytest.approx(Q, abs=1e-12 * size)
    assert value(terms.J[0, :3].T) == pytest.approx(J, abs=1e-13)
    assert value(terms.P[0]) == pytest.approx(value(np.array(P)), abs=1e-14)
    assert value(terms.beams.missing[0]) == pytest.approx(missing, rel=1e-12)
    beams = [chain.places[1], chain.places[3]]
    of_beams = np.array([own[place] for own, place in zip(rate, beams, strict=True)])
    assert value(terms.beams.rate[0]) == pytest.approx(of_beams, abs=1e-12 * np.max(np.abs(rate)))
    # what a moment does beside that: the exterior derivative of its work, m . (w_a x w_b)
    w = value(terms.J[0, 3:].T)
    expected = [[0.5 * W[3:] @ np.cross(a, b) for b in w] for a in w]
    assert value(terms.bracket[0]) == pytest.approx(np.array(expected), abs=1e-13)


def test_turns_have_one_value_on_both_sides_of_where_series_end() -> None:
    axis = np.array([[0.36, 0.48, 0.8]])
    inside, outside = (axis * FURTHEST_TURN * (1 + s * 1e-13) for s in (-1, 1))
    near, far = FiniteTurn.of(inside), FiniteTurn.of(outside)
    assert near.factors == pytest.approx(far.factors, rel=1e-10)
    assert near.R == pytest.approx(matrix_of_rotation(inside), abs=1e-15)
    assert far.R == pytest.approx(matrix_of_rotation(outside), abs=1e-15)

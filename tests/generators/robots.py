"""Random parallel robots: legs as plain matrices, and the same as a snapshot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st

from robostiff.model import Snapshot
from tests.generators.chains import (
    LENGTH,
    SEEDS,
    FreeChain,
    Turning,
    ball,
    random_beam,
    random_block,
    random_joint,
    random_rotation,
    random_single,
    snapshot_of,
)


@dataclass(frozen=True)
class FreeRobot:
    """Legs between a base and a rigid platform."""

    legs: tuple[FreeChain, ...]
    reference: np.ndarray

    @property
    def snapshot(self) -> Snapshot:
        return snapshot_of(list(self.legs), self.reference)

    def held(self) -> np.ndarray:
        """All wrenches that the legs transmit, unit columns, turns weighed by a length."""
        columns = []
        for leg in self.legs:
            J_q = leg.joint_columns(self.reference)
            scaled = np.concatenate([J_q[:3], LENGTH * J_q[3:]])
            scaled = scaled / np.linalg.norm(scaled, axis=0)
            U, values, _ = np.linalg.svd(scaled)
            columns.append(U[:, np.count_nonzero(values > 1e-8) :])
        return np.hstack(columns)

    def rounding(self) -> float:
        """What rounding may do to K: fifty units in the last place, times what is cancelled.

        That is a leg's whole compliance over the least that a transmitted wrench meets, and how
        nearly its joints depend on one another.
        """
        worst = 1.0
        s = np.array([1.0] * 3 + [LENGTH] * 3)
        for leg in self.legs:
            C, J_q = leg.matrices(self.reference)
            scaled = J_q * s[:, None]
            U, values, _ = np.linalg.svd(scaled / np.linalg.norm(scaled, axis=0))
            kept = values[values > 1e-8].min(initial=1.0)
            W = U[:, np.count_nonzero(values > 1e-8) :]
            if W.shape[1]:
                C = C * np.outer(s, s)
                least = np.linalg.eigvalsh(W.T @ C @ W)[0]
                worst = max(worst, float(np.trace(C) / least / kept))
        return 50 * np.finfo(float).eps * worst

    def rank(self) -> int:
        return int(np.linalg.matrix_rank(self.held(), tol=1e-8))

    def whole_system(self, F: np.ndarray) -> tuple[np.ndarray, float]:
        """Twist and energy under a wrench: all internal coordinates of all legs at once.

        Unknowns are theta and q of every leg and the platform twist t; the energy minus F.t is
        stationary under J_theta theta + J_q q = t for each leg.
        """
        unit = 1e6
        n_internal = sum(
            leg.spring_columns(self.reference)[0].shape[1] + len(leg.joints) for leg in self.legs
        )
        m = len(self.legs)
        size = n_internal + 6 + 6 * m
        S, wanted = np.zeros((size, size)), np.zeros(size)
        t_at = slice(n_internal, n_internal + 6)
        wanted[t_at] = F / unit
        start = 0
        for i, leg in enumerate(self.legs):
            J_theta, K_theta = leg.spring_columns(self.reference)
            J_q = leg.joint_columns(self.reference)
            rows = slice(n_internal + 6 + 6 * i, n_internal + 12 + 6 * i)
            root = np.linalg.cholesky(K_theta / unit)
            A = np.linalg.solve(root, J_theta.T).T
            theta = slice(start, start + A.shape[1])
            q = slice(theta.stop, theta.stop + J_q.shape[1])
            start = q.stop
            S[theta, theta] = np.eye(A.shape[1])
            S[rows, theta], S[rows, q], S[rows, t_at] = A, J_q, -np.eye(6)
            S[theta, rows], S[q, rows], S[t_at, rows] = A.T, J_q.T, -np.eye(6)
        x, *_ = np.linalg.lstsq(S, -wanted, rcond=1e-13)
        # the multipliers carry the sign of the wrench on the legs; theta and t that of the load
        theta = x[:n_internal].copy()
        energy, start = 0.0, 0
        for leg in self.legs:
            springs = leg.spring_columns(self.reference)[0].shape[1]
            energy += (
                0.5 * unit * float(theta[start : start + springs] @ theta[start : start + springs])
            )
            start += springs + len(leg.joints)
        return -x[t_at], energy


def strut(rng: np.random.Generator, base: np.ndarray, tip: np.ndarray) -> FreeChain:
    """A beam between two balls: the spin about it is redundant."""
    joints = (*ball(base, random_rotation(rng)), *ball(tip, random_rotation(rng)))
    return FreeChain((random_beam(rng),), joints, tip)


def _general_leg(rng: np.random.Generator) -> FreeChain:
    springs = tuple((random_beam, random_block)[rng.integers(2)](rng) for _ in range(2))
    joints = tuple(random_joint(rng) for _ in range(int(rng.integers(0, 6))))
    return FreeChain(springs, joints, rng.uniform(-1, 1, 3))


def _soft_leg(rng: np.random.Generator) -> FreeChain:
    """Fewer springs than six, and turns enough."""
    joints = tuple(replace(random_joint(rng), pitch=0.0) for _ in range(4))
    return FreeChain((random_single(rng), random_single(rng)), joints, rng.uniform(-1, 1, 3))


KINDS_OF_ROBOTS = ("struts", "general", "over-constrained", "apex", "soft")


def random_robot(rng: np.random.Generator, kind: str, number: int) -> FreeRobot:
    """A random parallel robot of a kind; see `robots`."""
    reference = rng.uniform(-0.5, 0.5, 3)
    if kind == "struts":
        legs = [
            strut(rng, rng.uniform(-1, 1, 3) - [0, 0, 2], rng.uniform(-1, 1, 3))
            for _ in range(number + 3)
        ]
    elif kind == "apex":
        apex = rng.uniform(-1, 1, 3)
        legs = []
        for _ in range(number + 2):
            direction = rng.normal(size=3)
            legs.append(strut(rng, apex + 2 * direction, apex + direction))
    elif kind == "over-constrained":
        axis = rng.normal(size=3)
        legs = [
            FreeChain(
                (random_beam(rng),),
                tuple(Turning(0.0, rng.uniform(-1, 1, 3), axis) for _ in range(3)),
                rng.uniform(-1, 1, 3),
            )
            for _ in range(number + 1)
        ]
    elif kind == "soft":
        legs = [_soft_leg(rng) for _ in range(number)] + [_general_leg(rng)]
    else:
        legs = [_general_leg(rng) for _ in range(number)]
    return FreeRobot(tuple(legs), reference)


@st.composite
def robots(draw: st.DrawFn) -> FreeRobot:
    """Random parallel robots.

    Kinds: `struts`, legs between balls; `general`, legs of any joints; `over-constrained`, legs
    with the same parallel axes; `apex`, struts that meet in one point; `soft`, legs of few springs
    beside one full leg.
    """
    rng = np.random.default_rng(draw(SEEDS))
    kind = draw(st.sampled_from(KINDS_OF_ROBOTS))
    return random_robot(rng, kind, draw(st.integers(1, 5)))

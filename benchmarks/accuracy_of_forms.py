"""Digits that the forms of K_C keep, against 60-digit arithmetic.

Random chains of elastic parts and passive joints. The error of an entry is given relative to
sqrt(K0_ii K0_jj), K0 the stiffness without passive joints, so that N/m and N m/rad are comparable.

    python benchmarks/accuracy_of_forms.py [chains of each kind]
"""

import sys
from collections.abc import Callable, Iterator

import mpmath as mp
import numpy as np

from robostiff import elasticity
from robostiff.elasticity import beam_compliance, material
from robostiff.elastostatics import (
    Block,
    Form,
    IndexRules,
    Recursive,
    SaddlePoint,
    WrenchBasis,
    chain_stiffness,
)
from robostiff.spatial import move_compliance, rotate_stiffness

mp.mp.dps = 60

FORMS: tuple[Form, ...] = (WrenchBasis(), SaddlePoint(), Block(), Recursive(), IndexRules())
BY_HAND = "plain inverse of (7)"
Problem = tuple[np.ndarray, np.ndarray]


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    random = np.random.default_rng(0)
    families: tuple[tuple[str, Callable[[np.random.Generator], Problem]], ...] = (
        ("regular", regular),
        ("along axes", along_axes),
        ("nearly redundant", nearly_redundant),
        ("stiff and soft", stiff_and_soft),
        ("two ball joints", rod_between_balls),
    )
    columns = [form.name for form in FORMS] + [BY_HAND]
    print(f"largest error of K over {count} chains of each kind ('-': refused)")
    print(f"{'':18s}" + "".join(f"{name:>22s}" for name in columns))
    by_hand: list[float] = []
    for name, family in families:
        errors = [errors_of(*family(random)) for _ in range(count)]
        answered = [[e for e in own if e is not None] for own in zip(*errors, strict=True)]
        cells = [f"{max(own):.0e}" if own else "-" for own in answered]
        print(f"{name:18s}" + "".join(f"{cell:>22s}" for cell in cells))
        by_hand = answered[-1]
    low, median, high = np.percentile(by_hand, [10, 50, 90])
    print(f"\n{BY_HAND}, two ball joints: median {median:.0%}, a tenth below {low:.0%} and a tenth")
    print(f"above {high:.0%}; NumPy raised LinAlgError in {count - len(by_hand)} of {count} chains")


def errors_of(C: np.ndarray, J_q: np.ndarray) -> Iterator[float | None]:
    """Relative error of each form, none where it refuses."""
    exact = exact_stiffness(C, J_q)
    size = np.sqrt(np.diag(np.linalg.inv(C)))
    for form in FORMS:
        result = chain_stiffness(C, J_q, form=form)
        if result.status.has_stiffness:
            yield float(np.max(np.abs(result.K - exact) / np.outer(size, size)))
        else:
            yield None
    saddle = np.block([[C, J_q], [J_q.T, np.zeros((J_q.shape[1],) * 2)]])
    try:
        by_hand = np.linalg.inv(saddle)[:6, :6]
    except np.linalg.LinAlgError:
        yield None
        return
    yield float(np.max(np.abs(by_hand - exact) / np.outer(size, size)))


def exact_stiffness(C: np.ndarray, J_q: np.ndarray) -> np.ndarray:
    """K by (15) in 60 digits; a joint that meets no stiffness is skipped."""
    K = mp.matrix(C.tolist()) ** -1
    for column in J_q.T:
        J = mp.matrix(column.tolist())
        u = K * J
        mu = (J.T * u)[0]
        if mu > mp.mpf(10) ** -20 * mp.norm(J) ** 2 * mp.mnorm(K, 1):
            K = K - u * u.T / mu
    return np.array(K.tolist(), dtype=float)


def regular(random: np.random.Generator) -> Problem:
    """Three tubes in random directions, one to five joints about and along random lines."""
    C = sum(tube(random) for _ in range(3))
    joints = random.integers(1, 6)
    return np.asarray(C), np.array([joint(random) for _ in range(joints)]).reshape(-1, 6).T


def along_axes(random: np.random.Generator) -> Problem:
    """The same with joints about and along the frame axes."""
    C, J_q = regular(random)
    columns = []
    for i in random.permutation(6)[: J_q.shape[1]]:
        column = np.eye(6)[i]
        if i >= 3:
            column[:3] = np.cross(column[3:], random.uniform(-0.5, 0.5, 3))
        columns.append(column)
    return C, np.array(columns).reshape(-1, 6).T


def nearly_redundant(random: np.random.Generator) -> Problem:
    """Two joints whose twists differ by a part of 1e-5."""
    C, _ = regular(random)
    first = joint(random)
    return C, np.array([first, joint(random), first + 1e-5 * joint(random)]).T


def stiff_and_soft(random: np.random.Generator) -> Problem:
    """A soft spring of 1 N/m in series with tubes."""
    C, J_q = regular(random)
    soft = random.normal(size=6) * [1, 1, 1, 0, 0, 0]
    return C + np.outer(soft, soft) / (soft @ soft), J_q


def rod_between_balls(random: np.random.Generator) -> Problem:
    """Two spherical joints, so that the spin about the line between them counts twice."""
    C, _ = regular(random)
    points = random.uniform(-0.5, 0.5, (2, 3))
    turns = [np.concatenate([np.cross(p, e), e]) for p in points for e in np.eye(3)]
    return C, np.array(turns).T


def tube(random: np.random.Generator) -> np.ndarray:
    """Compliance of a steel tube somewhere, about the origin."""
    length = random.uniform(0.2, 1.0)
    own = beam_compliance(length, material("steel"), elasticity.tube(0.04, 0.03))
    R = np.linalg.qr(random.normal(size=(3, 3)))[0]
    return move_compliance(rotate_stiffness(own, R), random.uniform(-0.5, 0.5, 3))


def joint(random: np.random.Generator) -> np.ndarray:
    """Twist of the origin by a joint in a random place."""
    e = random.normal(size=3)
    e /= np.linalg.norm(e)
    if random.random() < 0.3:
        return np.concatenate([e, np.zeros(3)])
    return np.concatenate([np.cross(e, random.uniform(-0.5, 0.5, 3)), e])


if __name__ == "__main__":
    main()

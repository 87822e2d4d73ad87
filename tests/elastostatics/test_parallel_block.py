"""A parallel block in a chain: pinv(K) on range(K), freedoms null(K), shares of least energy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.elastostatics import Tolerance, block_compliance, chain_stiffness
from tests.generators.chains import LENGTH, SEEDS, FreeChain, chains, planar_chains
from tests.generators.metric import rounding

TOLERANCE = Tolerance()
SCALE = np.array([1, 1, 1, LENGTH, LENGTH, LENGTH])

regular = st.lists(chains(arrangements=("general", "repeated", "aligned")), min_size=2, max_size=3)
in_plane = st.lists(planar_chains(), min_size=2, max_size=3)


def scale_of(n: int) -> np.ndarray:
    return SCALE if n == 6 else SCALE[[0, 1, 5]]


def block_of(branches, length=LENGTH):
    return block_compliance(branches, np.array(length), TOLERANCE)


def freedoms(block) -> np.ndarray:
    return block.J_q[:, block.present]


def branches_of(chains: list[FreeChain]) -> list[tuple[np.ndarray, np.ndarray]]:
    """C and J_q of chains that all end at the end of the first."""
    return [chain.matrices(chains[0].end) for chain in chains]


def whole_stiffness(branches) -> np.ndarray:
    return np.sum([chain_stiffness(C, J_q, length=LENGTH).K for C, J_q in branches], axis=0)


@given(st.one_of(regular, in_plane))
def test_compliance_and_freedoms_are_those_of_the_sum_of_stiffnesses(free):
    branches = branches_of(free)
    block, s = block_of(branches), scale_of(len(branches[0][0]))
    K = whole_stiffness(branches) / np.outer(s, s)
    values, modes = np.linalg.eigh(K)
    allowed = max(1e-8, *(rounding(C) for C, _ in branches))
    held = values > 1e-9 * values[-1]
    if np.any((values > 1e-12 * values[-1]) & (values < 1e-6 * values[-1])):
        return  # rounding decides what is held
    N = s[:, None] * freedoms(block)
    assert N.shape[1] == np.count_nonzero(~held)
    assert np.abs(K @ N).max(initial=0.0) <= allowed * values[-1]
    range_of_K = modes[:, held]
    expected = range_of_K @ np.diag(1 / values[held]) @ range_of_K.T
    C = block.C * np.outer(s, s)
    assert np.abs(C - expected).max() <= allowed * np.abs(expected).max()


@given(st.one_of(regular, in_plane), SEEDS)
def test_shares_balance_the_wrench_and_have_the_energy_of_the_block(free, seed):
    branches = branches_of(free)
    block, n = block_of(branches), len(branches[0][0])
    s = scale_of(n)
    K = whole_stiffness(branches)
    F = K @ (np.random.default_rng(seed).normal(size=n) / s)  # a wrench that the block carries
    carried = block.shares @ F
    size = np.abs(F / s).max()
    assert np.abs((carried.sum(axis=0) - F) / s).max() <= 1e-9 * size
    for (_, J_q), own in zip(branches, carried, strict=True):
        assert np.abs(J_q.T @ own).max(initial=0.0) <= 1e-9 * size
    energy = sum(own @ C @ own for (C, _), own in zip(branches, carried, strict=True))
    assert energy == pytest.approx(F @ block.C @ F, rel=1e-9)


@given(st.lists(chains(joints=st.integers(0, 1)), min_size=2, max_size=3), SEEDS)
def test_no_other_shares_have_less_energy(free, seed):
    branches = branches_of(free)
    block = block_of(branches)
    rng = np.random.default_rng(seed)
    F = whole_stiffness(branches) @ rng.normal(size=6)
    least = F @ block.C @ F
    carried = block.shares @ F
    # What the first two branches may exchange: wrenches that the joints of both transmit.
    both = np.concatenate([np.zeros((6, 1)), *(J_q for _, J_q in branches[:2])], axis=1)
    _, values, Vt = np.linalg.svd((both * SCALE[:, None]).T)
    exchanged = Vt[np.count_nonzero(values > 1e-9) :] * SCALE
    for way in (own / np.abs(own).max() * np.abs(F).max() * 0.3 for own in exchanged):
        first, second = carried[0] + way, carried[1] - way
        others = [own @ C @ own for (C, _), own in zip(branches[2:], carried[2:], strict=True)]
        C1, C2 = branches[0][0], branches[1][0]
        assert first @ C1 @ first + second @ C2 @ second + sum(others) >= least * (1 - 1e-9)


def test_two_rigid_bars_side_by_side_are_a_rigid_parallelogram():
    """Bars along x at y = +-w/2, hinged about z at both ends: the far body moves along y alone."""
    length, w = 0.6, 0.1
    bars = []
    for y in (-w / 2, w / 2):
        # the twist of the point between the far hinges, eq. (17): e x (P - hinge)
        hinges = [np.array([y, -x, 0, 0, 0, 1.0]) for x in (-length, 0.0)]
        bars.append((np.zeros((6, 6)), np.stack(hinges, axis=-1)))
    block = block_of(bars)
    assert not np.any(block.C)
    (free,) = freedoms(block).T
    assert np.abs(free / free[1] - [0, 1, 0, 0, 0, 0]).max() < 1e-12
    assert not np.any(block.redundant)


def test_a_rigid_branch_takes_all_that_it_can():
    soft = (1e-6 * np.eye(6), np.zeros((6, 0)))
    rail = (np.zeros((6, 6)), np.eye(6)[:, [2]])  # rigid, but slides along z
    block = block_of([soft, rail])
    assert np.abs(block.C - np.diag([0, 0, 1e-6, 0, 0, 0])).max() < 1e-20
    assert freedoms(block).shape == (6, 0)
    assert np.abs(block.shares[1] - np.diag([1, 1, 0, 1, 1, 1])).max() < 1e-12


@pytest.mark.parametrize("soft", [1e4, 1e-3, 1e-9])
def test_a_soft_branch_leaves_the_shares_of_the_others_alone(soft):
    stiffnesses = (1e9, 4e9, soft)
    block = block_of([(np.eye(6) / k, np.zeros((6, 0))) for k in stiffnesses])
    whole = sum(stiffnesses)
    assert block.C[0, 0] == pytest.approx(1 / whole, rel=1e-9)
    for own, k in zip(block.shares[:, 0, 0], stiffnesses, strict=True):
        assert own == pytest.approx(k / whole, abs=1e-9)


@given(st.one_of(regular, in_plane))
def test_millimetres_decide_and_answer_alike(free):
    branches = branches_of(free)
    n = len(branches[0][0])
    t = 3 if n == 6 else 2
    mm = np.where(np.arange(n) < t, 1e3, 1.0)  # of a twist
    in_mm = [(C * np.outer(mm, mm), J_q * mm[:, None]) for C, J_q in branches]
    metres, millimetres = block_of(branches), block_of(in_mm, 1e3 * LENGTH)
    assert millimetres.present.tolist() == metres.present.tolist()
    assert millimetres.redundant.tolist() == metres.redundant.tolist()
    s = scale_of(n)
    C, back = (x * np.outer(s, s) for x in (metres.C, millimetres.C / np.outer(mm, mm)))
    allowed = max(1e-9, *(rounding(C) for C, _ in branches))
    assert np.abs(back - C).max() <= allowed * max(np.abs(C).max(), 1e-300)


@given(st.lists(SEEDS, min_size=2, max_size=4, unique=True))
def test_poses_of_a_batch_have_the_freedoms_they_have_alone(seeds):
    """Two hinges in line at some poses, apart at the others."""
    C = [np.diag([1e-6, 2e-6, 3e-6, 1e-4, 2e-4, 3e-4]), 1e-6 * np.eye(6)]
    stacks = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        point, other = rng.uniform(-1, 1, (2, 3))
        if rng.uniform() < 0.5:
            other = point
        axis = np.array([0, 0, 1.0])
        stacks.append([np.concatenate([np.cross(axis, -p), axis])[:, None] for p in (point, other)])
    many = [np.stack(own) for own in zip(*stacks, strict=True)]
    together = block_compliance(
        [(np.broadcast_to(c, (len(seeds), 6, 6)), J) for c, J in zip(C, many, strict=True)],
        np.full(len(seeds), LENGTH),
        TOLERANCE,
    )
    for i, own in enumerate(stacks):
        alone = block_of(list(zip(C, own, strict=True)))
        columns = together.J_q[i][:, together.present[i]]
        assert columns.shape[1] == freedoms(alone).shape[1]
        assert np.abs(np.abs(columns) - np.abs(freedoms(alone))).max(initial=0) < 1e-9
        assert not np.any(together.J_q[i][:, ~together.present[i]])
        assert np.abs(together.C[i] - alone.C).max() < 1e-12 * np.abs(alone.C).max()


def test_freedoms_of_a_block_inside_count_where_they_are():
    hinge = np.array([[0, 0, 0, 0, 0, 1.0]]).T
    absent = np.zeros((6, 1))
    C = 1e-6 * np.eye(6)
    block = block_compliance(
        [(C, np.concatenate([absent, hinge], axis=1)), (C, hinge)],
        np.array(LENGTH),
        TOLERANCE,
        [np.array([False, True]), None],
    )
    assert freedoms(block).shape == (6, 1)
    assert block.redundant.tolist() == [False, False, False]

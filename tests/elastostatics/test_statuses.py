"""Forms of K: statuses and advice, parallel blocks, and shapes that are refused."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.elastostatics import aggregate, block_compliance
from robostiff.spatial import skew
from tests.cases.metric import distance
from tests.generators.chains import LENGTH

E6 = np.eye(6)
NO_JOINTS = np.zeros((6, 0))
FORMS = [rs.WrenchBasis(), rs.Block(), rs.Recursive(), rs.SaddlePoint(), rs.IndexRules()]
RNG = np.random.default_rng(11)
A = RNG.normal(size=(6, 6))
C_FULL = 1e-7 * (A @ A.T + 0.2 * E6)


def test_plain_answer():
    result = rs.chain_stiffness(C_FULL, NO_JOINTS)
    assert result.status is rs.Status.OK
    assert str(result.status) == "ok"
    assert result.status.advice == ()
    assert not result.status.is_bad
    assert result.compliance is not None
    assert distance(result.compliance, C_FULL) <= 1e-11


def test_free_motions():
    J_q = RNG.normal(size=(6, 2))
    result = rs.chain_stiffness(C_FULL, J_q)
    assert result.status == rs.Status.FREE_MOTIONS
    assert not result.status.is_bad
    assert result.free_motions.shape == (2, 6)
    assert np.linalg.matrix_rank(np.vstack([result.free_motions, J_q.T]), tol=1e-9) == 2
    assert result.compliance is None
    assert "singular" in result.status.advice[0]


def test_redundant_joints_are_named_by_their_column():
    J = RNG.normal(size=(6, 2))
    J_q = np.stack([J[:, 0], 2 * J[:, 0], J[:, 1], J[:, 0] - J[:, 1]], axis=1)
    result = rs.chain_stiffness(C_FULL, J_q)
    assert result.status == rs.Status.FREE_MOTIONS | rs.Status.REDUNDANT_JOINTS
    assert result.redundant.tolist() == [False, True, False, True]
    assert not result.status.is_bad
    assert int(result.rank) == 4
    assert distance(result.K, rs.chain_stiffness(C_FULL, J).K) <= 1e-9


@pytest.mark.parametrize("joints", [6, 7, 9])
@pytest.mark.parametrize("form", [rs.WrenchBasis(), rs.Recursive()])
def test_six_joints_or_more_leave_no_stiffness(joints: int, form):
    J_q = np.random.default_rng(joints).normal(size=(6, joints))
    result = rs.chain_stiffness(C_FULL, J_q, form=form)
    assert int(result.rank) == 0
    assert result.free_motions.shape == (6, 6)
    assert np.abs(result.K).max() <= 1e-9 / np.abs(C_FULL).max()
    if isinstance(form, rs.WrenchBasis):
        assert not result.K.any()
    assert np.count_nonzero(result.redundant) == joints - 6


def test_rigid_direction_and_its_wrench():
    """Two springs and three turns: one wrench is carried without compliance."""
    springs = np.random.default_rng(12).normal(size=(6, 2))
    joints = np.random.default_rng(13).normal(size=(6, 3))
    C = 1e-7 * springs @ springs.T
    result = rs.chain_stiffness(C, joints)
    assert rs.Status.RIGID_DIRECTION in result.status
    assert result.status.is_bad
    assert not result.status.has_stiffness
    assert not result.answered
    with pytest.raises(rs.NoAnswerError, match=r"infinite.*give a link or an actuator"):
        _ = result.K
    (w,) = result.rigid_directions
    expected = np.linalg.svd(np.hstack([springs, joints]))[0][:, 5]
    aligned = w / np.linalg.norm(w) * np.sign(w @ expected)
    assert np.allclose(aligned, expected, rtol=0, atol=1e-9)
    assert np.abs(C @ w).max() <= 1e-12 * np.abs(C).max()
    assert np.isfinite(result.matrix).all()


def test_a_chain_without_any_compliance_is_rigid_in_all_that_it_transmits():
    result = rs.chain_stiffness(np.zeros((6, 6)), E6[:, :2])
    assert rs.Status.RIGID_DIRECTION in result.status
    assert result.rigid_directions.shape == (4, 6)
    assert np.isfinite(result.matrix).all()
    free = rs.chain_stiffness(np.zeros((6, 6)), E6)  # transmits nothing
    assert free.status == rs.Status.FREE_MOTIONS
    assert not free.K.any()


@pytest.mark.parametrize(
    ("angle", "status"),
    [
        (1e-2, rs.Status.FREE_MOTIONS),
        (1e-7, rs.Status.FREE_MOTIONS | rs.Status.ILL_CONDITIONED),
        (1e-10, rs.Status.FREE_MOTIONS | rs.Status.REDUNDANT_JOINTS | rs.Status.ILL_CONDITIONED),
        (0.0, rs.Status.FREE_MOTIONS | rs.Status.REDUNDANT_JOINTS),
    ],
)
def test_nearly_redundant_joints(angle: float, status: rs.Status):
    J_q = np.stack([E6[:, 3], np.cos(angle) * E6[:, 3] + np.sin(angle) * E6[:, 4]], axis=1)
    result = rs.chain_stiffness(C_FULL, J_q)
    assert result.status == status
    assert np.isfinite(result.K).all()


@pytest.mark.parametrize(
    ("ratio", "status"),
    [(1e-9, rs.Status.OK), (1e-13, rs.Status.ILL_CONDITIONED), (1e-16, rs.Status.RIGID_DIRECTION)],
)
def test_springs_of_too_different_size(ratio: float, status: rs.Status):
    result = rs.chain_stiffness(np.diag([1.0, 1, 1, 1, 1, ratio]), NO_JOINTS)
    assert result.status == status


@pytest.mark.parametrize(
    ("angle", "rank", "ill"), [(1e-3, 6, False), (1e-7, 6, True), (1e-10, 5, True), (0.0, 5, False)]
)
def test_near_a_singular_pose_of_a_robot(angle: float, rank: int, ill: bool):
    """Six single wrenches, of which two come together."""
    directions = [*E6[:5], np.cos(angle) * E6[4] + np.sin(angle) * E6[5]]
    legs = []
    for w in directions:
        J_q = np.linalg.svd(w[None])[2][1:].T
        legs.append(rs.chain_stiffness(1e-6 * E6, J_q, length=1.0))
    whole = aggregate(legs)
    assert int(whole.rank) == rank
    assert (rs.Status.ILL_CONDITIONED in whole.status) == ill
    assert (rs.Status.FREE_MOTIONS in whole.status) == (rank < 6)
    assert np.isfinite(whole.K).all()
    decision = whole.decision
    assert decision.smallest_kept is not None
    if rank == 6:
        assert decision.smallest_kept <= 2 * angle
        assert decision.largest_dropped is None
    else:
        assert decision.smallest_kept > 0.1
        assert decision.largest_dropped is not None
        assert decision.largest_dropped <= 1e-9


def test_rank_decision_in_words():
    result = rs.chain_stiffness(C_FULL, E6[:, :1], length=0.25)
    text = str(result.decision)
    assert "smallest kept 1" in text
    assert "tolerance 1e-09" in text
    assert "characteristic length 0.25 m" in text
    nothing = rs.chain_stiffness(C_FULL, E6, length=0.25).decision
    assert nothing.smallest_kept is None
    assert "smallest kept none" in str(nothing)


def test_tolerances_are_the_users():
    angle = 1e-4
    J_q = np.stack([E6[:, 3], np.cos(angle) * E6[:, 3] + np.sin(angle) * E6[:, 4]], axis=1)
    strict = rs.chain_stiffness(C_FULL, J_q)
    loose = rs.chain_stiffness(
        C_FULL, J_q, tolerance=rs.Tolerance(independence=1e-3, near_independence=1e-2)
    )
    assert strict.redundant.tolist() == [False, False]
    assert loose.redundant.tolist() == [False, True]
    assert int(loose.rank) == 5


def test_no_answer_in_a_batch_names_the_first_pose():
    C = np.stack([C_FULL, np.zeros((6, 6)), C_FULL])
    result = rs.chain_stiffness(C, NO_JOINTS)
    with pytest.raises(rs.NoAnswerError, match=r"1 of 3 poses, the first being \(1,\)"):
        _ = result.K
    assert result[result.answered].K.shape == (2, 6, 6)
    assert result.compliance is None
    for ask in ("free_motions", "rigid_directions", "decision"):
        with pytest.raises(rs.NoAnswerError, match="take one pose"):
            getattr(result, ask)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_never_a_nan(form):
    rng = np.random.default_rng(14)
    worst = [
        (np.zeros((6, 6)), NO_JOINTS),
        (np.zeros((6, 6)), E6),
        (C_FULL, np.zeros((6, 3))),
        (C_FULL, np.hstack([E6, E6])),
        (np.diag([1e-9, 0, 0, 0, 0, 0]), E6[:, 3:]),
        (1e-300 * E6, E6[:, :2]),
        (1e-7 * np.outer(A[0], A[0]), rng.normal(size=(6, 4))),
        (C_FULL, np.stack([E6[0], E6[0] * (1 + 1e-12), E6[3]], axis=1)),
        (np.diag([1e-9, 1, 1, 1, 1, 1]), np.stack([E6[0], E6[0] + 1e-4 * E6[1]], axis=1)),
    ]
    for C, J_q in worst:
        result = rs.chain_stiffness(C, J_q, form=form)
        assert np.isfinite(result.matrix).all()
        assert np.isfinite(result.rigid).all()
        if result.answered:
            assert np.isfinite(result.K).all()
        else:
            assert result.status.is_bad


def test_every_status_has_advice():
    for member in rs.Status:
        assert (len(member.advice) == 1) == (member is not rs.Status.OK)
    several = rs.Status.FREE_MOTIONS | rs.Status.UNREACHABLE
    assert str(several) == "free-motions+unreachable"
    assert len(several.advice) == 2


TOLERANCE = rs.Tolerance()


def block_of(branches, length=LENGTH):
    return block_compliance(branches, np.array(length), TOLERANCE)


def freedoms(block) -> np.ndarray:
    return block.J_q[:, block.present]


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


def test_forms_are_objects_with_names():
    assert rs.IndexRules().name == "index-rules"
    assert rs.Recursive() == rs.Recursive(groups=None)
    assert hash(rs.Recursive(groups=((1, 0),))) is not None


def test_shapes_are_checked_while_testing():
    jaxtyping = pytest.importorskip("jaxtyping")
    with pytest.raises(jaxtyping.TypeCheckError, match="parameter 'v'"):
        skew(np.zeros(4))

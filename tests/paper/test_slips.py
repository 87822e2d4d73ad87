"""The slips of the printed paper, each proved with symbols or exact fractions."""

import sympy as sp

from tests.paper.exact_chain import (
    blocks,
    case_a_angles,
    case_b_angles,
    eliminated,
    jointed_legs,
    skew,
    symmetric,
)

I3, Z3 = sp.eye(3), sp.zeros(3)
V = sp.Matrix(sp.symbols("v1:4"))
OMEGA = sp.Matrix(sp.symbols("w1:4"))


def test_eq_13_sign():
    """A turn of the leg end moves the reference point by w x v, v from leg end to it."""
    J = blocks(I3, -skew(V), Z3, I3)
    printed = blocks(I3, skew(V), Z3, I3)
    turn = sp.Matrix.vstack(sp.zeros(3, 1), OMEGA)
    moved = sp.Matrix.vstack(OMEGA.cross(V), OMEGA)
    assert (J * turn - moved).expand() == sp.zeros(6, 1)
    assert (printed * turn - moved).expand() != sp.zeros(6, 1)
    assert J.inv() == blocks(I3, skew(V), Z3, I3)


def test_eq_24_and_25_sign():
    """A leg that only pulls along u: its moment about the reference point is (E - P) x u."""
    u = sp.Matrix(sp.symbols("u1:4"))
    K_end = blocks(u * u.T, Z3, Z3, Z3)
    J_inverse = blocks(I3, skew(V), Z3, I3)
    K = J_inverse.T * K_end * J_inverse
    right = sp.Matrix.vstack(u, -V.cross(u))
    printed = sp.Matrix.vstack(u, V.cross(u))
    assert (K - right * right.T).expand() == sp.zeros(6)
    assert (K - printed * printed.T).expand() != sp.zeros(6)


def test_case_a_has_three_free_turns_not_one():
    R, r, h = sp.symbols("R r h", positive=True)
    K = jointed_legs(*case_a_angles(), R, r, h, (R - r) ** 2 + h**2)
    assert K.rank(simplify=True) == 3
    apex = sp.Matrix([0, 0, h * r / (R - r)])
    for k in range(3):
        e = sp.eye(3)[:, k]
        turn = sp.Matrix.vstack(e.cross(-apex), e)
        assert (K * turn).applyfunc(sp.simplify) == sp.zeros(6, 1)


def test_case_a_has_rank_five_in_a_general_pose():
    """Shifted and turned by a rational rotation, the hexagon with its exact root of three."""

    root = sp.sqrt(3)
    corners = [(2, 0), (1, root), (-1, root), (-2, 0), (-1, -root), (1, -root)]
    turn = sp.Matrix([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
    assert turn.T * turn == sp.eye(3)
    columns = []
    for x, y in corners:
        base = sp.Matrix([5 * x, 5 * y, 0])
        arm = turn * sp.Matrix([2 * x, 2 * y, 0])
        u = sp.Matrix([1, 2, 15]) + arm - base
        columns.append(sp.Matrix.vstack(u, arm.cross(u)).applyfunc(sp.expand))
    W = sp.Matrix.hstack(*columns)
    assert sp.expand(W.det(method="berkowitz")) == 0
    minors = (W.extract([i for i in range(6) if i != k], list(range(5))) for k in range(6))
    assert any(sp.expand(minor.det(method="berkowitz")) != 0 for minor in minors)


def test_eq_17_second_column_is_a_turn():
    """d = e x r: the derivative of a rotation about e at r from the joint."""
    a = sp.Symbol("a")
    e = sp.Matrix([sp.Rational(2, 3), sp.Rational(-1, 3), sp.Rational(2, 3)])
    r = sp.Matrix(sp.symbols("r1:4"))
    rotation = sp.eye(3) + sp.sin(a) * skew(e) + (1 - sp.cos(a)) * skew(e) ** 2
    rate = sp.diff(rotation * r, a).subs(a, 0)
    assert (rate - e.cross(r)).expand() == sp.zeros(3, 1)
    assert (rate - r.cross(e)).expand() != sp.zeros(3, 1)


def test_eq_19_indices():
    K = symmetric(3)
    p = 2
    J = sp.Matrix([0, 0, 1])
    right = sp.Matrix(3, 3, lambda j, k: K[j, k] - K[j, p] * K[p, k] / K[p, p])
    printed = sp.Matrix(3, 3, lambda j, k: K[j, k] - K[j, k] * K[k, j] / K[p, p])
    assert (right - eliminated(K, J)).applyfunc(sp.cancel) == sp.zeros(3)
    assert (printed - eliminated(K, J)).applyfunc(sp.cancel) != sp.zeros(3)


def test_eq_20_for_all_k_not_for_all_p():
    K = symmetric(3)
    reduced = eliminated(K, sp.Matrix([0, 0, 1]))
    assert all(reduced[2, k] == 0 and reduced[k, 2] == 0 for k in range(3))
    assert reduced[0, 0] != 0  # "for all p" would leave nothing at all
    assert reduced[0, 1] != 0


def test_remarks_speak_of_eq_9_and_10():
    """ "Expression (5)" has no terms to be singular: (9) does, and (10) is its recursion."""
    K0 = symmetric(2)
    J = sp.Matrix([sp.Symbol("a"), sp.Symbol("b")])
    eq9 = K0 - K0 * J * (J.T * K0 * J).inv() * J.T * K0
    assert (eq9 - eliminated(K0, J)).applyfunc(sp.cancel) == sp.zeros(2)


def test_leg_lengths_of_eq_27_and_28():
    R, r, h = sp.symbols("R r h", positive=True)
    lengths = []
    for phi, psi in (case_a_angles(), case_b_angles()):
        squares = {
            sp.simplify(
                (r * sp.cos(b) - R * sp.cos(a)) ** 2 + (r * sp.sin(b) - R * sp.sin(a)) ** 2 + h**2
            ).expand()
            for a, b in zip(phi, psi, strict=True)
        }
        assert len(squares) == 1
        lengths.append(squares.pop())
    assert sp.expand(lengths[0] - ((R - r) ** 2 + h**2)) == 0
    assert sp.expand(lengths[1] - (R**2 - R * r + r**2 + h**2)) == 0
    assert sp.expand(lengths[0] - lengths[1]) != 0


def test_eq_9_needs_six_springs_and_eq_7_does_not():
    """One spring and five joints: C has rank 1, the system of (7) has an inverse all the same."""
    T = sp.Matrix(6, 6, lambda i, j: sp.Rational(1, i + j + 1))
    J_theta, J_q = T[:, :1], T[:, 1:]
    C = J_theta * J_theta.T
    assert C.det() == 0
    S = sp.zeros(11)
    S[:6, :6], S[:6, 6:], S[6:, :6] = C, J_q, J_q.T
    assert S.det() != 0
    K = S.inv()[:6, :6]
    assert K.rank() == 1
    assert (J_theta.T * K * J_theta)[0] == 1

"""Section VI of the paper: its leg, (21) to (25), and its platforms, (26) to (28)."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff import stiffness
from robostiff.elasticity import CrossSection, Material, beam_compliance
from robostiff.elastostatics import eliminate_joint
from robostiff.spatial import rotate_stiffness
from tests.cases.metric import distance
from tests.generators.chains import random_rotation
from tests.paper.exact_chain import case_a_angles, case_b_angles, eliminated, jointed_legs
from tests.paper.home_matrices import entries27, entries28, eq27, eq28

LENGTH = 0.8
STEEL = Material.isotropic("steel", E=200e9, poisson_ratio=0.25)
SECTION = CrossSection(A=4e-4, Iy=3e-8, Iz=3e-8, J=6e-8)
C0 = beam_compliance(LENGTH, STEEL, SECTION)
FORMS = [rs.WrenchBasis(), rs.Block(), rs.Recursive(), rs.SaddlePoint(), rs.IndexRules()]


def eq21(L: float) -> np.ndarray:
    """Columns Rx, Ry, Rz at the reference point, then Ry and Rz at the distance L."""
    J = np.zeros((6, 5))
    J[3, 0] = J[4, 1] = J[5, 2] = 1
    J[2, 3], J[4, 3] = -L, 1
    J[1, 4], J[5, 4] = L, 1
    return J


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_only_traction_is_left(form):
    K = rs.chain_stiffness(C0, eq21(LENGTH), form=form).K
    expected = np.zeros((6, 6))
    expected[0, 0] = STEEL.E * SECTION.A / LENGTH
    K0 = np.abs(np.linalg.inv(C0)).max()
    assert np.isclose(K[0, 0], expected[0, 0], rtol=1e-13)
    assert np.abs(K - expected).max() <= 1e-13 * K0


def test_columns_are_those_of_balls_at_both_ends():
    """(21) by eq. (17): the base lies at -L along x from the tip."""
    r = np.array([LENGTH, 0, 0])
    for column, e in ((3, np.eye(3)[1]), (4, np.eye(3)[2])):
        expected = np.concatenate([np.cross(e, r), e])
        assert np.array_equal(eq21(LENGTH)[:, column], expected)


def test_stages_in_numbers():
    """K^1 to K^5 by known beams: clamped-free, clamped-hinged, both ends hinged."""
    E, A, L = STEEL.E, SECTION.A, LENGTH
    EI = E * SECTION.Iz
    GJ = STEEL.G * SECTION.J
    J = eq21(L)
    stages = [np.linalg.inv(C0)]
    for column in J.T:
        stages.append(eliminate_joint(stages[-1], column))
    K0, K1, K2, K3, K4, K5 = stages
    assert np.allclose(
        np.diag(K0),
        [E * A / L, 12 * EI / L**3, 12 * EI / L**3, GJ / L, 4 * EI / L, 4 * EI / L],
        rtol=1e-12,
    )
    assert np.isclose(K0[1, 5], -6 * EI / L**2, rtol=1e-12)
    assert np.isclose(K0[2, 4], 6 * EI / L**2, rtol=1e-12)
    size = np.abs(K0).max()
    expected = K0.copy()
    expected[3, 3] = 0  # no torque about x
    assert np.abs(K1 - expected).max() <= 1e-14 * size
    expected[2, :] = expected[:, 2] = expected[4, :] = expected[:, 4] = 0
    expected[2, 2] = 3 * EI / L**3  # hinged at the tip about y
    assert np.abs(K2 - expected).max() <= 1e-13 * size
    expected[1, :] = expected[:, 1] = expected[5, :] = expected[:, 5] = 0
    expected[1, 1] = 3 * EI / L**3
    assert np.abs(K3 - expected).max() <= 1e-13 * size
    expected[2, 2] = 0  # hinged at both ends about y
    assert np.abs(K4 - expected).max() <= 1e-13 * size
    expected[1, 1] = 0
    assert np.abs(K5 - expected).max() <= 1e-13 * size


def test_stages_with_symbols():
    E, A, L, Iz, GJ = sp.symbols("E A L I GJ", positive=True)
    K = sp.zeros(6)
    K[0, 0], K[3, 3] = E * A / L, GJ / L
    K[1, 1] = K[2, 2] = 12 * E * Iz / L**3
    K[4, 4] = K[5, 5] = 4 * E * Iz / L
    K[1, 5] = K[5, 1] = -6 * E * Iz / L**2
    K[2, 4] = K[4, 2] = 6 * E * Iz / L**2
    columns = sp.Matrix(
        [[0, 0, 0, 0, 0], [0, 0, 0, 0, L], [0, 0, 0, -L, 0],
         [1, 0, 0, 0, 0], [0, 1, 0, 1, 0], [0, 0, 1, 0, 1]]
    )  # fmt: skip
    for i in range(5):
        K = eliminated(K, columns[:, i])
    expected = sp.zeros(6)
    expected[0, 0] = E * A / L
    assert K == expected


def test_eq_22_and_23():
    R = random_rotation(np.random.default_rng(4))
    K = rotate_stiffness(rs.chain_stiffness(C0, eq21(LENGTH)).K, R)
    u, K11 = R[:, 0], STEEL.E * SECTION.A / LENGTH
    expected = np.zeros((6, 6))
    expected[:3, :3] = K11 * np.outer(u, u)
    assert np.abs(K - expected).max() <= 1e-12 * K11


@pytest.mark.parametrize(
    ("angles", "entries", "rank"), [(case_a_angles, entries27, 3), (case_b_angles, entries28, 6)]
)
def test_eq_27_and_28_with_symbols(angles, entries, rank: int):
    R, r, h, L2 = sp.symbols("R r h L2", positive=True)  # L^2 of the legs is in test_slips
    K, expected = jointed_legs(*angles(), R, r, h, L2), sp.Matrix(entries(R, r, h))
    assert (K - 3 * expected / L2).expand() == sp.zeros(6)
    assert expected.rank(simplify=True) == rank
    printed = jointed_legs(*angles(), R, r, h, L2, sign=+1)
    assert sp.simplify(printed[0, 4] + K[0, 4]) == 0  # the coupling comes out with the other sign
    assert sp.simplify(printed[0, 4] - K[0, 4]) != 0


R, r, h = 0.5, 0.2, 0.6


@pytest.mark.parametrize(("case", "equation", "rank"), [("a", eq27, 3), ("b", eq28, 6)])
def test_models_of_the_robots(case: str, equation, rank: int):
    result = stiffness(rs.load(f"gough-stewart-{case}", {"R": R, "r": r, "h": h, "k": 1e8}))
    assert distance(result.K, equation(1e8, R, r, h)) <= 1e-13
    assert int(result.rank) == rank


def test_case_a_has_one_free_motion_elsewhere():
    poses = [0, 0, h, 0, 0, 0] + 0.1 * np.random.default_rng(1).uniform(-1, 1, (8, 6))
    robot = rs.load("gough-stewart-a", {"R": R, "r": r, "h": h})
    assert (stiffness(robot, poses).rank == 5).all()

"""Robots written down as model files, all symbols, against the form that statics gives them."""

import numpy as np
import sympy as sp

import robostiff as rs
from robostiff.analytic import canonical
from robostiff.model import Chain, Leg, Robot, parallelogram, prismatic, revolute
from robostiff.spatial import Frame, Space
from tests.files import FILES, text_of


def written(tmp_path, text):
    file = tmp_path / "robot.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def symbols_of(derivation, *names):
    by_name = {symbol.name: symbol for symbol in derivation.symbols}
    return [by_name[name] for name in names]


def cubic(a, k):
    return sp.diag(2 * k * sp.eye(3), 2 * k * a**2 * (sp.eye(3) + sp.ones(3)))


def test_three_links_at_symbolic_joint_angles_agree_with_numbers():
    robot = rs.load(FILES / "3r-arm.yaml", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=rs.AtSymbols())
    assert derivation.coordinates == ("q1", "q2", "q3")
    random = np.random.default_rng(3)
    for _ in range(3):
        values = {name: v * random.uniform(0.8, 1.2) for name, v in robot.nominal.items()}
        q = random.uniform(0.2, 1.2, 3)
        given = values | dict(zip(derivation.coordinates, q, strict=True))
        found = derivation.substituted({s: given[s.name] for s in derivation.symbols})
        expected = rs.stiffness(robot.substituted(values), rs.JointCoordinates(q)).K
        size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        difference = np.array(found.evalf(30), dtype=float) - expected
        assert np.max(np.abs(difference) / size) < 1e-10


def test_planar_arm_of_beams_closes_with_all_symbols_and_stays_short():
    robot = rs.load(FILES / "2r-beams.yaml", symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, pose=rs.AtSymbols(), form=rs.Closed())
    assert max(len(sp.Add.make_args(sp.numer(e).expand())) for e in derivation.K) < 100
    given = robot.nominal | {"q1": 0.4, "q2": 0.9}
    found = derivation.substituted({s: given[s.name] for s in derivation.symbols})
    expected = rs.stiffness(robot.numeric, rs.JointCoordinates([0.4, 0.9])).K
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.max(np.abs(np.array(found.evalf(30), dtype=float) - expected) / size) < 1e-10


def test_3_puu_about_its_centre_is_pull_and_torque_of_three_rods():
    """Each rod pulls with k, drive and traction in series, and turns with k_tau = G J / L."""
    derivation = rs.derive(FILES / "3-puu.yaml")
    R, r, L, k_a, E, A, G, J = symbols_of(derivation, "R", "r", "L", "k_a", "E", "A", "G", "I_t")
    s = (R - r) / L
    c = sp.sqrt(L**2 - (R - r) ** 2) / L
    k, k_tau = 1 / (c**2 / k_a + L / (E * A)), G * J / L
    tilt = sp.Rational(3, 2) * (r**2 * c**2 * k + s**2 * k_tau)
    expected = sp.diag(
        *[sp.Rational(3, 2) * s**2 * k] * 2, 3 * c**2 * k, tilt, tilt, 3 * c**2 * k_tau
    )
    coupling = sp.Rational(3, 2) * r * s * c * k
    expected[0, 4] = expected[4, 0] = -coupling
    expected[1, 3] = expected[3, 1] = coupling
    assert canonical(derivation.K - expected).is_zero_matrix


def test_cubic_platform_about_its_centre_and_above(tmp_path):
    """2 k in every direction; 8 k a^2 about one diagonal, 2 k a^2 square to it."""
    at_centre = rs.derive(written(tmp_path, text_of("cubic.yaml").replace("HEIGHT", "0")))
    a, k = symbols_of(at_centre, "a", "k")
    assert at_centre.K == sp.ImmutableMatrix(cubic(a, k))
    above = rs.derive(written(tmp_path, text_of("cubic.yaml").replace("HEIGHT", "h")))
    a, k, h = symbols_of(above, "a", "k", "h")
    lever = sp.Matrix([[0, -h, 0], [h, 0, 0], [0, 0, 0]])
    J = sp.Matrix(sp.BlockMatrix([[sp.eye(3), lever], [sp.zeros(3), sp.eye(3)]]))
    expected = J.T * cubic(a, k) * J
    assert canonical(above.K - expected).is_zero_matrix


NOMINAL = {"k": 3e6, "l": 0.5, "w": 0.1}


def bars_that_only_stretch(k, length, width) -> Robot:
    """A planar parallelogram of two bars along x, each a spring of stiffness k."""
    z = [0, 0, 1]
    free, spring = rs.Passive(), rs.Actuated(k)
    bar = Chain(
        (
            revolute(z, free, name="near pin"),
            prismatic([1, 0, 0], spring, home=[length], name="bar"),
            revolute(z, free, name="far pin"),
        )
    )
    across = np.array([0, width, 0], dtype=object)
    still = Frame(np.eye(3, dtype=int), np.zeros(3, dtype=int))
    leg = Leg("leg", still, Chain((parallelogram(bar, across),)), still)
    home = Frame(np.eye(3, dtype=int), np.array([length, 0, 0], dtype=object))
    return Robot("parallelogram", (leg,), home=home, space=Space.PLANAR, nominal=NOMINAL)


def test_planar_parallelogram_by_hand():
    """Bars along x at y = +-w/2 feel dx -+ w/2 rz: K = diag(2 k, 0, k w^2/2)."""
    k, length, w = sp.symbols("k l w", positive=True)
    robot = bars_that_only_stretch(k, length, w)
    K = sp.Matrix(rs.derive(robot, form=rs.Closed()).K)
    assert sp.simplify(K - sp.diag(2 * k, 0, k * w**2 / 2)) == sp.zeros(3)
    numeric = rs.stiffness(robot.numeric)
    assert np.abs(numeric.K - np.diag([6e6, 0, 1.5e4])).max() < 1e-6
    assert int(numeric.rank) == 2

"""Stiffness to first order in the load: answers on paper, and differences of equilibria."""

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Definition, FormulaTooLargeError
from robostiff.analytic.exact.operation_count import count_of
from robostiff.analytic.legs.first_order import LegResponse
from robostiff.analytic.stiffness_under_load import StiffnessUnderLoad
from robostiff.robots import robot_file
from robostiff.spatial import skew

L, k, c, d, P = sp.symbols("L k c d P", real=True)

PENDULUM = """
robostiff: 1
name: pendulum
source: A slide on a hinge.
planar: true
parameters: {L: 500 mm, k: 1e5 N/m, c: 1000 N m/rad, d: 800 N m/rad}
legs:
  - name: leg
    chain:
      - {type: revolute, name: root, axis: z, role: actuated, stiffness: c}
      - {type: prismatic, name: slide, axis: x, role: actuated, stiffness: k}
      - {type: rigid, name: link, to: [L, 0, 0]}
      - {type: revolute, name: tip, axis: z, role: actuated, stiffness: d}
"""

ARM = """
robostiff: 1
name: arm
source: Chosen at random.
parameters: {l: 400 mm, k: 2e4 N m/rad}
legs:
  - name: arm
    chain:
      - {type: revolute, name: root, axis: [0, 0.6, 0.8], role: actuated, stiffness: k}
      - {type: helical, name: screw, axis: x, pitch: 10 mm, role: actuated, stiffness: 50 N m/rad}
      - {type: beam, name: first, to: [l, 0, 0], y_axis: y, material: steel,
         section: {rectangle: {width_y: 20 mm, height_z: 30 mm}}, theory: timoshenko}
      - {type: revolute, name: elbow, axis: y, role: actuated, stiffness: 1e4 N m/rad}
      - {type: beam, name: second, to: [0, 200 mm, 100 mm], y_axis: x, material: steel,
         section: {circle: {diameter: 25 mm}}}
reference_point: [20 mm, 30 mm, -10 mm]
"""


def derived(text: str, folder: Path, wrench: object = None, **more: object) -> StiffnessUnderLoad:
    file = folder / "robot.yaml"
    file.write_text(text)
    return rs.derive_under_load(file, wrench, **more)  # pyright: ignore


def by_name(K: sp.Matrix) -> sp.Matrix:
    """The same with symbols of no other assumption than to be real."""
    return K.xreplace({x: sp.Symbol(x.name, real=True) for x in K.free_symbols})


def differences(robot: rs.Robot, F: np.ndarray, beams: object, share: float) -> np.ndarray:
    """Derivative of K by a factor of the load, from four equilibria."""

    def rate(s: float) -> np.ndarray:
        ends = [rs.equilibrium(robot, None, e * F, beams=beams).K for e in (s, -s)]  # pyright: ignore
        return (ends[0] - ends[1]) / (2 * s)

    return (4 * rate(share / 2) - rate(share)) / 3


def test_pendulum_is_the_third_derivative_of_its_energy(tmp_path: Path):
    """In the plane K is the Hessian of U(x, y, angle), and K1 its derivative along the twist."""
    found = derived(PENDULUM, tmp_path)
    assert found.is_closed
    x, y, angle = q = sp.symbols("x y angle", real=True)
    turn = sp.atan2(y, x)
    U = (c * turn**2 + k * (sp.sqrt(x**2 + y**2) - L) ** 2 + d * (angle - turn) ** 2) / 2
    positive = {L: sp.Symbol("L", positive=True)}
    H = sp.hessian(U, q).subs(positive)
    home = {x: positive[L], y: 0, angle: 0}
    K0 = H.subs(home)
    t = K0.inv() * by_name(found.wrench)
    K1 = sp.zeros(3)
    for q_k, t_k in zip(q, t, strict=True):
        K1 += t_k * H.diff(q_k).subs(home)
    assert (by_name(found.K0).subs(positive) - K0).applyfunc(sp.simplify) == sp.zeros(3)
    assert (by_name(found.K1).subs(positive) - K1).applyfunc(sp.simplify) == sp.zeros(3)


def test_pendulum_upside_down(tmp_path: Path):
    """(c + d)/a^2 - P/a at its length a = L - P/k."""
    found = derived(PENDULUM, tmp_path, ["-P", 0, 0])
    exact = (c + d) / L**2 * (1 + 2 * P / (k * L)) - P / L
    assert sp.simplify(by_name(found.K)[1, 1] - exact) == 0


def test_cantilever_has_the_geometric_stiffness_of_a_beam_element(tmp_path: Path):
    text = robot_file("planar-link").read_text()
    clamped = text[: text.index("      - {type: revolute")]
    found = derived(clamped, tmp_path, ["-P", 0, 0])
    exact = sp.Matrix([[0, 0, 0], [0, 6 / (5 * L), -sp.Rational(1, 10)]])
    exact = -P * exact.col_join(sp.Matrix([[0, -sp.Rational(1, 10), 2 * L / 15]]))
    assert (by_name(found.K1) - exact).applyfunc(sp.simplify) == sp.zeros(3)
    assert derived(clamped, tmp_path, ["-P", 0, 0], beams=rs.Linear()).K1 == sp.zeros(3)


def test_cantilever_with_a_free_tip():
    """Its platform turns freely, whatever the load."""
    found = rs.derive_under_load("planar-link", ["-P", 0, 0])
    assert by_name(found.K1) == sp.diag(0, -6 * P / (5 * L), 0)
    number = rs.derive_under_load("planar-link", "-2.5 0 0")
    assert by_name(number.K1) == sp.diag(0, -3 / L, 0)


def test_load_that_does_work_on_a_free_motion_is_refused():
    with pytest.raises(rs.InputError, match="Mz, which does work on a free motion"):
        rs.derive_under_load("planar-link")


def test_hinged_column_has_no_stiffness_to_first_order(tmp_path: Path):
    """It may move aside, and its axial stiffness turns along."""
    column = PENDULUM.replace("actuated, stiffness: c", "passive")
    column = column.replace("actuated, stiffness: d", "passive")
    with pytest.raises(rs.InputError, match="along which K changes"):
        derived(column, tmp_path, ["-P", 0, 0])


@pytest.mark.parametrize("beams", [rs.Bowing(1), rs.Linear()], ids=["bowing", "linear"])
def test_spatial_arm_is_the_derivative_of_its_equilibria(tmp_path: Path, beams: object):
    found = derived(ARM, tmp_path, form=rs.Steps(), beams=beams)
    values = {"l": 0.43, "k": 2.3e4}
    robot = rs.load(tmp_path / "robot.yaml", symbols=("l", "k")).substituted(values)  # pyright: ignore
    F = np.random.default_rng(3).normal(size=6) * [10, 10, 10, 3, 3, 3]
    K1 = evaluated(found, values, F) - evaluated(found, values, 0 * F)
    expected = differences(robot, F, beams, 0.02)
    assert np.allclose(K1, expected, rtol=1e-7, atol=1e-7 * np.max(np.abs(expected)))
    unloaded = rs.stiffness(robot).K
    assert np.allclose(
        evaluated(found, values, 0 * F), unloaded, rtol=1e-9, atol=1e-9 * np.max(unloaded)
    )
    # linear in the load, and unsymmetric by the moment alone
    doubled = evaluated(found, values, 2 * F) - evaluated(found, values, 0 * F)
    assert np.allclose(doubled, 2 * K1, rtol=1e-9, atol=1e-7)
    odd = np.zeros((6, 6))
    odd[3:, 3:] = -skew(F[3:])
    assert np.allclose(K1 - K1.T, odd, atol=1e-7 * np.max(np.abs(K1)))


def evaluated(found: StiffnessUnderLoad, values: dict[str, float], F: np.ndarray) -> np.ndarray:
    known = values | dict(zip(("Fx", "Fy", "Fz", "Mx", "My", "Mz"), F.tolist(), strict=True))
    names = [x.name for x in found.symbols]
    return found.lambdify(*names)(*(known[name] for name in names))


def test_parallel_robot_with_passive_joints_is_the_derivative_of_its_equilibria():
    found = rs.derive_under_load("3-rrr", ["F", 0, "M"], form=rs.Steps())
    robot = rs.load("3-rrr", symbols=rs.ALL_PARAMETERS)
    at = dict(robot.nominal) | {"F": 30.0, "M": 2.0}  # pyright: ignore
    K1 = np.array(found.subs(at).K1, dtype=float)
    expected = differences(robot.numeric, np.array([30.0, 0, 2]), rs.Bowing(1), 1e-2)  # pyright: ignore
    assert np.allclose(K1, expected, rtol=1e-6, atol=1e-6 * np.max(np.abs(expected)))


def test_steps_and_closed_form_are_one(tmp_path: Path):
    closed = derived(PENDULUM, tmp_path, ["F", "F", 3])
    steps = derived(PENDULUM, tmp_path, ["F", "F", 3], form=rs.Steps())
    values = dict.fromkeys(("L", "k", "c", "d"), 2.0) | {"F": 0.3}
    both = [np.array(one.subs(values).K, dtype=float) for one in (closed, steps)]
    assert np.allclose(both[0], both[1], rtol=1e-12)


def test_pendulum_at_any_coordinates(tmp_path: Path):
    """Turned by its root, its stiffness across the link is what it is at home."""
    found = derived(PENDULUM, tmp_path, ["F", 0, 0], pose=rs.AtSymbols())
    values = {"L": 0.5, "k": 1e5, "c": 900.0, "d": 700.0, "q1": 0.3, "q2": 0.04, "q3": 0.2}
    names = [x.name for x in found.symbols if x.name != "F"]
    at = found.lambdify(*names, "F")
    K1 = at(*(values[name] for name in names), [0.0, 1.0])
    K1 = K1[1] - K1[0]
    a, turn = values["L"] + values["q2"], values["q1"]
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    across, push = R[:, 1], R[0, 0]  # of the force along x, what pulls along the link
    exact = push / a - 2 * (values["c"] + values["d"]) / a**2 * push / (values["k"] * a)
    assert np.isclose(across @ K1[:2, :2] @ across, exact, rtol=1e-9)


def test_closed_form_has_a_limit():
    with pytest.raises(FormulaTooLargeError):
        rs.derive_under_load("two-link-arm", ["F", 0, 0, 0, 0, 0], form=rs.Closed(limit=5))


@pytest.mark.parametrize(
    ("wrench", "words"),
    [
        (5, "got 5, expected Fx, Fy, Mz"),
        ((1, 2), "2 components"),
        ((0, 0, 0), "no component"),
        (("F G", 0, 0), "name of a symbol"),
    ],
)
def test_wrench_that_is_none_is_refused(tmp_path: Path, wrench: object, words: str):
    with pytest.raises(rs.InputError, match=words):
        derived(PENDULUM, tmp_path, wrench)


def test_pose_that_is_none_is_refused():
    with pytest.raises(rs.InputError, match="AtHome"):
        rs.derive_under_load("planar-link", "-P 0 0", pose="home")  # pyright: ignore


def test_wrong_formula_is_not_returned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Without the part of the bowing it disagrees with equilibria."""
    monkeypatch.setattr(LegResponse, "shapes", lambda *_: [])
    with pytest.raises(rs.DisagreementError, match="equilibria under small loads"):
        rs.derive_under_load("planar-link", ["-P", 0, 0])


def test_platform_on_springs_under_its_load_has_a_closed_form():
    """Case B of the paper under -F along z, of which K33 follows from z alone.

    With L^2 = s + z^2 and unloaded lengths L0 the force is 6 k (L - L0) z/L; its second derivative
    at z = h is 18 k s h/L^4, and the platform sinks by F L^2/(6 k h^2).
    """
    loaded = rs.derive_under_load("gough-stewart-b", [0, 0, "-F", 0, 0, 0])
    R, h, r = (next(s for s in loaded.symbols if s.name == name) for name in "Rhr")
    F = next(s for s in loaded.symbols if s.name == "F")
    across = R**2 - R * r + r**2
    assert loaded.is_closed
    assert sp.simplify(loaded.K1[2, 2] + 3 * F * across / (h * (across + h**2))) == 0
    assert loaded.K1[0, 0] == loaded.K1[1, 1]
    assert max(map(count_of, loaded.K1)) < 50
    assert loaded.K1[0, 1] == loaded.K1[0, 2] == loaded.K1[3, 5] == 0


def test_a_formula_that_names_a_step_is_refused():
    step = sp.Symbol("L_a", real=True)
    K = sp.ImmutableMatrix(sp.diag(k / step, k, 0))
    defined = (Definition(step, sp.sqrt(L**2 + 1)),)
    loaded = StiffnessUnderLoad("K_C", "at home", sp.ImmutableMatrix([0, P, 0]), K, K, defined)
    assert loaded.subs({"L": 0}).K[0, 0] == 2 * k
    with pytest.raises(rs.InputError, match="a formula without L_a"):
        loaded.subs({"k": sp.Symbol("L_a")})

"""Laws: small loads, least energy, differences of equilibria, order, frame and unit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import elasticity_from_stiffness
from robostiff.model import Actuated, PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.statics.chains.elements import Share
from robostiff.statics.loading.given_loads import Acting
from robostiff.statics.loading.loaded_posture import postures_of
from tests.cases.metric import distance
from tests.statics.robots_under_load import beam_legs, case, loaded, planar_chain, stewart

COVERED = rs.shipped_robots()


@pytest.mark.parametrize("name", COVERED)
def test_without_load_it_is_the_stiffness(name: str):
    robot = rs.load(name)
    known = rs.stiffness(robot)
    for beams in (rs.Linear(), rs.Bowing(), rs.Bowing(2)):
        answer = loaded(robot, beams=beams)
        if name == "planar-link":  # its rotation block has no stiffness at all
            assert np.abs(answer.K - known.K).max() < 1e-9 * np.abs(known.K).max()
        else:
            assert distance(answer.K, known.K) < 1e-9
        assert answer.has_answer
        assert np.allclose(answer.pose, np.broadcast_to(known.pose, 6), atol=1e-12)
        assert ("free-motions" in str(answer.status)) == (int(known.rank) < known.space.size)


@pytest.mark.parametrize("name", ["hexapod", "delta", "3-rrr", "six-joint-arm", "h4"])
def test_small_loads_deflect_as_the_linear_theory_says(name: str):
    robot = rs.load(name)
    wrench = np.array([3.0, -2, 5, 1, 0.5, -1])[list(robot.space.rows)] * 1e-3
    bent, answer = rs.deflection(robot, wrench=wrench), loaded(robot, wrench=wrench)
    size = np.abs(bent.twist).max()
    assert np.abs(answer.displacement - bent.twist).max() < 1e-6 * size + 1e-14
    assert np.isclose(answer.energy, bent.energy, rtol=1e-6)
    shares = {(p.leg, p.part): p.share for p in bent.parts}
    for part in answer.shares:
        assert np.isclose(part.share, shares[part.leg, part.part], atol=1e-5)


def asymmetric() -> Snapshot:
    """A posture without symmetry, from LP1, with a moment and forces on a leg."""
    return beam_legs(case("LP1_gough_stewart_b_beams"))


LOADS = {
    "leg2/s2": rs.DeadForce([300, -2000, 900]),
    "leg5/j1": rs.DeadForce([-500, 0, 4000], [0.1, 0.2, 0.3]),
    "platform": [rs.DeadForce([0, 0, -9e3], [0.2, 0, 0.8])],
}
WRENCH = np.array([3e4, -1e4, -2e5, 1e3, 0, 2e3])


def test_K_is_the_difference_of_equilibria():
    robot = asymmetric()
    answer = loaded(robot, wrench=WRENCH, loads=LOADS, beams=rs.Bowing(1))
    assert answer.status == 0
    here = answer.displacement

    def carried(step: np.ndarray) -> np.ndarray:
        turn = Rotation.from_rotvec(step[3:]) * Rotation.from_rotvec(here[3:])
        moved = [*(here[:3] + step[:3]), *turn.as_rotvec()]
        held = loaded(robot, displacement=moved, loads=LOADS, beams=rs.Bowing(1))
        return np.sum(held.leg_wrenches, axis=0)

    h, numeric = 4e-6, np.zeros((6, 6))
    for i in range(6):
        e = h * np.eye(6)[i]
        near, far = carried(e) - carried(-e), carried(2 * e) - carried(-2 * e)
        numeric[:, i] = (8 * near - far) / (12 * h)
    assert distance(answer.K, numeric) < 1e-8
    assert distance(answer.K_sym, (numeric + numeric.T) / 2) < 1e-8


def test_K_total_is_the_rate_of_more_load():
    robot = asymmetric()
    loads = {**LOADS, "platform": rs.DeadForce([0, 0, -9e4], [0.4, 0, 1.8])}
    answer = loaded(robot, wrench=WRENCH, loads=loads)
    assert distance(answer.K_total, answer.K) > 1e-5
    h = 20.0
    for i in range(6):
        ends = [loaded(robot, wrench=WRENCH + s * h * np.eye(6)[i], loads=loads) for s in (1, -1)]
        R = [Rotation.from_rotvec(end.displacement[3:]) for end in ends]
        turn = (R[0] * R[1].inv()).as_rotvec()
        shift = ends[0].displacement[:3] - ends[1].displacement[:3]
        pull = answer.K_total @ np.concatenate([shift, turn]) / (2 * h)
        assert np.allclose(pull, np.eye(6)[i], atol=1e-7)


def test_wrench_and_displacement_answer_one_another():
    robot = rs.load("orthoglide")
    F = np.array([300.0, -200, 500, 10, 20, -5])
    moved = loaded(robot, wrench=F)
    held = loaded(robot, displacement=moved.displacement)
    assert np.allclose(held.wrench, F, rtol=1e-8, atol=1e-6)
    assert distance(held.K, moved.K) < 1e-9


def test_energy_is_least():
    """An independent optimiser over the joints of a chain, its tip held."""
    data = case("L4_planar_RPRPR_compressed")
    k1, k2, k3 = 2e5, 3e3, 1.5e5
    target = np.array(data["loaded_tip"])

    def tip(x: np.ndarray) -> np.ndarray:
        a, b = 0.3 + x[0], 0.9 + x[0] + x[2]
        return (0.5 + x[1]) * np.array([np.cos(a), np.sin(a)]) + (0.4 + x[3]) * np.array(
            [np.cos(b), np.sin(b)]
        )

    found = minimize(
        lambda x: 0.5 * (k1 * x[1] ** 2 + k2 * x[2] ** 2 + k3 * x[3] ** 2),
        np.zeros(4),
        constraints={"type": "eq", "fun": lambda x: 1e3 * (tip(x) - target)},
        options={"ftol": 1e-15, "maxiter": 500},
    )
    answer = loaded(planar_chain(k1, k2, k3), displacement=[-0.03, -0.01, 0])
    assert np.isclose(answer.energy, found.fun, rtol=1e-7)
    motion = [float(part.motion[0]) for part in answer.parts[:4]]
    assert np.allclose(motion, found.x, atol=1e-5)


def test_energy_of_struts_is_least():
    data = case("L1_stewartB_springs_force")
    robot, base, arms, k = stewart(data)
    F, p0 = np.array(data["load"])[:3], robot.reference_point
    rest = np.linalg.norm(p0 + arms - base, axis=1)

    def potential(x: np.ndarray) -> float:
        R = Rotation.from_rotvec(x[3:]).as_matrix()
        lengths = np.linalg.norm(p0 + x[:3] + arms @ R.T - base, axis=1)
        return float(0.5 * k * np.sum((lengths - rest) ** 2) - F @ x[:3])

    found = minimize(potential, np.zeros(6), method="BFGS", options={"gtol": 1e-6})
    answer = loaded(robot, wrench=data["load"])
    least = answer.potential - F @ answer.displacement[:3]
    assert least <= found.fun + 1e-9 * abs(found.fun)
    assert np.isclose(least, found.fun, rtol=1e-8)
    assert np.allclose(answer.displacement, found.x, atol=1e-5)


@pytest.mark.parametrize("beams", [rs.Bowing(2), rs.Bowing()], ids=["cubics", "inner modes"])
@pytest.mark.parametrize("name", ["LP1", "delta"])
def test_tangent_is_the_derivative_of_the_residual(name: str, beams: rs.Bowing):
    """Along motions that keep chains closed; moments turn half as far as the bodies at ends."""
    robot, loads, wrench = asymmetric(), LOADS, WRENCH
    if name == "delta":
        robot, loads = rs.find_posture(rs.load("delta")).snapshot.one(0), {}
    found = loaded(robot, wrench=wrench, loads=loads, beams=beams).found
    assert found is not None
    legs, state, eq = found.problem.legs, found.state, found.known.equations
    share, size = found.loading.shares(found.factor), np.full(legs.numbers.total, 1e4)
    size[found.problem.free] = 0.1 / np.maximum(legs.units(1.0)[found.problem.free], 1e-12)
    step = np.random.default_rng(3).uniform(-1, 1, size.size) * size
    for block, A in zip(legs.numbers.blocks, eq.A, strict=True):
        for u, own in zip(block.coordinates, A, strict=True):
            closure = own[block.free :, : block.free] * size[u]
            step[u] -= size[u] * (np.linalg.pinv(closure) @ (closure @ (step[u] / size[u])))
    turned = legs.steps(eq, step[:, None], np.zeros((6, 1)))[: len(step), 0]

    def residual(part: float) -> np.ndarray:
        """Axial forces of beams in balance with coordinates."""
        own = legs.stepped(state.legs, np.pad(part * turned, (0, len(legs.beams))))
        for _ in range(12):
            missing = legs.equations(own, state.R, state.p, share).terms.beams.missing
            own = replace(own, axial=own.axial + missing)
        return legs.equations(own, state.R, state.p, share).r

    near, far = ((residual(part) - residual(-part)) / (2 * part) for part in (1e-5, 2e-5))
    rate = (4 * near - far) / 3  # without the error of second order
    for block, A in zip(legs.numbers.blocks, eq.A, strict=True):
        for u, own in zip(block.at, A, strict=True):
            scale = np.abs(own * step[u]).max(axis=1)
            assert np.abs((own @ step[u] - rate[u]) / scale).max() < 2e-8


def test_order_of_legs_does_not_matter():
    robot = asymmetric()
    loads = {key: value for key, value in LOADS.items() if key != "platform"}
    turned = replace(robot, legs=robot.legs[::-1])
    one, other = (loaded(own, wrench=WRENCH, loads=loads) for own in (robot, turned))
    assert distance(one.K, other.K) < 1e-12
    assert np.allclose(one.leg_wrenches, other.leg_wrenches[::-1], rtol=1e-9, atol=1e-6)


def moved_robot(robot: Snapshot, Q: np.ndarray, shift: np.ndarray, unit: float) -> Snapshot:
    """The same robot in another frame and another unit of length."""
    legs = []
    scale = np.diag([unit, unit, unit, 1, 1, 1])
    for leg in robot.legs:
        elements = []
        for e in leg.elements:
            assert not isinstance(e, PlacedBlock)
            point = unit * (Q @ e.point + shift)
            if isinstance(e, PlacedFreedom):
                role = e.role
                elements.append(replace(e, point=point, axis=Q @ e.axis, role=role))
            else:
                # forces in the same newtons: C maps (N, N unit) to (unit, rad)
                C = scale @ e.elasticity.compliance @ scale / unit
                own = type(e.elasticity)(C)
                elements.append(replace(e, point=point, rotation=Q @ e.rotation, elasticity=own))
        legs.append(PlacedLeg(leg.name, tuple(elements), unit * (Q @ leg.end + shift)))
    return replace(
        robot, legs=tuple(legs), reference_point=unit * (Q @ robot.reference_point + shift)
    )


def test_a_nut_advances_while_it_turns():
    """A push F along a screw of pitch h turns it by h F / k, also over many turns."""
    k, h, load, tip = 2.0, 0.005, 3000.0, np.array([0.0, 0.0, 0.2])
    stiffness = np.diag([1e7, 1e7, 1e7, 1e5, 1e5, 1e5])
    part = PlacedSpring("part", tip, np.eye(3), elasticity_from_stiffness(stiffness))
    screw = PlacedFreedom(np.array([0, 0, 1.0]), np.zeros(3), h, "screw", Actuated(k))
    robot = Snapshot("nut", (PlacedLeg("leg", (screw, part), tip),), tip)
    found = rs.equilibrium(robot, wrench=[0, 0, load, 0, 0, 0])
    turn = h * load / k
    assert turn > 2 * np.pi
    assert found.displacement[2] == pytest.approx(h * turn + load / 1e7, rel=1e-9)
    without = rs.equilibrium(robot)
    expected = rs.stiffness(robot).K
    np.testing.assert_allclose(without.K, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("unit", [1.0, 1e3])
def test_frame_and_unit_do_not_matter(unit: float):
    robot = asymmetric()
    Q = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    other = moved_robot(robot, Q, np.array([0.4, -2, 1.0]), unit)
    B = np.kron(np.eye(2), Q)
    # in millimetres the same force is as many N, energies are in N mm
    scale = np.array([1, 1, 1, unit, unit, unit])
    one = loaded(robot, wrench=WRENCH)
    two = loaded(other, wrench=scale * (B @ WRENCH))
    K = np.outer(scale, scale) * (B @ one.K @ B.T) / unit
    assert distance(two.K, K, unit) < 1e-9
    assert np.isclose(two.margin, one.margin, rtol=1e-7)


def test_batches_have_a_status_for_each():
    data = case("L1_stewartB_springs_force")
    robot, *_ = stewart(data)
    factors = [0.5, 1.0, 3.0]
    many = rs.equilibrium(robot, wrench=np.outer(factors, data["load"]))
    assert many.answered[:2].all()
    assert many.stable.tolist() == [True, True, False]
    assert "beyond-critical-load" in str(many[2].status)
    assert not np.isnan(many.K.compressed()).any()
    one = loaded(robot, wrench=data["load"])
    assert np.array_equal(many[1].K, one.K)
    known = rs.load("hexa")
    poses = np.array([rs.stiffness(known).pose, [0, 0, -9, 0, 0, 0]])
    answers = rs.equilibrium(known, poses, [0, 0, -1e4, 0, 0, 0])
    assert answers.status_codes.tolist() == [0, int(rs.Status.UNREACHABLE)]
    assert np.ma.getmaskarray(answers.K)[1].all()
    with pytest.raises(rs.NoAnswerError, match="unreachable"):
        _ = answers[1].K


def test_misuse():
    robot = rs.load("hexapod")
    with pytest.raises(rs.InputError, match="one of them"):
        rs.equilibrium(robot, wrench=np.zeros(6), displacement=np.zeros(6))
    with pytest.raises(rs.InputError, match="such as 'leg1/strut"):
        rs.equilibrium(robot, loads={"leg1/strutt": [0, 0, -1]})
    with pytest.raises(rs.InputError, match="6 numbers"):
        rs.equilibrium(robot, wrench=[1, 2, 3])
    with pytest.raises(rs.InputError, match="a load that grows"):
        rs.critical_load(robot, wrench=np.zeros(6))
    with pytest.raises(rs.InputError, match="one joint that moves"):
        rs.equilibrium(rs.load("gough-stewart-b-beams"), preload={"leg1/tube": 5.0})
    with pytest.raises(rs.InputError, match="1 to 64"):
        rs.Bowing(0)


def test_legs_with_other_loads_are_computed_together():
    """A load on one leg alone leaves all alike legs in one block, at the same answer."""
    robot = rs.find_posture(rs.load("hexapod")).snapshot.one(0)
    p = np.asarray(robot.reference_point)
    loads = {"leg2/strut": [rs.DeadForce([0, 0, -900.0]), rs.DeadForce([50.0, 0, 0])]}
    residuals = []
    for given in (loads, {}):
        legs = postures_of(robot, None, None).loaded(0, Acting(given)).problem.legs
        (block,) = legs.numbers.blocks
        assert len(block.at) == 6
        residuals.append(legs.equations(legs.unloaded, np.eye(3), p, Share(1.0, 1.0)).r[block.at])
    others = np.abs(residuals[0] - residuals[1]).max(axis=1) > 0
    assert others.tolist() == [False, True, False, False, False, False]

"""J_q and J_theta against finite differences of the direct kinematics, eq. (5)-(7) and (17)."""

import numpy as np
import pytest
from hypothesis import given
from scipy.linalg import block_diag

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.kinematics import freedom_twists, leg_compliance, passive_jacobian, place_chain
from robostiff.kinematics.closure.motion_tree import AT_REST, MotionTree, advanced
from robostiff.kinematics.frames import ChainWalk, Way
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.spatial import Frame, block_rotation, twist_transport
from tests.generators.chains import random_rotation
from tests.generators.elements import BAR, KINDS, STEEL, element_chains, random_element
from tests.kinematics.finite_differences import AxesAndPoint, twist_rate

CLOSE = 1e-9


def placed_leg(chain: rs.Chain, base: Frame, q: np.ndarray) -> PlacedLeg:
    placed = place_chain(chain, q, base.R, base.p)
    return PlacedLeg("leg", placed.elements, placed.p)


def leg_of(chain: rs.Chain, base: Frame) -> rs.Leg:
    """A leg that may lack compliance, which only the closure's steps look at."""
    elastic = rs.Chain((*chain.elements, rs.revolute([0, 0, 1], rs.Actuated(1.0))))
    return rs.Leg("leg", base, elastic, Frame.identity())


@given(element_chains())
def test_columns_of_all_joints(case: tuple[rs.Chain, Frame, np.random.Generator]):
    chain, base, rng = case
    q = chain.home + 0.3 * rng.uniform(-1, 1, chain.size)
    at = rng.uniform(-1, 1, 3)
    leg = placed_leg(chain, base, q)
    R_base, p_base = base.R, base.p
    with_extra = leg_of(chain, base)
    J = freedom_twists(leg.freedoms, at)
    assert J.shape == (6, chain.size)
    for i in range(chain.size):

        def frame(step: float, i: int = i) -> AxesAndPoint:
            delta = np.zeros(chain.size + 1)
            delta[i] = step
            tree = MotionTree()
            tree.along(with_extra.chain, AT_REST)
            moved = advanced(np.append(q, 0.0), delta, tree.balls)[:-1]
            end = place_chain(chain, moved, R_base, p_base)
            return end.R, end.p

        assert np.abs(J[:, i] - twist_rate(frame, at)).max() <= CLOSE
    passive, names = passive_jacobian(leg, at)
    where = [k for k, freedom in enumerate(leg.freedoms) if freedom.is_passive]
    assert np.array_equal(passive, J[:, where])
    assert len(names) == len(where)


def spring_jacobian(leg: PlacedLeg, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """J_theta of the springs of a leg about a point, and K_theta^-1, by their definitions."""
    columns, blocks = [np.zeros((6, 0))], [np.zeros((0, 0))]
    for element in leg.elements:
        if isinstance(element, PlacedSpring):
            J_v = twist_transport(at - element.point)
            columns.append(J_v @ block_rotation(element.rotation))
            blocks.append(element.elasticity.compliance)
        elif isinstance(element, PlacedFreedom) and element.stiffness is not None:
            columns.append(element.twist(at)[:, None])
            blocks.append(np.array([[1.0 / element.stiffness]]))
    return np.hstack(columns), np.asarray(block_diag(*blocks))


class DeflectedWalk(ChainWalk):
    """The way along a chain one spring of which deflects, by its number."""

    number, theta, met = 0, np.zeros(6), 0

    def spring(self, name: str, axes: np.ndarray, elasticity: Elasticity) -> None:
        super().spring(name, axes, elasticity)
        if self.met == self.number:
            R = self.R @ axes
            self.p = self.p + R @ self.theta[:3]
            self.R = turn_by_vector(R @ self.theta[3:]) @ self.R
        self.met += 1


@given(element_chains())
def test_columns_of_virtual_springs(case: tuple[rs.Chain, Frame, np.random.Generator]):
    chain, base, rng = case
    q = chain.home + 0.3 * rng.uniform(-1, 1, chain.size)
    at = rng.uniform(-1, 1, 3)
    leg = placed_leg(chain, base, q)
    J_theta, K_theta_inverse = spring_jacobian(leg, at)
    column = 0
    spring = 0
    for element in leg.elements:
        if isinstance(element, PlacedFreedom):
            if element.stiffness is not None:
                assert np.array_equal(J_theta[:, column], element.twist(at))
                assert np.isclose(K_theta_inverse[column, column], 1 / element.stiffness)
                column += 1
            continue
        # A beam of a telescope that others follow turns their way, which is read at once.
        for k in range(0 if element.name.endswith(".beam1") else 6):

            def frame(step: float, k: int = k, spring: int = spring) -> AxesAndPoint:
                walk = DeflectedWalk(base.R, base.p, Way.of(chain, q))
                walk.number, walk.theta = spring, step * np.eye(6)[k]
                walk.along(chain)
                return walk.R, walk.p

            assert np.abs(J_theta[:, column + k] - twist_rate(frame, at)).max() <= CLOSE
        assert isinstance(element, PlacedSpring)
        block = K_theta_inverse[column : column + 6, column : column + 6]
        assert np.array_equal(block, element.elasticity.compliance)
        column += 6
        spring += 1
    assert column == J_theta.shape[1]


@given(element_chains())
def test_compliance_of_a_leg_is_the_sum_over_its_springs(
    case: tuple[rs.Chain, Frame, np.random.Generator],
):
    chain, base, rng = case
    q = chain.home + 0.3 * rng.uniform(-1, 1, chain.size)
    at = rng.uniform(-1, 1, 3)
    leg = placed_leg(chain, base, q)
    J_theta, K_theta_inverse = spring_jacobian(leg, at)
    expected = J_theta @ K_theta_inverse @ J_theta.T
    C = leg_compliance(leg, at)
    assert np.abs(C - expected).max() <= 1e-13 * np.abs(expected).max(initial=1e-300)


def test_a_column_with_the_arm_reversed_is_caught():
    """The check can fail: d = r x e in place of e x r is seen by the finite differences."""
    e, point, at = np.array([0, 0.6, 0.8]), np.array([0.1, 0.2, 0.3]), np.array([1.0, -1, 0.5])
    wrong = np.concatenate([np.cross(at - point, e), e])
    freedom = PlacedFreedom(e, point, 0.0, "turn", rs.Passive())

    def frame(step: float) -> AxesAndPoint:
        E = np.cross(np.eye(3), -e).T  # (e x)
        R = np.eye(3) + np.sin(step) * E + (1 - np.cos(step)) * E @ E
        return R, point - R @ point

    right = twist_rate(frame, at)
    assert np.abs(right - wrong).max() > 0.1
    assert np.abs(right - freedom.twist(at)).max() <= CLOSE


@pytest.mark.parametrize("shape", [(), (1,), (3, 1, 2)])
@pytest.mark.parametrize("kind", KINDS)
def test_batches_are_loops(kind: str, shape: tuple[int, ...]):
    rng = np.random.default_rng([*kind.encode()])
    chain = rs.Chain(
        (
            random_element("part", rng),
            random_element(kind, rng),
            random_element("spring", rng),
            random_element("revolute", rng),
        )
    )
    R, p = random_rotation(rng), rng.uniform(-1, 1, 3)
    q = chain.home + 0.2 * rng.uniform(-1, 1, (*shape, chain.size))
    at = rng.uniform(-1, 1, (*shape, 3))
    placed = place_chain(chain, q, R, p)
    assert placed.R.shape == (*shape, 3, 3)
    assert placed.p.shape == (*shape, 3)
    leg = PlacedLeg("leg", placed.elements, placed.p)
    J_q, _ = passive_jacobian(leg, at)
    C = leg_compliance(leg, at)
    for index in np.ndindex(shape):
        one = place_chain(chain, q[index], R, p)
        leg_one = PlacedLeg("leg", one.elements, one.p)
        assert np.allclose(placed.R[index], one.R, rtol=0, atol=1e-15)
        assert np.allclose(placed.p[index], one.p, rtol=0, atol=1e-15)
        assert np.allclose(J_q[index], passive_jacobian(leg_one, at[index])[0], atol=1e-15)
        C_one = leg_compliance(leg_one, at[index])
        assert np.allclose(C[index], C_one, rtol=0, atol=1e-14 * np.abs(C_one).max())


def test_freedoms_of_a_singular_spring_are_passive_joints():
    rng = np.random.default_rng(4)
    hinge = Elasticity(np.diag([1e-8, 0, 0, 0, 0, 0]), np.eye(6)[:, [5, 1]])
    R, point, at = random_rotation(rng), rng.normal(size=3), rng.normal(size=3)
    leg = PlacedLeg("leg", (PlacedSpring("hinge", point, R, hinge),), at)
    J_q, names = passive_jacobian(leg, at)
    turn, slide = R[:, 2], R[:, 1]
    assert np.allclose(J_q[:, 0], np.concatenate([np.cross(turn, at - point), turn]), atol=1e-15)
    assert np.allclose(J_q[:, 1], np.concatenate([slide, np.zeros(3)]), atol=1e-15)
    assert names == ("hinge.free[0]", "hinge.free[1]")


def test_telescope_is_as_long_as_its_beams():
    rng = np.random.default_rng(5)
    element = random_element("telescope of two", rng)
    assert isinstance(element, rs.Telescope)
    chain = rs.Chain((element,))
    for extension in (0.3, 0.7):
        placed = place_chain(chain, np.array([extension]), np.eye(3), np.zeros(3))
        assert np.allclose(placed.p, (element.fixed_length + extension) * element.direction)
        springs = [e for e in placed.elements if isinstance(e, PlacedSpring)]
        lengths = [beam.fixed + beam.share * extension for beam in element.beams]
        # L / EA along the beam
        axial = [float(s.elasticity.compliance[0, 0]) for s in springs]
        assert np.allclose(axial, np.array(lengths) / (STEEL.E * BAR.A), rtol=1e-12)


def test_rigid_parts_change_no_elasticity():
    beam = rs.beam_link(np.array([0.5, 0, 0]), STEEL, BAR, y_axis=np.array([0, 1.0, 0]))
    part = rs.Rigid(Frame(np.eye(3), np.array([0.0, 0.0, 0.4])))
    plain = place_chain(rs.Chain((beam,)), np.zeros(0), np.eye(3), np.zeros(3))
    longer = place_chain(rs.Chain((beam, part)), np.zeros(0), np.eye(3), np.zeros(3))
    at = np.array([0.1, 0.2, 0.3])
    legs = [PlacedLeg("leg", placed.elements, placed.p) for placed in (plain, longer)]
    assert np.array_equal(leg_compliance(legs[0], at), leg_compliance(legs[1], at))

"""Laws of equilibria: small loads, rates, order, frame and unit."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import elasticity_from_stiffness
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.model import Actuated, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.spatial.rotation import matrix_of_rotation
from robostiff.statics.chains.moving_chain import FURTHEST_TURN, FiniteTurn
from tests.campaign.ways import in_frame
from tests.cases.metric import distance
from tests.files import text_of
from tests.statics.robots_under_load import beam_legs, case, loaded

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


def asymmetric() -> Snapshot:
    """A posture without symmetry, from LP1, with a moment and forces on a leg."""
    return beam_legs(case("LP1_gough_stewart_b_beams"))


LOADS = {
    "leg2/s2": rs.DeadForce([300, -2000, 900]),
    "leg5/j1": rs.DeadForce([-500, 0, 4000], [0.1, 0.2, 0.3]),
    "platform": [rs.DeadForce([0, 0, -9e3], [0.2, 0, 0.8])],
}
WRENCH = np.array([3e4, -1e4, -2e5, 1e3, 0, 2e3])


def test_K_total_is_the_rate_of_more_load():
    robot = asymmetric()
    loads = {**LOADS, "platform": rs.DeadForce([0, 0, -9e4], [0.4, 0, 1.8])}
    answer = loaded(robot, wrench=WRENCH, loads=loads)
    assert distance(answer.K_total, answer.K) > 1e-5
    h = 20.0
    for i in (1, 5):
        ends = [loaded(robot, wrench=WRENCH + s * h * np.eye(6)[i], loads=loads) for s in (1, -1)]
        R = [Rotation.from_rotvec(end.displacement[3:]) for end in ends]
        turn = (R[0] * R[1].inv()).as_rotvec()
        shift = ends[0].displacement[:3] - ends[1].displacement[:3]
        pull = answer.K_total @ np.concatenate([shift, turn]) / (2 * h)
        assert np.allclose(pull, np.eye(6)[i], atol=1e-7)


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


def test_the_frame_does_not_matter():
    """Nor does the unit, see below."""
    robot = asymmetric()
    Q = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    other = in_frame(robot, Q, np.array([0.4, -2, 1.0]), 1.0)
    B = np.kron(np.eye(2), Q)
    one, two = loaded(robot, wrench=WRENCH), loaded(other, wrench=B @ WRENCH)
    assert distance(two.K, B @ one.K @ B.T) < 1e-9
    assert np.isclose(two.margin, one.margin, rtol=1e-7)


HEAD = text_of("tilting-head.yaml")
PUSH = np.array([100.0, 40.0, -160.0, 6.0, 8.0, 4.0])


def head(s: float, f: float) -> Any:
    document = parse_document(HEAD, file="head.yaml")
    return model_from_document(document, {"size": str(s), "force": str(f)})


@pytest.mark.filterwarnings("ignore::robostiff.errors.PlausibilityWarning")
@pytest.mark.parametrize(("s", "f"), [(1e-4, 1e4), (1e-2, 1e-4), (30, 1), (1e3, 1e-4)])
def test_equilibria_and_modes(s, f):
    lengths, forces = np.repeat([s, 1.0], 3), f * np.repeat([s**2, s**3], 3)
    here = rs.equilibrium(head(1, 1), wrench=PUSH)
    there = rs.equilibrium(head(s, f), wrench=forces * PUSH)
    assert there.status is here.status is rs.Status.OK
    np.testing.assert_allclose(there.displacement / lengths, here.displacement, rtol=1e-7)
    assert there.margins == pytest.approx(here.margins, rel=1e-7)
    K = there.K / np.outer(forces, 1 / lengths)
    np.testing.assert_allclose(K, here.K, atol=1e-7 * np.max(here.K))
    here, there = rs.modes(head(1, 1)), rs.modes(head(s, f))
    frequencies = there.frequencies[:6] * s / np.sqrt(f)
    np.testing.assert_allclose(frequencies, here.frequencies[:6], rtol=1e-7)


def test_turns_have_one_value_on_both_sides_of_where_series_end():
    axis = np.array([[0.36, 0.48, 0.8]])
    inside, outside = (axis * FURTHEST_TURN * (1 + s * 1e-13) for s in (-1, 1))
    near, far = FiniteTurn.of(inside), FiniteTurn.of(outside)
    assert near.factors == pytest.approx(far.factors, rel=1e-10)
    assert near.R == pytest.approx(matrix_of_rotation(inside), abs=1e-15)
    assert far.R == pytest.approx(matrix_of_rotation(outside), abs=1e-15)

"""Kernels of cable robots: tensions by an enumeration of limits, K by the energy in 40 digits."""

import itertools
import pickle
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import robostiff as rs
from robostiff.cables import structure_matrix, weight_wrench
from robostiff.frozen import replace
from robostiff.spatial import Space
from tests.cables.machines import random_robot

ARRAYS = rs.Backend.ARRAYS
BOXES = {
    "cable-8": ([-0.6, -0.6, 0.4, -0.1, -0.1, -0.1], [0.6, 0.6, 1.8, 0.1, 0.1, 0.1]),
    "cable-8-suspended": ([-6, -4, 0.5, -0.1, -0.1, -0.1], [6, 4, 4.5, 0.1, 0.1, 0.1]),
    "cable-4-planar": ([0.2, 0.2, -0.4], [1.8, 1.3, 0.4]),
}


def changed(name: str, seed: int) -> rs.CableRobot:
    """A shipped robot without its symmetry, with other limits, and another aim of its tensions."""
    robot, random = rs.load(name), np.random.default_rng(seed)
    in_space = np.array([1.0, 1.0, float(robot.space is Space.SPATIAL)])
    cables = tuple(
        replace(
            cable,
            exit_point=cable.exit_point + 0.05 * random.uniform(-1, 1, 3) * in_space,
            attachment=cable.attachment + 0.01 * random.uniform(-1, 1, 3) * in_space,
            guide_length=random.uniform(0, 1),
            least_tension=[20.0, 0.0, 5.0][seed % 3],
            greatest_tension=np.inf if seed % 5 == 4 else cable.greatest_tension,
        )
        for cable in robot.cables
    )
    level = 0.0 if seed % 5 == 4 else [0.0, 0.2, 0.7][seed // 3 % 3]
    return replace(robot, cables=cables, tension_level=level)


def poses(name: str, seed: int, count: int) -> np.ndarray:
    low, high = BOXES[name]
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def by_enumeration(
    W: np.ndarray, F: np.ndarray, low: np.ndarray, high: np.ndarray, level: float
) -> np.ndarray | None:
    """Tensions nearest to the aim: every set of cables at limits is tried, m of them too many."""
    n, m = W.shape
    aim = low + level * (high - low) if level else low
    best: np.ndarray | None = None
    for count in range(m - n + 1):
        for chosen in itertools.combinations(range(m), count):
            for sides in itertools.product((low, high), repeat=count):
                t = aim.copy()
                for i, side in zip(chosen, sides, strict=True):
                    t[i] = side[i]
                free = [i for i in range(m) if i not in chosen]
                if not np.all(np.isfinite(t)):
                    continue
                t[free] -= np.linalg.lstsq(W[:, free], W @ t + F, rcond=None)[0]
                balanced = np.abs(W @ t + F).max() < 1e-9 * (1 + np.abs(F).max())
                within = np.all((t >= low - 1e-9) & (t <= high + 1e-9))
                if balanced and within:
                    nearer = best is None or np.sum((t - aim) ** 2) < np.sum((best - aim) ** 2)
                    best = t if nearer else best
    return best


@pytest.mark.parametrize("name", BOXES)
@pytest.mark.parametrize("seed", range(6))
def test_kernels_answer_as_the_direct_form(name: str, seed: int) -> None:
    """Matrix, rank, and every status, also where the record proves that no tensions exist."""
    robot, at = changed(name, seed), poses(name, seed, 500)
    outputs = [rs.StiffnessMatrix(), rs.TensionsOf(robot.cable_names)]
    fast = rs.compile(robot, outputs, backend=ARRAYS)
    own, direct = fast.evaluate(at, again=False), rs.stiffness(robot, at)
    sure = ~own.guarded
    assert fast.verified
    assert np.mean(sure) > 0.9
    assert np.array_equal(own.status_codes[sure], direct.status_codes[sure])
    assert np.array_equal(own.rank[sure], direct.rank[sure])
    rows = sure & direct.answered
    K, d = direct.matrix[rows], np.sqrt(np.einsum("nii->ni", direct.matrix[rows]))
    assert np.max(np.abs(own.matrix[rows] - K) / (d[:, :, None] * d[:, None, :])) < 1e-12
    assert not np.signbit(own.values["tensions"][rows]).any()
    scale = direct.tensions[rows].max(axis=-1, keepdims=True)  # Newton's method ends at 1e-13
    assert np.max(np.abs(own.values["tensions"][rows] - direct.tensions[rows]) / scale) < 1e-11
    assert np.isnan(own.values["tensions"][sure & ~direct.answered]).all()
    whole = fast.evaluate(at)
    assert np.array_equal(whole.status_codes, direct.status_codes)


@pytest.mark.parametrize(("name", "seed"), [("cable-8", 1), ("cable-8", 3), ("cable-4-planar", 6)])
def test_tensions_are_those_of_an_enumeration_of_all_limits(name: str, seed: int) -> None:
    robot, at = changed(name, seed), poses(name, seed, 30)
    fast = rs.compile(robot, [rs.TensionsOf(robot.cable_names)], backend=ARRAYS)
    answer, low_high = fast.evaluate(at, again=False), robot.tension_limits
    found = rs.cable_tensions(robot, at)
    placed, kinds = found.placed, set[bool]()
    for i in np.flatnonzero(~answer.guarded).tolist():
        W, F = structure_matrix(placed[i]), weight_wrench(placed[i])
        best = by_enumeration(W, F, *low_high, robot.tension_level)
        kinds.add(best is None)
        if best is None:
            assert answer.status_codes[i] == rs.Status.INFEASIBLE
        else:
            assert answer.values["tensions"][i] == pytest.approx(best, rel=1e-8, abs=1e-7)
    assert False in kinds


def energy(robot: rs.CableRobot, R0: Any, p0: Any, slack: list[Any], x: Any) -> Any:
    """Potential energy with the reference point moved by x[:3], turned by x[3:], in mpmath."""
    angle = mp.sqrt(x[3] ** 2 + x[4] ** 2 + x[5] ** 2)
    S = mp.matrix([[0, -x[5], x[4]], [x[5], 0, -x[3]], [-x[4], x[3], 0]])
    R = mp.eye(3)
    if angle:
        R += mp.sin(angle) / angle * S + (1 - mp.cos(angle)) / angle**2 * S * S

    def moved(point: Any) -> Any:
        arm = R0 * mp.matrix([mp.mpf(float(v)) for v in point - robot.reference_point])
        centre = p0 + R0 * mp.matrix([mp.mpf(float(v)) for v in robot.reference_point])
        return centre + mp.matrix(x[:3]) + R * arm

    weight = robot.weight
    assert weight is not None
    total = -sum(
        mp.mpf(float(f)) * v for f, v in zip(weight.force, moved(weight.point), strict=True)
    )
    for cable, (k, free) in zip(robot.cables, slack, strict=True):
        end = moved(cable.attachment)
        span = [e - mp.mpf(float(v)) for e, v in zip(end, cable.exit_point, strict=True)]
        total += k * (mp.sqrt(sum(v * v for v in span)) - free) ** 2 / 2
    return total


def test_K_is_the_second_derivative_of_the_energy_in_many_digits() -> None:
    """With tensions of the kernel, springs of the model, and nothing else of this package."""
    robot = changed("cable-8", 0)
    outputs = [rs.StiffnessMatrix(), rs.TensionsOf(robot.cable_names)]
    fast, at = rs.compile(robot, outputs, backend=ARRAYS), [0.2, -0.1, 1.1, 0.05, -0.08, 0.1]
    answer = fast.evaluate(np.array(at))
    assert not answer.guarded
    with mp.workdps(40):
        r = [mp.mpf(v) for v in at[3:]]
        angle = mp.sqrt(sum(v * v for v in r))
        S = mp.matrix([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        R0 = mp.eye(3) + mp.sin(angle) / angle * S + (1 - mp.cos(angle)) / angle**2 * S * S
        p0, springs = mp.matrix([mp.mpf(v) for v in at[:3]]), []
        for cable, tension in zip(robot.cables, answer.values["tensions"], strict=True):
            end = p0 + R0 * mp.matrix([mp.mpf(float(v)) for v in cable.attachment])
            span = [e - mp.mpf(float(v)) for e, v in zip(end, cable.exit_point, strict=True)]
            length, t = mp.sqrt(sum(v * v for v in span)), mp.mpf(float(tension))
            assert cable.EA is not None
            give = 0 if cable.winch_stiffness is None else 1 / mp.mpf(cable.winch_stiffness)
            natural = (length + mp.mpf(cable.guide_length) - t * give) / (1 + t / mp.mpf(cable.EA))
            k = 1 / (natural / mp.mpf(cable.EA) + give)
            springs.append((k, length - t / k))
        h, K = mp.mpf(10) ** -10, np.empty((6, 6))
        for i, j in itertools.product(range(6), repeat=2):
            steps = []
            for a, b in itertools.product((1, -1), repeat=2):
                x = [mp.mpf(0)] * 6
                x[i] += a * h
                x[j] += b * h
                steps.append(a * b * energy(robot, R0, p0, springs, x))
            K[i, j] = float(sum(steps) / (4 * h * h))
    scale = np.sqrt(np.diag(K))
    assert np.abs(answer.matrix - K).max() > 0  # two ways
    assert np.max(np.abs(answer.matrix - K) / np.outer(scale, scale)) < 1e-11


def test_derivatives_follow_the_tensions() -> None:
    robot, rate = changed("cable-8", 4), rs.Derivative(rs.StiffnessMatrix(), "y")
    fast = rs.compile(robot, [rate], backend=ARRAYS)
    at = np.array([0.1, -0.2, 1.0, 0.02, 0.03, -0.05])
    up, down = at + 1e-6 * np.eye(6)[1], at - 1e-6 * np.eye(6)[1]
    difference = (rs.stiffness(robot, up).K - rs.stiffness(robot, down).K) / 2e-6
    answer = fast.evaluate(at)
    assert not answer.guarded
    np.testing.assert_allclose(
        answer.values["dK/dy"], difference, atol=1e-7 * np.abs(difference).max()
    )


def test_an_attachment_near_its_exit_point_is_out_of_reach() -> None:
    robot = rs.load("cable-4-planar")
    at = np.array([[0.1, -0.05, 0.0], [0.1 + 1e-12, -0.05, 0.0], [1.0, 0.75, 0.0]])
    own = rs.compile(robot, backend=ARRAYS).evaluate(at)
    assert own.guarded.tolist() == [True, True, False]
    assert own.status_codes.tolist() == rs.stiffness(robot, at).status_codes.tolist()
    assert own.status_codes[0] == rs.Status.UNREACHABLE


def test_poses_of_a_batch_without_a_compliance_are_masked() -> None:
    """They were an error, as the documents do not say."""
    robot = rs.load("cable-8")
    at = np.array([[0, 0, 1, 0, 0, 0], [0.2, 0, 1, 0, 0, 0], [0, 0, 2.2, 0, 0, 0]])
    C: Any = rs.compliance(robot, at)
    assert C.mask[:, 0, 0].tolist() == [False, False, True]
    K = rs.stiffness(robot, at[1]).K
    np.testing.assert_allclose(C[1] @ K, np.eye(6), atol=1e-9)
    with pytest.raises(rs.NoAnswerError, match="infeasible"):
        rs.compliance(robot, at[2])


def test_other_outputs_and_poses_without_an_answer() -> None:
    robot, at = rs.load("cable-8"), poses("cable-8", 0, 300)
    at[:5] = [0, 0, 1, 0, 0, 0]  # a symmetric pose
    outputs = [rs.ComplianceMatrix(), rs.WorstDeflection(), rs.PrincipalStiffness()]
    fast = rs.compile(robot, outputs, backend=ARRAYS)
    whole, direct = fast.evaluate(at), rs.stiffness(robot, at)
    rows = direct.answered
    assert 0 < rows.sum() < len(rows)
    for own in whole.values.values():
        assert np.isnan(own[~rows]).all()
        assert np.isfinite(own[rows]).all()
    C = rs.compliance(robot, at[rows])
    np.testing.assert_allclose(whole.values["compliance"][rows], C, atol=1e-12 * np.abs(C).max())
    worst = np.linalg.eigvalsh(C[:, :3, :3])[:, -1]
    np.testing.assert_allclose(whole.values["worst_deflection"][rows], worst, rtol=1e-11)


def test_given_tensions_are_kept_and_said_to_be_out_of_balance() -> None:
    robot = rs.load("cable-4-planar")
    tension = rs.cable_tensions(robot).tensions
    pairs = zip(robot.cables, tension.tolist(), strict=True)
    given = replace(robot, cables=tuple(replace(cable, tension=t) for cable, t in pairs))
    at = np.array([*poses("cable-4-planar", 0, 50), [1.0, 0.75, 0.0]])
    fast = rs.compile(given, backend=ARRAYS)
    own, direct = fast.evaluate(at, again=False), rs.stiffness(given, at)
    assert own.guarded[-1]  # at home they balance, which the direct form decides
    assert not own.guarded[:-1].any()
    assert rs.Status(int(own.status_codes[0])) & rs.Status.UNBALANCED
    assert np.array_equal(own.status_codes[:-1], direct.status_codes[:-1])
    np.testing.assert_allclose(own.matrix[:-1], direct.matrix[:-1], rtol=1e-10, atol=1e-7)
    assert fast.evaluate(at).status_codes[-1] == direct.status_codes[-1]


def test_kernels_are_kept_on_disk_pickled_and_written_as_C(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOSTIFF_CACHE", str(tmp_path))
    robot, at = rs.load("cable-4-planar"), poses("cable-4-planar", 1, 20)
    outputs = [rs.StiffnessMatrix(), rs.TensionsOf(robot.cable_names)]
    first = rs.compile(robot, outputs, backend=ARRAYS)
    assert len(list(tmp_path.glob("*.record"))) == 1
    pickled = pickle.loads(pickle.dumps(first))  # noqa: S301
    for other in (rs.compile(robot, outputs, backend=ARRAYS), pickled):
        assert np.array_equal(other.evaluate(at).matrix, first.evaluate(at).matrix)
    assert "void stiffness(" in rs.compile(robot, backend=ARRAYS).source(rs.SourceLanguage.C)


def test_one_tension_beyond_its_winch_does_not_stop_the_other_poses() -> None:
    """It was an error for all poses of a batch."""
    robot = random_robot(1, 7)
    soft = tuple(
        replace(cable, winch_stiffness=3e3, greatest_tension=np.inf) for cable in robot.cables
    )
    robot = replace(robot, cables=soft, tension_level=0.0)
    at = np.random.default_rng(0).uniform(-1, 1, (300, 6))
    tensions = rs.cable_tensions(robot, at)
    result = rs.stiffness(robot, at)
    lost = tensions.feasible & ~result.answered
    assert lost.any()
    assert result.answered.any()
    assert set(result.status_codes[lost].tolist()) == {int(rs.Status.INFEASIBLE)}
    one = rs.stiffness(robot, at[np.flatnonzero(lost)[0]])
    assert one.advice[0] == (
        "under its tension a winch deflects by more than the length of its cable"
    )


def test_what_has_no_kernel_is_refused() -> None:
    robot = rs.load("cable-8")
    with pytest.raises(rs.NoAnswerError, match="3 cables balance its weight at single poses"):
        rs.compile(rs.load("cable-3-suspended"))
    with pytest.raises(rs.InputError, match="cable_response"):
        rs.compile(robot, [rs.DeflectionUnder([1, 0, 0, 0, 0, 0])])
    with pytest.raises(rs.InputError, match="none: a cable robot has numbers alone"):
        rs.compile(robot, parameters=("EA",))
    with pytest.raises(rs.InputError, match="cable1, cable2"):
        rs.compile(robot, [rs.TensionsOf(["rope"])])
    with pytest.raises(rs.InputError, match="none: it has no cables"):
        rs.compile(rs.load("3-rpr"), [rs.TensionsOf(["rope"])])
    fast = rs.compile(robot, backend=ARRAYS)
    with pytest.raises(rs.InputError, match=r"an array \(N, 6\): x y z rx ry rz"):
        fast.evaluate(np.zeros((4, 3)))
    with pytest.raises(rs.InputError, match="got joint coordinates"):
        fast.evaluate(rs.JointCoordinates(np.zeros(8)))

"""Helical joints through every way to an answer."""
# pyright: reportAttributeAccessIssue=false, reportArgumentType=false

from inspect import signature
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic.export import python_function
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.model import Chain, Leg, Passive, PlacedFreedom, PlacedLeg, Snapshot
from robostiff.plot.displacement import motion_under
from robostiff.robots import robot_file
from robostiff.spatial import Frame, Screw
from tests.campaign.placed import slender_beam
from tests.cases.metric import apart
from tests.files import text_of

DATA = rs.plot.PictureData()
HERE = Path(__file__).parent
LEAD = 0.005  # m in one turn
H = LEAD / (2 * np.pi)
POSES = np.array([0, 0, 0.8, 0, 0, 0]) + np.random.default_rng(0).uniform(-0.15, 0.15, (6, 6))
LOAD = [100.0, 20, -500, 3, 2, 1]


def lead_screws(**options) -> rs.Robot:
    """Case B with a nut and screw in every leg for its slide, equally stiff along the leg."""
    text = robot_file("gough-stewart-b").read_text()
    slide = "type: prismatic, name: actuator, axis: z, role: actuated, stiffness: k"
    assert slide in text
    screw = "type: helical, name: actuator, axis: z, pitch: lead, role: actuated"
    text = text.replace(slide, f"{screw}, stiffness: k*(lead/(2*pi))^2")
    text = text.replace("parameters:", "parameters:\n  lead: 5 mm")
    return model_from_document(parse_document(text), **options)


def random_leg(rng: np.random.Generator, pitch: float | None, role=Passive()) -> PlacedLeg:  # noqa: B008
    """Beams, a turn, and a joint of some pitch."""
    e, other = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    joints = (
        PlacedFreedom(other, rng.normal(size=3), 0.0, "turn", Passive()),
        PlacedFreedom(e, rng.normal(size=3), pitch, "screw", role),
    )
    beams = [slender_beam(rng, name, *rng.uniform(-1, 1, (2, 3))) for name in "ab"]
    return PlacedLeg("leg", (beams[0], *joints, beams[1]), np.ones(3))


def stiffness_of(leg: PlacedLeg) -> np.ndarray:
    return rs.stiffness(Snapshot("leg", (leg,), leg.end)).K


@pytest.mark.parametrize("seed", range(4))
def test_a_fine_screw_is_a_turn_and_a_steep_one_a_slide(seed: int):
    """K differs by the pitch to the first power, and by its inverse."""
    turn, slide = (stiffness_of(random_leg(np.random.default_rng(seed), p)) for p in (0.0, None))
    for h in (1e-4, 1e-6):
        fine = stiffness_of(random_leg(np.random.default_rng(seed), h))
        steep = stiffness_of(random_leg(np.random.default_rng(seed), 1 / h))
        assert 1e-4 * h < apart(fine, turn) < 100 * h
        assert 1e-4 * h < apart(steep, slide) < 100 * h


def test_a_robot_on_lead_screws_is_as_stiff_as_one_on_slides():
    robot, slides = lead_screws(), rs.load("gough-stewart-b")
    found, expected = rs.stiffness(robot, POSES), rs.stiffness(slides, POSES)
    assert found.status.has_stiffness
    assert apart(found.K, expected.K) < 1e-11
    assert apart(rs.compile(robot).evaluate(POSES).values["K"], found.K) < 1e-9
    lengths = [q[:, 2] for q in rs.find_posture(slides, POSES).coordinates]
    angles = [q[:, 2] for q in rs.find_posture(robot, POSES).coordinates]
    assert np.min(angles) > 100 * 2 * np.pi  # a hundred turns at least
    assert H * np.array(angles) == pytest.approx(np.array(lengths), rel=1e-9)


def test_deflection_energy_and_picture_are_those_of_slides():
    robot, slides = lead_screws(), rs.load("gough-stewart-b")
    bent, expected = (
        rs.deflection(robot, POSES[0], wrench=LOAD),
        rs.deflection(slides, POSES[0], wrench=LOAD),
    )
    assert apart(bent.twist, expected.twist) < 1e-10
    shares, others = ([part.share for part in one.parts] for one in (bent, expected))
    assert shares == pytest.approx(others, rel=1e-9)
    snapshot = rs.find_posture(robot, POSES[0]).snapshot.one(0)
    motions = motion_under(snapshot, bent)
    for leg in snapshot.legs:
        (i,) = (i for i, e in enumerate(leg.elements) if e.name == "actuator")
        screw = leg.elements[i]
        before, after = (motions[f"{leg.name}/{leg.elements[k].name}"] for k in (i - 1, i))
        # of a small turn r, D is the cross product with r
        D = after.D - before.D
        turn = np.array([D[2, 1], D[0, 2], D[1, 0]]) @ screw.axis
        shift = after.displacement(screw.point) - before.displacement(screw.point)
        assert shift == pytest.approx(H * turn * screw.axis, abs=1e-15)
    # Along the screw the line is that of a slide.
    scene = rs.plot.robot(snapshot, backend=DATA)
    about = {getattr(item, "about", "") for item in scene.items}
    assert "leg1/actuator" in about


def test_formula_with_a_symbolic_pitch_and_its_export():
    """The pitch cancels, exactly: k of the angle is k (lead / 2 pi)^2."""
    names = ("k", "R", "r", "h", "lead")
    derivation = rs.derive(lead_screws(symbols=names))
    K = rs.stiffness(lead_screws()).K
    given = {"k": 1e8, "R": 0.5, "r": 0.3, "h": 0.8, "lead": LEAD}
    q = rs.find_posture(lead_screws()).coordinates
    given |= {f"q_leg{i + 1}_{j + 1}": q[i][0, j] for i in range(6) for j in range(6)}
    module: dict = {}
    exec(python_function(derivation, "K"), module)  # noqa: S102
    # These are in the closure of the legs and in the conditions, and cancel in K.
    assert {"r", "lead"}.isdisjoint(symbol.name for symbol in derivation.K.free_symbols)
    found = module["K"](**{name: given[name] for name in signature(module["K"]).parameters})
    assert apart(found, K) < 1e-10


def arm(pitch: str = "20 mm", more: str = "") -> str:
    text = text_of("screw-arm.yaml").replace("p: 20 mm", f"p: {pitch}")
    return text.replace("home: 90 deg", f"home: 90 deg{more}")


def load_arm(pitch: str = "20 mm", more: str = "", **options) -> rs.Robot:
    return model_from_document(parse_document(arm(pitch, more)), **options)


def test_an_arm_posed_by_its_joints_in_numbers_and_kernel():
    robot = load_arm()
    q = np.array([[0.3, 40.0], [-0.5, -7.0]])
    posture = rs.find_posture(robot, rs.JointCoordinates(q))
    quill = posture.snapshot.legs[0].elements[2]
    end = posture.snapshot.legs[0].end
    # 40 rad are 6.37 turns of 20 mm.
    assert end[:, 2] == pytest.approx(-0.2 + 0.02 * q[:, 1] / (2 * np.pi))
    assert quill.pitch == pytest.approx(0.02 / (2 * np.pi))
    K = rs.stiffness(robot, rs.JointCoordinates(q)).K
    fast = rs.compile(robot)
    assert apart(fast.evaluate(rs.JointCoordinates(q)).values["K"], K) < 1e-10


def test_limits_are_an_angle():
    robot = load_arm(more=", limits: [0, 4 deg*360]")
    assert robot.legs[0].chain.roles[1].limits == pytest.approx((0, 8 * np.pi))
    posture = rs.find_posture(robot, rs.JointCoordinates([0, 30.0]))
    assert "'quill' of leg 'arm' is at 1718.9 deg" in posture.complaints[0]
    inside = rs.find_posture(robot, rs.JointCoordinates([0, 20.0]))
    assert not inside.complaints


def test_a_platform_pose_of_an_arm_keeps_the_turns_of_its_screw():
    """An angle of a screw is not brought near to home: there the platform would be elsewhere."""
    robot = load_arm()
    q = np.array([0.3, 15.0])
    pose = rs.find_posture(robot, rs.JointCoordinates(q)).pose
    found = rs.find_posture(robot, pose, near=rs.JointCoordinates([0.25, 14.0]))
    assert np.ravel(found.coordinates[0]) == pytest.approx(q, abs=1e-8)


def test_a_free_screw_is_reported_as_one():
    leg = Leg(
        "leg",
        Frame.identity(),
        Chain(
            (
                rs.helical([0, 0, 1], 0.01, Passive()),
                rs.beam_link([0, 0, 1], rs.material("steel"), rs.circle(0.02)),
            )
        ),
        Frame.identity(),
    )
    (free,) = rs.stiffness(rs.Robot("jack", (leg,))).free_motions
    assert str(free) == "screw motion about z through (0, 0, 1) m, 1.592 mm per radian"
    assert isinstance(free.screw, Screw)
    assert free.screw.pitch == pytest.approx(0.01 / (2 * np.pi))

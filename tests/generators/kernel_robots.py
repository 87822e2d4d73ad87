"""Robots that try a compiled robot hard."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.model import (
    Branch,
    Coordinate,
    Element,
    Joint,
    ParallelBlock,
    beam_axes,
    parallelogram,
)
from robostiff.spatial import Frame, Space
from tests.generators.elements import BAR, ROD, STEEL, shift_by
from tests.generators.legs import platform_at, random_leg
from tests.generators.machines import DRIVE, FREE, X, Y, Z, case_b, elbow_arm, five_bar, turned

TRANSLATIONS = (Coordinate.X, Coordinate.Y, Coordinate.Z)
IN_PLANE = (Coordinate.X, Coordinate.Y, Coordinate.RZ)


def sps_hexapod() -> rs.Robot:
    """A hexapod whose legs may spin about themselves."""
    return replace(_with_first(case_b(), rs.spherical(FREE)), name="SPS")


def six_upu() -> rs.Robot:
    """Six legs UPU whose outer axes stay parallel: a platform that does not turn.

    It is over-constrained: each leg holds the platform by a couple too.
    """
    legs = []
    for i in range(6):
        angle = np.pi * i / 3 + 0.2
        turn = np.array([0, 0, angle])
        radial = np.array([np.cos(angle), np.sin(angle), 0])
        chain = rs.Chain((rs.universal(Y, X, FREE), _telescope(ROD), rs.universal(X, Y, FREE)))
        base, end = turned(turn, 0.5 * radial), turned(turn, 0.2 * radial)
        legs.append(rs.Leg(f"leg{i}", base, chain, end))
    home = shift_by(0, 0, 0.6)
    return rs.Robot("6-UPU", tuple(legs), home=home, coordinates=TRANSLATIONS)


def rigid_cranks() -> rs.Robot:
    """A planar 3-RRR of rigid links: near a dead point its elastic motors hold it rigidly."""
    legs = []
    for i in range(3):
        angle = 2 * np.pi * i / 3
        turn = np.array([0, 0, angle + np.pi])
        radial = np.array([np.cos(angle), np.sin(angle), 0])
        link = rs.Rigid(shift_by(0.35, 0, 0))
        chain = rs.Chain(
            (
                rs.revolute(Z, rs.Actuated(2e4), home=[0.9]),
                link,
                rs.revolute(Z, FREE, home=[-1.5]),
                link,
                rs.revolute(Z, FREE),
            )
        )
        home = shift_by(*(0.1 * radial))
        legs.append(rs.Leg(f"leg{i}", turned(turn, 0.5 * radial), chain, home, rs.Elbow.PLUS))
    return _planar("rigid cranks", legs, shift_by(0, 0, 0))


def flat_struts() -> rs.Robot:
    """A planar 3-RPR whose legs are all parallel at home, which says nothing of other poses."""
    legs = []
    for i, (a, b, h) in enumerate(((-0.4, -0.4, 0.0), (0.1, 0.1, 0.15), (0.5, 0.5, -0.1))):
        chain = rs.Chain(
            (rs.revolute(Z, FREE), rs.prismatic(Y, DRIVE, home=[0.6]), rs.revolute(Z, FREE))
        )
        legs.append(rs.Leg(f"leg{i}", shift_by(a, 0, 0), chain, shift_by(b, h, 0)))
    return _planar("flat struts", legs, shift_by(0, 0.6, 0))


def stiff_and_soft() -> rs.Robot:
    """A hexapod whose actuators differ by ten decades."""
    sizes = 10.0 ** np.linspace(2, 12, 6)
    return _changed(
        case_b(),
        "stiff and soft",
        rs.Telescope,
        lambda i, e: replace(e, role=rs.Actuated(float(sizes[i]))),
    )


def thin_legs() -> rs.Robot:
    """A hexapod of wires: ten million times as compliant in bending as in tension."""
    wire = rs.TelescopicBeam(STEEL, rs.circle(0.0004), share=1.0)
    return _changed(
        case_b(),
        "thin legs",
        rs.Telescope,
        lambda _, e: replace(e, beams=(wire,), role=rs.Actuated()),
    )


def skewed_hexapod() -> rs.Robot:
    """A hexapod whose universal joints have axes that are not square, and bars for legs."""
    telescope = _telescope(BAR)
    robot = _changed(case_b(), "skewed", rs.Telescope, lambda _, e: telescope)
    return _with_first(robot, rs.universal([1, 0.2, 0.1], [0, 1, 0.1], FREE))


def of_random_legs(kind: str) -> rs.Robot:
    """A hexapod on six legs of a kind, each at random, and at home where all of them are."""
    legs = []
    for seed in range(6):
        case = random_leg(kind, seed)
        here = platform_at(case.leg, case.leg.chain.home)
        home = Frame(here.rotation.as_matrix(), here.translation)
        legs.append(replace(case.leg, name=f"leg{seed}", base=home.inverse @ case.leg.base))
    return rs.Robot(kind, tuple(legs), home=Frame.identity())


def _planar(name: str, legs: list[rs.Leg], home: Frame) -> rs.Robot:
    return rs.Robot(name, tuple(legs), home=home, coordinates=IN_PLANE, space=Space.PLANAR)


def _changed(
    robot: rs.Robot, name: str, kind: type, change: Callable[[int, Any], Element]
) -> rs.Robot:
    """The robot with other elements in place of those of a kind, by the number of their leg."""
    legs = []
    for i, leg in enumerate(robot.legs):
        elements = (change(i, e) if isinstance(e, kind) else e for e in leg.chain.elements)
        legs.append(replace(leg, chain=rs.Chain(tuple(elements))))
    return replace(robot, name=name, legs=tuple(legs))


def _with_first(robot: rs.Robot, joint: Joint) -> rs.Robot:
    """The robot with another joint at the base of each leg."""
    first = {id(leg.chain.elements[0]) for leg in robot.legs}
    return _changed(robot, robot.name, Joint, lambda _, e: joint if id(e) in first else e)


def _telescope(section: rs.CrossSection, home: float | None = None) -> rs.Telescope:
    """A driven beam along z, all of which is as long as the leg."""
    beam = rs.TelescopicBeam(STEEL, section, share=1.0)
    return rs.Telescope(Z, (beam,), beam_axes(Z, None), DRIVE, home)


def drives_only_arm() -> rs.Robot:
    """A serial arm of rigid links and elastic drives, singular wherever an axis is lost."""
    return elbow_arm(elastic_links=False)


def spherical_joint_arm() -> rs.Robot:
    """A serial arm with a passive joint in its middle."""
    return _changed(
        elbow_arm(),
        "arm with a free joint",
        Joint,
        lambda _, e: replace(e, role=FREE) if e.name == "j5" else e,
    )


def _pinned_bar(length: float) -> rs.Chain:
    """A bar along y between two pins about z."""
    bar = rs.beam_link([0, length, 0], STEEL, BAR, y_axis=Z)
    return rs.Chain(
        (rs.revolute(Z, FREE, name="near pin"), bar, rs.revolute(Z, FREE, name="far pin"))
    )


def four_bar() -> ParallelBlock:
    """Two bars of different lengths side by side."""
    left = Branch("left", shift_by(-0.1, 0, 0), _pinned_bar(0.3), shift_by(-0.1, 0, 0))
    right = Branch("right", shift_by(0.1, 0, 0), _pinned_bar(0.35), shift_by(0.1, 0.05, 0))
    return ParallelBlock((left, right), "four-bar")


def parallelogram_of_parallelograms() -> ParallelBlock:
    """Two bars, each of them two bars."""
    inner = parallelogram(_pinned_bar(0.3), 0.04 * X, name="inner")
    return parallelogram(rs.Chain((inner,)), 0.2 * X, name="outer")


def planar_legs_with(block: Callable[[], ParallelBlock]) -> rs.Robot:
    """Three planar legs: a slide, a parallel block and a pinned rod."""
    legs = []
    for i in range(3):
        base = turned(np.array([0, 0, 2 * np.pi * i / 3]), np.zeros(3))
        rod = rs.beam_link([0.15, 0.3, 0], STEEL, BAR, y_axis=Z)
        chain = rs.Chain((rs.prismatic(Y, DRIVE), block(), rs.revolute(Z, FREE, name="elbow"), rod))
        start = Frame(base.R, base.R @ np.array([-0.15, -0.75, 0]))
        legs.append(
            rs.Leg(f"leg{i}", start, chain, Frame(base.R, base.R @ np.array([0, -0.15, 0])))
        )
    return _planar(block().name, legs, shift_by(0, 0, 0))


def pairs_of_struts() -> rs.Robot:
    """Three pairs of struts, parallel at home: where the platform turns, they are no copies."""
    legs = []
    for i in range(3):
        base = turned(np.array([0, 0, 2 * np.pi * i / 3]), np.zeros(3))
        strut = rs.Chain((rs.universal(Y, X, FREE), _telescope(ROD, 0.6), rs.spherical(FREE)))
        chain = rs.Chain((parallelogram(strut, 0.2 * Y, name="pair"),))
        start, end = (Frame(base.R, size * base.R[:, 0]) for size in (0.4, 0.25))
        legs.append(rs.Leg(f"leg{i}", start, chain, end))
    return rs.Robot("pairs of struts", tuple(legs), home=shift_by(0, 0, 0.6))


HAND_MADE: dict[str, Callable[[], rs.Robot]] = {
    "case b with limits": lambda: case_b(limits=(0.45, 0.9)),
    "SPS": sps_hexapod,
    "6-UPU": six_upu,
    "five-bar": lambda: replace(five_bar(), coordinates=IN_PLANE),
    "rigid cranks": rigid_cranks,
    "flat struts": flat_struts,
    "stiff and soft": stiff_and_soft,
    "thin legs": thin_legs,
    "skewed": skewed_hexapod,
    "elbow arm": elbow_arm,
    "drives only": drives_only_arm,
    "free joint": spherical_joint_arm,
    "four-bar legs": lambda: planar_legs_with(four_bar),
    "nested parallelograms": lambda: planar_legs_with(parallelogram_of_parallelograms),
    "pairs of struts": pairs_of_struts,
}


#: Legs that no other robot has.
KINDS_OF_LEGS = ("UCU", "SPU", "RSU")


def robot_called(name: str) -> rs.Robot:
    """A hand-made robot, one of random legs, or a shipped one."""
    if name in HAND_MADE:
        return HAND_MADE[name]()
    if name in KINDS_OF_LEGS:
        return of_random_legs(name)
    robot = rs.load(name)
    if not isinstance(robot, rs.Robot):
        raise TypeError(name)
    return robot


ALL_ROBOTS = (*HAND_MADE, *KINDS_OF_LEGS, *rs.shipped_robots())

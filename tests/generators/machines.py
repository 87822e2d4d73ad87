"""A few whole robots: hexapod, zero-torsion tripods, a planar five-bar, serial arms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.model import Coordinate, Element, beam_axes
from robostiff.spatial import Frame, Space
from tests.generators.elements import BAR, ROD, STEEL, shift_by

X, Y, Z = np.eye(3)
FREE = rs.Passive()
DRIVE = rs.Actuated(2e7)


def turned(rotvec: np.ndarray, point: np.ndarray) -> Frame:
    """A frame at a point, turned."""
    return Frame(Rotation.from_rotvec(rotvec).as_matrix(), point)


def hexapod(
    base_angles: Sequence[float],
    platform_angles: Sequence[float],
    R: float = 0.5,
    r: float = 0.2,
    h: float = 0.6,
    limits: tuple[float, float] | None = None,
) -> rs.Robot:
    """A Stewart-Gough platform with UPS legs of one beam each."""
    legs = []
    beam = rs.TelescopicBeam(STEEL, ROD, share=1.0)
    for i, (phi, psi) in enumerate(
        zip(np.radians(base_angles), np.radians(platform_angles), strict=True)
    ):
        A = R * np.array([np.cos(phi), np.sin(phi), 0])
        B = r * np.array([np.cos(psi), np.sin(psi), 0])
        chain = rs.Chain(
            (
                rs.universal(X, Y, FREE, name="U"),
                rs.Telescope(Z, (beam,), beam_axes(Z, None), rs.Actuated(2e7, limits), name="P"),
                rs.spherical(FREE, name="S"),
            )
        )
        legs.append(rs.Leg(f"leg{i + 1}", shift_by(*A), chain, shift_by(*B)))
    return rs.Robot("hexapod", tuple(legs), home=shift_by(0, 0, h))


def case_b(**sizes) -> rs.Robot:
    """The regular platform of case B."""
    return hexapod([0, 120, 120, 240, 240, 360], [60, 60, 180, 180, 300, 300], **sizes)


def case_a(**sizes) -> rs.Robot:
    """The degenerate platform of case A."""
    angles = [0, 60, 120, 180, 240, 300]
    return hexapod(angles, angles, **sizes)


def tripod(kind: str = "RPS") -> rs.Robot:
    """Three legs RPS or PRS, posed by z, rx and ry: x, y and rz follow.

    Each leg's turn is about a tangent, so its ball stays in a vertical plane through the middle.
    """
    legs = []
    for i in range(3):
        angle = 2 * np.pi * i / 3
        turn = np.array([0, 0, angle])
        radial = np.array([np.cos(angle), np.sin(angle), 0])
        if kind == "RPS":
            beam = rs.TelescopicBeam(STEEL, ROD, share=1.0)
            chain = rs.Chain(
                (
                    rs.revolute(Y, FREE, name="R"),
                    rs.Telescope(Z, (beam,), beam_axes(Z, None), DRIVE, name="P"),
                    rs.spherical(FREE, name="S"),
                )
            )
        else:
            rod = np.array([-0.3, 0, 0.4])
            chain = rs.Chain(
                (
                    rs.prismatic(Z, DRIVE, home=[0.1], name="P"),
                    rs.revolute(Y, FREE, name="R"),
                    rs.beam_link(rod, STEEL, ROD),
                    rs.spherical(FREE, name="S"),
                )
            )
        home = turned(turn, 0.2 * radial)
        legs.append(rs.Leg(f"leg{i + 1}", turned(turn, 0.5 * radial), chain, home))
    return rs.Robot(
        kind,
        tuple(legs),
        home=shift_by(0, 0, 0.5),
        coordinates=(Coordinate.Z, Coordinate.RX, Coordinate.RY),
    )


def five_bar() -> rs.Robot:
    """Two RRR legs in the plane; a platform with a turn that the second leg leaves free."""
    legs = []
    for name, x, bend in (("left", -0.3, 0.4), ("right", 0.3, -0.4)):
        chain = rs.Chain(
            (
                rs.revolute(Z, rs.Actuated(5e4), home=[bend], name="drive"),
                rs.beam_link(0.5 * Y, STEEL, BAR, y_axis=X),
                rs.revolute(Z, FREE, home=[-2 * bend], name="knee"),
                rs.beam_link(0.5 * Y, STEEL, BAR, y_axis=X),
                rs.revolute(Z, FREE, name="wrist"),
            )
        )
        legs.append(rs.Leg(name, shift_by(x, 0, 0), chain, shift_by(0.0, 0, 0)))
    return rs.Robot("five-bar", tuple(legs), home=shift_by(0, 0.8, 0), space=Space.PLANAR)


def elbow_arm(elastic_links: bool = True, drives: float | None = 1e5) -> rs.Robot:
    """A serial arm with six turns."""
    role = rs.Actuated(drives)
    upper = (0.45 * Z, 0.4 * Z)

    def link(to: np.ndarray) -> Element:
        return rs.beam_link(to, STEEL, ROD) if elastic_links else rs.Rigid(shift_by(*to))

    chain = rs.Chain(
        (
            rs.revolute(Z, role, name="j1"),
            rs.Rigid(shift_by(0.05, 0, 0.3)),
            rs.revolute(Y, role, home=[0.3], name="j2"),
            link(upper[0]),
            rs.revolute(Y, role, home=[1.2], name="j3"),
            link(upper[1]),
            rs.revolute(Z, role, home=[0.2], name="j4"),
            rs.revolute(Y, role, home=[0.5], name="j5"),
            rs.revolute(Z, role, home=[-0.1], name="j6"),
            rs.Rigid(shift_by(0, 0, 0.1)),
        )
    )
    leg = rs.Leg("arm", shift_by(0, 0, 0), chain, shift_by(0, 0, 0))
    return rs.Robot("elbow arm", (leg,))

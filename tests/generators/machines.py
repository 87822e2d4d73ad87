"""A few whole robots: a hexapod, a planar five-bar, serial arms."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.model import Element, beam_axes
from robostiff.spatial import Frame, Space
from tests.generators.elements import BAR, ROD, STEEL, shift_by

X, Y, Z = np.eye(3)
FREE = rs.Passive()
DRIVE = rs.Actuated(2e7)


def turned(rotvec: np.ndarray, point: np.ndarray) -> Frame:
    """A frame at a point, turned."""
    return Frame(Rotation.from_rotvec(rotvec).as_matrix(), point)


def case_b(limits: tuple[float, float] | None = None) -> rs.Robot:
    """The regular platform of case B, with UPS legs of one beam and an elastic drive each."""
    legs = []
    beam = rs.TelescopicBeam(STEEL, ROD, share=1.0)
    angles = np.radians([[0, 120, 120, 240, 240, 360], [60, 60, 180, 180, 300, 300]])
    for i, (phi, psi) in enumerate(angles.T):
        chain = rs.Chain(
            (
                rs.universal(X, Y, FREE, name="U"),
                rs.Telescope(Z, (beam,), beam_axes(Z, None), rs.Actuated(2e7, limits), name="P"),
                rs.spherical(FREE, name="S"),
            )
        )
        foot, head = (np.array([np.cos(own), np.sin(own), 0]) for own in (phi, psi))
        legs.append(rs.Leg(f"leg{i + 1}", shift_by(*0.5 * foot), chain, shift_by(*0.2 * head)))
    return rs.Robot("hexapod", tuple(legs), home=shift_by(0, 0, 0.6))


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

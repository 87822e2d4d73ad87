"""Random legs of every kind that closes in closed form, with homes and reachable poses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.kinematics import place_chain
from robostiff.model import Element, Joint, JointKind, Role, beam_axes
from robostiff.spatial import Frame
from tests.generators.elements import ROD, STEEL, random_transform

DRIVE = rs.Actuated(1e7)
FREE = rs.Passive()


@dataclass(frozen=True)
class LegCase:
    """A leg, its home pose, and coordinates that place its end."""

    leg: rs.Leg
    home_pose: np.ndarray

    def pose_at(self, q: np.ndarray) -> np.ndarray:
        """Platform pose (x, y, z, rotation vector) at leg coordinates."""
        return six(platform_at(self.leg, q))

    @property
    def robot(self) -> rs.Robot:
        turn = Rotation.from_rotvec(self.home_pose[3:])
        home = Frame(turn.as_matrix(), self.home_pose[:3])
        return rs.Robot("one leg", (self.leg,), home=home)


def six(pose: RigidTransform) -> np.ndarray:
    """Pose coordinates of a transform."""
    return np.concatenate([pose.translation, pose.rotation.as_rotvec()])


def platform_at(leg: rs.Leg, q: np.ndarray) -> RigidTransform:
    """Platform frame that a leg's coordinates put it in."""
    R_base, p_base = leg.base.R, leg.base.p
    placed = place_chain(leg.chain, q, R_base, p_base)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = placed.R, placed.p
    return RigidTransform.from_matrix(T) * leg.attachment.inverse.rigid_transform


def random_slider(rng: np.random.Generator, along: np.ndarray, home: float) -> Element:
    """A telescope with one beam, or a rigid one, or a plain prismatic joint."""
    kind = rng.integers(3)
    if kind == 0:
        return rs.prismatic(along, DRIVE, home=[home])
    beams = (rs.TelescopicBeam(STEEL, ROD, share=1.0, fixed=0.2),) if kind == 1 else ()
    return rs.Telescope(along, beams, beam_axes(along, None), DRIVE, home=home)


def two_axes(
    rng: np.random.Generator, along: np.ndarray, skewed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Axes of a universal joint whose last is across a rod; at right angles unless `skewed`."""
    last = np.cross(along, rng.normal(size=3))
    last = last / np.linalg.norm(last)
    first = np.cross(last, along)
    if skewed:
        first, last = first + 0.3 * rng.normal(size=3), last + 0.2 * along
    return first, last


def _skewed_or_not(
    rng: np.random.Generator, along: np.ndarray, role: Role, home: list[float]
) -> Joint:
    first, last = two_axes(rng, along, bool(rng.integers(2)))
    return rs.universal(first, last, role, home=home)


def _joint(letter: str, rng: np.random.Generator, along: np.ndarray, role: Role = FREE) -> Element:
    a = rng.uniform(-0.5, 0.5, 3).tolist()
    match letter:
        case "S":
            return rs.spherical(role, home=a)
        case "U":
            return _skewed_or_not(rng, along, role, a[:2])
        case "u":  # the platform side: its first axis is across the rod
            second, first = two_axes(rng, along, False)
            return rs.universal(first, second, role, home=a[:2])
        case _:
            return rs.revolute(rng.normal(size=3), role, home=a[:1])


def _unit(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


STRUTS = ("UPS", "SPS", "UPU", "UCU", "SPU")
RODS = ("PUU", "PUS", "PSU", "RUU", "RUS", "RSU")
PLANAR = ("RPR", "RRR", "PRR")
SLIDING = ("PRRR", "CRR")
POSTS = ("S", "U", "R")
SCREWS = ("UHS", "SHU")  # closed by Newton's method


def random_leg(kind: str, seed: int) -> LegCase:
    """A leg of a kind, somewhere and at any angle; the first letter is next to the base."""
    rng = np.random.default_rng([seed, *kind.encode()])
    if kind in PLANAR:
        elements = _planar_elements(kind, rng)
    elif kind in SLIDING:
        elements = _sliding_elements(kind, rng)
    elif kind in POSTS:
        elements = [
            rs.beam_link(0.4 * _unit(rng), STEEL, ROD),
            _joint(kind, rng, _unit(rng), FREE if kind == "S" else DRIVE),
            rs.beam_link(0.1 * _unit(rng), STEEL, ROD),
        ]
    elif kind in (*STRUTS, *SCREWS):
        along = _unit(rng)
        elements = [_joint(kind[0], rng, along)]
        elements.append(random_slider(rng, along, rng.uniform(0.5, 0.9)))
        if kind[1] == "C":
            elements[-1] = rs.cylindrical(along, FREE, home=[rng.uniform(0.5, 0.9), 0.3])
            elements.append(rs.beam_link(0.2 * along, STEEL, ROD))
        elif kind[1] == "H":
            pitch = 10 ** rng.uniform(-2.3, -0.5) * rng.choice([-1, 1])
            turns = rng.uniform(0.5, 0.9) / pitch
            elements[-1] = rs.helical(along, pitch, DRIVE, home=[2 * np.pi * turns])
        elements.append(_joint(kind[2].replace("U", "u"), rng, along))
    else:
        along = _unit(rng)
        if kind[0] == "P":
            elements = [random_slider(rng, _unit(rng), rng.uniform(0.3, 0.6))]
        else:
            axis = _unit(rng)
            arm = np.cross(axis, rng.normal(size=3)) + 0.2 * axis
            elements = [
                rs.revolute(axis, DRIVE, home=[rng.uniform(-0.5, 0.5)]),
                rs.beam_link(0.3 * arm / np.linalg.norm(arm), STEEL, ROD),
            ]
        elements.append(_joint(kind[1], rng, along))
        elements.append(rs.beam_link(rng.uniform(0.6, 1.0) * along, STEEL, ROD))
        elements.append(_joint(kind[2].replace("U", "u"), rng, along))
    elements.append(rs.Rigid(random_transform(rng, 0.1)))
    if kind not in PLANAR:
        elements.insert(0, rs.Rigid(random_transform(rng, 0.2)))
    # something elastic somewhere, whatever the leg is made of
    if kind == "UCU":
        elements.append(rs.beam_link(0.05 * _unit(rng), STEEL, ROD))
    leg = rs.Leg(kind, random_transform(rng), rs.Chain(tuple(elements)), random_transform(rng, 0.2))
    return LegCase(leg, six(platform_at(leg, leg.chain.home)))


def _planar_elements(kind: str, rng: np.random.Generator) -> list[Element]:
    """Turns about z and slides across it."""
    z = [0, 0, 1]
    a = rng.uniform(-0.6, 0.6, 3).tolist()

    def in_plane(size: float) -> np.ndarray:
        angle = rng.uniform(-np.pi, np.pi)
        return size * np.array([np.cos(angle), np.sin(angle), 0.0])

    if kind == "RPR":
        return [
            rs.revolute(z, FREE, home=a[:1]),
            random_slider(rng, in_plane(1.0), rng.uniform(0.5, 0.9)),
            rs.revolute(z, FREE, home=a[1:2]),
        ]
    first: list[Element]
    if kind == "PRR":
        first = [random_slider(rng, in_plane(1.0), rng.uniform(0.3, 0.6))]
    else:
        first = [rs.revolute(z, DRIVE, home=a[2:]), rs.beam_link(in_plane(0.4), STEEL, ROD)]
    return [
        *first,
        rs.revolute(z, FREE, home=a[:1]),
        rs.beam_link(in_plane(0.7), STEEL, ROD),
        rs.revolute(z, FREE, home=a[1:2]),
    ]


def _sliding_elements(kind: str, rng: np.random.Generator) -> list[Element]:
    """A slide along the axes of three parallel turns."""
    e = _unit(rng)
    home = rng.uniform(-0.6, 0.6, 4).tolist()

    def link(size: float) -> Element:
        across = np.cross(e, _unit(rng))
        return rs.beam_link(
            size * across / np.linalg.norm(across) + rng.uniform(-0.2, 0.2) * e, STEEL, ROD
        )

    first = (
        [random_slider(rng, e, rng.uniform(0.3, 0.6)), rs.revolute(e, FREE, home=home[1:2])]
        if kind == "PRRR"
        else [rs.cylindrical(e, FREE, home=home[:2])]
    )
    turn = [rs.revolute(e, FREE, home=[h]) for h in home[2:]]
    return [*first, link(0.4), turn[0], link(0.7), turn[1]]


def near_home(case: LegCase, rng: np.random.Generator, size: float) -> np.ndarray:
    """Coordinates near those of the home configuration."""
    home = case.leg.chain.home
    return home + size * rng.uniform(-1, 1, home.size)


def with_elbow(case: LegCase, elbow: rs.Elbow) -> LegCase:
    """The same leg in a working mode by name."""
    return LegCase(replace(case.leg, elbow=elbow), case.home_pose)


def has_skewed_axes(case: LegCase) -> bool:
    """Whether the universal joint at the rod's near end cannot point it anywhere."""
    joints = [e for e in case.leg.chain.elements if isinstance(e, Joint)]
    first = next(joint for joint in joints if joint.kind is JointKind.UNIVERSAL)
    axes = [freedom.axis for freedom in first.freedoms]
    return abs(float(axes[0] @ axes[1])) > 1e-9

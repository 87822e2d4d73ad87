"""Random chains as plain matrices: springs and passive joints anywhere, at any angle.

Independent of the package, with vector products only, so that signs are checked twice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from robostiff.elasticity import Elasticity, Timoshenko
from robostiff.model import Passive, PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot

PLANE = [0, 1, 5]
LENGTH = 0.7  # metres: what a turn weighs beside a shift where a test needs a length


@dataclass(frozen=True)
class Spring:
    """A virtual spring at a point: own axes, the compliant directions, and their stiffness."""

    point: np.ndarray
    axes: np.ndarray
    directions: np.ndarray
    stiffness: np.ndarray

    @property
    def local_compliance(self) -> np.ndarray:
        C = self.directions @ np.linalg.inv(self.stiffness) @ self.directions.T
        return 0.5 * (C + C.T)

    def placed(self, name: str) -> PlacedSpring:
        """The same spring as the package knows it."""
        return PlacedSpring(name, self.point, self.axes, Elasticity(self.local_compliance))


@dataclass(frozen=True)
class Turning:
    """A passive joint; the axis need not be a unit vector.

    The pitch [m/rad] is 0 of a revolute joint, None of a prismatic one.
    """

    pitch: float | None
    point: np.ndarray
    axis: np.ndarray


@dataclass(frozen=True)
class FreeChain:
    """Springs and passive joints of a chain, fixed at one end."""

    springs: tuple[Spring, ...]
    joints: tuple[Turning, ...]
    end: np.ndarray
    planar: bool = False

    def joint_columns(self, at: np.ndarray) -> np.ndarray:
        """J_q about a point."""
        columns = np.zeros((6, len(self.joints)))
        for i, joint in enumerate(self.joints):
            if joint.pitch is None:
                columns[:3, i] = joint.axis
            else:
                columns[:3, i] = np.cross(joint.axis, at - joint.point) + joint.pitch * joint.axis
                columns[3:, i] = joint.axis
        return columns[PLANE] if self.planar else columns

    def spring_columns(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """J_theta about a point, and K_theta."""
        columns, blocks = [], []
        for spring in self.springs:
            shift, turn = spring.directions[:3], spring.directions[3:]
            world = np.vstack([spring.axes @ shift, spring.axes @ turn])
            world[:3] += np.cross(world[3:].T, at - spring.point).T
            columns.append(world)
            blocks.append(spring.stiffness)
        J = np.hstack(columns)
        K = np.zeros((J.shape[1], J.shape[1]))
        start = 0
        for block in blocks:
            stop = start + len(block)
            K[start:stop, start:stop] = block
            start = stop
        return (J[PLANE] if self.planar else J), K

    def compliance(self, at: np.ndarray) -> np.ndarray:
        """C = J_theta K_theta^-1 J_theta^T about a point, in the plane as the chain is."""
        J, K = self.spring_columns(at)
        C = J @ np.linalg.solve(K, J.T)
        return 0.5 * (C + C.T)

    def matrices(self, at: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """C and J_q about the end, or another point."""
        at = self.end if at is None else at
        return self.compliance(at), self.joint_columns(at)

    def turned(self, R: np.ndarray) -> FreeChain:
        """The same chain, turned about the origin."""
        return replace(
            self,
            springs=tuple(replace(s, point=R @ s.point, axes=R @ s.axes) for s in self.springs),
            joints=tuple(replace(j, point=R @ j.point, axis=R @ j.axis) for j in self.joints),
            end=R @ self.end,
        )

    def placed(self, name: str = "leg") -> PlacedLeg:
        """The same chain as the package knows it."""
        springs = [s.placed(f"spring{i}") for i, s in enumerate(self.springs)]
        joints = [
            PlacedFreedom(j.axis / np.linalg.norm(j.axis), j.point, j.pitch, f"joint{i}", Passive())
            for i, j in enumerate(self.joints)
        ]
        return PlacedLeg(name, (*springs, *joints), self.end)


def snapshot_of(chains: list[FreeChain], reference: np.ndarray) -> Snapshot:
    """Legs in parallel between a base and a platform."""
    legs = tuple(chain.placed(f"leg{i}") for i, chain in enumerate(chains))
    return Snapshot("random", legs, reference)


def on_rigid_links(leg: PlacedLeg) -> PlacedLeg:
    """The leg without its springs and masses, and so its branches: drives alone are elastic."""
    elements = [
        PlacedBlock(e.name, tuple(map(on_rigid_links, e.branches)))
        if isinstance(e, PlacedBlock)
        else e
        for e in leg.elements
        if not isinstance(e, PlacedSpring)
    ]
    return replace(leg, elements=tuple(elements), masses=())


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A rotation matrix, all directions alike."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q if np.linalg.det(Q) > 0 else -Q


def beam_compliance_of(
    L: float,
    EA: float,
    EIy: float,
    EIz: float,
    GJ: float,
    shear_y: float = 0.0,
    shear_z: float = 0.0,
) -> np.ndarray:
    """Tip compliance of a cantilever along x; the shear compliances are those of a length."""
    C = np.diag([L / EA, L**3 / (3 * EIz), L**3 / (3 * EIy), L / GJ, L / EIy, L / EIz])
    C[1, 5] = C[5, 1] = L**2 / (2 * EIz)
    C[2, 4] = C[4, 2] = -(L**2) / (2 * EIy)
    C[1, 1] += L * shear_y
    C[2, 2] += L * shear_z
    return C


def rigidities(m: Any, s: Any, theory: Any = None) -> tuple[float, ...]:
    """EA, EIy, EIz and GJ of a material and a section; a theory may add what shear gives."""
    own = (float(m.E * s.A), float(m.E * s.Iy), float(m.E * s.Iz), float(m.G * s.J))
    if isinstance(theory, Timoshenko):
        shear = m.G * s.A
        own = (*own, 1 / float(s.shear_factor_y * shear), 1 / float(s.shear_factor_z * shear))
    return own


def random_beam(rng: np.random.Generator) -> Spring:
    """A beam of a rectangular section in a random place and direction."""
    length = rng.uniform(0.2, 1.0)
    width, height = rng.uniform(0.02, 0.06, size=2)
    E = rng.uniform(60e9, 210e9)
    EIy, EIz = E * width * height**3 / 12, E * height * width**3 / 12
    C = beam_compliance_of(length, E * width * height, EIy, EIz, 0.5 * (EIy + EIz) / 2.6)
    K = np.linalg.inv(C)
    return Spring(rng.uniform(-1, 1, 3), random_rotation(rng), np.eye(6), 0.5 * (K + K.T))


def random_block(rng: np.random.Generator) -> Spring:
    """A spring with a full 6 x 6 stiffness matrix."""
    A = rng.normal(size=(6, 6))
    size = np.diag([1e3, 1e3, 1e3, 1e2, 1e2, 1e2]) * 10 ** rng.uniform(-0.5, 0.5)
    K = size @ (A @ A.T + 0.3 * np.eye(6)) @ size
    return Spring(rng.uniform(-1, 1, 3), random_rotation(rng), np.eye(6), 0.5 * (K + K.T))


def random_single(rng: np.random.Generator) -> Spring:
    """A spring along or about one axis only, such as an actuator's."""
    direction = np.zeros((6, 1))
    start = rng.choice([0, 3])
    direction[start] = 1.0
    k = 10 ** rng.uniform(5.5, 6.5) * (1.0 if start == 0 else 0.1)
    return Spring(rng.uniform(-1, 1, 3), random_rotation(rng), direction, np.array([[k]]))


def random_joint(rng: np.random.Generator) -> Turning:
    """A revolute joint, or a prismatic or helical one now and then."""
    return Turning(drawn_pitch(rng.uniform(), 0.25, 0.4), rng.uniform(-1, 1, 3), rng.normal(size=3))


def drawn_pitch(drawn: float, slides: float, both: float) -> float | None:
    """Of a slide with one probability, of a screw up to another, of a turn otherwise [m/rad]."""
    if drawn < slides:
        return None
    return float(4 * (drawn - slides) / (both - slides) - 2) if drawn < both else 0.0


def ball(point: np.ndarray, axes: np.ndarray) -> tuple[Turning, ...]:
    """Three turns about a point."""
    return tuple(Turning(0.0, point, axis) for axis in axes.T)


_MAKERS = {"beam": random_beam, "block": random_block, "single": random_single}
SEEDS = st.integers(0, 2**32 - 1)


@st.composite
def chains(
    draw: st.DrawFn,
    joints: st.SearchStrategy[int] | None = None,
    arrangements: tuple[str, ...] = ("general", "repeated", "two balls", "parallel", "aligned"),
    regular: bool = True,
) -> FreeChain:
    """Random chains.

    Arrangements of the joints: `general`; `repeated`, one axis occurs twice; `two balls`, whose
    common line is a redundant spin; `parallel`, four parallel axes of which one is redundant;
    `aligned`, all along the world axes. With `regular`, rank(J_theta) = 6; otherwise springs give
    way in one or a few directions only.
    """
    rng = np.random.default_rng(draw(SEEDS))
    arrangement = draw(st.sampled_from(arrangements))
    if regular:
        kinds = draw(st.lists(st.sampled_from(["beam", "block"]), min_size=1, max_size=2))
        kinds += draw(st.lists(st.just("single"), max_size=1))
    else:
        kinds = draw(st.lists(st.just("single"), min_size=2, max_size=5))
    springs = tuple(_MAKERS[kind](rng) for kind in kinds)
    number = draw(st.integers(0, 5) if joints is None else joints)
    freedoms = tuple(random_joint(rng) for _ in range(number))
    if arrangement == "repeated" and freedoms:
        again = freedoms[int(rng.integers(number))]
        along = again.point + rng.uniform(0.5, 1.0) * again.axis
        freedoms = (*freedoms, Turning(again.pitch, along, -2.0 * again.axis))
    elif arrangement == "two balls":
        p1, p2 = rng.uniform(-1, 1, (2, 3))
        freedoms = (*ball(p1, random_rotation(rng)), *ball(p2, random_rotation(rng)))
    elif arrangement == "parallel":
        axis = rng.normal(size=3)
        freedoms = tuple(Turning(0.0, rng.uniform(-1, 1, 3), axis) for _ in range(4))
    elif arrangement == "aligned":
        freedoms = tuple(replace(j, axis=np.eye(3)[rng.integers(3)]) for j in freedoms)
    order = rng.permutation(len(freedoms))
    return FreeChain(springs, tuple(freedoms[i] for i in order), rng.uniform(-1, 1, 3))


def planar_rotation(rng: np.random.Generator) -> np.ndarray:
    """A rotation about z."""
    a = rng.uniform(-np.pi, np.pi)
    return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])


def planar_chain(rng: np.random.Generator, joints: int) -> FreeChain:
    """A random chain in the x-y plane: beams, turns about z, slides across it."""
    springs = []
    for _ in range(int(rng.integers(1, 3))):
        R, point = planar_rotation(rng), np.append(rng.uniform(-1, 1, 2), 0.0)
        springs.append(replace(random_beam(rng), axes=R, point=point))
    freedoms = []
    for _ in range(joints):
        point = np.append(rng.uniform(-1, 1, 2), 0.0)
        slides = rng.uniform() < 0.3
        axis = np.append(rng.normal(size=2), 0.0) if slides else np.array([0, 0, 1.0])
        freedoms.append(Turning(None if slides else 0.0, point, axis))
    if freedoms and rng.uniform() < 0.5:
        freedoms.append(freedoms[0])
    end = np.append(rng.uniform(-1, 1, 2), 0.0)
    return FreeChain(tuple(springs), tuple(freedoms), end, planar=True)


@st.composite
def planar_chains(draw: st.DrawFn, joints: st.SearchStrategy[int] | None = None) -> FreeChain:
    """Random chains in the x-y plane; see `planar_chain`."""
    rng = np.random.default_rng(draw(SEEDS))
    return planar_chain(rng, draw(st.integers(0, 2) if joints is None else joints))


def joint_rank(J_q: np.ndarray, length: float = LENGTH) -> int:
    """Rank of J_q, from unit columns in lengths."""
    if J_q.shape[-1] == 0:
        return 0
    t = 3 if J_q.shape[0] == 6 else 2
    scaled = np.concatenate([J_q[:t], length * J_q[t:]])
    scaled = scaled / np.linalg.norm(scaled, axis=0)
    return int(np.linalg.matrix_rank(scaled, tol=1e-8))

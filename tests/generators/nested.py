"""Random legs that hold parallel blocks, nested to some depth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import robostiff as rs
from robostiff.model import PlacedBlock, PlacedElement, PlacedFreedom, PlacedLeg
from robostiff.spatial import Space
from tests.generators.chains import (
    Spring,
    planar_rotation,
    random_beam,
    random_block,
    random_joint,
    random_single,
)

_MAKERS = (random_beam, random_block, random_single)


def _beam(rng: np.random.Generator, space: Space) -> Spring:
    if space is Space.SPATIAL:
        return _MAKERS[rng.integers(len(_MAKERS))](rng)
    R = planar_rotation(rng)
    return replace(random_beam(rng), axes=R, point=np.append(rng.uniform(-1, 1, 2), 0.0))


def _joint(name: str, rng: np.random.Generator, space: Space) -> PlacedFreedom:
    joint = random_joint(rng)
    point, axis = joint.point, joint.axis
    if space is Space.PLANAR:
        point = np.append(point[:2], 0.0)
        axis = np.append(axis[:2], 0.0) if joint.pitch is None else np.array([0, 0, 1.0])
    pitch = joint.pitch and (joint.pitch if space is Space.SPATIAL else 0.0)
    return PlacedFreedom(axis / np.linalg.norm(axis), point, pitch, name, rs.Passive())


class _Grower:
    """Grows legs element by element."""

    def __init__(
        self, rng: np.random.Generator, space: Space, rigid: bool, clamps: bool = False
    ) -> None:
        self.rng, self.space, self.rigid, self.clamps = rng, space, rigid, clamps

    def leg(self, name: str, depth: int, joints: int, elastic: bool = True) -> PlacedLeg:
        """A leg with a block in it, unless the depth is spent."""
        rng = self.rng
        elements: list[PlacedElement] = []
        if elastic:
            elements += [
                _beam(rng, self.space).placed(f"spring{i}")
                for i in range(1 + int(rng.uniform() < 0.25))
            ]
        elements += [_joint(f"joint{i}", rng, self.space) for i in range(joints)]
        if joints and rng.uniform() < 0.25:  # the same axis once more
            elements.append(replace(elements[-1], name="joint again"))
        if depth:
            elements += [
                self.block(f"block{i}", depth) for i in range(1 + int(rng.uniform() < 0.15))
            ]
        order = rng.permutation(len(elements))
        return PlacedLeg(name, tuple(elements[i] for i in order), self._point())

    def block(self, name: str, depth: int) -> PlacedBlock:
        """Two or three branches, a rigid one among them now and then."""
        rng = self.rng
        branches = []
        for i in range(2 + int(rng.uniform() < 0.25)):
            elastic = not (self.rigid and rng.uniform() < 0.3)
            most = 5 if self.space is Space.SPATIAL else 3
            joints = int(rng.integers(0 if elastic else 1, most))
            if self.clamps and not elastic and rng.uniform() < 0.5:
                joints = 0
            deeper = depth - 1 if rng.uniform() < 0.4 else 0
            branches.append(self.leg(f"branch{i}", deeper, joints, elastic))
        return PlacedBlock(name, tuple(branches))

    def _point(self) -> np.ndarray:
        p = self.rng.uniform(-1, 1, 3)
        return p if self.space is Space.SPATIAL else np.append(p[:2], 0.0)


def nested_snapshot(
    rng: np.random.Generator,
    space: Space,
    rigid: bool,
    number: int,
    depth: int,
    clamps: bool = False,
) -> rs.Snapshot:
    """A random robot whose legs hold parallel blocks, up to `depth` of them one in another.

    With `rigid`, some branches are rigid. Joints may be redundant.
    With `clamps`, a rigid branch may be without joints, so that its whole block is rigid.
    """
    grower = _Grower(rng, space, rigid, clamps)
    grown = tuple(grower.leg(f"leg{i}", depth, int(rng.integers(0, 3))) for i in range(number))
    reference = rng.uniform(-1, 1, 3)
    if space is Space.PLANAR:
        reference[2] = 0.0
    return rs.Snapshot("nested", grown, reference, space)

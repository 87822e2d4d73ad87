"""Closed form for a leg of variable length between two joints: UPS, SPS, UPU, UCU, planar RPR."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from robostiff.kinematics.closure.assembly import Mode
from robostiff.kinematics.closure.pointing import fits, has_two_ways, point_and_take_up
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton, Slide
from robostiff.spatial.batch import product


@dataclass(frozen=True)
class Strut:
    """A slide along the line from joint A to joint B, perhaps with a turn about it.

    Its length, the fixed one and the slide's coordinate, has the sign that its mode says.
    """

    skeleton: Skeleton
    A: Cluster
    B: Cluster
    slide: Slide
    spin: int | None
    fixed_length: float
    mode: Mode = field(default_factory=Mode)

    @property
    def signs(self) -> tuple[bool, bool, bool]:
        """Which signs of a mode there are."""
        return (True, *has_two_ways(self.A, self.B, self.spin))

    @property
    def leading(self) -> int:
        """Place of the coordinate that the first sign decides."""
        return self.slide.place

    def in_mode(self, mode: Mode) -> Strut:
        """The same leg in another assembly mode."""
        return replace(self, mode=mode)

    def leaves_drive_open(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Nowhere: the length of a strut follows from its ends."""
        return np.zeros(p.shape[:-1], dtype=bool)

    def solve(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Coordinates (..., size) that bring the end frame to (R, p) in the leg's base frame."""
        skeleton, along = self.skeleton, self.slide.axis
        R_wanted = product(R, skeleton.R_end.T)
        end_to_B = self.B.point - skeleton.p_end
        B = p + np.einsum("...ij,j->...i", R_wanted, end_to_B)
        A_to_B = B - self.A.point
        length = self.mode.root * np.sqrt(np.einsum("...i,...i->...", A_to_B, A_to_B))
        direction = A_to_B / np.where(length != 0, length, 1.0)[..., None]
        q = _coordinates(skeleton.home, p.shape[:-1])
        q[..., self.slide.place] = length - self.fixed_length
        point_and_take_up(q, self.A, self.B, along, direction, R_wanted, self.spin, self.mode)
        return q


def recognise_strut(skeleton: Skeleton) -> Strut | None:
    """The closed form, when the leg is of this kind."""
    spin = None
    match skeleton.parts:
        case (Cluster() as A, Slide() as slide, Cluster() as B):
            pass
        case (Cluster() as A, Slide() as slide, Cluster() as turn, Cluster() as B):
            if not _turns_along(turn, slide):
                return None
            spin = turn.places[0]
        case _:
            return None
    along = slide.axis
    A_to_B = B.point - A.point
    size = 1e-9 * (np.linalg.norm(A_to_B) + np.linalg.norm(skeleton.p_end) + 1e-300)
    if np.linalg.norm(np.cross(along, A_to_B)) > size or not fits(A, B, along):
        return None
    return Strut(skeleton, A, B, slide, spin, float(along @ A_to_B))


def _turns_along(turn: Cluster, slide: Slide) -> bool:
    """Whether a joint turns about the slide itself, as a cylindrical joint does."""
    if turn.is_ball or len(turn.axes) != 1:
        return False
    return float(np.linalg.norm(turn.axes[0] - slide.axis)) < 1e-9


def _coordinates(home: np.ndarray, batch: tuple[int, ...]) -> np.ndarray:
    """Room for coordinates, poses side by side in memory, locked joints at home."""
    q = np.empty((home.size, *batch))
    q[...] = home.reshape(-1, *(1,) * len(batch))
    return np.moveaxis(q, 0, -1)

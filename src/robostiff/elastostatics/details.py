"""What is found of a machine beside its stiffness: its legs, their shares, and the posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.elastostatics.parallel_block import BlockCompliance
from robostiff.elastostatics.result import CartesianStiffness


@dataclass(frozen=True, kw_only=True)
class Details(CartesianStiffness):
    """What the direct form finds at poses: K about `origin`, where ranks are decided, and the legs.

    Attributes
    ----------
    origin : (..., 3) array
        Where it was computed: the machine's own reference point in the world [m], or the middle of
        a machine that is far away from it.
    reference_point : (..., 3) array
        The machine's own, in the world [m].
    passive_joint_names : tuple of str
        ``leg/joint`` of every passive freedom, the columns of ``redundant``.
    legs : tuple of CartesianStiffness
        Each leg about `origin`; none of a network.
    leg_blocks : tuple of tuples of BlockCompliance
        Parallel blocks of each leg about `origin`, by which their branches share a wrench.
    shares : (..., b, n, n) array or None
        On a flexible platform, what each leg carries of a wrench on the tool about `origin`, and
        then each part of the platform.
    pose : (..., 6) array or None
        x, y, z [m] and rotation vector [rad] of the platform; None for a snapshot.
    joint_coordinates : mapping of str to (..., size) array
        The posture: coordinates of the joints of each leg [m, rad], by its name.
    joint_names : mapping of str to tuple of str
        Names of these coordinates, of robots of legs.
    """

    origin: np.ndarray
    reference_point: np.ndarray
    passive_joint_names: tuple[str, ...]
    legs: tuple[CartesianStiffness, ...] = ()
    leg_blocks: tuple[tuple[BlockCompliance, ...], ...] = ()
    shares: np.ndarray | None = None
    pose: np.ndarray | None = None
    joint_coordinates: Mapping[str, np.ndarray] = field(default_factory=dict)
    joint_names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, whole: CartesianStiffness, **more: Any) -> Details:
        """A stiffness about an origin, with what else was found."""
        own = {one.name: getattr(whole, one.name) for one in fields(CartesianStiffness)}
        return cls(**{**own, **more})

    @cached_property
    def at_reference(self) -> np.ndarray:
        """K about the reference point (..., n, n), meaningful where there is one."""
        return self.moved(self.reference_point - self.origin)

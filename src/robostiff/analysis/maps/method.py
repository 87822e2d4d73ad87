"""How a map is computed."""

from __future__ import annotations

from dataclasses import dataclass

from robostiff.compiled import Backend


@dataclass(frozen=True)
class Compiled:
    """By the robot's kernel, see `robostiff.compile`; unsafe poses by the batched form.

    Parameters
    ----------
    backend : Backend
    """

    backend: Backend = Backend.BEST


@dataclass(frozen=True)
class Batched:
    """By the wrench basis form on batches of poses, see `robostiff.stiffness`."""


Method = Compiled | Batched

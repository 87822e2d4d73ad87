"""Stiffness of a cable with its winch, from its length and its tension."""

from __future__ import annotations

import numpy as np

from robostiff.errors import InputError
from robostiff.model.cable import CableRobot


def axial_stiffness(robot: CableRobot, lengths: np.ndarray, tensions: np.ndarray) -> np.ndarray:
    """Stiffness of every cable in series with its winch, 1/k = l0/EA + 1/k_w (..., m) [N/m].

    A cable of unstrained length l0 between winch and platform carries t = EA (l - l0)/l0. With the
    winch locked, ``l0 = (l + g - t/k_w) / (1 + t/EA)`` of present length, guide and tension. The
    tension is then linear in the length, t = k (l - l_slack), however far the platform moves.

    Parameters
    ----------
    robot : CableRobot
    lengths, tensions : (..., m) arrays
        From exit point to attachment [m], and [N].

    Raises
    ------
    InputError
        When a winch would deflect by more than the length of its cable.

    Examples
    --------
    >>> from robostiff.model.cable import Cable
    >>> from robostiff.spatial import Frame
    >>> rope = Cable("rope", [0, 0, 3], [0, 0, 0], EA=1e5, guide_length=1.0)
    >>> robot = CableRobot("pendulum", (rope,), Frame.identity())
    >>> axial_stiffness(robot, np.array([3.0]), np.array([0.0]))
    array([25000.])
    """
    stretch, give, guide = _compliances(robot)
    unstrained = (lengths + guide - tensions * give) / (1.0 + tensions * stretch)
    if np.any((unstrained <= 0) & (stretch > 0) & (lengths > 0)):
        i = int(np.argwhere((unstrained <= 0) & (stretch > 0) & (lengths > 0))[0][-1])
        raise InputError(
            f"tension of cable {robot.cables[i].name!r}",
            got=f"{np.max(tensions[..., i]):g} N, by which its winch deflects by more than "
            "the length of the cable",
            expected="less, or a stiffer winch",
        )
    # A cable of zero length has no matrix; its stiffness must only be finite.
    compliance = np.where(unstrained > 0, unstrained, 1.0) * stretch + give
    return 1.0 / compliance


def _compliances(robot: CableRobot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """1/EA, 1/k_w and length of the guide of every cable."""
    stretch = [0.0 if cable.EA is None else 1.0 / cable.EA for cable in robot.cables]
    give = [
        0.0 if cable.winch_stiffness is None else 1.0 / cable.winch_stiffness
        for cable in robot.cables
    ]
    guide = [cable.guide_length for cable in robot.cables]
    return np.array(stretch), np.array(give), np.array(guide)

"""An equilibrium against the minimum of the energy of bodies in the world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import robostiff as rs
from tests.campaign.answers import Judge
from tests.campaign.assembled import Assembly
from tests.campaign.bodies import Minimum, NoMinimumError, curvatures, elastic_energy, minimum

_SAME = 1e-7  # of the displacement
_SAME_C = 1e-6  # of the compliance: second differences
_OF_STIFFEST = 3e-12  # of a curvature: what second differences lose of it
_ZERO = 1e-9  # of the largest curvature


def least(own: Assembly, wrench: np.ndarray) -> Minimum:
    """The minimum, all loads at once, or little by little."""
    try:
        return minimum(own.bodies, wrench)
    except NoMinimumError:
        state = None
        for part in (0.25, 0.5, 0.75):
            state = minimum(own.bodies, part * wrench, part, state).state
        return minimum(own.bodies, wrench, 1.0, state)


def compare(
    judge: Judge,
    ask: Callable[..., Any],
    own: Assembly,
    truth: Minimum,
    scale: np.ndarray,
    beams: rs.Linear | rs.Bowing = rs.Linear(),  # noqa: B008
) -> None:
    """Displacement, compliance, energy and stability, elastic parts linear or single beams."""
    say, found = judge.say, ask(beams=beams)
    curved = curvatures(own.bodies, truth.state)
    is_stable = bool(curved[0] > -_ZERO * curved[-1])
    moved = float(np.max(np.abs(truth.displacement / scale)))
    doubt = rs.Status.FREE_MOTIONS | rs.Status.UNREACHABLE | rs.Status.ILL_CONDITIONED
    if found.status & doubt or moved > 0.2:
        return
    if not found.has_answer:
        # What lies beyond a snap need not be found, where it is said.
        snaps = found.status & rs.Status.BEYOND_CRITICAL_LOAD
        if is_stable and not snaps and curved[0] > 1e-6 * curved[-1]:
            say("equilibrium", "none, and the energy has a minimum", f"{found.status}; {moved:.1e}")
        return
    if found.found.known.regular and found.status & rs.Status.REDUNDANT_JOINTS:
        return  # what spins freely at rest is turned by the least load
    limit = _SAME * moved + 1e-11
    off = float(np.max(np.abs((found.displacement - truth.displacement) / scale)))
    detail = f"{found.status}, margin {found.margin:.2g}, moved {moved:.1e}"
    if not off <= limit:
        if found.margin > 0.3 and is_stable:
            say("equilibrium", "another place than the minimum", f"{off:.1e}; {detail}")
        return
    if found.stable != is_stable and abs(curved[0]) > 1e-6 * curved[-1] and found.margin < 0.9:
        say(
            "equilibrium", "called stable, and is not, or the reverse", f"{curved[0]:.1e}; {detail}"
        )
    if found.stable and not is_stable:
        return  # a saddle, at which inner bodies are elsewhere
    s = np.outer(scale, scale)
    off = _off(found.compliance / s, truth.compliance / s)
    if not off <= _SAME_C + _OF_STIFFEST * curved[-1] / abs(curved[0]):
        say("equilibrium", "another compliance than the minimum", f"{off:.1e}; {detail}")
    energy = elastic_energy(own.bodies, truth.state)
    if not abs(found.energy - energy) <= 1e-6 * energy + 1e-18:
        say("equilibrium", "another energy", f"{found.energy:.6g} for {energy:.6g}; {detail}")


def _off(one: np.ndarray, other: np.ndarray) -> float:
    """In units of the entries on the diagonal."""
    size = np.sqrt(np.abs(np.diag(other)))
    size = np.maximum(size, 1e-3 * np.max(size))
    return float(np.max(np.abs(one - other) / np.outer(size, size)))

"""Beams that bend far, against the corotational beams of OpenSees."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.elasticity.cantilever import cantilever_compliance
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from tests.peers.opensees import load_opensees, silence
from tests.statics.opensees_beam import EA, EI, GJ, L, extrapolated
from tests.statics.robots_under_load import loaded

LOADS = [[-60.0, 90, 50, 0, 0, 0], [80.0, -120, 30, 0, 0, 0], [0.0, 40, -25, 0, 0, 0]]


@pytest.fixture(scope="module")
def reference():
    """OpenSees in a process of its own, where nobody reads what it prints as it ends."""
    with ProcessPoolExecutor(1, get_context("spawn"), initializer=silence) as process:
        try:
            process.submit(load_opensees).result()
        except ImportError as error:
            pytest.skip(f"OpenSees cannot be loaded here: {error}")
        yield lambda load: process.submit(extrapolated, load).result()


def cantilever() -> Snapshot:
    tip = np.array([L, 0, 0])
    C = cantilever_compliance(L, 1.0, 1.0, EA, EI, EI, GJ)
    part = PlacedSpring("beam", tip, np.eye(3), Elasticity(C))
    return Snapshot("cantilever", (PlacedLeg("leg", (part,), tip),), tip)


@pytest.mark.parametrize("load", LOADS)
def test_beam_bent_far(load: list[float], reference):
    exact = reference(load)
    assert np.linalg.norm(exact) > 0.1 * L
    size, missed = np.linalg.norm(exact), []
    for n in (8, 16):
        answer = loaded(cantilever(), wrench=load, beams=rs.Bowing(n))
        assert answer.stable
        missed.append(np.linalg.norm(answer.displacement[:3] - exact) / size)
    assert missed[0] < 1e-3
    assert missed[1] < 1.2e-4
    assert missed[0] / missed[1] > 6  # with the third power of the number, and not by luck

"""OpenSees for tests of equilibria and of vibrations."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest

from tests.peers.opensees import load_opensees, silence


@pytest.fixture(scope="module")
def by_opensees():
    """OpenSees in a process of its own, where nobody reads what it prints as it ends."""
    with ProcessPoolExecutor(1, get_context("spawn"), initializer=silence) as process:
        try:
            process.submit(load_opensees).result()
        except ImportError as error:
            pytest.skip(f"OpenSees cannot be loaded here: {error}")
        yield lambda by, *given: process.submit(by, *given).result()

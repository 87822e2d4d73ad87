"""Settings that all tests share."""

import gc
import os
from pathlib import Path

import jaxtyping
import pytest
from hypothesis import HealthCheck, settings

# The workers of pytest fill the processors: threads of BLAS beside them wait for one another, busily.
# Workers and commands inherit it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_UNTIMED = [HealthCheck.too_slow, HealthCheck.data_too_large]

# The same examples on every machine, so that a pass here is a pass there.
settings.register_profile(
    "repeatable",
    derandomize=True,
    max_examples=40,
    deadline=None,
    database=None,
    suppress_health_check=_UNTIMED,
)
# Others at each run; failures print how to repeat them.
settings.register_profile(
    "campaign",
    max_examples=400,
    deadline=None,
    database=None,
    print_blob=True,
    suppress_health_check=_UNTIMED,
)
settings.load_profile("repeatable")

# Modules and tests stay to the end: looking through them for garbage again and again takes long.
gc.disable()
_SLOW = frozenset((Path(__file__).parent / "slow_tests.txt").read_text().splitlines())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests of ``slow_tests.txt`` for `make slow`.

    They take seconds each, or are the same test at more robots and poses; a few of each are fast.
    """
    for item in items:
        if item.nodeid in _SLOW:
            item.add_marker("slow")


def pytest_collection_finish() -> None:
    """Look for garbage in what the tests leave alone."""
    gc.collect()
    gc.freeze()
    gc.enable()


# Where formulas and robots are tested by themselves; what is built on them calls them with the
# same shapes thousands of times, at a third of the time of its tests. All slow tests check them.
_SHAPES_CHECKED = {"cases", "compiled", "elastostatics", "kinematics", "laws"}
_SHAPES_CHECKED |= {"network", "paper", "project", "recorded", "robots"}


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Check the shapes in the signatures of the formulas in some folders alone."""
    folder = item.nodeid.split("/")[1]
    is_checked = folder in _SHAPES_CHECKED or item.get_closest_marker("slow") is not None
    jaxtyping.config.update("jaxtyping_disable", not is_checked)

"""Settings that all tests share."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

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

_SLOW = frozenset((Path(__file__).parent / "slow_tests.txt").read_text().splitlines())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests of ``slow_tests.txt`` for `make slow`.

    They take seconds each, or are the same test at more robots and poses; a few of each are fast.
    """
    for item in items:
        if item.nodeid in _SLOW:
            item.add_marker("slow")

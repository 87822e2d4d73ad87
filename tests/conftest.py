"""Settings that all tests share."""

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

"""Quantiles of the normal distribution against more digits, and by both codes."""

import mpmath as mp
import numpy as np
import pytest
from scipy.special import ndtri

from robostiff.design import normal_quantiles as module
from robostiff.design.normal_quantiles import normal_quantiles

RANDOM = np.random.default_rng(5)
U = np.concatenate(
    [
        RANDOM.random(300),
        2.0 ** -RANDOM.uniform(1, 32, 150),
        1 - 2.0 ** -RANDOM.uniform(1, 32, 150),
        0.5 + 2.0 ** -RANDOM.uniform(2, 50, 100),
        [2.0**-32, 1 - 2.0**-32, 0.5],
    ]
)


def with_30_digits(p: float) -> float:
    """By steps of Newton's method from SciPy's."""
    with mp.workdps(30):
        x = mp.mpf(ndtri(p))
        for _ in range(3):
            x -= (mp.ncdf(x) - mp.mpf(p)) / mp.npdf(x)
        return float(x)


@pytest.mark.parametrize("has_machine_code", [True, False])
def test_quantiles_have_all_digits(monkeypatch, has_machine_code):
    module._code.cache_clear()
    if not has_machine_code:
        monkeypatch.setattr(module, "machine_code_is_available", lambda: False)
    found = normal_quantiles(U, np.empty(U.shape))
    module._code.cache_clear()
    right = np.array([with_30_digits(p) for p in U.tolist()])
    np.testing.assert_allclose(found, right, rtol=2e-15, atol=1e-17)


def test_quantiles_end_where_no_draw_comes():
    found = normal_quantiles(np.array([0.0, 2.0**-40, 2.0**-32, 1.0]), np.empty(4))
    np.testing.assert_allclose(found, [*[ndtri(2.0**-32)] * 3, -ndtri(2.0**-32)], rtol=1e-9)

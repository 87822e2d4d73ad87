"""Eq. (14): the matrix of a vector product."""

import numpy as np

from robostiff.spatial import skew


def test_as_printed():
    x, y, z = 2.0, 3.0, 5.0
    printed = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    assert np.array_equal(skew(np.array([x, y, z])), printed)


def test_is_the_vector_product_and_skew():
    rng = np.random.default_rng(1)
    v, w = rng.normal(size=(2, 4, 2, 3))
    product = np.einsum("...ij,...j->...i", skew(v), w)
    assert np.allclose(product, np.cross(v, w), rtol=0, atol=1e-15)
    assert np.array_equal(skew(v), -np.swapaxes(skew(v), -1, -2))

"""Colours are distinguished by everybody, and read on their ground."""

from itertools import combinations

import numpy as np
import pytest

from robostiff.plot.theme import Theme, contrast, luminance

# Machado, Oliveira, Fernandes: A physiologically-based model for simulation of color vision
# deficiency, IEEE TVCG 15(6), 2009: severity 1, linear RGB.
BLINDNESS = {
    "none": np.eye(3),
    "protan": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deutan": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}


def linear(colour: str) -> np.ndarray:
    s = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIE L*a*b* of linear RGB."""
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    t = to_xyz @ np.clip(rgb, 0, 1) / [0.9505, 1.0, 1.089]
    f = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("theme", Theme)
@pytest.mark.parametrize("sight", BLINDNESS)
def test_first_categories_are_distinguished(theme: Theme, sight: str):
    seen = [lab(BLINDNESS[sight] @ linear(colour)) for colour in theme.palette.categories[:5]]
    for one, other in combinations(seen, 2):
        assert np.linalg.norm(one - other) > 12


@pytest.mark.parametrize("theme", Theme)
def test_texts_and_lines_are_read_on_their_ground(theme: Theme):
    palette = theme.palette
    assert contrast(palette.ink, palette.ground) > 7
    assert contrast(palette.muted, palette.ground) > 4.5
    for colour in palette.categories[:4]:
        assert contrast(colour, palette.ground) > 2.5


@pytest.mark.parametrize("theme", Theme)
def test_values_grow_lighter(theme: Theme):
    light = [luminance(colour) for colour in theme.palette.values]
    assert light == sorted(light)


@pytest.mark.parametrize("theme", Theme)
def test_numbers_are_read_on_every_cell(theme: Theme):
    palette = theme.palette
    for where in np.linspace(0, 1, 41):
        cell = palette.along(palette.signed, float(where))
        assert contrast(cell, palette.on(cell)) > 4

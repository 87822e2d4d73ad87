"""Free motions described in words, for spaces of motions made by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.analysis import free_motions_in_words
from robostiff.spatial import move_twist

ORIGIN = np.zeros(3)


def turn(axis, point, pitch: float = 0.0) -> np.ndarray:
    """Twist of the origin for a turn about a line, or a screw along it."""
    e = np.asarray(axis, float) / np.linalg.norm(axis)
    return np.concatenate([np.cross(np.asarray(point, float), e) + pitch * e, e])


def slide(axis) -> np.ndarray:
    e = np.asarray(axis, float) / np.linalg.norm(axis)
    return np.concatenate([e, np.zeros(3)])


CASES = [
    ([slide([1, 0, 0])], {"translation along x"}),
    ([slide([0, 3, 4])], {"translation along (0, 0.6, 0.8)"}),
    ([turn([0, 0, 1], [1, 2, 0])], {"rotation about z through (1, 2, 0) m"}),
    ([turn([0, 3, 4], [1, 0, 0])], {"rotation about (0, 0.6, 0.8) through (1, 0, 0) m"}),
    (
        [turn([0, 0, 1], [0.5, 0, 0], pitch=0.01)],
        {"screw motion about z through (0.5, 0, 0) m, 10 mm per radian"},
    ),
    (
        [turn([1, 0, 0], [0, 0, 2]), turn([0, 1, 0], [0, 0, 2]), turn([0, 0, 1], [0, 0, 2])],
        {f"rotation about {axis} through (0, 0, 2) m" for axis in "xyz"},
    ),
    ([slide([1, 0, 0]), slide([0, 1, 0])], {"translation along x", "translation along y"}),
    (
        [turn([1, 0, 0], [0, 0, 1]), turn([0, 1, 0], [0, 0, 3])],
        {"rotation about x through (0, 0, 1) m", "rotation about y through (0, 0, 3) m"},
    ),
    (
        [slide([0, 0, 1]), turn([0, 0, 1], [0.2, 0.1, 0.7])],
        {"translation along z", "rotation about z through (0.2, 0.1, 0) m"},
    ),
]


@pytest.mark.parametrize(("twists", "words"), CASES)
def test_words_whatever_the_basis(twists: list[np.ndarray], words: set[str]):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        basis = rng.normal(size=(len(twists),) * 2) @ np.stack(twists)
        found = {str(motion) for motion in free_motions_in_words(basis, ORIGIN, 1.0)}
        assert {_sign_free(text) for text in found} == {_sign_free(text) for text in words}


def _sign_free(text: str) -> str:
    """A direction and its opposite are one."""
    return text.replace("(-0, -0.6, -0.8)", "(0, 0.6, 0.8)").replace(
        "(0, -0.6, -0.8)", "(0, 0.6, 0.8)"
    )


@given(st.integers(1, 5), st.integers(0, 2**32 - 1), st.sampled_from([0.01, 1.0, 100.0]))
def test_the_motions_span_the_space(number: int, seed: int, length: float):
    rng = np.random.default_rng(seed)
    basis = rng.normal(size=(number, 6))
    basis[:, :3] *= length
    point = rng.normal(size=3) * length
    motions = free_motions_in_words(basis, point, length)
    assert len(motions) == number
    scale = np.array([1, 1, 1, length, length, length])
    described = np.stack(
        [motion.twist * scale / np.linalg.norm(motion.twist * scale) for motion in motions]
    )
    given_ = basis * scale / np.linalg.norm(basis * scale, axis=1)[:, None]
    assert np.linalg.matrix_rank(described, tol=1e-9) == number
    assert np.linalg.matrix_rank(np.vstack([described, given_]), tol=1e-7) == number


@given(st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_the_screw_is_the_twist(number: int, seed: int):
    rng = np.random.default_rng(seed)
    point = rng.normal(size=3)
    for motion in free_motions_in_words(rng.normal(size=(number, 6)), point, 1.0):
        screw = motion.screw
        if screw.point is None:
            assert np.allclose(motion.twist[:3], screw.axis, atol=1e-9)
            assert not motion.twist[3:].any()
            continue
        pitch = screw.pitch or 0.0
        at_line = np.concatenate([pitch * screw.axis, screw.axis])
        assert np.allclose(move_twist(at_line, point - screw.point), motion.twist, atol=1e-6)


def test_in_the_plane():
    motions = free_motions_in_words(np.array([[0.5, -1.0, 1.0]]), np.array([1.0, 1, 0]), 1.0)
    # the pole p with v = z x (ref - p)
    assert [str(motion) for motion in motions] == ["rotation about z through (2, 1.5, 0) m"]
    assert motions[0].twist.shape == (3,)
    slides = free_motions_in_words(np.array([[0.0, 2.0, 0]]), ORIGIN, 1.0)
    assert [str(motion) for motion in slides] == ["translation along y"]
    assert free_motions_in_words(np.zeros((0, 3)), ORIGIN, 1.0) == ()

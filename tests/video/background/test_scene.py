"""Learning, pixel by pixel, against its equations."""

import numpy as np
import pytest

from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import BEAM, SHADOW, UNSEEN, Scene, learn, spare

WEIGHT, NOISE_WEIGHT, DT = np.float32(0.1), np.float32(0.05), np.float32(0.04)


def drawn(shape, seed):
    """A picture, a scene with a history, and what covers it: vehicles, shadow, beams, and a side out of view."""
    noise = np.random.default_rng(seed)
    half = tuple((size + 1) // 2 for size in shape)
    luma, cb, cr = (noise.integers(0, 256, size).astype(np.uint8) for size in (shape, half, half))
    planes = [noise.random(size).astype(np.float32) for size in (shape, half, half, *5 * [shape])]
    scene = Scene(*(plane * 200 for plane in planes[:3]), planes[3] * 8, *(plane * 20 for plane in planes[4:]))
    covered = np.where(noise.random(shape) < 0.2, 255, 0).astype(np.uint8)
    covered[:2], covered[:, 0] = 0, UNSEEN  # the first rows are free
    hit = noise.choice(np.array([0, 0, 0, 1, SHADOW, BEAM], np.uint8), shape)
    hit[:2] = 0
    return Picture(luma, cb, cr), scene, covered, hit


@pytest.mark.parametrize("shape", [(6, 8), (7, 9), (33, 70), (40, 71)])
def test_free_pixels_are_averaged_and_covered_ones_are_counted(shape):
    picture, scene, covered, hit = drawn(shape, seed=sum(shape))
    before = Scene(*(plane.copy() for plane in scene))
    learn(picture, scene, covered, hit, WEIGHT, NOISE_WEIGHT, DT)
    free = (covered == 0) & (hit != SHADOW) & (hit != BEAM)
    seen = ~free & (covered != UNSEEN)
    d, change = picture.luma - before.luma, picture.luma - before.cover
    deviation = np.minimum(np.abs(d), 4 * np.maximum(before.noise, 1))
    steady = np.abs(change) < np.maximum(10, 4 * before.noise)
    left = free[::2, ::2]
    right = np.pad(free[::2], ((0, 0), (0, shape[1] % 2)), constant_values=True)[:, 1::2]
    expected = {
        "luma": before.luma + np.where(free, WEIGHT * d, 0),
        "noise": before.noise + np.where(free, NOISE_WEIGHT * (deviation - before.noise), 0),
        "covered_s": np.where(free, 0, before.covered_s + np.where(covered == UNSEEN, 0, DT)),
        "cover": before.cover + np.where(seen, np.where(steady, WEIGHT, 1) * change, 0),
        "steady_s": np.where(free, 0, np.where(seen, np.where(steady, before.steady_s + DT, 0), before.steady_s)),
        "cb": before.cb + np.where(left & right, WEIGHT * (picture.cb - before.cb), 0),
        "cr": before.cr + np.where(left & right, WEIGHT * (picture.cr - before.cr), 0),
        "former": before.former,
    }
    for name, plane in expected.items():
        assert np.allclose(getattr(scene, name), plane, rtol=1e-5, atol=1e-4), name


@pytest.mark.parametrize(
    ("box", "inside"),
    [
        ((3, 2, 4, 2), np.s_[2:5, 3:8]),
        ((-5, -5, 7, 8), np.s_[:4, :3]),
        ((8.5, 5.5, 50, 50), np.s_[5:, 8:]),
        ((-50, 2, 20, 2), np.s_[:0, :0]),
        ((3, -50, 4, 20), np.s_[:0, :0]),
        ((40, 2, 4, 2), np.s_[:0, :0]),
        ((3, 40, 4, 2), np.s_[:0, :0]),
        ((2, 2, 1e19, 2), np.s_[:0, :0]),
        ((2, 2, 4, 1e19), np.s_[:0, :0]),
        ((2, 2, np.nan, np.nan), np.s_[:0, :0]),
    ],
)
def test_cover_is_limited_inside_boxes_also_beyond_each_side(box, inside):
    covered_s = np.random.default_rng(1).random((9, 12)).astype(np.float32)
    expected = covered_s.copy()
    expected[inside] = np.minimum(expected[inside], np.float32(0.3))
    spare(covered_s, np.array([box], float), np.float32(0.3))
    np.testing.assert_array_equal(covered_s, expected)

"""The shadow test, row by row in vectorised loops, against its equations, pixel by pixel."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import SHADOW, start
from vidtrack.video.background.shadow import SOFT, Tolerance, mark_shadow
from vidtrack.video.background.veil import Air

HARD = Tolerance(*map(np.float32, (0.35, 0.4, 0.15, 6, 0.3)))
NOTHING = np.empty((0, 0), np.uint8)
DARKEST, LIGHTEST, BINS = 0.25, 0.97, 20


def differences(plane, y, x):
    """Of luminance over +-1 px, across and down; one-sided at the edge of the picture."""
    h, w = plane.shape
    across = plane[y, min(x + 1, w - 1)] - plane[y, max(x - 1, 0)]
    return np.array([across, plane[min(y + 1, h - 1), x] - plane[max(y - 1, 0), x]])


def by_pixel(picture, scene, air, tolerance, hit):
    """Whether each hit is shadow, and the counts."""
    luma, chroma = picture.luma.astype(np.float32), [plane.astype(np.float32) for plane in picture[1:]]
    shadow, count = np.zeros(hit.shape, bool), np.zeros(BINS + 1)
    for y, x in np.argwhere(hit):
        light = scene.luma[y, x] - air.black[y, x]
        r = (luma[y, x] - air.black[y, x]) / light if light > 0 else np.float32(1)
        if not r < np.float32(LIGHTEST):
            continue
        structure = np.abs(r * differences(scene.luma, y, x)).sum()
        missed = np.abs(differences(luma, y, x) - r * differences(scene.luma, y, x)).sum()
        off = colour = np.float32(0)
        share = np.float32(0.05)
        if chroma[0].size:
            of_scene = np.array([scene.cb[y // 2, x // 2], scene.cr[y // 2, x // 2]]) - np.float32(128)
            of_picture = np.array([plane[y // 2, x // 2] for plane in chroma]) - np.float32(128)
            off, colour = np.abs(of_picture - r * of_scene).max(), np.abs(of_scene).max()
            share = tolerance.texture_share
        count[BINS] += structure > 6
        if r < DARKEST:
            continue
        if structure > 6 and missed < structure / 2 and off < 4:
            count[int(float(r) * BINS)] += 1
        darkest = tolerance.darkest + air.spread[y, x] * (tolerance.faintest - tolerance.darkest)
        fits = off < 4 + tolerance.chroma_share * colour and missed < tolerance.texture + share * light
        shadow[y, x] = r >= darkest and fits
    return shadow, count


@given(
    shape=st.tuples(st.integers(1, 12), st.integers(1, 75)),
    share=st.sampled_from([0.02, 0.5, 1.0]),
    coloured=st.booleans(),
    tolerance=st.sampled_from([SOFT, HARD]),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=150, deadline=None)
def test_each_pixel_passes_by_the_equations(shape, share, coloured, tolerance, seed):
    random = np.random.default_rng(seed)
    half = ((shape[0] + 1) // 2, (shape[1] + 1) // 2)
    road = (random.integers(5, 200) + random.integers(0, 40, shape)).astype(np.uint8)
    tint = [random.integers(100, 156, half).astype(np.uint8) if coloured else NOTHING for _ in range(2)]
    scene = start(Picture(road, *tint))
    factor = random.choice([0.2, 0.3, 0.6, 0.8, 1.1], shape[1])
    luma = np.clip(road * factor + random.integers(-2, 3, shape), 0, 255).astype(np.uint8)
    shown = [np.clip(128 + 0.7 * (plane.astype(float) - 128), 0, 255).astype(np.uint8) for plane in tint]
    picture = Picture(luma, *(shown if coloured else tint))
    levels = random.choice(np.float32([0, 8, 60]), shape), random.choice(np.float32([0, 0.5, 1]), shape)
    air, hit = Air(*levels), (random.random(shape) < share).astype(np.uint8)
    shadow, count = by_pixel(picture, scene, air, tolerance, hit)
    marked = hit.copy()
    np.testing.assert_array_equal(mark_shadow(picture, scene, air, tolerance, marked), count)
    np.testing.assert_array_equal(marked, np.where(shadow, SHADOW, hit))

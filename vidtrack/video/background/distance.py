"""How far each pixel is from the scene, in units of its threshold.

Every inner loop writes one row of one array: so the compiler vectorises it.
"""

from __future__ import annotations

import numba
import numpy as np

from vidtrack.compiled import CACHE


@numba.njit(cache=CACHE, nogil=True, error_model="numpy")
def disturbance(picture, scene, floor, noise_factor, chroma_threshold, strength, hit):  # type: ignore[no-untyped-def]
    """strength = sqrt((dY / TY)^2 + (dCb / TC)^2 + (dCr / TC)^2) and hit = strength > 1, both (h, w).

    TY = max(floor, noise_factor * noise), per pixel; TC = chroma_threshold. Four luminance pixels share one of
    chroma. strength is float32, hit uint8 0 or 1.
    """
    h, w = hit.shape
    coloured = len(picture.cb) > 0
    scale = np.float32(1) / chroma_threshold
    half = np.zeros((w + 1) // 2, np.float32)
    chroma = np.zeros(w, np.float32)
    for y in range(h):
        if coloured and y % 2 == 0:
            half[:] = np.float32(0)
            _add_square(picture.cb[y // 2], scene.cb[y // 2], scale, half)
            _add_square(picture.cr[y // 2], scene.cr[y // 2], scale, half)
            _widen(half, chroma)
        _distance(picture.luma[y], scene.luma[y], scene.noise[y], chroma, floor, noise_factor, strength[y])
        _above_one(strength[y], hit[y])


@numba.njit(cache=CACHE, nogil=True)
def _add_square(plane, scene, scale, total):  # type: ignore[no-untyped-def]
    for x in range(len(total)):
        d = (np.float32(plane[x]) - scene[x]) * scale
        total[x] += d * d


@numba.njit(cache=CACHE, nogil=True)
def _widen(half, wide):  # type: ignore[no-untyped-def]
    for x in range(len(wide)):
        wide[x] = half[x // 2]


@numba.njit(cache=CACHE, nogil=True, error_model="numpy")
def _distance(luma, scene, noise, chroma, floor, factor, strength):  # type: ignore[no-untyped-def]
    for x in range(len(strength)):
        d = (np.float32(luma[x]) - scene[x]) / max(floor, factor * noise[x])
        strength[x] = np.sqrt(d * d + chroma[x])


@numba.njit(cache=CACHE, nogil=True)
def _above_one(strength, hit):  # type: ignore[no-untyped-def]
    for x in range(len(hit)):
        hit[x] = np.uint8(strength[x] > np.float32(1))

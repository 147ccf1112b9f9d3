"""Majority of a window: the median of a yes-or-no picture, by running column sums."""

from __future__ import annotations

import numpy as np

from vidtrack.compiled import kernel
from vidtrack.video.frame import Image


@kernel
def majority(hit: Image, window: int, mask: Image) -> None:
    """mask = 255 where more than half of the window x window pixels around have hit == 1, else 0.

    hit, mask (h, w) uint8; window is odd and at most 15; pixels outside the picture have no hit.
    """
    h, w = hit.shape
    reach = window // 2
    need = np.uint8(window * window // 2)
    column = np.zeros(w + 2 * reach, np.uint8)
    inside = column[reach : reach + w]
    total = np.empty(w, np.uint8)
    for y in range(-reach, h):
        if y + reach < h:
            for x in range(w):
                inside[x] += np.uint8(hit[y + reach, x] == 1)
        if y - reach > 0:
            for x in range(w):
                inside[x] -= np.uint8(hit[y - reach - 1, x] == 1)
        if y >= 0:
            total[:] = 0
            for shift in range(window):
                shifted = column[shift:]
                for x in range(w):
                    total[x] += shifted[x]
            for x in range(w):
                mask[y, x] = np.uint8(255) if total[x] > need else np.uint8(0)

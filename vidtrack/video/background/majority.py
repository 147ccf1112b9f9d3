"""Majority of a window: the median of a yes-or-no picture, by running column sums."""

from __future__ import annotations

import numba
import numpy as np

from vidtrack.compiled import CACHE


@numba.njit(cache=CACHE, nogil=True)
def majority(hit, window, mask):  # type: ignore[no-untyped-def]
    """mask = 255 where more than half of the window x window pixels around have hit == 1, else 0.

    hit, mask (h, w) uint8; window is odd and at most 15; pixels outside the picture have no hit.
    """
    h, w = hit.shape
    reach = window // 2
    need = np.uint8(window * window // 2)
    column = np.zeros(w + 2 * reach, np.uint8)
    inside = column[reach : reach + w]
    total = np.empty(w, np.uint8)
    for y in range(min(reach, h)):
        _add(hit[y], inside)
    for y in range(h):
        if y + reach < h:
            _add(hit[y + reach], inside)
        if y - reach - 1 >= 0:
            _subtract(hit[y - reach - 1], inside)
        total[:] = 0
        for shift in range(window):
            _accumulate(column[shift : shift + w], total)
        _more_than(total, need, mask[y])


@numba.njit(cache=CACHE, nogil=True)
def _add(hit, column):  # type: ignore[no-untyped-def]
    for x in range(len(hit)):
        column[x] = np.uint8(column[x] + np.uint8(hit[x] == 1))


@numba.njit(cache=CACHE, nogil=True)
def _subtract(hit, column):  # type: ignore[no-untyped-def]
    for x in range(len(hit)):
        column[x] = np.uint8(column[x] - np.uint8(hit[x] == 1))


@numba.njit(cache=CACHE, nogil=True)
def _accumulate(column, total):  # type: ignore[no-untyped-def]
    for x in range(len(total)):
        total[x] = np.uint8(total[x] + column[x])


@numba.njit(cache=CACHE, nogil=True)
def _more_than(total, need, mask):  # type: ignore[no-untyped-def]
    for x in range(len(mask)):
        mask[x] = np.uint8(255) if total[x] > need else np.uint8(0)

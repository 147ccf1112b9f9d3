"""The normal equations of a track's fit: a band matrix of its path, bordered by the few numbers of the whole track.

By Cholesky's factor of the band: the path is eliminated first, and the numbers of the whole track follow from what is
left of their equations (Schur complement).
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.compiled import kernel

SIZE = 4
"""Numbers of the whole track: length, width, height [m], and by how much the boxes are too wide [px]."""
BAND = 4
"""Places beside the diagonal of the normal matrix, for two coordinates and two neighbours"""


@kernel
def factor(band: Floats, right: Floats) -> None:
    """Cholesky's factor of a band matrix (n, BAND + 1), row i has (i, i), (i, i - 1), ...; in place.

    Of the diagonal it has the inverses, since all that is done with it is to divide by it. The right sides
    (n, SIZE + 1) are solved with the factor on the way, not yet with its transpose.
    """
    for i in range(len(band)):
        reach = min(i, BAND)
        for d in range(reach, 0, -1):
            value = band[i, d]
            for m in range(reach, d, -1):
                value -= band[i, m] * band[i - d, m - d]
            band[i, d] = value * band[i - d, 0]
        value = band[i, 0]
        for d in range(1, reach + 1):
            value -= band[i, d] ** 2
            for c in range(SIZE + 1):
                right[i, c] -= band[i, d] * right[i - d, c]
        band[i, 0] = 1 / np.sqrt(max(value, 1e-12))
        for c in range(SIZE + 1):
            right[i, c] *= band[i, 0]


@kernel
def eliminate(right: Floats, whole: Floats, rest: Floats) -> None:
    """Take the path out of the size's equations (Schur complement), with the right sides as `factor` leaves them."""
    for k in range(len(right)):
        for s in range(SIZE):
            for r in range(s + 1):
                whole[s, r] -= right[k, s] * right[k, r]
            rest[s] -= right[k, s] * right[k, SIZE]
    for s in range(SIZE):
        for r in range(s):
            whole[r, s] = whole[s, r]


@kernel
def invert(whole: Floats, inverse: Floats) -> None:
    """Write the inverse of a symmetric positive definite matrix (SIZE, SIZE): Gauss and Jordan, column by column."""
    inverse[:] = whole
    for p in range(SIZE):
        pivot = 1 / inverse[p, p]
        inverse[p, p] = 1.0
        for c in range(SIZE):
            inverse[p, c] *= pivot
        for r in range(SIZE):
            if r != p:
                share, inverse[r, p] = inverse[r, p], 0.0
                for c in range(SIZE):
                    inverse[r, c] -= share * inverse[p, c]


@kernel
def product(matrix: Floats, vector: Floats) -> Floats:
    """(SIZE,) of a matrix (SIZE, SIZE) and a vector (SIZE,)."""
    result = np.zeros(SIZE)
    for s in range(SIZE):
        for r in range(SIZE):
            result[s] += matrix[s, r] * vector[r]
    return result


@kernel
def move_path(band: Floats, right: Floats, step: Floats, path: Floats) -> float:
    """Move the path (K, 2) as far as it goes with a step of the size (SIZE,); returns how far at most."""
    n, most = len(band), 0.0
    for r in range(n - 1, -1, -1):
        change = right[r, SIZE]
        for s in range(SIZE):
            change -= right[r, s] * step[s]
        for d in range(1, min(n - 1 - r, BAND) + 1):
            change -= band[r + d, d] * right[r + d, SIZE]
        change *= band[r, 0]
        right[r, SIZE] = change
        path[r // 2, r % 2] += change
        most = max(most, abs(change))
    return most


@kernel
def solve_back(band: Floats, right: Floats) -> None:
    """Solve for the coupling to the size, the first SIZE right sides, with the transpose of the factor, too."""
    n = len(band)
    for i in range(n - 1, -1, -1):
        for d in range(1, min(n - 1 - i, BAND) + 1):
            for c in range(SIZE):
                right[i, c] -= band[i + d, d] * right[i + d, c]
        for c in range(SIZE):
            right[i, c] *= band[i, 0]


@kernel
def solve_one(band: Floats, right: Floats) -> None:
    """Solve for one right side (n,)."""
    n = len(band)
    for i in range(n):
        for d in range(1, min(i, BAND) + 1):
            right[i] -= band[i, d] * right[i - d]
        right[i] *= band[i, 0]
    for i in range(n - 1, -1, -1):
        for d in range(1, min(n - 1 - i, BAND) + 1):
            right[i] -= band[i + d, d] * right[i + d]
        right[i] *= band[i, 0]

"""A vehicle as a cuboid on the road: where the edges of its box in the picture are.

With G the homography from metres to homogeneous picture points and `up` what a metre of height adds to them, a corner
of the cuboid at q on the road and at height z is seen at G (q, 1) + z up. Each edge of the box is that of one corner,
so its derivatives are those of this corner.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.compiled import inlined

LEFT, TOP, RIGHT, BOTTOM = range(4)
X, Y, LENGTH, WIDTH, HEIGHT = range(5)


@inlined
def box_edges(G: Floats, up: Floats, state: Floats, e: Floats, edge: Floats, by_state: Floats) -> float:
    """Write the edges (4,) px of the box of a cuboid and their derivatives (4, 5); returns px per metre there.

    G (3, 3), up (3,); state (5,) x, y of the footprint's middle, length, width, height [m]; e (2,) unit vector ahead.
    Edges are NaN where a corner lies behind the camera.
    """
    x, y, length, width, height = state[X], state[Y], state[LENGTH], state[WIDTH], state[HEIGHT]
    u, u_ahead, u_left = _seen(G, 0, x, y, e)
    v, v_ahead, v_left = _seen(G, 1, x, y, e)
    w, w_ahead, w_left = _seen(G, 2, x, y, e)
    if w - abs(w_ahead) * length / 2 - abs(w_left) * width / 2 + min(height * up[2], 0.0) <= 0:
        edge[:] = np.nan
        return 0.0
    left, top, right, bottom = np.inf, np.inf, -np.inf, -np.inf
    leftmost = uppermost = rightmost = lowest = 0
    for corner in range(8):
        a, b, z = _at(corner, length, width, height)
        near = 1 / (w + a * w_ahead + b * w_left + z * up[2])
        across = (u + a * u_ahead + b * u_left + z * up[0]) * near
        down = (v + a * v_ahead + b * v_left + z * up[1]) * near
        left, leftmost = (across, corner) if across < left else (left, leftmost)
        top, uppermost = (down, corner) if down < top else (top, uppermost)
        right, rightmost = (across, corner) if across > right else (right, rightmost)
        bottom, lowest = (down, corner) if down > bottom else (bottom, lowest)
    edge[LEFT], edge[TOP], edge[RIGHT], edge[BOTTOM] = left, top, right, bottom
    for side in range(4):
        corner = (leftmost, uppermost, rightmost, lowest)[side]
        axis, place = side % 2, edge[side]
        a, b, z = _at(corner, length, width, height)
        near = 1 / (w + a * w_ahead + b * w_left + z * up[2])
        by_x, by_y = (G[axis, 0] - place * G[2, 0]) * near, (G[axis, 1] - place * G[2, 1]) * near
        by_state[side, X], by_state[side, Y] = by_x, by_y
        by_state[side, LENGTH] = ((corner & 1) - 0.5) * (by_x * e[0] + by_y * e[1])
        by_state[side, WIDTH] = ((corner >> 1 & 1) - 0.5) * (by_y * e[0] - by_x * e[1])
        by_state[side, HEIGHT] = (corner >> 2) * (up[axis] - place * up[2]) * near
    of_left = by_state[LEFT, X] ** 2 + by_state[LEFT, Y] ** 2
    of_right = by_state[RIGHT, X] ** 2 + by_state[RIGHT, Y] ** 2
    return np.sqrt(max(of_left, of_right))


@inlined
def _seen(G: Floats, row: int, x: float, y: float, e: Floats) -> tuple[float, float, float]:
    """A coordinate of a point of the road, by a row of G, and what a metre along e and to its left adds."""
    by_x, by_y = G[row, 0], G[row, 1]
    return by_x * x + by_y * y + G[row, 2], by_x * e[0] + by_y * e[1], by_y * e[0] - by_x * e[1]


@inlined
def _at(corner: int, length: float, width: float, height: float) -> tuple[float, float, float]:
    """m; how far a corner, 0 to 7, is ahead, to the left and above the footprint's middle."""
    return ((corner & 1) - 0.5) * length, ((corner >> 1 & 1) - 0.5) * width, (corner >> 2) * height

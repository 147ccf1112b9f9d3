"""A vehicle as a cuboid on the road: where the edges of its box in the picture are.

With G the homography from metres to homogeneous picture points and `up` what a metre of height adds to them, a corner
of the cuboid at q on the road and at height z is seen at G (q, 1) + z up. Each edge of the box is that of one corner,
so its derivatives are those of this corner.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.compiled import kernel

LEFT, TOP, RIGHT, BOTTOM = range(4)
X, Y, LENGTH, WIDTH, HEIGHT = range(5)


@kernel
def box_edges(G: Floats, up: Floats, state: Floats, e: Floats, edge: Floats, by_state: Floats) -> float:
    """Write the edges (4,) px of the box of a cuboid and their derivatives (4, 5); returns px per metre there.

    G (3, 3), up (3,); state (5,) x, y of the footprint's middle, length, width, height [m]; e (2,) unit vector ahead.
    Edges are NaN where a corner lies behind the camera.
    """
    edge[0], edge[1], edge[2], edge[3] = np.inf, np.inf, -np.inf, -np.inf
    for corner in range(8):
        a = 0.5 if corner & 1 else -0.5
        b = 0.5 if corner & 2 else -0.5
        top = 1.0 if corner & 4 else 0.0
        qx = state[X] + a * state[LENGTH] * e[0] - b * state[WIDTH] * e[1]
        qy = state[Y] + a * state[LENGTH] * e[1] + b * state[WIDTH] * e[0]
        z = top * state[HEIGHT]
        w = G[2, 0] * qx + G[2, 1] * qy + G[2, 2] + z * up[2]
        if w <= 0:
            edge[:] = np.nan
            return 0.0
        near = 1 / w
        for axis in range(2):
            u = (G[axis, 0] * qx + G[axis, 1] * qy + G[axis, 2] + z * up[axis]) * near
            for side in (axis, axis + 2):
                if (side < 2 and u < edge[side]) or (side >= 2 and u > edge[side]):
                    edge[side] = u
                    by_state[side, X], by_state[side, LENGTH] = near, a  # until it is known which corner it is
                    by_state[side, WIDTH], by_state[side, HEIGHT] = b, top
    for side in range(4):
        axis, u, near = side % 2, edge[side], by_state[side, X]
        by_x, by_y = (G[axis, 0] - u * G[2, 0]) * near, (G[axis, 1] - u * G[2, 1]) * near
        by_state[side, X], by_state[side, Y] = by_x, by_y
        by_state[side, LENGTH] *= by_x * e[0] + by_y * e[1]
        by_state[side, WIDTH] *= by_y * e[0] - by_x * e[1]
        by_state[side, HEIGHT] *= (up[axis] - u * up[2]) * near
    left = by_state[LEFT, X] ** 2 + by_state[LEFT, Y] ** 2
    right = by_state[RIGHT, X] ** 2 + by_state[RIGHT, Y] ** 2
    return np.sqrt(max(left, right))

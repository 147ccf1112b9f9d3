"""The border of the picture: which boxes it cuts, and which tracks are leaving."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.compiled import kernel
from vidtrack.scan import Floats, Mask

REACH = 2.0
"""px; a box this close to the border is cut by it."""
EXIT_S = 0.2
"""s; a track that is leaving over the border is deleted this long after its last evidence."""
SPECK = 1 / 30
"""Share of the picture's longer side; a smaller object must travel as far as one of this size to be confirmed. The
leaves of a swaying tree are small, and a track that jumps from leaf to leaf seems to travel."""


@dataclass(frozen=True, slots=True)
class Border:
    """A picture of width x height pixels; infinite where a sensor has no border."""

    width: float = np.inf
    height: float = np.inf

    @property
    def speck(self) -> float:
        """px; size below which objects are treated as this large, zero without a border."""
        return 0.0 if np.isinf(self.width) else SPECK * max(self.width, self.height)

    def sides(self, box: Floats) -> Mask:
        """(N, 4) which sides (left, top, right, bottom) of boxes (N, 4) the border cuts."""
        return _sides(box, self.width, self.height)

    def cut(self, box: Floats) -> Mask:
        """(N,) boxes that are cut somewhere: their extent changes faster than any vehicle's."""
        return _cut(box, self.width, self.height)

    def outside(self, xy: Floats) -> Mask:
        """(N,) positions (N, d) beyond the border."""
        return _outside(xy, self.width, self.height)

    def leaving(self, box: Floats, v: Floats) -> Mask:
        """(N,) boxes cut by the border they move towards with velocities v (N, 2)."""
        return _leaving(box, v, self.width, self.height)

    def reaching(self, box: Floats, sides: Mask) -> Floats:
        """Boxes (N, 4) extended to the border on the given sides (N, 4)."""
        return _reaching(box, sides, (self.width, self.height))


@kernel
def _sides(box: Floats, width: float, height: float) -> Mask:
    sides = np.zeros((len(box), 4), np.bool_)
    if np.isinf(width):
        return sides
    for i in range(len(box)):
        sides[i, 0] = box[i, 0] < REACH
        sides[i, 1] = box[i, 1] < REACH
        sides[i, 2] = box[i, 0] + box[i, 2] > width - REACH
        sides[i, 3] = box[i, 1] + box[i, 3] > height - REACH
    return sides


@kernel
def _cut(box: Floats, width: float, height: float) -> Mask:
    cut, sides = np.zeros(len(box), np.bool_), _sides(box, width, height)
    for i in range(len(box)):
        cut[i] = sides[i].any()
    return cut


@kernel
def _outside(xy: Floats, width: float, height: float) -> Mask:
    outside = np.zeros(len(xy), np.bool_)
    if np.isinf(width):
        return outside
    for i in range(len(xy)):
        x, y = xy[i, 0], xy[i, 1]
        outside[i] = x < 0 or y < 0 or x > width or y > height
    return outside


@kernel
def _leaving(box: Floats, v: Floats, width: float, height: float) -> Mask:
    leaving, sides = np.zeros(len(box), np.bool_), _sides(box, width, height)
    for i in range(len(box)):
        for axis in range(min(2, v.shape[1])):
            near, far = sides[i, axis] and v[i, axis] < 0, sides[i, axis + 2] and v[i, axis] > 0
            leaving[i] |= near or far
    return leaving


@kernel
def _reaching(box: Floats, sides: Mask, picture: tuple[float, float]) -> Floats:
    drawn = np.empty_like(box)
    for i in range(len(box)):
        for axis in range(2):
            near, far = box[i, axis], box[i, axis] + box[i, axis + 2]
            if sides[i, axis]:
                near = min(near, 0.0)
            if sides[i, axis + 2]:
                far = max(far, picture[axis])
            drawn[i, axis], drawn[i, axis + 2] = near, far - near
    return drawn

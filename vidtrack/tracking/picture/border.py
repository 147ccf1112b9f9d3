"""The border of the picture: which boxes it cuts, and how probably a position is in view."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.compiled import kernel
from vidtrack.scan import Scan

FAR = 6.0
"""erf of this is one in double precision."""
REACH = 2.0
"""Pixels of the sensor; a box this close to the border is cut by it."""
RETURN = 0.25
"""Share of the longer side; who comes in again by so much before having left is another one."""
COMES = 0.25
"""Sizes a second; who is slower may stand."""
NEAR = 0.1
"""Share of the longer side; so near the border a box may be cut by it."""
SPECK = 1 / 30
"""Share of the picture's longer side; a smaller object must travel as far as one of this size to be confirmed. The
leaves of a swaying tree are small, and a track that jumps from leaf to leaf seems to travel."""


@dataclass(frozen=True, slots=True)
class Border:
    """A picture of width x height px, from left and top on; infinite where a sensor has no border.

    pixel  px per pixel of what the sensor looks at
    """

    width: float = np.inf
    height: float = np.inf
    left: float = 0.0
    top: float = 0.0
    pixel: float = 1.0

    def of(self, scan: Scan) -> Border:
        """The border of what a scan surveyed, this one if it does not say."""
        if scan.surveyed is None:
            return self
        left, top, right, bottom = scan.surveyed.tolist()
        return Border(right - left, bottom - top, left, top, float(scan.pixel))  # an integer has kernels of its own

    @property
    def _edges(self) -> tuple[float, float, float, float]:
        return self.left, self.top, self.left + self.width, self.top + self.height

    @property
    def _reach(self) -> float:
        return REACH * self.pixel

    @property
    def speck(self) -> float:
        """px; size below which objects are treated as this large, zero without a border."""
        return 0.0 if math.isinf(self.width) else SPECK * max(self.width, self.height)

    def sides(self, box: Floats) -> Mask:
        """(N, 4) which sides (left, top, right, bottom) of boxes (N, 4) the border cuts."""
        return _sides(box, self._edges, self._reach)

    def cut(self, box: Floats) -> Mask:
        """(N,) boxes that are cut somewhere: their extent changes faster than any vehicle's."""
        return _cut(box, self._edges, self._reach)

    def in_view(self, x: Floats, P: Floats) -> Floats:
        """(N,) probability that positions are within the border: states [x, vx, y, vy, ...] (N, n), P (N, n, n)."""
        return _in_view(x, P, self._edges)

    def relieved(self, box: Floats, v: Floats, alone: Mask, shown: Floats) -> Mask:
        """(N,) boxes (N, 4) that moved out over a side by RETURN of their size, and now move in by as much.

        v      (N, 2) velocities
        alone  (N,) whether each was seen, on a blob of its own; others stay as they are
        shown  (N, 4, 2) where the inner edge of each was inside a side that cuts it, along the normal that points in:
               at most, and at least since. NaN: not cut. Updated
        """
        return _relieved(box, v, alone, self._edges, shown)

    def reaching(self, box: Floats, sides: Mask) -> Floats:
        """Boxes (N, 4) extended to the border on the given sides (N, 4)."""
        return _reaching(box, sides, self._edges)


@kernel
def _sides(box: Floats, edges: tuple[float, float, float, float], reach: float) -> Mask:
    sides = np.zeros((len(box), 4), np.bool_)
    if np.isinf(edges[2]):
        return sides
    for i in range(len(box)):
        for axis in range(2):
            sides[i, axis] = box[i, axis] < edges[axis] + reach
            sides[i, axis + 2] = box[i, axis] + box[i, axis + 2] > edges[axis + 2] - reach
    return sides


@kernel
def _in_view(x: Floats, P: Floats, edges: tuple[float, float, float, float]) -> Floats:
    """(N,) product of both axes' normal probabilities between the edges; a pixel is a unit square around its place."""
    inside = np.ones(len(x))
    if np.isinf(edges[2]):
        return inside
    for i in range(len(x)):
        for axis in range(2):
            variance, at = 2 * P[i, 2 * axis, 2 * axis], x[i, 2 * axis] + 0.5
            below, above = edges[axis] - at, edges[axis + 2] - at
            if below < 0 < above and min(below * below, above * above) > FAR * FAR * variance:
                continue
            sigma = math.sqrt(variance)
            inside[i] *= (math.erfc(-above / sigma) - math.erfc(-below / sigma)) / 2
    return inside


@kernel
def _cut(box: Floats, edges: tuple[float, float, float, float], reach: float) -> Mask:
    cut, sides = np.zeros(len(box), np.bool_), _sides(box, edges, reach)
    for i in range(len(box)):
        cut[i] = sides[i, 0] or sides[i, 1] or sides[i, 2] or sides[i, 3]
    return cut


@kernel
def _reaching(box: Floats, sides: Mask, edges: tuple[float, float, float, float]) -> Floats:
    drawn = np.empty_like(box)
    for i in range(len(box)):
        for axis in range(2):
            near, far = box[i, axis], box[i, axis] + box[i, axis + 2]
            if sides[i, axis]:
                near = min(near, edges[axis])
            if sides[i, axis + 2]:
                far = max(far, edges[axis + 2])
            drawn[i, axis], drawn[i, axis + 2] = near, far - near
    return drawn


@kernel
def _relieved(box: Floats, v: Floats, alone: Mask, edges: tuple[float, float, float, float], shown: Floats) -> Mask:
    relieved = np.zeros(len(box), np.bool_)
    if np.isinf(edges[2]):
        return relieved
    for i in range(len(box)):
        if not alone[i]:
            continue
        for side in range(4):
            axis, inward = side % 2, 1.0 if side < 2 else -1.0
            near, far = inward * box[i, axis], inward * (box[i, axis] + box[i, axis + 2])
            inner, outer, border = max(near, far), min(near, far), inward * edges[side]
            if outer - border > NEAR * max(box[i, 2], box[i, 3]):
                shown[i, side] = np.nan
                continue
            size = np.fmax(max(box[i, 2], box[i, 3]), shown[i, side, 0] - border)  # also what has left
            gone = shown[i, side, 0] - shown[i, side, 1] > RETURN * size
            speed = inward * v[i, axis]
            if not (gone or inner <= shown[i, side, 0]):  # it comes in, or this is the first time
                shown[i, side] = inner
            elif speed <= 0:
                shown[i, side, 1] = min(shown[i, side, 1], inner)
            relieved[i] |= gone and speed > COMES * size and inner - shown[i, side, 1] > RETURN * size
    return relieved

"""The border of the picture: what it cuts, and who is on the way out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.scan import Floats

REACH = 2.0
"""px; a box this close to the border is cut by it."""

Mask = np.ndarray


@dataclass(frozen=True, slots=True)
class Border:
    """A picture of width x height pixels; infinite where a sensor has no border."""

    width: float = np.inf
    height: float = np.inf

    def sides(self, box: Floats) -> Mask:
        """(N, 4) which sides (left, top, right, bottom) of boxes (N, 4) the border cuts."""
        if np.isinf(self.width):
            return np.zeros((len(box), 4), bool)
        near, far = box[:, :2], box[:, :2] + box[:, 2:]
        return np.concatenate([near < REACH, far > (self.width - REACH, self.height - REACH)], axis=1)

    def cut(self, box: Floats) -> Mask:
        """(N,) boxes that are cut somewhere: their extent changes faster than any vehicle's."""
        return np.asarray(self.sides(box).any(axis=1))

    def outside(self, xy: Floats) -> Mask:
        """(N,) positions (N, d) beyond the border."""
        if np.isinf(self.width):
            return np.zeros(len(xy), bool)
        x, y = xy[:, 0], xy[:, 1]
        return (x < 0) | (y < 0) | (x > self.width) | (y > self.height)

    def leaving(self, box: Floats, v: Floats) -> Mask:
        """(N,) boxes cut by the border they move towards with velocities v (N, 2)."""
        sides = self.sides(box)
        near, far = sides[:, :2] & (v[:, :2] < 0), sides[:, 2:] & (v[:, :2] > 0)
        return np.asarray((near | far).any(axis=1))

    def reaching(self, box: Floats, sides: Mask) -> Floats:
        """Boxes (N, 4) drawn out to the border on the given sides (N, 4)."""
        near, far = box[:, :2], box[:, :2] + box[:, 2:]
        near = np.where(sides[:, :2], np.minimum(near, 0.0), near)
        far = np.where(sides[:, 2:], np.maximum(far, (self.width, self.height)), far)
        return np.hstack([near, far - near])

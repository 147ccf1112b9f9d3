"""Learnt from traffic: the size of vehicles at each place, and the places and sizes of what is no vehicle."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.compiled import kernel
from vidtrack.tracking.picture.restless import RestlessMap
from vidtrack.tracking.picture.sizes import SizeField
from vidtrack.tracking.picture.swarm import Swarm
from vidtrack.tracks import Tracks

_CAUTION = 3.0  # times as far must a track travel to be confirmed where the picture is restless
_FASTEST = 1.2  # times as large can a vehicle become from one scan to the next
_EDGE = 2.0  # px; a box this close to the border is cut by it


class Road:
    """Learnt from tracks, scan by scan; used to explain the blobs of the next one."""

    STATE = ("sizes", "restless", "swarm")

    def __init__(self, width: float, height: float, *, careful: bool = True) -> None:
        """width, height of the picture [px]; careful: doubt tracks where others began in vain, or of a swarm."""
        self._wary = careful
        self._width, self._height = width, height
        self.forget()

    def forget(self) -> None:
        """Reset all maps after a change of the camera's view."""
        self.sizes = SizeField(self._width, self._height)
        self.restless = RestlessMap(self._width, self._height)
        self.swarm = Swarm()

    def learn(self, tracks: Tracks) -> None:
        """Take in the tracks of a scan."""
        self.sizes.learn(tracks, _whole(tracks.box, self._width - _EDGE, self._height - _EDGE))
        self.restless.learn(tracks)
        self.swarm.learn(tracks)

    def growth(self, before: Floats, after: Floats) -> Floats:
        """(N, 4) factors by which boxes (N, 4) grow on their way, about a point in them: far vehicles look small."""
        if not self.sizes.known or not len(before):
            return np.ones((len(before), 4))
        return _growth(self.sizes.typical(before), self.sizes.typical(after))

    @property
    def flake(self) -> float:
        """Longer side [px] up to which an object is taken for a flake or a drop; zero without a swarm of them."""
        return self.swarm.size if self._wary else 0.0

    def travel_factor(self, xy: Floats, size: Floats) -> Floats:
        """(N,) how much farther than elsewhere tracks at xy (N, 2) of sizes (N,) must travel to be believed."""
        if not self._wary:
            return np.ones(len(xy))
        factor = np.where(self.restless.restless(xy), _CAUTION, 1.0)
        factor[size <= self.flake] = np.inf
        return factor


@kernel
def _whole(box: Floats, right: float, bottom: float) -> Mask:
    """(N,) boxes (N, 4) that no border cuts."""
    whole = np.empty(len(box), np.bool_)
    for i in range(len(box)):
        left, top, width, height = box[i, 0], box[i, 1], box[i, 2], box[i, 3]
        whole[i] = left > _EDGE and top > _EDGE and left + width < right and top + height < bottom
    return whole


@kernel
def _growth(before: Floats, after: Floats) -> Floats:
    """(N, 4) bounded ratios of typical sizes (N, 2), for both corners and both sides of boxes; 1 where unknown."""
    growth = np.ones((len(before), 4))
    for i in range(len(before)):
        for axis in range(2):
            ratio = after[i, axis] / before[i, axis]
            if not np.isnan(ratio):
                growth[i, axis] = growth[i, axis + 2] = min(max(ratio, 1 / _FASTEST), _FASTEST)
    return growth

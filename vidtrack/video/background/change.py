"""Tell a change of the whole picture (light, view) from traffic, by how much is foreground and how fast it came."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.video.frame import Image

_SUDDEN_SHARE, _SUDDEN_S = 0.25, 0.2  # of the picture, in at most this time: traffic does not come so fast


class Change:
    """Watches the foreground's share of the picture."""

    def __init__(self, largest_share: float) -> None:
        """largest_share: more foreground than that is no traffic, however slowly it came."""
        self._largest_share = largest_share
        self._steady_share = 0.0  # when the picture was last steady,
        self._steady_s = math.inf  # which was then
        self._time_s = math.inf

    def lasted_s(self, mask: Image, time_s: float) -> float:
        """Seconds since the picture was steady, 0 while it is; mask (h, w)."""
        share = np.count_nonzero(mask) / mask.size
        sudden = time_s - self._time_s <= _SUDDEN_S or self._steady_s < self._time_s
        self._time_s = time_s
        if share > self._largest_share or (sudden and share - self._steady_share > _SUDDEN_SHARE):
            return time_s - self._steady_s
        self._steady_share, self._steady_s = share, time_s
        return 0.0

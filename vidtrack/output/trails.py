"""Recent positions of each track."""

from __future__ import annotations

from collections import deque

import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats, Ints
from vidtrack.tracks import Status, Tracks


class Trails:
    """Positions of all tracks but tentative ones over the last `seconds`."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._scans: deque[tuple[float, Ints, Floats]] = deque()

    def step(self, tracks: Tracks) -> None:
        """Add a scan and drop those older than `seconds`."""
        shown = tracks.status != Status.TENTATIVE
        self._scans.append((tracks.t, tracks.id[shown], tracks.xy[shown]))
        while tracks.t - self._scans[0][0] > self._seconds:
            self._scans.popleft()

    def paths(self, motion: Floats | None = None) -> dict[int, Floats]:
        """(n, d) positions in order of time for each track of the last scan.

        motion  (2, 3) from the scene to the picture; None: identity
        """
        if not self._scans:
            return {}
        alive = self._scans[-1][1]
        ids = np.concatenate([scan[1] for scan in self._scans])
        xy = np.concatenate([scan[2] for scan in self._scans])
        xy = xy if motion is None else affine.points(motion, xy)
        order = np.argsort(ids, kind="stable")
        ids, xy = ids[order], xy[order]
        first, last = np.searchsorted(ids, alive), np.searchsorted(ids, alive, side="right")
        return {int(i): xy[a:b] for i, a, b in zip(alive, first, last, strict=True)}

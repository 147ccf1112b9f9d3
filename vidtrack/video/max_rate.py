"""Which pictures are looked at, if there are more in a second than the user wants."""

from __future__ import annotations

from math import inf

import numpy as np

_EARLY = 0.25
"""Share of an interval by which a picture may come before it: stamps are rounded, and cameras jitter"""


class MaxRate:
    """Chooses the first picture in each of equal intervals of time, so that there are no more than `fps` a second.

    fps      frames/s; None: all pictures are chosen
    since_s  begin of an interval [s]; None: the time of the first picture
    after_s  time of the picture before the first one [s]; -inf: there was none

    With `since_s`, the intervals do not depend on the pictures: readings of a video from different places agree.
    """

    def __init__(self, fps: float | None, since_s: float | None = None, after_s: float = -inf) -> None:
        self._fps = fps
        self._since_s = since_s
        self._last = -inf if fps is None or since_s is None else _interval(after_s - since_s, fps)

    def chooses(self, time_s: float) -> bool:
        """Whether the picture of this time is looked at; times do not decrease."""
        if self._fps is None:
            return True
        if self._since_s is None:
            self._since_s = time_s
        last, self._last = self._last, _interval(time_s - self._since_s, self._fps)
        return self._last > last


def _interval(time_s: float, fps: float) -> float:
    """Number of the interval to which a time belongs."""
    return float(np.floor(time_s * fps + _EARLY))

"""Which pictures are looked at, if there are more in a second than the user wants."""

from __future__ import annotations

from math import floor, inf

_EARLY, _EARLY_PICTURE = 0.25, 0.4
"""A picture may come before its interval by these shares of the interval and of the time from picture to picture, the
lesser of both: stamps are rounded, and cameras jitter"""


class MaxRate:
    """Chooses the first picture in each of equal intervals of time, so that there are no more than `most` a second.

    most     frames/s; None: all pictures are chosen
    fps      nominal frames/s of the source; all are chosen if these are no more than `most`; None: not known for sure
    since_s  begin of an interval [s]; None: the time of the first picture

    With `since_s`, readings of a video from different places agree one interval after they begin.
    """

    def __init__(self, most: float | None, fps: float | None = None, since_s: float | None = None) -> None:
        self._most = None if most is None or (fps is not None and fps <= most) else most
        self._early = _EARLY if fps is None or most is None else min(_EARLY, _EARLY_PICTURE * most / fps)
        self._since_s = since_s
        self._last = -inf

    def chooses(self, time_s: float) -> bool:
        """Whether the picture of this time is looked at; times do not decrease."""
        if self._most is None:
            return True
        if self._since_s is None:
            self._since_s = time_s
        last, self._last = self._last, floor((time_s - self._since_s) * self._most + self._early)
        return self._last > last

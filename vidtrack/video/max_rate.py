"""Which pictures are looked at, if there are more in a second than the user wants."""

from __future__ import annotations

from math import floor, inf

_EARLY = 0.4
"""Time from picture to picture by which one may come before its interval: stamps are rounded, and cameras jitter"""
_EARLY_AT_ANY_RATE = 0.25
"""The same in intervals, where the source's rate is not known for sure"""


class MaxRate:
    """Chooses the first picture in each of equal intervals of time, so that there are no more than `most` a second.

    most     frames/s; None: all pictures are chosen
    fps      nominal frames/s of the source, of which `most` is a whole part; None: not known for sure
    since_s  begin of an interval [s]; None: the time of the first picture

    With `since_s`, readings of a video from different places agree one interval after they begin.
    """

    def __init__(self, most: float | None, fps: float | None = None, since_s: float | None = None) -> None:
        self._most = None if most == fps else most
        self._early = _EARLY_AT_ANY_RATE if fps is None or most is None else _EARLY * most / fps
        self._since_s = since_s
        self._last: float = -inf

    @property
    def chooses_all(self) -> bool:
        """Whether all pictures are chosen."""
        return self._most is None

    def chooses(self, time_s: float) -> bool:
        """Whether the picture of this time is looked at; times do not decrease."""
        if self.chooses_all:
            return True
        if self._since_s is None:
            self._since_s = time_s
        last, self._last = self._last, self.interval(time_s)
        return self._last > last

    def interval(self, time_s: float) -> int:
        """Number of the interval in which this time is, of a rate with a limit and a begin."""
        assert self._most is not None
        assert self._since_s is not None
        return floor((time_s - self._since_s) * self._most + self._early)

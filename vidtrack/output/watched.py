"""When pictures came: spans of time without a longer pause."""

from __future__ import annotations

PAUSE_S = 2.0
"""A longer time without a picture was not watched"""
_USUAL = 5.0
"""The same in usual times between two pictures, for slow cameras"""
_MEMORY = 0.1
_LONGEST_S = 10.0
"""One pause counts no more than this in the usual time"""


class Watched:
    """Takes the time of each picture.

    usual_s  nominal time between two pictures

    spans    [first, last] picture of each span [s]
    """

    def __init__(self, usual_s: float) -> None:
        self.spans: list[list[float]] = []
        self._usual_s = usual_s

    def add(self, time_s: float) -> None:
        """Continue the last span, or begin one after a pause."""
        time_s = round(time_s, 6)
        if not self.spans:
            self.spans.append([time_s, time_s])
            return
        pause = time_s - self.spans[-1][1]
        self._usual_s += _MEMORY * (min(pause, _LONGEST_S) - self._usual_s)
        if pause > max(PAUSE_S, _USUAL * self._usual_s):
            self.spans.append([time_s, time_s])
        else:
            self.spans[-1][1] = time_s

"""One clock for the messages of a feed: time of day goes on after midnight, and jumps are told from strays."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from vidtrack.radar.feeds.messages import Losses, Messages

DAY_S = 86400.0
JUMP_S = 30.0
"""s; a larger step between two messages is a jump: a pause, a clock that was set, or one stray message."""
BELIEVED = 3
"""Messages in a row that agree on a new time, before it is believed."""


class Clock:
    """Seconds since midnight of the first day for messages in order of arrival.

    A message that is more than JUMP_S after the one before, or more than disorder_s before it, is set aside, unless
    BELIEVED in a row agree: then the clock has jumped. After a jump forward there is a gap, which a pause of the radar
    would leave as well; after one back, time goes on without one.

    disorder_s  s; by how much a message may be older than the one before
    """

    def __init__(self, losses: Losses, disorder_s: float = JUMP_S) -> None:
        self._losses, self._disorder_s = losses, disorder_s
        self._last: float | None = None
        self._offset = 0.0
        self._suspect, self._agreed = 0.0, 0

    def on_one_clock(self, messages: Messages) -> Messages:
        """The messages that can be believed, with time_s since midnight of the first day."""
        time_s = np.array([self._time(clock_s) for clock_s in messages.time_s.tolist()])
        believed = np.isfinite(time_s)
        self._losses.strayed += len(messages) - int(believed.sum())
        return replace(messages, time_s=time_s).only(believed)

    def _time(self, clock_s: float) -> float:
        """The time of the next message, NaN if it strays. One that does not say its time has that of the last one."""
        if math.isnan(clock_s):
            return math.nan if self._last is None else self._last
        if self._last is None:
            self._last = clock_s
            return clock_s
        step = within_a_day(clock_s + self._offset - self._last)
        if not -self._disorder_s <= step <= JUMP_S:
            agrees = self._agreed and abs(within_a_day(clock_s - self._suspect)) <= JUMP_S
            self._suspect, self._agreed = clock_s, self._agreed + 1 if agrees else 1
            if self._agreed < BELIEVED:
                return math.nan
            if step < 0:
                self._losses.resets += 1
                self._offset -= step
                step = 0.0
        self._agreed = 0
        self._last += step
        return self._last


def within_a_day(step: float) -> float:
    """The same step between two times of day, in -12 to 12 hours."""
    return step - DAY_S * round(step / DAY_S)

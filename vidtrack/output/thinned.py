"""Leaves frames out of the files of tracks."""

from __future__ import annotations

from vidtrack.output.sink import Sink, Step
from vidtrack.output.threaded import close_together


class Pace:
    """Chooses times that are at least `every_s` [s] apart; 0: all."""

    def __init__(self, every_s: float) -> None:
        self._every_s = every_s
        self._due_s = 0.0

    def __call__(self, time_s: float) -> bool:
        """Whether this time is chosen; times do not decrease."""
        if self._every_s and time_s < self._due_s - 1e-6:
            return False
        self._due_s = time_s + self._every_s
        return True


class Thinned:
    """Passes on to `sinks` the steps that are at least `every_s` apart."""

    def __init__(self, *sinks: Sink, every_s: float) -> None:
        self._sinks = sinks
        self._pace = Pace(every_s)

    def step(self, step: Step) -> None:
        """Receive a step; pass it on if it is chosen."""
        if self._pace(step.time_s):
            for sink in self._sinks:
                sink.step(step)

    def close(self) -> None:
        """Close the sinks."""
        close_together(*self._sinks)

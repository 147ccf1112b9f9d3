"""Capture times of pictures on this machine's monotonic clock, from camera timestamps and arrival times."""

from __future__ import annotations

import math

DRIFT = 0.002  # how fast the least delay may grow: more than clocks drift, so that a short pause is forgotten
LATE_S = 2.0  # a delay that grows more than this was a pause of the camera, or its stamps were restarted
EARLY_S = 2.0  # stamps that jump ahead of the arrivals by more than this were restarted
STEP_S = 1e-4  # times of pictures that have none of their own stay apart by this


class CaptureClock:
    """Converts timestamps and arrival times into strictly increasing capture times.

    The delay between stamp and arrival is at least the network's latency. So the smallest delay seen, with slow growth
    allowed, is the offset between the camera's clock and ours, and a picture that the network delays keeps its capture
    time.

    patient  the reader waits for its consumer, so a growing delay does not count as a pause of the camera
    """

    def __init__(self, patient: bool = False) -> None:
        self._late_s = math.inf if patient else LATE_S
        self._delay_s = math.nan  # least arrival - stamp
        self._last_stamp_s = -math.inf
        self._last_s = -math.inf

    def reconnected(self) -> None:
        """Forget the stamps; times go on increasing."""
        self._delay_s = math.nan
        self._last_stamp_s = -math.inf

    def time_s(self, stamp_s: float | None, arrived_s: float) -> float:
        """Monotonic time at which the camera had the picture ready; stamp_s None if the stream has no stamps."""
        t = arrived_s if stamp_s is None else self._by_stamp(stamp_s, arrived_s)
        self._last_s = max(t, self._last_s + STEP_S)
        return self._last_s

    def _by_stamp(self, stamp_s: float, arrived_s: float) -> float:
        delay = arrived_s - stamp_s
        step = stamp_s - self._last_stamp_s
        self._last_stamp_s = stamp_s
        grown = delay - self._delay_s
        if not (step > 0 and -EARLY_S < grown < self._late_s):  # also for the first, whose delay is unknown
            self._delay_s = delay
        else:
            self._delay_s = min(delay, self._delay_s + DRIFT * step)
        return stamp_s + self._delay_s

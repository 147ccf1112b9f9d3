"""Statistics of a live source."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field

from vidtrack.video.stats import SourceStats, log

_REMEMBERED = 20
_RATE_S = 10.0


@dataclass(slots=True)
class LiveStats(SourceStats):
    """Counters and state of a camera.

    received    pictures received: read, dropped, or left out for `max_fps`
    reconnects  connections after the first
    stalls      time-outs of an open connection
    state       "connecting", "running", "waiting" (before another attempt) or "ended"
    problems    (Unix time [s], message) of the last problems
    """

    received: int = 0
    reconnects: int = 0
    stalls: int = 0
    state: str = "connecting"
    problems: deque[tuple[float, str]] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))
    _arrivals: deque[float] = field(default_factory=lambda: deque(maxlen=100), repr=False)

    def warn(self, message: str) -> None:
        """Log a warning and keep it among the last problems; the list is bounded."""
        self.note(message)
        log.warning(message)

    def note(self, message: str) -> None:
        """Keep a problem without logging it."""
        self.problems.append((time.time(), message))

    def arrived(self, now_s: float) -> None:
        """Count a picture."""
        self.received += 1
        self._arrivals.append(now_s)

    def left_out(self, now_s: float) -> None:
        """Count a picture that nobody decodes; before the first one that was, nobody knows that it is one."""
        if self.received:
            self.arrived(now_s)

    def rate(self, now_s: float) -> float:
        """Pictures per second in the last seconds; 0 while none arrive."""
        times = [time_s for time_s in list(self._arrivals) if now_s - time_s < _RATE_S]
        return (len(times) - 1) / max(now_s - times[0], 1e-3) if len(times) > 1 else 0.0

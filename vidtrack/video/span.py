"""The span of media time of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vidtrack.config.settings import SourceSettings

ROUNDING_S = 1e-6  # 3 * 0.1 s still belongs to a span that ends at 0.3 s


@dataclass(frozen=True, slots=True)
class Span:
    """From `start_s` to `end_s`, both included."""

    start_s: float
    end_s: float

    @classmethod
    def of(cls, settings: SourceSettings) -> Span:
        """The user's span; without an end it is open."""
        return cls(settings.start_s, math.inf if settings.end_s is None else settings.end_s)

    def begun(self, time_s: float) -> bool:
        """Whether `time_s` is not before the span."""
        return time_s >= self.start_s - ROUNDING_S

    def over(self, time_s: float) -> bool:
        """Whether `time_s` is after the span."""
        return time_s > self.end_s + ROUNDING_S

    def frames(self, fps: float, count: int) -> range:
        """Which of `count` evenly spaced frames lie in the span."""
        first = math.ceil((self.start_s - ROUNDING_S) * fps)
        last = math.floor(min((self.end_s + ROUNDING_S) * fps, count - 1))
        return range(max(first, 0), last + 1)

    def __str__(self) -> str:
        return f"{self.start_s:g} s and {'its end' if math.isinf(self.end_s) else f'{self.end_s:g} s'}"

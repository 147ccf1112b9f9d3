"""Where a long video is cut."""

from __future__ import annotations

from dataclasses import dataclass

OVERLAP_S = 5.0
"""Slices with a warm-up track this much before and after a cut; the seam is laid at the quietest moment in it."""


@dataclass(frozen=True, slots=True)
class Cut:
    """One slice of a video, times in seconds of the file.

    number          from 0
    begin_s, end_s  what the slice answers for, without end_s itself; None: to the end of the file
    warm_s          length of the warm-up before begin_s; None: the slice goes on from the state of the one before it
    """

    number: int
    begin_s: float
    end_s: float | None
    warm_s: float | None

    @property
    def from_s(self) -> float:
        """The slice is tracked from here on."""
        return max(0.0, self.begin_s - (self.warm_s or 0.0))

    @property
    def to_s(self) -> float | None:
        """The slice is tracked up to here."""
        return None if self.end_s is None else self.end_s + self._overlap_s

    @property
    def kept_from_s(self) -> float:
        """Steps before this time are warm-up only."""
        return self.begin_s - self._overlap_s

    def holds(self, time_s: float) -> bool:
        """Whether a frame is tracked here; slices that go on from each other share none."""
        if self.warm_s is not None:
            return True
        return (self.number == 0 or time_s >= self.begin_s) and (self.end_s is None or time_s < self.end_s)

    @property
    def goes_on(self) -> bool:
        """Whether the slice begins with the state of the one before it."""
        return self.warm_s is None and self.number > 0

    @property
    def _overlap_s(self) -> float:
        return 0.0 if self.warm_s is None else OVERLAP_S


def cuts(begin_s: float, end_s: float | None, length_s: float, slice_s: float, warm_s: float | None) -> list[Cut]:
    """Equal slices of a video, as near to slice_s [s] as they divide it.

    begin_s, end_s  the span that is tracked; None: to the end of the file
    length_s        of the file, as it states
    warm_s          least length of the warm-up of all slices but the first; None: the state is handed on
    """
    last_s = length_s if end_s is None else min(end_s, length_s)
    count = max(1, round((last_s - begin_s) / slice_s)) if last_s > begin_s else 1
    each_s = (last_s - begin_s) / count
    begins = [begin_s + number * each_s for number in range(count)]
    ends = [*begins[1:], end_s]
    warm = None if warm_s is None else max(warm_s, OVERLAP_S)
    return [
        Cut(number, begin, end, warm if warm is None else min(warm, begin - begin_s))
        for number, (begin, end) in enumerate(zip(begins, ends, strict=True))
    ]

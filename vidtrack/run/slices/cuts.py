"""Where a long video is cut."""

from __future__ import annotations

from dataclasses import dataclass

OVERLAP_S = 5.0
"""Both neighbours track this much before and after a cut; the seam is laid at the quietest moment in it."""


@dataclass(frozen=True, slots=True)
class Cut:
    """One slice of a video, times in seconds of the file.

    number          from 0
    from_s          the warm-up begins here; the decoder begins with the key picture before
    begin_s, end_s  what the slice answers for; None: to the end of the file
    """

    number: int
    from_s: float
    begin_s: float
    end_s: float | None

    @property
    def kept_from_s(self) -> float:
        """Steps before this time are warm-up only."""
        return self.begin_s - OVERLAP_S if self.number else self.begin_s

    @property
    def to_s(self) -> float | None:
        """The slice is tracked up to here."""
        return None if self.end_s is None else self.end_s + OVERLAP_S


def cuts(begin_s: float, end_s: float | None, length_s: float, slice_s: float, warm_s: float) -> list[Cut]:
    """Equal slices of a video, as near to slice_s [s] as they divide it.

    begin_s, end_s  the span that is tracked; None: to the end of the file
    length_s        of the file, as it states
    warm_s          length of the warm-up of all slices but the first
    """
    last_s = length_s if end_s is None else min(end_s, length_s)
    count = max(1, round((last_s - begin_s) / slice_s)) if last_s > begin_s else 1
    each_s = (last_s - begin_s) / count
    begins = [begin_s + number * each_s for number in range(count)]
    ends = [*begins[1:], end_s]
    return [
        Cut(number, max(begin_s, begin - max(warm_s, OVERLAP_S)) if number else begin_s, begin, end)
        for number, (begin, end) in enumerate(zip(begins, ends, strict=True))
    ]

"""The way of each vehicle as a whole, for formats that store vehicles and not moments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.output.export.road_run import RoadRun, Rows

_LATEST = 1.75
"""Times between two rows after which the next one may come: not two, where one is missing"""


@dataclass(frozen=True, slots=True)
class Piece:
    """The rows of a track without a gap. `number`: of the track's pieces, from 1."""

    track: int
    number: int
    kind: str
    rows: Rows

    @property
    def name(self) -> str:
        """The track's number, and the piece's from the second on."""
        return str(self.track) if self.number == 1 else f"{self.track}.{self.number}"


def pieces(run: RoadRun) -> Iterator[Piece]:
    """All pieces of all tracks, each as soon as it ends: memory holds what is in view at once.

    A track that leaves the calibrated part of the road and comes back has two: nothing is drawn where it was not seen.
    """
    parts: dict[int, list[Rows]] = {}
    counts: dict[int, int] = {}

    def ended(track: int) -> Piece:
        counts[track] = counts.get(track, 0) + 1
        (kind,) = run.vehicles.kind[run.vehicles.row(np.array([track]))].tolist()
        return Piece(track, counts[track], kind, _joined(parts.pop(track)))

    gap = _Gap(_LATEST * run.every_s)
    for rows in run.batches():
        for part in _unbroken(rows, gap):
            track = int(part.track[0])
            if track in parts and gap.between(parts[track][-1], part.frame[0], part.time[0]):
                yield ended(track)
            parts.setdefault(track, []).append(part)
        now = rows.frame[-1], rows.time[-1]  # the last frame may go on in the next batch
        for track in [track for track, found in parts.items() if gap.between(found[-1], *now)]:
            yield ended(track)
    for track in list(parts):
        yield ended(track)


@dataclass(frozen=True, slots=True)
class _Gap:
    """What counts as a gap: a missing frame, and where there are not rows of all, more than `longest_s` [s]."""

    longest_s: float

    def __call__(self, frames: Ints, seconds: Floats) -> Mask:
        """Whether so many frames and seconds from one row to the next are a gap."""
        return (frames > 1) & (seconds > self.longest_s)

    def between(self, rows: Rows, frame: int, time_s: float) -> bool:
        """Whether there is one between the last of the rows and a frame."""
        return bool(self(frame - rows.frame[-1], time_s - rows.time[-1]))


def _unbroken(rows: Rows, gap: _Gap) -> Iterator[Rows]:
    """The rows of each track, cut at gaps."""
    rows = rows.select(np.lexsort((rows.frame, rows.track)))
    cut = (np.diff(rows.track) != 0) | gap(np.diff(rows.frame), np.diff(rows.time))
    ends = [0, *(np.flatnonzero(cut) + 1).tolist(), len(rows)]
    yield from (rows.select(slice(first, end)) for first, end in pairwise(ends))


def _joined(parts: list[Rows]) -> Rows:
    return Rows(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Rows)))

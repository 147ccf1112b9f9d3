"""The way of each vehicle as a whole, for formats that store vehicles and not moments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from vidtrack.output.export.road_run import RoadRun, Rows


@dataclass(frozen=True, slots=True)
class Piece:
    """The rows of a track in frames without a gap. `number`: of the track's pieces, from 1."""

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

    for rows in run.batches():
        for part in _unbroken(rows):
            track = int(part.track[0])
            if track in parts and parts[track][-1].frame[-1] + 1 < part.frame[0]:
                yield ended(track)
            parts.setdefault(track, []).append(part)
        open_from = rows.frame[-1] - 1  # the last frame may go on in the next batch
        for track in [track for track, found in parts.items() if found[-1].frame[-1] < open_from]:
            yield ended(track)
    for track in list(parts):
        yield ended(track)


def _unbroken(rows: Rows) -> Iterator[Rows]:
    """The rows of each track, cut at gaps."""
    rows = rows.select(np.lexsort((rows.frame, rows.track)))
    cut = (np.diff(rows.track) != 0) | (np.diff(rows.frame) != 1)
    ends = [0, *(np.flatnonzero(cut) + 1).tolist(), len(rows)]
    yield from (rows.select(slice(first, end)) for first, end in pairwise(ends))


def _joined(parts: list[Rows]) -> Rows:
    return Rows(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Rows)))

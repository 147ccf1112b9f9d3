"""mot.txt: tracks in the form of MOTChallenge, for its evaluation tools."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa

from vidtrack.arrays.types import Floats, Ints
from vidtrack.output.linefile import Every, LineFile
from vidtrack.output.sink import Step
from vidtrack.output.tables import csv_text, stacked

_FRAME, _ID, _SEEN = 0, 1, 7


class MotFile:
    """Sink that writes `frame,id,left,top,width,height,conf,-1,-1,-1`, frames from 1, sorted by frame and id.

    The rows of a gap wait until the track is measured again; they are dropped if the track ends first. Rows of later
    frames wait too, so that the file is always sorted and memory is bounded by the longest gap. `conf` is the track's
    probability of existence.

    waits  whether rows of an open gap wait
    """

    def __init__(self, path: Path) -> None:
        self._file = LineFile(path)
        self._steps: list[Step] = []
        self._waiting = np.empty((0, 8))
        self._due = Every(1.0)
        self._last: float = np.inf  # number of the last frame

    @property
    def waits(self) -> bool:
        """Whether rows of a gap wait for later frames."""
        return bool((self._waiting[:, _FRAME] <= self._last).any())

    def end(self) -> None:
        """The frames so far are all; later steps only tell whether tracks in a gap are found again."""
        self.flush()
        self._last = self._waiting[:, _FRAME].max(initial=-np.inf)

    def step(self, step: Step) -> None:
        """Receive one frame's confirmed tracks."""
        self._steps.append(step.in_picture())
        if self._due():
            self.flush()

    def close(self) -> None:
        """Write the waiting rows without those of open gaps."""
        try:
            self._write(alive=np.empty(0, np.int64))
        finally:
            self._file.close()

    def flush(self) -> None:
        """Write the rows before the first open gap."""
        if self._steps:
            self._write(alive=self._steps[-1].tracks.id)

    def _write(self, alive: Ints) -> None:
        rows = np.concatenate([self._waiting, _rows(self._steps)]) if self._steps else self._waiting
        decided, self._waiting = settle_gaps(rows, alive)
        decided = decided[decided[:, _FRAME] <= self._last]
        self._steps.clear()
        self._file.add(_lines(decided))
        self._file.flush()


def _rows(steps: Sequence[Step]) -> Floats:
    """(N, 8) frame, id, left, top, width, height, conf, seen; tracks without a box are left out."""
    frame = np.repeat([step.index + 1 for step in steps], [len(step.tracks) for step in steps])
    box, existence = stacked(steps, "box"), stacked(steps, "existence")
    conf = np.where(np.isnan(existence), 1.0, existence)
    rows = np.column_stack([frame, stacked(steps, "id"), box, conf, stacked(steps, "seen")])
    return rows[~np.isnan(box).any(axis=1)]


def settle_gaps(rows: Floats, alive: Ints) -> tuple[Floats, Floats]:
    """Rows to write now, and rows that wait: those from the first open gap on.

    rows   (N, 8) see _rows, sorted by frame; an unseen row is written if its track is seen later, else dropped
    alive  ids of the tracks that may still be seen again
    """
    frame, seen = rows[:, _FRAME], rows[:, _SEEN] > 0
    ids, index = np.unique(rows[:, _ID], return_inverse=True)
    last_seen = np.zeros(len(ids))
    np.maximum.at(last_seen, index[seen], frame[seen])
    sure = frame <= last_seen[index]
    open_gap = ~sure & np.isin(rows[:, _ID], alive)
    early = frame < frame[open_gap].min(initial=np.inf)
    return rows[sure & early], rows[(sure | open_gap) & ~early]


def _lines(rows: Floats) -> str:
    rows = rows[np.lexsort((rows[:, _ID], rows[:, _FRAME]))]
    number = rows[:, [_FRAME, _ID]].astype(np.int64)
    unused = np.full((len(rows), 3), -1)
    columns = [*number.T, *np.round(rows[:, 2:6], 2).T, np.round(rows[:, 6], 3), *unused.T]
    return csv_text(pa.table(columns, [str(i) for i in range(len(columns))]))

"""mot.txt: tracks in MOTChallenge form, for its evaluation tools."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa

from vidtrack.output.linefile import Every, LineFile, sort_rows
from vidtrack.output.sink import Step
from vidtrack.output.tables import csv_text
from vidtrack.scan import Floats, Ints

_FRAME, _ID, _SEEN = 0, 1, 7


class MotFile:
    """Sink that writes `frame,id,left,top,width,height,conf,-1,-1,-1`, frames from 1.

    Measured and merged rows are written every second. The rows of a gap wait until the track is found
    again, and are dropped at its death: nobody saw it go there. `close` sorts the file by frame and id.
    `conf` is the track's probability of existence.
    """

    def __init__(self, path: Path) -> None:
        self._file = LineFile(path)
        self._steps: list[Step] = []
        self._gaps = np.empty((0, 8))
        self._due = Every(1.0)

    def step(self, step: Step) -> None:
        """Take one frame's confirmed tracks."""
        self._steps.append(step)
        if self._due():
            self._write()

    def close(self) -> None:
        """Write what waits; gaps that stayed open are dropped."""
        try:
            self._write()
        finally:
            self._file.close()
        sort_rows(self._file.path, columns=2, header=False)

    def _write(self) -> None:
        if not self._steps:
            return
        rows = np.concatenate([self._gaps, *(_rows(step) for step in self._steps)])
        sure, self._gaps = settle_gaps(rows, self._steps[-1].tracks.id)
        self._steps.clear()
        self._file.add(_lines(sure))
        self._file.flush()


def _rows(step: Step) -> Floats:
    """(T, 8) frame, id, left, top, width, height, conf, seen."""
    tracks = step.tracks
    frame = np.full(len(tracks), step.index + 1)
    conf = np.where(np.isnan(tracks.existence), 1.0, tracks.existence)
    rows = np.column_stack([frame, tracks.id, tracks.box, conf, tracks.seen])
    return rows[~np.isnan(tracks.box).any(axis=1)]


def settle_gaps(rows: Floats, alive: Ints) -> tuple[Floats, Floats]:
    """Rows that are sure, and the gap rows that still wait; gaps of dead tracks are in neither.

    rows   (N, 8) see _rows; a row that was not seen is sure once its track was seen later
    alive  ids of the tracks that may be found again
    """
    ids, index = np.unique(rows[:, _ID], return_inverse=True)
    last_seen = np.zeros(len(ids))
    seen = rows[:, _SEEN] > 0
    np.maximum.at(last_seen, index[seen], rows[seen, _FRAME])
    sure = rows[:, _FRAME] <= last_seen[index]
    return rows[sure], rows[~sure & np.isin(rows[:, _ID], alive)]


def _lines(rows: Floats) -> str:
    number = rows[:, [_FRAME, _ID]].astype(np.int64)
    unused = np.full((len(rows), 3), -1)
    columns = [*number.T, *np.round(rows[:, 2:6], 2).T, np.round(rows[:, 6], 3), *unused.T]
    return csv_text(pa.table(columns, [str(i) for i in range(len(columns))]))

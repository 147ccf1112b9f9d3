"""The files of one part of a live run: the same as those of a run over a video."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from vidtrack.errors import StoppedEarly
from vidtrack.output.counts import HEADER
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.linefile import LineFile, sort_rows
from vidtrack.output.mot import MotFile
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.repair import add_parquet
from vidtrack.output.sink import Step
from vidtrack.output.summary import Summary
from vidtrack.output.tables import ROAD, VIDEO, csv_text, track_rows
from vidtrack.traffic.lines import LineCounter
from vidtrack.video.frame import Image

if TYPE_CHECKING:
    from vidtrack.traffic.footprint import Footprints


class Part:
    """Tables that grow, and what is made of them when the part ends. Raises StoppedEarly when the disk refuses.

    shape    (H, W) of the source
    scene    gives the (H, W, 3) background for tracks.png
    summary  makes the summary at a path
    counter  counts on through all parts; None without lines
    road     places vehicles on the road, through all parts; None without a calibrated site
    """

    def __init__(
        self,
        folder: Path,
        shape: tuple[int, int],
        scene: Callable[[], Image],
        summary: Callable[[Path], Summary],
        counter: LineCounter | None,
        road: Footprints | None,
        decisions: bool,
    ) -> None:
        self.folder = folder
        self._columns = VIDEO if road is None else (*VIDEO, *ROAD)
        self._road = road
        self._counter = counter
        with ExitStack() as stack:  # if the disk is full, what is open by then is closed
            self._summary = summary(folder / "summary.json")
            self._tracks = LineFile(folder / "tracks.csv", ",".join(column.name for column in self._columns) + "\n")
            stack.callback(self._tracks.close)
            self._mot = MotFile(folder / "mot.txt")
            stack.callback(self._mot.close)
            self._counts = self._decisions = None
            if counter is not None:
                self._counts = LineFile(folder / "counts.csv", HEADER)
                stack.callback(self._counts.close)
            if decisions:
                self._decisions = DecisionLog(folder / "decisions.csv")
                stack.callback(self._decisions.close)
            self._plot = TrajectoryPlot(folder / "tracks.png", shape, scene, counter.lines if counter else ())
            self._files = stack.pop_all()

    def write(self, steps: Sequence[Step], crossings: str) -> None:
        """Put the rows of confirmed tracks, and rows of counts.csv, on the disk."""
        filled = [step for step in steps if len(step.tracks)]
        if filled:
            _write(self._tracks, csv_text(track_rows(filled, self._columns, self._road)))
        if self._counts is not None and crossings:
            _write(self._counts, crossings)
        for step in steps:
            self._mot.step(step)
            self._plot.step(step)
            if self._decisions is not None:
                self._decisions.step(step)
        self._mot.flush()
        count(self._summary, steps)

    def finish(self) -> None:
        """Close the tables, sort them, and add tracks.parquet and tracks.png."""
        with ExitStack() as stack:
            self._summary.interrupted = False
            stack.callback(self._summary.close)
            stack.callback(self._plot.close)
            stack.callback(add_parquet, self.folder)
            if self._counts is not None:
                stack.callback(sort_rows, self._counts.path, columns=1, header=True)
            stack.push(self._files)


def count(summary: Summary, steps: Sequence[Step]) -> None:
    """Bring a summary up to date; if the disk refuses it now, the next one says the same and more."""
    for step in steps:
        with suppress(StoppedEarly):
            summary.step(step)


def _write(file: LineFile, lines: str) -> None:
    """Bring lines to the disk, safe from a power cut."""
    file.add(lines)
    file.flush()
    file.sync()

"""The files of tracks in one part of a live run, by how much is to be written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Protocol

import pyarrow as pa

from vidtrack.config.names import Level
from vidtrack.output.linefile import LineFile
from vidtrack.output.mot import MotFile
from vidtrack.output.parquet import ParquetParts
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.repair import add_parquet
from vidtrack.output.sink import Step
from vidtrack.output.tables import Column, csv_text, schema
from vidtrack.run.sinks import Subject


class TrackFiles(Protocol):
    """Files of tracks. Methods raise StoppedEarly on a write error."""

    def write(self, steps: Sequence[Step], rows: pa.Table | None) -> None:
        """Write steps of confirmed tracks, and their rows."""

    def end(self) -> None:
        """No more steps will be written; tracks in a gap may still be found again."""

    def is_settled(self, later: Sequence[Step]) -> bool:
        """Whether no gap is open, given the steps after the part."""

    def finish(self) -> None:
        """Complete and close the files."""


class AllFiles:
    """tracks.csv and mot.txt as the tracks come; tracks.parquet and tracks.png at the end."""

    def __init__(self, folder: Path, subject: Subject, columns: Sequence[Column]) -> None:
        self._folder = folder
        with ExitStack() as stack:  # on a full disk, files already open are closed
            self._tracks = LineFile(folder / "tracks.csv", ",".join(column.name for column in columns) + "\n")
            stack.callback(self._tracks.close)
            self._mot = MotFile(folder / "mot.txt")
            stack.callback(self._mot.close)
            self._plot = TrajectoryPlot(folder / "tracks.png", subject.shape, subject.scene, subject.lines)
            self._files = stack.pop_all()

    def write(self, steps: Sequence[Step], rows: pa.Table | None) -> None:
        """Write and synchronise."""
        if rows is not None:
            write_lines(self._tracks, csv_text(rows))
        for step in steps:
            self._mot.step(step)
            self._plot.step(step)
        self._mot.flush()

    def end(self) -> None:
        """Later steps are for open gaps in mot.txt."""
        self._mot.end()

    def is_settled(self, later: Sequence[Step]) -> bool:
        """Whether mot.txt waits for no track."""
        for step in later:
            self._mot.step(step)
        self._mot.flush()
        return not self._mot.waits

    def finish(self) -> None:
        """Write tracks.parquet and tracks.png."""
        with ExitStack() as stack:
            stack.callback(self._plot.close)
            stack.callback(add_parquet, self._folder)
            stack.push(self._files)


class ParquetAlone:
    """tracks.parquet, which a kill leaves in parts without the last minute."""

    def __init__(self, folder: Path, subject: Subject, columns: Sequence[Column]) -> None:
        self._parquet = ParquetParts(folder / "tracks.parquet", schema(columns))

    def write(self, steps: Sequence[Step], rows: pa.Table | None) -> None:
        """Keep the rows until there are enough for a part."""
        if rows is not None:
            self._parquet.add(rows)

    def end(self) -> None:
        """Do nothing."""

    def is_settled(self, later: Sequence[Step]) -> bool:
        """True."""
        return True

    def finish(self) -> None:
        """Join the parts."""
        self._parquet.close()


class NoTracks:
    """Nothing."""

    def __init__(self, folder: Path, subject: Subject, columns: Sequence[Column]) -> None:
        pass

    def write(self, steps: Sequence[Step], rows: pa.Table | None) -> None:
        """Do nothing."""

    def end(self) -> None:
        """Do nothing."""

    def is_settled(self, later: Sequence[Step]) -> bool:
        """True."""
        return True

    def finish(self) -> None:
        """Do nothing."""


TRACK_FILES: dict[Level, Callable[[Path, Subject, Sequence[Column]], TrackFiles]] = {
    "counts": NoTracks,
    "tracks": ParquetAlone,
    "all": AllFiles,
}


def write_lines(file: LineFile, lines: str) -> None:
    """Write lines and synchronise the file with the disk."""
    file.add(lines)
    file.flush()
    file.sync()

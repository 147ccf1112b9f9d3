"""groups.csv: how many members each confirmed group has, and how many the scan showed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from vidtrack.output.linefile import LineFile
from vidtrack.output.sink import Step
from vidtrack.tracks import TENTATIVE


class GroupTable:
    """Sink that writes a row per confirmed group and scan.

    sizes  returns id, members and members seen of all groups after the scan
    """

    def __init__(self, path: Path, sizes: Callable[[], list[tuple[int, int, int]]]) -> None:
        self._sizes = sizes
        self._file = LineFile(path, "scan,time_s,track_id,members,seen\n")

    def step(self, step: Step) -> None:
        """Write the groups of one scan."""
        known = set(step.tracks.id[step.tracks.status != TENTATIVE].tolist())
        start = f"{step.index},{step.time_s:.6f}"
        rows = (f"{start},{track},{size},{seen}\n" for track, size, seen in self._sizes() if track in known)
        self._file.add("".join(rows))

    def close(self) -> None:
        """Write the rest and close the file."""
        self._file.close()

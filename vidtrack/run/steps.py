"""Tracks scans: of stored detections, of radar plots, and of the radars and the camera of a road."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from time import perf_counter
from typing import Protocol

from vidtrack.associate.redundancy import combined
from vidtrack.output.sink import Step
from vidtrack.scan import Scan
from vidtrack.tracks import Tracks

REHEARSED = 3
"""Scans that show which kernels a run needs."""


class Stepping(Protocol):
    """What takes scans and gives tracks: a tracker of targets or of groups."""

    def step(self, scan: Scan) -> Tracks: ...


def scan_steps(scans: Iterable[tuple[int, Scan]], tracker: Stepping, redundant: float | None = None) -> Iterator[Step]:
    """Yields a step for each (number, scan), with the tracks after it.

    redundant  probability with which two measurements of one target are combined first; None: they are not combined
    """
    ended = perf_counter()
    for index, scan in scans:
        began = perf_counter()
        if redundant is not None:
            scan, _ = combined(scan, redundant)
        tracks = tracker.step(scan)
        stages = {"read": began - ended, "track": perf_counter() - began}
        yield Step(index, scan.t, scan, tracks, None, None, stages)
        ended = perf_counter()

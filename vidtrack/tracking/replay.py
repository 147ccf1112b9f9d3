"""Scans that come late: the tracker goes back to the time before them and processes what followed once more.

One-step and l-step algorithms (Y. Bar-Shalom, H. Chen, M. Mallick, "One-step solution for the multistep
out-of-sequence-measurement problem in tracking", IEEE Trans. Aerospace and Electronic Systems 40(1), 2004) correct the
state of one linear filter for one late measurement. They take the associations, the births and the modes of an IMM as
they were decided without it. Processing again is exact for all of these: the tracks are those of scans in order.
"""

from __future__ import annotations

from bisect import bisect_right
from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays.types import Ints
from vidtrack.errors import ConfigError, ScanError
from vidtrack.scan import Scan
from vidtrack.tracking.immediate import Immediate
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import Tracks

_MEMORY = ("t", "bank", "register", "timing", "sharing", "stations", "picture")
"""What a step changes in a tracker."""


class _Kept(NamedTuple):
    """A scan, and the tracker as it was before it."""

    scan: Scan
    before: dict[str, Any]


class Replay:
    """A tracker whose scans may come out of order, up to `window_s` late.

    It keeps the tracker's memory before each scan of the window. A late scan costs as many steps as scans came before
    it that are newer. A track keeps its id when it is begun again from the same measurement.

    Raises ConfigError for a window below zero, and for methods that decide some scans later.
    """

    def __init__(self, tracker: Tracker, window_s: float) -> None:
        if not window_s >= 0:
            raise ConfigError(f"the window for late scans is {window_s} s; it must not be negative")
        if not isinstance(tracker.timing, Immediate):
            raise ConfigError("late scans need decisions in the scan itself; take another method than mht and split")
        self._tracker = tracker
        self._window_s = window_s
        self._kept: list[_Kept] = []
        self._ids: dict[tuple[int, float, int], int] = {}
        self._next_id = 1
        tracker.number = self._number

    def step(self, scan: Scan) -> Tracks:
        """Take a scan, late or not; returns all tracks at the time of the newest scan.

        Raises ScanError if the scan is older than the window, or as Tracker.step.
        """
        newest = self._kept[-1].scan.t if self._kept else scan.t
        if scan.t < newest - self._window_s:
            raise ScanError(
                f"the scan of {scan.t:.6g} s is {newest - scan.t:.6g} s late, more than the window of "
                f"{self._window_s:g} s; leave it out, or make the window longer"
            )
        place = bisect_right(self._kept, scan.t, key=lambda kept: kept.scan.t)
        again = [kept.scan for kept in self._kept[place:]]
        if again:
            self._recall(self._kept[place].before)
            del self._kept[place:]
        for each in (scan, *again):
            self._kept.append(_Kept(each, deepcopy({name: getattr(self._tracker, name) for name in _MEMORY})))
            tracks = self._tracker.step(each)
        self._forget(self._kept[-1].scan.t - self._window_s)
        return tracks

    def _recall(self, memory: dict[str, Any]) -> None:
        for name, value in memory.items():
            setattr(self._tracker, name, value)

    def _forget(self, t: float) -> None:
        """Drop what is older than the window; of the scans at its beginning no late one goes back beyond."""
        while len(self._kept) > 1 and self._kept[0].scan.t < t:
            del self._kept[0]
        self._ids = {key: track for key, track in self._ids.items() if key[1] >= t}

    def _number(self, scan: Scan, born: Ints) -> Ints:
        """Ids (B,) of the tracks that measurements (B,) of a scan begin."""
        found = []
        for j in born.tolist():
            key = (scan.station, scan.t, j)
            if key not in self._ids:
                self._ids[key] = self._next_id
                self._next_id += 1
            found.append(self._ids[key])
        return np.array(found, np.int64)

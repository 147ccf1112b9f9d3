"""The truth of a radar run from what targets say themselves: ADS-B, AIS, or another system's tracks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import FormatError
from vidtrack.formats import Table
from vidtrack.radar.feeds.clock import Clock
from vidtrack.radar.feeds.messages import NO_TARGET, Kind, Losses
from vidtrack.radar.feeds.recording import read_messages
from vidtrack.radar.plane import Plane, plane_of_run

LONGEST_GAP_S = 30.0
"""s; between reports that are farther apart a target's place is not known."""


def read_truth(path: Path, run: Path) -> Table:
    """The places of all targets with numbers at the times of a run's scans, by linear interpolation, in metres.

    run  folder of `vidtrack radar --radar-position`, with the same clock; its scans are those from its first to its
         last row

    Raises FormatError for a folder that is no run or does not know its position, and if no target was there.
    """
    scan, time_s, plane = _scans(run)
    messages = read_messages(path, Losses())
    named = (messages.kind == Kind.GEODETIC) & (messages.target != NO_TARGET)
    messages = Clock(Losses()).on_one_clock(messages.only(named))
    rows = []
    for number, target in enumerate(np.unique(messages.target)):
        own = messages.only(messages.target == target)
        own = own.only(np.argsort(own.time_s, kind="stable"))
        known = _known(own.time_s, time_s)
        xy = plane.metres(own.u, own.v)
        place = [np.interp(time_s[known], own.time_s, xy[:, axis]) for axis in (0, 1)]
        rows.append(np.column_stack([scan[known], np.full(int(known.sum()), number), *place]))
    table = np.concatenate(rows) if rows else np.zeros((0, 4))
    if not len(table):
        raise FormatError(f"{path} has no target at the time of {run}; the clocks must be the same")
    frame, identity = table[:, :2].astype(np.int64).T
    return Table(frame, identity, table[:, 2:], None, np.ones(len(table)), None, None, "m")


def _scans(run: Path) -> tuple[Ints, Floats, Plane]:
    """Numbers and times of a run's scans, and its plane."""
    try:
        plane = plane_of_run(json.loads((run / "summary.json").read_text()))
        table = pq.read_table(run / "tracks.parquet", columns=["scan", "time_s"])
    except (OSError, ValueError) as error:
        raise FormatError(f"{run} is not a run of vidtrack radar: {error}") from None
    if plane is None:
        raise FormatError(f"{run} does not know where its radar is; track again with --radar-position LAT,LON")
    number, first = np.unique(table["scan"].to_numpy(), return_index=True)
    if not len(number):
        raise FormatError(f"{run} has no tracks")
    scan = np.arange(number[0], number[-1] + 1)
    return scan, np.interp(scan, number, table["time_s"].to_numpy()[first]), plane


def _known(reported_s: Floats, time_s: Floats) -> np.ndarray:
    """(N,) times between two reports of at most LONGEST_GAP_S."""
    after = np.searchsorted(reported_s, time_s)
    inside = (after > 0) & (after < len(reported_s))
    gap = np.full(len(time_s), np.inf)
    gap[inside] = reported_s[after[inside]] - reported_s[after[inside] - 1]
    return gap <= LONGEST_GAP_S

"""The truth of a radar run from what targets say themselves: ADS-B, AIS, or another system's tracks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import FormatError
from vidtrack.formats import Table, interpolated, more_scans, scans_between, usual_step
from vidtrack.radar.feeds.clock import Clock
from vidtrack.radar.feeds.messages import NO_TARGET, Kind, Losses
from vidtrack.radar.feeds.recording import read_messages
from vidtrack.radar.plane import Plane, plane_of_run

LONGEST_GAP_S = 30.0
"""s; between reports that are farther apart a target's place is not known."""


def read_truth(path: Path, run: Path) -> Table:
    """The places of all targets with numbers at the times of a run's scans, by linear interpolation, in metres.

    run  folder of `vidtrack radar --radar-position`, with the same clock; its scans are all that were tracked, those
         before its first row and after its last one in the usual step, if its rows are of two scans or more

    Raises FormatError for a folder that is no run or does not know its position, and if no target was there.
    """
    scan, time_s, plane = _scans(run)
    messages = read_messages(path, Losses())
    named = (messages.kind == Kind.GEODETIC) & (messages.target != NO_TARGET)
    messages = Clock(Losses()).on_one_clock(messages.only(named))
    truth = Table(
        np.zeros(len(messages), np.int64), messages.target.astype(np.int64), plane.metres(messages.u, messages.v), None,
        np.ones(len(messages)), unit="m", time_s=messages.time_s,
    )  # fmt: skip
    found = interpolated(truth, scan, time_s, LONGEST_GAP_S) if len(messages) else truth
    if not len(found):
        raise FormatError(f"{path} has no target at the time of {run}; the clocks must be the same")
    return found


def _scans(run: Path) -> tuple[Ints, Floats, Plane]:
    """Numbers and times of a run's scans, and its plane."""
    try:
        summary = json.loads((run / "summary.json").read_text())
        plane = plane_of_run(summary)
        table = pq.read_table(run / "tracks.parquet", columns=["scan", "time_s"])
    except (OSError, ValueError) as error:
        raise FormatError(f"{run} is not a run of vidtrack radar: {error}") from None
    if plane is None:
        raise FormatError(f"{run} does not know where its radar is; track again with --radar-position LAT,LON")
    if not len(table):
        raise FormatError(f"{run} has no tracks")
    scan, time_s = scans_between(table["scan"].to_numpy(), table["time_s"].to_numpy())
    step_s = usual_step(time_s)
    if not step_s:
        return scan, time_s, plane
    after = max(0, round((float(summary["media_s"]) - time_s[-1]) / step_s))
    before = max(0, int(summary["scans"]) - len(scan) - after)
    return *more_scans(scan, time_s, step_s, before, after), plane

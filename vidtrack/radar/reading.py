"""Reads plots from a file; its content decides in which format it is."""

from __future__ import annotations

import logging
from collections.abc import Collection
from pathlib import Path

from vidtrack.config.radar import RadarSettings
from vidtrack.errors import ConfigError
from vidtrack.radar.feeds.plots import Code
from vidtrack.radar.feeds.recording import is_feed, read_recording
from vidtrack.radar.plots import Plots, read_plots
from vidtrack.radar.rhythm import rhythm

_log = logging.getLogger(__name__)

SLOWEST_S = 600.0
"""s; scans of a table that are farther apart have times in another unit."""


def read(path: str | Path, settings: RadarSettings) -> Plots:
    """The plots of a table (CSV, Parquet) or a recording (ASTERIX, NMEA, AIS).

    Raises the errors of `read_any`, and ConfigError for radar.scan_s with a table.
    """
    if settings.scan_s is not None and not is_feed(path):
        raise ConfigError(f"setting radar.scan_s has no effect on a table, {path}; leave it out")
    return read_any(path, settings)


def read_any(path: str | Path, settings: RadarSettings, known: Collection[Code] = ()) -> Plots:
    """The same, whatever is set for recordings; `known` as in `read_recording`.

    A warning says when the time jumps so far that all tracks end, and if a table's times seem to be no seconds.

    Raises the errors of `read_plots` and `read_recording`.
    """
    recorded = is_feed(path)
    plots = read_recording(path, settings, known) if recorded else read_plots(path, settings)
    pauses = rhythm(plots.scan, plots.time_s)
    if not recorded and pauses.scan_s > SLOWEST_S:
        _log.warning("%s: scans are %.6g s apart: is time_s in seconds, not in milliseconds?", path, pauses.scan_s)
    for begin_s, end_s in zip(pauses.begin_s[:1], pauses.end_s[:1], strict=True):
        others = f", the first of {len(pauses.end_s)} such jumps" if len(pauses.end_s) > 1 else ""
        _log.warning(
            "%s: the time jumps from %.10g to %.10g s%s; all tracks end there: is the clock right?",
            path, begin_s, end_s, others,
        )  # fmt: skip
    return plots

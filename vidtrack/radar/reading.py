"""Reads plots from a file; its content decides in which format it is."""

from __future__ import annotations

from pathlib import Path

from vidtrack.config.radar import RadarSettings
from vidtrack.errors import ConfigError
from vidtrack.radar.feeds.recording import is_feed, read_recording
from vidtrack.radar.plots import Plots, read_plots

OF_RECORDINGS = ("scan_s", "sac", "sic")
"""Settings without effect on a table, in which scans are numbered and the radar is one."""


def read(path: str | Path, settings: RadarSettings) -> Plots:
    """The plots of a table (CSV, Parquet) or a recording (ASTERIX, NMEA, AIS).

    Raises the errors of `read_plots` and `read_recording`, and ConfigError for settings of recordings with a table.
    """
    if is_feed(path):
        return read_recording(path, settings)
    plots = read_plots(path, settings)
    idle = [name for name in OF_RECORDINGS if getattr(settings, name) is not None]
    if idle:
        raise ConfigError(
            "\n".join(f"setting radar.{name} has no effect on a table, {path}; leave it out" for name in idle)
        )
    return plots

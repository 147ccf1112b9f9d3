"""Reads plots from a file; its content decides in which format it is."""

from __future__ import annotations

from pathlib import Path

from vidtrack.config.radar import RadarSettings
from vidtrack.radar.feeds.recording import is_feed, read_recording
from vidtrack.radar.plots import Plots, read_plots


def read(path: str | Path, settings: RadarSettings) -> Plots:
    """The plots of a table (CSV, Parquet) or a recording (ASTERIX, NMEA, AIS).

    Raises the errors of `read_plots` and `read_recording`.
    """
    return read_recording(path, settings) if is_feed(path) else read_plots(path, settings)

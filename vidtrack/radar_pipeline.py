"""From radar plots to tracks: plots, scans, tracker. No pictures, and no OpenCV."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from vidtrack.associate.gate import Gate
from vidtrack.associate.methods import STRENGTH
from vidtrack.config import Settings
from vidtrack.errors import ConfigError
from vidtrack.radar.filters import estimator, motion
from vidtrack.radar.plots import read_plots
from vidtrack.radar.scans import Measurements, measurements, surveyed
from vidtrack.scan import Tracks
from vidtrack.steps import scan_steps
from vidtrack.tracking.methods import life, rule
from vidtrack.tracking.picture.picture import NoPicture
from vidtrack.tracking.tracker import Tracker


def track_plots(path: str | Path, settings: Settings | None = None, seed: int = 0) -> Iterator[tuple[int, Tracks]]:
    """Number of each scan of a plot table (CSV, Parquet) and the tracks after it, lazily.

    Raises SourceError and PlotFormatError for a table that cannot be used.
    """
    settings = settings or Settings()
    found = measurements(read_plots(path, settings.radar), settings.radar)
    for step in scan_steps(found, build_radar_tracker(settings, found, seed=seed), settings.tracker.redundant):
        yield step.index, step.tracks


def build_radar_tracker(settings: Settings, found: Measurements, *, explain: bool = False, seed: int = 0) -> Tracker:
    """The tracker that the settings describe, for these measurements in metres; the seed is for particles.

    Raises ConfigError for a filter that cannot be smoothed, or a method that needs amplitudes where there are none.
    """
    radar, common = settings.radar, settings.tracker
    if common.method in STRENGTH and found.amplitude is None:
        raise ConfigError(
            f"the plots have no amplitudes, by which {common.method} chooses; take another method (gnn, jpda, mht)"
        )
    if settings.output.smooth and radar.estimator == "alpha-beta":
        raise ConfigError("alpha-beta keeps no covariances of its own, and cannot be smoothed; take another estimator")
    return Tracker(
        model=motion(radar, found.dim),
        estimator=estimator(radar, found, seed),
        associate=rule(common),
        gate=Gate(common.gate_probability, common.distance, radar.euclidean_radius_m),
        life=life(radar.life, common, common.confirm_hits, common.confirm_window, coast_scans=radar.coast_scans),
        picture=NoPicture(),
        detection_probability=radar.detection_probability,
        clutter_density=radar.clutter_density,
        surveyed=surveyed(found),
        explain=explain,
        smooth=settings.output.smooth,
    )

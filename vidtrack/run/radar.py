"""Tracks radar plots: table, scans, tracker, and sinks in metres. Does not load OpenCV."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from vidtrack.associate.methods import STRENGTH
from vidtrack.config.radar import RadarSettings
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError
from vidtrack.output.confirmed import Confirmed
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.linked import refuse_link
from vidtrack.output.radar_plot import RadarPlot
from vidtrack.output.sink import Sink
from vidtrack.output.smoothed import smoothed_first
from vidtrack.output.summary import Summary
from vidtrack.output.tables import RADAR, RADAR_3D, TrackTable
from vidtrack.output.threaded import Threaded
from vidtrack.radar.filters import estimator, motion
from vidtrack.radar.reading import read
from vidtrack.radar.scans import Measurements, measurements, surveyed
from vidtrack.run.run import Extras, Pipeline, Run
from vidtrack.run.steps import scan_steps
from vidtrack.tracking.methods import gate, life, rule
from vidtrack.tracking.occlusion.sharing import Exclusive, Sharing
from vidtrack.tracking.picture.picture import NoPicture
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.unresolved.cell import PolarCell
from vidtrack.tracking.unresolved.unresolved import Unresolved
from vidtrack.tracks import Tracks


def track_plots(path: str | Path, settings: Settings | None = None, seed: int = 0) -> Iterator[tuple[int, Tracks]]:
    """Yields the number of each scan of a plot table (CSV, Parquet) and the tracks after it, lazily.

    Raises SourceError and PlotFormatError for a table that cannot be used.
    """
    settings = settings or Settings()
    found = measurements(read(path, settings.radar), settings.radar)
    for step in scan_steps(found, build_radar_tracker(settings, found, seed=seed), settings.tracker.redundant):
        yield step.index, step.tracks


def run_plots(
    path: str,
    settings: Settings,
    output: Path | None = None,
    extras: Extras | None = None,
    *,
    force: bool = False,
    seed: int = 0,
) -> Run:
    """A run over a plot table; `seed` is for the particle filter. Raises the errors of Run, and PlotFormatError."""
    return Run(radar_pipeline(path, settings, extras or Extras(), seed), output, force=force)


@contextmanager
def radar_pipeline(path: str, settings: Settings, extras: Extras, seed: int) -> Iterator[Pipeline]:
    """The pipeline of a plot table. Raises SourceError, PlotFormatError, ConfigError."""
    plots = read(path, settings.radar)
    found = measurements(plots, settings.radar)
    refuse_link(settings.output, "radar runs")
    tracker = build_radar_tracker(settings, found, explain=extras.explain, seed=seed)
    account: dict[str, Any] = {"plots": len(plots), "bad_rows": plots.bad_rows, **plots.losses, "truncated": False}
    if plots.plane is not None:
        account["origin"] = [plots.plane.latitude, plots.plane.longitude, plots.plane.height]

    def summary(folder: Path) -> Summary:
        return Summary(folder / "summary.json", path, settings, lambda: account | tracker.rates.as_dict(), unit="scans")

    yield Pipeline(
        name=Path(path).stem,
        place=Path(path),
        count=found.count,
        steps=scan_steps(found, tracker, settings.tracker.redundant),
        summary=summary,
        sinks=partial(radar_sinks, settings, extras, found.dim),
    )


def radar_sinks(settings: Settings, extras: Extras, dim: int, folder: Path) -> Iterator[Sink]:
    """The sinks of a run over plots in `dim` dimensions."""
    table = TrackTable(folder, RADAR if dim == 2 else RADAR_3D)
    plot = RadarPlot(folder / "tracks.png", settings.radar.position[:2])
    yield Confirmed(*smoothed_first(settings.output, table, plot), hold_s=math.inf)  # scans may be far apart
    if extras.decisions:
        yield DecisionLog(folder / "decisions.csv", index="scan")
    if extras.rerun is not None:
        from vidtrack.output.rerun.plots import RadarRerun

        yield Threaded(RadarRerun(extras.rerun, settings))


def build_radar_tracker(settings: Settings, found: Measurements, *, explain: bool = False, seed: int = 0) -> Tracker:
    """The tracker of the settings for these measurements in metres; `seed` is for the particle filter.

    Raises ConfigError for a filter without a smoother, or a method that needs amplitudes where there are none.
    """
    radar, common = settings.radar, settings.tracker
    if common.method in STRENGTH and found.amplitude is None:
        raise ConfigError(
            f"the plots have no amplitudes, by which {common.method} chooses; take another method (gnn, jpda, mht)"
        )
    if settings.output.smooth and radar.estimator == "alpha-beta":
        raise ConfigError("alpha-beta keeps no covariances of its own, and cannot be smoothed; take another estimator")
    sharing = _sharing(radar, found.dim)
    return Tracker(
        model=motion(radar, found.dim),
        estimator=estimator(radar, found, seed),
        associate=rule(common, unresolved=isinstance(sharing, Unresolved)),
        gate=gate(common, radar.euclidean_radius_m, adaptive=True),
        life=life(radar.life, common, common.confirm_hits, common.confirm_window, coast_scans=radar.coast_scans),
        picture=NoPicture(),
        sharing=sharing,
        detection_probability=radar.detection_probability,
        clutter_density=radar.clutter_density,
        surveyed=surveyed(found),
        explain=explain,
        smooth=settings.output.smooth,
    )


def _sharing(radar: RadarSettings, dim: int) -> Sharing:
    """The model for unresolved targets; alpha-beta has no covariances from which to tell them."""
    if not radar.unresolved or radar.estimator == "alpha-beta":
        return Exclusive()
    angles = (radar.cell_azimuth_deg, radar.cell_elevation_deg)[: dim - 1]
    sides = (radar.cell_range_m, *(None if side is None else math.radians(side) for side in angles))
    return Unresolved(PolarCell(radar.position[:dim], sides))

"""Tracks radar plots: table, scans, tracker, and sinks in metres. Does not load OpenCV."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from vidtrack.amplitude.reduction import gated
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.associate.gate import Gate, quantile
from vidtrack.associate.methods import STRENGTH
from vidtrack.config.radar import RadarSettings
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError
from vidtrack.output.confirmed import Confirmed
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.groups import GroupTable
from vidtrack.output.linked import refuse_link
from vidtrack.output.radar_page import RadarPage
from vidtrack.output.radar_plot import RadarPlot
from vidtrack.output.sink import Sink
from vidtrack.output.smoothed import smoothed_first
from vidtrack.output.summary import Summary
from vidtrack.output.tables import RADAR, RADAR_3D, TrackTable
from vidtrack.output.threaded import Threaded
from vidtrack.radar.filters import estimator, motion
from vidtrack.radar.own_threshold import GATE, controller
from vidtrack.radar.reading import read
from vidtrack.radar.scans import Measurements, extent, measurements, surveyed
from vidtrack.run.groups import Groups
from vidtrack.run.radar_life import radar_life
from vidtrack.run.run import Extras, Pipeline, Run
from vidtrack.run.steps import REHEARSED, scan_steps
from vidtrack.tracking.clutter import ClutterMap, EvenBox, EvenClutter
from vidtrack.tracking.methods import gate, rule
from vidtrack.tracking.occlusion.sharing import Exclusive, Sharing
from vidtrack.tracking.picture.picture import NoPicture
from vidtrack.tracking.rates import Rates
from vidtrack.tracking.station import Station
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.unresolved.cell import PolarCell
from vidtrack.tracking.unresolved.unresolved import Unresolved
from vidtrack.tracks import Tracks

LOSS = 10.0
"""What refusing the target's plot costs, in costs of admitting a false one: the track may be lost, not a position."""


def track_plots(path: str | Path, settings: Settings | None = None, seed: int = 0) -> Iterator[tuple[int, Tracks]]:
    """Yields the number of each scan of a plot table (CSV, Parquet) and the tracks after it, lazily.

    Raises SourceError and PlotFormatError for a table that cannot be used.
    """
    settings = settings or Settings()
    found = measurements(read(path, settings.radar), settings.radar)
    for step in scan_steps(found, build_radar_tracker(settings, found, seed=seed), settings.tracker.redundant):
        yield step.index, step.tracks


def first_plots(path: str, settings: dict[str, Any]) -> None:
    """Track the first scans of a plot table, by the settings that are not defaults: a rehearsal of its run."""
    for _ in islice(track_plots(path, Settings.model_validate(settings)), REHEARSED):
        pass


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
    account: dict[str, Any] = {"plots": len(plots), "bad_rows": plots.bad_rows, **plots.losses}
    account["truncated"] = bool(plots.losses.get("truncated"))
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
        sinks=partial(radar_sinks, settings, extras, found.dim, [settings.radar.position[:2]], now=lambda: tracker),
    )


def radar_sinks(
    settings: Settings,
    extras: Extras,
    dim: int,
    radars: Sequence[tuple[float, float]],
    folder: Path,
    now: Callable[[], Tracker | Groups | None] = lambda: None,
) -> Iterator[Sink]:
    """The sinks of a run over plots in `dim` dimensions of radars at these places (x, y).

    now  returns the tracker of one radar, once there is one
    """
    table = TrackTable(folder, RADAR if dim == 2 else RADAR_3D)
    plot = RadarPlot(folder / "tracks.png", radars)
    page = RadarPage(folder / "radar.html", radars, lambda: _clutter_map(now()))
    tables = smoothed_first(settings.output.smooth, settings.output.smooth_lag_s, table, plot, page)
    yield Confirmed(*tables, hold_s=math.inf)  # scans may be far apart
    if settings.radar.group_link_m is not None:
        yield GroupTable(folder / "groups.csv", lambda: _sizes(now()))
    if extras.decisions:
        yield DecisionLog(folder / "decisions.csv", index="scan")
    if extras.rerun is not None:
        from vidtrack.output.rerun.plots import RadarRerun

        yield Threaded(RadarRerun(extras.rerun, settings))


def _sizes(tracker: Tracker | Groups | None) -> list[tuple[int, int, int]]:
    """Those of groups."""
    return tracker.sizes() if isinstance(tracker, Groups) else []


def _clutter_map(tracker: Tracker | Groups | None) -> dict[str, Any] | None:
    """Where the clutter is, if a map of it has been learnt."""
    where = None if tracker is None else tracker.rates.where
    if not isinstance(where, ClutterMap):
        return None
    density = where.density.round(3).tolist()
    return {"low": where.low.tolist(), "high": where.high.tolist(), "density": density, "polar": where.polar}


def build_radar_tracker(
    settings: Settings, found: Measurements, *, explain: bool = False, seed: int = 0
) -> Tracker | Groups:
    """The tracker of the settings for these measurements in metres; `seed` is for the particle filter.

    Raises ConfigError for a filter without a smoother, a method that needs amplitudes where there are none, and
    settings that exclude each other.
    """
    radar = settings.radar
    learnt = rates(radar, found, radar.detection_probability)
    if radar.group_link_m is not None:
        return Groups(settings, found, learnt, seed)
    station = Station(learnt)
    return build_point_tracker(settings, [found], [radar.position], [station], explain=explain, seed=seed)


def rates(radar: RadarSettings, found: Measurements, detection: float | None) -> Rates:
    """Detection probability and clutter density of the radar that made these measurements."""
    where: EvenClutter | None = None
    if radar.clutter_density is None:
        low, high = (corner[:2] for corner in extent(found))
        where = (ClutterMap if radar.clutter_map else EvenBox)(low, high, polar=bool(found.sensor.angles))
    return Rates(detection, radar.clutter_density, surveyed(found), where)


def build_point_tracker(
    settings: Settings,
    found: Sequence[Measurements],
    places: Sequence[tuple[float, float, float]],
    stations: Sequence[Station],
    *,
    explain: bool = False,
    seed: int = 0,
) -> Tracker:
    """The tracker of radars that have made these measurements at these places [m]; each is a station.

    Raises ConfigError as `build_radar_tracker`.
    """
    radar, common, dim = settings.radar, settings.tracker, found[0].dim
    if common.method in STRENGTH and any(each.amplitude is None for each in found):
        raise ConfigError(
            f"the plots have no amplitudes, by which {common.method} chooses; take another method (gnn, jpda, mht)"
        )
    refuse_smoothing(settings)
    if radar.group_link_m is not None or (radar.snr_db is not None and len(found) > 1):
        raise ConfigError("radar.group_link_m and radar.snr_db are for one radar; leave them out")
    sharing = _sharing(radar, [place[:dim] for place in places])
    admits, threshold = _gate_and_threshold(settings, found[0])
    return Tracker(
        model=motion(radar, dim),
        estimator=estimator(radar, found[0], seed),
        associate=rule(common, unresolved=isinstance(sharing, Unresolved)),
        gate=admits,
        threshold=threshold,
        life=radar_life(settings, found, stations),
        picture=NoPicture(),
        sharing=sharing,
        stations=stations,
        explain=explain,
        smooth=bool(settings.output.smooth),
    )


def _gate_and_threshold(settings: Settings, found: Measurements) -> tuple[Gate, ThresholdController | None]:
    """The gate, and the controller of the detection threshold, whose gate has a fixed width."""
    radar, common = settings.radar, settings.tracker
    if radar.snr_db is None:
        return gate(common, radar.euclidean_radius_m, adaptive=True, loss=LOSS), None
    if common.distance != "mahalanobis":
        raise ConfigError(
            f"radar.snr_db needs the distance mahalanobis, and not {common.distance}; leave one of them out"
        )
    dim, share = found.z.shape[1], common.gate_probability
    width = GATE if share is None else math.sqrt(quantile(share, dim))
    return Gate(gated(dim, width)), controller(radar, found, width)


def refuse_smoothing(settings: Settings) -> None:
    """Raise ConfigError for output.smooth with a filter that does not know its errors."""
    radar = settings.radar
    if settings.output.smooth and not _has_covariances(radar):
        filter_ = radar.estimator if radar.estimator != "particle" else f"particle with resampling {radar.resampling}"
        raise ConfigError(f"{filter_} keeps no covariances of its own, and cannot be smoothed; take another estimator")


def _has_covariances(radar: RadarSettings) -> bool:
    """Whether the filter knows its errors: alpha-beta does not, nor do particles of which one gets all the weight."""
    degenerate = radar.estimator == "particle" and radar.resampling in ("none", "error-signal")
    return radar.estimator != "alpha-beta" and not degenerate


def _sharing(radar: RadarSettings, places: Sequence[tuple[float, ...]]) -> Sharing:
    """The model for targets that radars at these places do not resolve; without covariances they cannot be told."""
    if not radar.unresolved or not _has_covariances(radar):
        return Exclusive()
    angles = (radar.cell_azimuth_deg, radar.cell_elevation_deg)[: len(places[0]) - 1]
    sides = (radar.cell_range_m, *(None if side is None else math.radians(side) for side in angles))
    cells = [PolarCell(place, sides) for place in places]
    return Unresolved(cells[0], cells)

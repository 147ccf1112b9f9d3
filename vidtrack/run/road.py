"""Radar and camera on one road: plots and blobs go to one tracker in metres, in order of time."""

from __future__ import annotations

import heapq
import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from itertools import tee
from pathlib import Path
from typing import Any

from vidtrack.config.settings import Settings, SourceSettings
from vidtrack.errors import ConfigError
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.output.linked import refuse_link
from vidtrack.output.sink import Step
from vidtrack.output.summary import Summary
from vidtrack.radar.filters import estimator, motion
from vidtrack.radar.network.feed import Feed, overlap, read_feeds, warn_if_apart
from vidtrack.radar.network.network import Network, Turn
from vidtrack.radar.network.radars import Radars, read_radars
from vidtrack.radar.scans import surveyed
from vidtrack.run.network import learn_ahead, network_sinks
from vidtrack.run.radar import refuse_smoothing
from vidtrack.run.radar_life import radar_life
from vidtrack.run.run import Extras, Pipeline, Run
from vidtrack.run.steps import scan_steps
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, look_ahead, video_steps
from vidtrack.scan import Scan
from vidtrack.tracking.methods import gate, rule
from vidtrack.tracking.picture.picture import NoPicture
from vidtrack.tracking.rates import Rates
from vidtrack.tracking.station import Station, Visibility
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import TENTATIVE
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.road_scans import InPicture, RoadScans
from vidtrack.traffic.site import read_site
from vidtrack.video.resources import frame_by_frame
from vidtrack.video.source import duration_s, open_source

_log = logging.getLogger(__name__)

ROAD: Mapping[str, Any] = {
    "radar": {"estimator": "kalman", "max_speed": 40.0, "accel": 1.5, "hold_s": 2.0, "extent_m": 0.7, "coast_scans": 40,
              "unresolved": False, "detection_probability": 0.9},
    "tracker": {"missed_track": 1e-4},
}  # fmt: skip
"""Defaults where vehicles are tracked and not aircraft."""
CAMERA_DETECTION = 0.9
LASTING_S = 1.0
"""s; the light of headlamps, a reflection or a shadow looks like a vehicle for so long."""
LASTING_M = 5.0
"""m, a vehicle's length; what was learnt wrongly of the scene looks like a vehicle for long, but stays there."""
BY_RADAR, BY_CAMERA = Visibility(visible_s=20.0, hidden_s=0.2), Visibility(visible_s=10.0, hidden_s=3.0)
"""A radar loses sight of slow vehicles, of others rarely; a camera of those behind others and in the dark."""


@dataclass(frozen=True, slots=True)
class Camera:
    """A calibrated camera: its steps in pixels, its blobs on the road, and what it covers."""

    steps: Iterable[Step]
    scans: RoadScans
    coverage: InPicture


def run_road(
    paths: Sequence[str],
    radars: Path,
    video: str,
    site: Path,
    settings: Settings,
    output: Path | None = None,
    extras: Extras | None = None,
    *,
    force: bool = False,
    seed: int = 0,
) -> Run:
    """A run over plot tables and a video of one road. Raises the errors of Run, and PlotFormatError."""
    return Run(
        _pipeline(paths, read_radars(radars), video, site, settings, extras or Extras(), seed), output, force=force
    )


@contextmanager
def _pipeline(
    paths: Sequence[str], radars: Radars, video: str, site: Path, settings: Settings, extras: Extras, seed: int
) -> Iterator[Pipeline]:
    if radars.origin is not None:
        raise ConfigError(f"{radars.path} has latitudes; with a camera give x_m and y_m, in the metres of {site}")
    refuse_link(settings.output, "radar runs")
    network = Network(read_feeds(paths, radars, settings.radar))
    learn_ahead(settings, network, seed)
    with open_camera(video, site, settings) as camera:
        tracker = build_road_tracker(settings, network.feeds, camera, explain=extras.explain, seed=seed)
        shown = [k for k, feed in enumerate(network.feeds) if is_shown(feed, camera.coverage)]
        warn_if_apart(network.feeds, shown)
        if not shown:
            _log.warning(
                "no plot of a radar is where the camera shows the road: are the places in %s in the metres of %s, and "
                "the directions right?", radars.path, site,
            )  # fmt: skip

        def reading() -> dict[str, object]:
            names = [*(feed.placed.name for feed in network.feeds), "camera"]
            biases = network.as_dict()
            own = zip(names, tracker.stations.each, strict=True)
            return {
                "plots": sum(len(feed.plots) for feed in network.feeds),
                "stations": {name: station.rates.as_dict() | biases.get(name, {}) for name, station in own},
            }

        steps, coast_s = road_steps(network, camera, tracker), max(feed.coast_s for feed in network.feeds)
        begin_s, end_s = zip(*(feed.span_s for feed in network.feeds), strict=True)
        pictures = stated_span(video, settings.source)
        if pictures is None or not _tell_if_apart((min(begin_s), max(end_s)), pictures, coast_s):
            steps = told_if_apart(steps, len(network.feeds), coast_s)
        yield Pipeline(
            name=Path(video).stem,
            place=Path(video),
            count=None,
            steps=steps,
            summary=lambda folder: Summary(folder / "summary.json", video, settings, reading, unit="scans"),
            sinks=lambda folder: network_sinks(settings, extras, network, folder),
        )


@contextmanager
def open_camera(video: str, site: Path, settings: Settings) -> Iterator[Camera]:
    """A camera whose video is tracked in pixels, so that its blobs are single vehicles.

    Raises SourceError, FormatError, ConfigError, for example for a site without calibration.
    """
    with closing(open_source(video, settings.source)) as source, frame_by_frame(settings.detector.kind):
        size = source.width, source.height
        drawn = read_site(site).scaled(*size)
        if drawn.calibration is None:
            raise ConfigError(f"{site} has no section [calibration], so nobody knows the metres")
        ground = calibrated(drawn)
        detector = build_detector(settings)
        look_ahead(source, detector, settings)
        steps = video_steps(source, detector, build_blob_tracker(settings.tracker, size), settings)
        yield Camera(steps, RoadScans(ground, size), InPicture(ground, size))


def is_shown(feed: Feed, coverage: InPicture) -> bool:
    """Whether any plot of a radar is in the picture."""
    return bool(coverage.share(feed.xy).any())


def told_if_apart(steps: Iterable[Step], radars: int, within_s: float) -> Iterator[Step]:
    """The steps of so many radars, then a camera; after the last a warning, if their times are more than that apart."""
    spans: list[tuple[float, float] | None] = [None, None]  # of the radars together, and of the camera
    for step in steps:
        kind = int(step.scan.station >= radars)
        begin, end = spans[kind] or (step.time_s, step.time_s)
        spans[kind] = min(begin, step.time_s), max(end, step.time_s)
        yield step
    scans, pictures = spans
    if scans and pictures:
        _tell_if_apart(scans, pictures, within_s)


def stated_span(video: str, settings: SourceSettings) -> tuple[float, float] | None:
    """The times of the pictures of a video file, by the length that it states [s]; None where it states none."""
    length_s = duration_s(video, settings)
    if length_s is None:
        return None
    return settings.start_s, length_s if settings.end_s is None else min(length_s, settings.end_s)


def _tell_if_apart(scans: tuple[float, float], pictures: tuple[float, float], within_s: float) -> bool:
    """Whether the times of a radar and a camera are more than that apart [s]; a warning says so."""
    if overlap(scans, pictures, within_s):
        return False
    _log.warning(
        "the radar and the camera have no common time (scans %.10g to %.10g s, pictures %.10g to %.10g s): times "
        "of plots count from the first picture", *scans, *pictures,
    )  # fmt: skip
    return True


def build_road_tracker(
    settings: Settings, feeds: Sequence[Feed], camera: Camera | None, *, explain: bool = False, seed: int = 0
) -> Tracker:
    """The tracker in metres: a station for each radar, then one for the camera; each may lose sight of a vehicle.

    Raises ConfigError for settings that exclude each other.
    """
    radar, common = settings.radar, settings.tracker
    if radar.group_link_m is not None or radar.snr_db is not None:
        raise ConfigError("radar.group_link_m and radar.snr_db are for one radar without a camera; leave them out")
    refuse_smoothing(settings)
    if radar.estimator == "alpha-beta":
        raise ConfigError("alpha-beta has one gain, for scans at one rate; radar and camera have two, take kalman")
    stations = [
        Station(
            Rates(
                feed.placed.radar.detection_probability or radar.detection_probability,
                radar.clutter_density,
                surveyed(feed.found),
            ),
            feed.coverage,
            BY_RADAR,
            blind=feed.blind,
        )
        for feed in feeds
    ]
    if camera is not None:
        stations.append(
            Station(
                Rates(CAMERA_DETECTION, None, camera.coverage.area()), camera.coverage, BY_CAMERA, LASTING_S, LASTING_M
            )
        )
    return Tracker(
        model=motion(radar, 2),
        estimator=estimator(radar, feeds[0].found, seed) if feeds else KalmanBank,
        associate=rule(common),
        gate=gate(common, radar.euclidean_radius_m, adaptive=True),
        life=radar_life(settings, [feed.found for feed in feeds], stations),
        picture=NoPicture(),
        stations=stations,
        explain=explain,
        smooth=bool(settings.output.smooth),
    )


def road_steps(network: Network | None, camera: Camera | None, tracker: Tracker) -> Iterator[Step]:
    """Yields a step for each scan of a radar and each picture, numbered in order of time."""
    plots: Iterator[tuple[float, int, Turn | Step]] = ((turn.span.t, 0, turn) for turn in network or ())
    pictures: Iterator[tuple[float, int, Turn | Step]] = (
        (step.time_s, 1, step) for step in (camera.steps if camera else ())
    )
    number = 0 if network is None else len(network.feeds)

    def scan_of(seen: Turn | Step) -> Scan:
        if isinstance(seen, Turn):
            assert network is not None
            return network.scan(seen)
        assert camera is not None
        dark = seen.foreground is not None and seen.foreground.dark
        expected = tracker.predict(seen.time_s)
        vehicles = expected.xy[(expected.status != TENTATIVE) & (camera.coverage.share(expected.xy) > 0)]
        return camera.scans.scan(seen.scan, seen.tracks, vehicles, number, dark=dark)

    merged, again = tee(one for _, _, one in heapq.merge(plots, pictures, key=lambda one: one[:2]))
    for one, step in zip(merged, scan_steps(enumerate(map(scan_of, again)), tracker), strict=True):
        if isinstance(one, Turn) and network is not None:
            network.learn(one, step.tracks)
        yield step if network is None else replace(step, tracks=network.stated(step.tracks))
    if network is not None:
        network.warn_of_biases()

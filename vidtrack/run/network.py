"""Tracks the plots of several radars as one picture: tables, scans in order of time, registration, tracker, sinks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from vidtrack.config.radar import RadarSettings
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError
from vidtrack.output.linked import refuse_link
from vidtrack.output.registration import RegistrationTable
from vidtrack.output.sink import Sink, Step
from vidtrack.output.summary import Summary
from vidtrack.radar.network.feed import Feed, read_feeds, warn_if_apart
from vidtrack.radar.network.network import Network
from vidtrack.radar.network.radars import Radars, read_radars
from vidtrack.run.radar import build_point_tracker, radar_sinks, rates
from vidtrack.run.run import Extras, Pipeline, Run
from vidtrack.run.steps import scan_steps
from vidtrack.tracking.station import Station
from vidtrack.tracking.tracker import Tracker

AHEAD_S = 60.0
"""s; so much of the recordings is tracked ahead, so that the first scans come without the biases, too."""


def run_network(
    paths: Sequence[str],
    radars: Path,
    settings: Settings,
    output: Path | None = None,
    extras: Extras | None = None,
    *,
    force: bool = False,
    seed: int = 0,
) -> Run:
    """A run over the plot tables of the radars in a file. Raises the errors of Run, and PlotFormatError."""
    pipeline = network_pipeline(paths, read_radars(radars), settings, extras or Extras(), seed)
    return Run(pipeline, output, force=force)


@contextmanager
def network_pipeline(
    paths: Sequence[str], radars: Radars, settings: Settings, extras: Extras, seed: int
) -> Iterator[Pipeline]:
    """The pipeline of several plot tables. Raises SourceError, PlotFormatError, ConfigError."""
    origin = _origin(radars, settings.radar)
    network = Network(read_feeds(paths, radars, settings.radar))
    warn_if_apart(network.feeds)
    refuse_link(settings.output, "radar runs")
    learn_ahead(settings, network, seed)
    tracker = build_network_tracker(settings, network, explain=extras.explain, seed=seed)
    account = {
        "plots": sum(len(feed.plots) for feed in network.feeds),
        "bad_rows": sum(feed.plots.bad_rows for feed in network.feeds),
        **_losses(network),
        "truncated": any(feed.plots.losses.get("truncated") for feed in network.feeds),
        "origin": origin,
    }

    def reading() -> dict[str, object]:
        own = zip(network.feeds, tracker.stations.each, strict=True)
        learnt = {feed.placed.name: station.rates.as_dict() for feed, station in own}
        biases = network.as_dict()
        return account | {"radars": {name: learnt[name] | biases[name] for name in learnt}}

    def summary(folder: Path) -> Summary:
        return Summary(folder / "summary.json", ", ".join(paths), settings, reading, unit="scans")

    yield Pipeline(
        name="-".join(Path(path).stem for path in paths),
        place=Path(paths[0]),
        count=network.count,
        steps=network_steps(network, tracker, settings.tracker.redundant),
        summary=summary,
        sinks=lambda folder: network_sinks(settings, extras, network, folder),
    )


def network_sinks(settings: Settings, extras: Extras, network: Network, folder: Path) -> Iterator[Sink]:
    """The sinks of a run over these radars, the last one for their biases."""
    places = [feed.placed.xyz[:2] for feed in network.feeds]
    yield from radar_sinks(settings, extras, network.feeds[0].found.dim, places, folder)
    yield RegistrationTable(folder / "registration.csv", network)


def _losses(network: Network) -> dict[str, int]:
    """What of the recordings was left out, over all radars."""
    found = [feed.plots.losses for feed in network.feeds if feed.plots.losses]
    return {what: sum(losses[what] for losses in found) for what in found[0]} if found else {}


def _origin(radars: Radars, settings: RadarSettings) -> tuple[float, float, float] | None:
    """Latitude, longitude [degrees] and height [m] of x = y = 0. Raises ConfigError if both say it."""
    if radars.origin is not None and settings.geodetic is not None:
        raise ConfigError(
            f"{radars.path} has latitudes, so --radar-position (radar.geodetic) has no effect; leave one of them out"
        )
    return radars.origin or settings.geodetic


def learn_ahead(settings: Settings, network: Network, seed: int = 0) -> None:
    """Learn the biases from the first AHEAD_S of the recordings with a tracker of its own; the scans come once more."""
    if not network.registration.prior.any():
        return
    tracker = build_network_tracker(settings, network, seed=seed)
    end_s, last_s = np.inf, -np.inf
    for turn in network:
        end_s = min(end_s, turn.span.t + AHEAD_S)
        if turn.span.t > end_s:
            break
        network.learn(turn, tracker.step(network.scan(turn)))
        last_s = turn.span.t
    network.learnt_until(last_s)


def network_steps(network: Network, tracker: Tracker, redundant: float | None = None) -> Iterator[Step]:
    """Yields a step for each scan, numbered in order of time; the registration learns from the tracks.

    redundant  probability with which two measurements of one target are combined first; None: they are not combined
    """
    scans = ((index, network.scan(turn)) for index, turn in enumerate(network))
    for turn, step in zip(network, scan_steps(scans, tracker, redundant), strict=True):
        network.learn(turn, step.tracks)
        yield replace(step, tracks=network.stated(step.tracks))
    network.warn_of_biases()


def build_network_tracker(settings: Settings, network: Network, *, explain: bool = False, seed: int = 0) -> Tracker:
    """The tracker of the settings for these radars, each a station. Raises ConfigError as `build_radar_tracker`."""
    if settings.radar.estimator == "alpha-beta" and len(network.feeds) > 1:
        raise ConfigError("alpha-beta has one gain for all plots; for several radars take another estimator")
    if settings.tracker.redundant is not None and len(network.feeds) > 1:
        raise ConfigError("tracker.redundant combines the plots of one radar's scan; leave it out for several radars")
    stations = [_station(feed, settings.radar) for feed in network.feeds]
    found, places = [feed.found for feed in network.feeds], [feed.placed.xyz for feed in network.feeds]
    return build_point_tracker(settings, found, places, stations, explain=explain, seed=seed)


def _station(feed: Feed, settings: RadarSettings) -> Station:
    own = feed.placed.radar.detection_probability
    detection = settings.detection_probability if own is None else own
    return Station(rates(settings, feed.found, detection), feed.coverage, blind=feed.blind)

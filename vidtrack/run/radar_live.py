"""Tracks what radars send over the network, until it is stopped."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any

from vidtrack.config.settings import Settings
from vidtrack.errors import SourceError
from vidtrack.output.linked import refuse_link
from vidtrack.output.sink import Step
from vidtrack.output.summary import Summary
from vidtrack.radar.feeds.stream import SILENT_SCANS, ScanStream
from vidtrack.radar.feeds.udp import UdpFeed
from vidtrack.run.groups import Groups
from vidtrack.run.radar import build_radar_tracker, radar_sinks
from vidtrack.run.run import Extras, Pipeline, Run
from vidtrack.run.steps import scan_steps
from vidtrack.scan import Scan
from vidtrack.tracking.tracker import Tracker

_log = logging.getLogger(__name__)

WAIT_S = 0.2
"""s; longest wait for a datagram before it is asked whether to stop."""
UNKNOWN_PERIOD_S = 10.0
"""s; duration of a scan that is assumed of a feed that falls silent before it is known."""


def run_feed(
    address: str,
    settings: Settings,
    stopped: Callable[[], bool],
    output: Path | None = None,
    extras: Extras | None = None,
    *,
    force: bool = False,
    seed: int = 0,
) -> Run:
    """A run over a feed at udp://ADDRESS:PORT until `stopped()`. Raises the errors of Run, and PlotFormatError."""
    pipeline = feed_pipeline(address, settings, extras or Extras(), seed, stopped)
    return Run(pipeline, output, force=force)


@contextmanager
def feed_pipeline(
    address: str, settings: Settings, extras: Extras, seed: int, stopped: Callable[[], bool]
) -> Iterator[Pipeline]:
    """The pipeline of a feed. Raises SourceError, ConfigError; its steps raise PlotFormatError."""
    refuse_link(settings.output, "radar runs")
    stream = ScanStream(settings.radar, address)
    trackers: list[Tracker | Groups] = []

    def account() -> dict[str, Any]:
        origin = stream.plane and {"origin": [stream.plane.latitude, stream.plane.longitude, stream.plane.height]}
        rates = trackers[0].rates.as_dict() if trackers else {}
        counted = {"plots": stream.plots, "bad_rows": stream.losses.damaged, **stream.losses.as_dict()}
        return counted | {"truncated": False} | (origin or {}) | rates

    def steps(feed: UdpFeed) -> Iterator[Step]:
        scans = received(feed, stream, stopped)
        first = next(scans, None)
        if first is None or stream.found is None:
            raise SourceError(f"nothing that can be tracked came to {address}; {_heard(stream)}")
        trackers.append(build_radar_tracker(settings, stream.found, explain=extras.explain, seed=seed))
        yield from scan_steps(_again(first, scans), trackers[0], settings.tracker.redundant)
        if str(stream.losses):
            _log.warning("%s: left out: %s", address, stream.losses)

    with UdpFeed(address) as feed:
        yield Pipeline(
            name=address.removeprefix("udp://").partition("?")[0].replace(":", "-"),
            place=Path(address),
            count=None,
            steps=steps(feed),
            summary=lambda folder: Summary(folder / "summary.json", address, settings, account, unit="scans"),
            sinks=partial(
                radar_sinks, settings, extras, 2, [settings.radar.position[:2]], now=lambda: next(iter(trackers), None)
            ),
        )


def received(feed: UdpFeed, stream: ScanStream, stopped: Callable[[], bool]) -> Iterator[tuple[int, Scan]]:
    """The scans of a feed as they are over; when stopped, also the one that waits for its end."""
    last_heard, silent = monotonic(), True
    while not stopped():
        datagrams = feed.poll(WAIT_S)
        for datagram in datagrams:
            stream.hear(datagram)
        if datagrams:
            last_heard, silent = monotonic(), False
        elif not silent and monotonic() - last_heard > SILENT_SCANS * (stream.period_s or UNKNOWN_PERIOD_S):
            silent = True
            yield from stream.over(silent=True)
        if datagrams:
            yield from stream.over()
    for datagram in feed.poll(0):
        stream.hear(datagram)
    yield from stream.over(silent=True)


def _again(first: tuple[int, Scan], scans: Iterator[tuple[int, Scan]]) -> Iterator[tuple[int, Scan]]:
    yield first
    yield from scans


def _heard(stream: ScanStream) -> str:
    said = [f"there were {stream.lacks}"] if stream.lacks else []
    said += [f"left out: {stream.losses}"] if str(stream.losses) else []
    return ", ".join(said) or "no datagram was received"

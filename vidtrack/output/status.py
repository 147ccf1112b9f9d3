"""The current status of a live run: plain data for the page, the metrics and the stream of tracks."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, tzinfo
from threading import Condition
from typing import Any

import numpy as np

from vidtrack.compiled import compiling
from vidtrack.config.settings import OutputSettings
from vidtrack.output.annotated_picture import annotated_jpeg
from vidtrack.output.sink import Step
from vidtrack.tracks import Status, Tracks
from vidtrack.traffic.lines import LineCounter

_LATENCIES = 500  # latest frames in the percentiles
_RATE_S = 5.0  # time over which fps_out is counted, and after which tracks are no more those of now


@dataclass(frozen=True, slots=True)
class Account:
    """State and counters of a live source.

    state     "connecting", "compiling" (before the first frame), "running", "waiting" (before the next attempt) or
              "ended"
    reading   counters as in summary.json: width, height, fps_in, frames_dropped, reconnects, stalls, lost, ...
    problems  (Unix time [s], message) of the last problems
    failing   outputs that cannot be written now, and why
    """

    state: str
    reading: Mapping[str, Any]
    problems: list[tuple[float, str]]
    failing: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class LiveStatus(Account):
    """The status of a live run at one time.

    source      address without credentials
    started_unix_s, now_unix_s
    frame, time_s   of the last frame, -1 and 0.0 before it
    frame_age_s     seconds since the last frame was tracked; None before it
    fps_out     recent rate of tracked frames [1/s]
    tracks      of the last frame, see `as_rows`; none after 5 s without frames
    counts      by line and direction
    """

    source: str
    started_unix_s: float
    now_unix_s: float
    frame: int
    time_s: float
    frame_age_s: float | None
    fps_out: float
    tracks: list[dict[str, Any]]
    counts: Mapping[str, Mapping[str, int]]


class StatusBoard:
    """Sink that keeps the newest step; status and pictures are computed on request, in the requesting thread.

    source     address without credentials
    account    returns the source's account
    latency_s  returns the time [s] since a frame's capture time; also an attribute
    counter    None without lines
    zone       of the clock on the pictures; None: this machine's
    """

    def __init__(
        self,
        source: str,
        account: Callable[[], Account],
        latency_s: Callable[[float], float],
        settings: OutputSettings,
        counter: LineCounter | None = None,
        zone: tzinfo | None = None,
    ) -> None:
        self._zone = zone
        self._source = source
        self._account = account
        self.latency_s = latency_s
        self._quality = settings.jpeg_quality
        self._counter = counter
        self._started = time.time()
        self._newest: Step | None = None
        self._done: deque[float] = deque(maxlen=_LATENCIES)  # monotonic time of each frame's end
        self._latencies: deque[float] = deque(maxlen=_LATENCIES)
        self._changed = Condition()

    def step(self, step: Step) -> None:
        """Keep the newest step."""
        self._latencies.append(self.latency_s(step.time_s))
        self._done.append(time.monotonic())
        with self._changed:
            self._newest = step
            self._changed.notify_all()

    def close(self) -> None:
        """Wake all waiting threads."""
        with self._changed:
            self._changed.notify_all()

    def newer(self, frame: int, timeout_s: float) -> Step | None:
        """Wait for a step after this frame number; None after the time-out."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None and self._newest.index > frame, timeout_s)
            newest = self._newest
        return newest if newest is not None and newest.index > frame else None

    def picture(self) -> bytes | None:
        """The newest picture with tracks, lines and the time of day, as JPEG; None before the first frame."""
        step = self._newest
        if step is None or step.frame is None:
            return None
        lines, totals = ([], None) if self._counter is None else (self._counter.lines, self._counter.totals())
        wall = datetime.fromtimestamp(time.time() - self.latency_s(step.time_s), self._zone)
        return annotated_jpeg(step, lines, totals, wall, self._quality)

    def latency_ms(self) -> dict[str, float]:
        """Latency from capture to tracks in the last frames [ms]: p50, p95, p99, max; empty before the first frame."""
        latencies = list(self._latencies)
        if not latencies:
            return {}
        values = np.round(1e3 * np.percentile(latencies, [50, 95, 99, 100]), 2).tolist()
        return dict(zip(("p50", "p95", "p99", "max"), values, strict=True))

    def now(self) -> LiveStatus:
        """The current status. Safe in any thread."""
        step = self._newest
        account = self._account()
        now_s = time.monotonic()
        done = list(self._done)
        age_s = now_s - done[-1] if done else None
        fresh = age_s is not None and age_s < _RATE_S
        return LiveStatus(
            state="compiling" if step is None and account.state == "running" and compiling() else account.state,
            reading=account.reading,
            problems=account.problems,
            failing=account.failing,
            source=self._source,
            started_unix_s=self._started,
            now_unix_s=time.time(),
            frame=-1 if step is None else step.index,
            time_s=0.0 if step is None else step.time_s,
            frame_age_s=age_s,
            fps_out=sum(now_s - t < _RATE_S for t in done) / _RATE_S,
            tracks=[] if step is None or not fresh else as_rows(step.shown),
            counts={} if self._counter is None else self._counter.totals(),
        )


def trouble_of(status: Mapping[str, Any], stale_s: float) -> str | None:
    """Why a camera does not deliver; None if it runs, its frames are tracked, and the results are written.

    status   fields of `LiveStatus`, of which only `state` is required
    stale_s  a camera whose last frame is older than this does not deliver [s]
    """
    age_s = status.get("frame_age_s")
    if status["state"] != "running":
        return str(status["state"])
    if age_s is None or age_s > stale_s:
        return "no frames"
    failing = [f"{output}: {why}" for output, why in status.get("failing", {}).items()]
    return "; ".join(failing) or None


def is_stuck(status: Mapping[str, Any], stale_s: float) -> bool:
    """Whether pictures come and are not tracked, `stale_s` after frames were tracked; the first one may take longer."""
    age_s = status.get("frame_age_s")
    return status["state"] == "running" and age_s is not None and age_s > stale_s


def as_rows(tracks: Tracks) -> list[dict[str, Any]]:
    """The confirmed tracks as JSON objects: track_id, status, x_px, y_px, vx_px_s, vy_px_s, box_px."""
    shown = tracks.status != Status.TENTATIVE
    columns = (tracks.id, tracks.status, tracks.xy, tracks.v, tracks.box)
    return [
        {
            "track_id": track,
            "status": Status(status).name.lower(),
            "x_px": xy[0],
            "y_px": xy[1],
            "vx_px_s": v[0],
            "vy_px_s": v[1],
            "box_px": box,
        }
        for track, status, xy, v, box in zip(*(np.round(column[shown], 2).tolist() for column in columns), strict=True)
    ]

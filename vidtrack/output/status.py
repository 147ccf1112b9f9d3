"""What a live run looks like now: plain data for a page, a metrics endpoint, a stream of tracks."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from threading import Condition
from typing import Any

import cv2
import numpy as np

from vidtrack.config.settings import OutputSettings
from vidtrack.output.draw import Pen, draw_clock, draw_lines, draw_tracks, moved_lines
from vidtrack.output.sink import Step
from vidtrack.tracks import Status, Tracks
from vidtrack.traffic.lines import LineCounter

_LATENCIES = 500  # the last so many are looked at
_RATE_S = 5.0  # frames per second are counted over this time


@dataclass(frozen=True, slots=True)
class Account:
    """What a live source says of itself.

    state     "connecting", "running", "waiting" (before another attempt) or "ended"
    reading   its numbers, as in summary.json: width, height, fps_in, frames_dropped, reconnects, stalls, lost, ...
    problems  (Unix time [s], what) of the last ones
    """

    state: str
    reading: Mapping[str, Any]
    problems: list[tuple[float, str]]


@dataclass(frozen=True, slots=True)
class LiveStatus(Account):
    """A live run at one moment.

    source      address without credentials
    started_unix_s, now_unix_s
    frame, time_s   of the last frame, -1 and 0.0 before it
    frame_age_s     seconds since the last frame was done; None before it
    fps_out     frames tracked per second, lately
    tracks      of the last frame, see `as_rows`
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
    """Sink that remembers the newest step; everything else is made when somebody asks, in the asker's thread.

    source     address without credentials
    account    gives the source's account
    latency_s  how long ago a frame's time was
    counter    None without lines
    """

    def __init__(
        self,
        source: str,
        account: Callable[[], Account],
        latency_s: Callable[[float], float],
        settings: OutputSettings,
        counter: LineCounter | None = None,
    ) -> None:
        self._source = source
        self._account = account
        self._latency_s = latency_s
        self._quality = settings.jpeg_quality
        self._counter = counter
        self._started = time.time()
        self._newest: Step | None = None
        self._done: deque[float] = deque(maxlen=_LATENCIES)  # monotonic time of each frame's end
        self._latencies: deque[float] = deque(maxlen=_LATENCIES)
        self._changed = Condition()

    def step(self, step: Step) -> None:
        """Take the newest frame."""
        self._latencies.append(self._latency_s(step.time_s))
        self._done.append(time.monotonic())
        with self._changed:
            self._newest = step
            self._changed.notify_all()

    def close(self) -> None:
        """Wake those who wait."""
        with self._changed:
            self._changed.notify_all()

    def newer(self, frame: int, timeout_s: float) -> Step | None:
        """Wait for a step after this frame number; None if none came in time. For streams of tracks or pictures."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None and self._newest.index > frame, timeout_s)
            newest = self._newest
        return newest if newest is not None and newest.index > frame else None

    def picture(self) -> bytes | None:
        """The newest picture with tracks and lines drawn in, as JPEG; None before the first frame."""
        step = self._newest
        if step is None or step.frame is None:
            return None
        picture = step.frame.bgr()
        pen = Pen(picture)
        if self._counter is not None:
            draw_lines(pen, moved_lines(self._counter.lines, step.motion), self._counter.totals())
        draw_tracks(pen, step.shown)
        draw_clock(pen, step.time_s, [])
        return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, self._quality])[1].tobytes()

    def latency_ms(self) -> dict[str, float]:
        """From capture to tracks, of the last frames: p50, p95, p99 and max; empty before the first."""
        latencies = list(self._latencies)
        if not latencies:
            return {}
        values = np.round(1e3 * np.percentile(latencies, [50, 95, 99, 100]), 2).tolist()
        return dict(zip(("p50", "p95", "p99", "max"), values, strict=True))

    def now(self) -> LiveStatus:
        """Everything at this moment; from any thread."""
        step = self._newest
        account = self._account()
        now_s = time.monotonic()
        done = list(self._done)
        return LiveStatus(
            state=account.state,
            reading=account.reading,
            problems=account.problems,
            source=self._source,
            started_unix_s=self._started,
            now_unix_s=time.time(),
            frame=-1 if step is None else step.index,
            time_s=0.0 if step is None else step.time_s,
            frame_age_s=now_s - done[-1] if done else None,
            fps_out=sum(now_s - t < _RATE_S for t in done) / _RATE_S,
            tracks=[] if step is None else as_rows(step.shown),
            counts={} if self._counter is None else self._counter.totals(),
        )


def as_rows(tracks: Tracks) -> list[dict[str, Any]]:
    """The confirmed tracks as JSON would have them: track_id, status, x_px, y_px, vx_px_s, vy_px_s, box_px."""
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

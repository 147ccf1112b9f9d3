"""Smooths results: steps wait for later measurements."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np

from vidtrack.estimate.smoother import smoothed
from vidtrack.output.sink import Sink, Step
from vidtrack.output.threaded import close_together
from vidtrack.tracking.boxes import absolute
from vidtrack.tracks import Tracks


class Smoothed:
    """Passes steps on to `sinks` with smoothed states; boxes are moved along.

    lag_s  s; steps wait for one to two times this; None: until no track continues from one step to the next, or the
           end
    """

    def __init__(self, *sinks: Sink, lag_s: float | None = None) -> None:
        self._sinks = sinks
        self._lag_s = lag_s
        self._waiting: deque[Step] = deque()

    def step(self, step: Step) -> None:
        """Receive a step with confirmed tracks of a tracker with `smooth`."""
        assert step.tracks.prior_x is not None
        if np.isnan(step.tracks.prior_x).all():  # no track continues, so later steps do not change earlier ones
            self._release(len(self._waiting))
        self._waiting.append(step)
        if self._lag_s is not None and step.time_s - self._waiting[0].time_s >= 2 * self._lag_s:
            self._release(sum(step.time_s - waiting.time_s >= self._lag_s for waiting in self._waiting))

    def close(self) -> None:
        """Pass on the waiting steps."""
        try:
            self._release(len(self._waiting))
        finally:
            close_together(*self._sinks)

    def _release(self, count: int) -> None:
        """Pass on the `count` oldest steps, smoothed by all waiting steps."""
        later: Tracks | None = None
        ready: deque[Tracks] = deque()
        for step in reversed(self._waiting):
            later = step.tracks if later is None else smoothed_by(step.tracks, later)
            ready.appendleft(later)
        for tracks in list(ready)[:count]:
            step = replace(self._waiting.popleft(), tracks=tracks)
            for sink in self._sinks:
                sink.step(step)


def smoothed_first(smooth: bool | None, lag_s: float | None, *sinks: Sink) -> tuple[Sink, ...]:
    """The sinks, behind a smoother with this lag if tracks are smoothed."""
    return (Smoothed(*sinks, lag_s=lag_s),) if smooth else sinks


def smoothed_by(tracks: Tracks, later: Tracks) -> Tracks:
    """Tracks smoothed by the smoothed snapshot after them; boxes move with the positions."""
    assert later.prior_x is not None
    assert later.prior_P is not None
    assert later.gain is not None
    known = np.flatnonzero(~np.isnan(later.prior_x[:, 0]))
    _, rows, found = np.intersect1d(tracks.id, later.id[known], assume_unique=True, return_indices=True)
    ahead = known[found]
    x, P = tracks.x.copy(), tracks.P.copy()
    x[rows], P[rows] = smoothed(
        x[rows], P[rows], later.gain[ahead], later.prior_x[ahead], later.prior_P[ahead], later.x[ahead], later.P[ahead]
    )
    shift = (x - tracks.x)[:, list(tracks.position)]
    return replace(tracks, x=x, P=P, box=absolute(tracks.box, shift))

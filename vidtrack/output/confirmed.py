"""Delays steps until each tentative track in them is confirmed or deleted, and passes on the confirmed ones."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from vidtrack.output.sink import Sink, Step
from vidtrack.output.threaded import close_together
from vidtrack.tracks import TENTATIVE


@dataclass(slots=True)
class _Held:
    step: Step
    undecided: set[int]
    proven: set[int] = field(default_factory=set)


HOLD_S = 2.0
"""s; longest time that rows wait for the confirmation of their track."""
LIVE_HOLD_S = 0.7
"""s; the same in live runs and their repetitions: a kill loses the waiting rows."""


class Confirmed:
    """Passes steps on to `sinks` without pictures and with confirmed tracks only, from their first measurement.

    Steps are delayed, in order. A track that is still tentative after `hold_s` loses its earlier rows, which bounds
    the memory.
    """

    def __init__(self, *sinks: Sink, hold_s: float = HOLD_S) -> None:
        self._sinks = sinks
        self._hold_s = hold_s
        self._held: deque[_Held] = deque()
        self._undecided: set[int] = set()

    def step(self, step: Step) -> None:
        """Receive a step; pass on the steps without undecided tracks."""
        tentative = step.tracks.status == TENTATIVE
        undecided = set(step.tracks.id[tentative].tolist())
        decided = self._undecided - undecided
        if decided:
            proven = decided.intersection(step.tracks.id.tolist())
            for held in self._held:
                held.proven |= held.undecided & proven
                held.undecided -= decided
        self._undecided = undecided
        self._held.append(_Held(step.having(step.tracks), undecided.copy()))
        while self._held and (not self._held[0].undecided or step.time_s - self._held[0].step.time_s > self._hold_s):
            self._release(self._held.popleft())

    def close(self) -> None:
        """Pass on the waiting steps, without unconfirmed tracks."""
        try:
            while self._held:
                self._release(self._held.popleft())
        finally:
            close_together(*self._sinks)

    def _release(self, held: _Held) -> None:
        tracks = held.step.tracks
        keep = tracks.status != TENTATIVE
        if not keep.all():
            if held.proven:
                keep |= np.isin(tracks.id, list(held.proven))
            held.step = held.step.having(tracks.only(keep))
        for sink in self._sinks:
            sink.step(held.step)

"""Scans from payloads as they come: first the pace is learnt, then each scan is given out when it is over."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from time import monotonic

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.config.radar import RadarSettings
from vidtrack.radar.feeds.clock import JUMP_S, Clock
from vidtrack.radar.feeds.messages import Losses, Message, Messages
from vidtrack.radar.feeds.pace import Pace, paced
from vidtrack.radar.feeds.plots import (
    Choice,
    FirstCopies,
    choose,
    nothing_wanted,
    plots_of,
    wanted,
    warn_of_assumed_errors,
    warn_of_others,
)
from vidtrack.radar.feeds.recording import Decoder, decoder_of, plane_of, warn_of_unknown_turns
from vidtrack.radar.plane import Plane
from vidtrack.radar.plots import Plots
from vidtrack.radar.scans import Measurements, measurements
from vidtrack.scan import Scan

_log = logging.getLogger(__name__)

LEARNT_SCANS = 3
"""Scans from which pace and surveyed space are learnt; they are tracked too, afterwards."""
LATE = 0.25
"""Share of a scan that messages may come late: so long after its end a scan is given out."""
MOST_EMPTY = 50
"""Empty scans given out for a pause; every track has ended before."""
SILENT_SCANS = 3
"""After a silence of so many scans what is there is given out."""
KEPT_S = 60.0
"""s; what was heard before is forgotten as long as no plot can be tracked."""
REMEMBERED = 1 << 17
"""Plots and marks of the last JUMP_S that are remembered at most, to leave out their copies from a second feed."""


class ScanStream:
    """Decodes payloads and gives out scans, in the coordinates of the settings' estimator.

    found   measurements of the first scans, from which a tracker is built; None until they are there
    plane   where x = y = 0 is on the earth; None: not known
    plots   number of plots given out
    lacks   why nothing can be tracked of what was heard; None: something can, or nothing was heard
    """

    def __init__(self, settings: RadarSettings, name: str) -> None:
        self._settings, self._name = settings, name
        self.losses = Losses()
        self.found: Measurements | None = None
        self.plane: Plane | None = None
        self.plots = 0
        self._decoders: dict[type[Decoder], Decoder] = {}
        self._kind: type[Decoder] | None = None  # of the one that told the first message
        self._heard: list[tuple[float, Message]] = []
        self.lacks: str | None = None
        self._warned = False
        self._choice: Choice | None = None
        self._pace: Pace | None = None
        self._clock, self._copies = Clock(self.losses), _copies(self.losses)
        self._waiting, self._progress = Messages.of([]), np.zeros(0)
        self._latest = 0.0
        self._next: int | None = None
        self._first = 0
        self._time_s = 0.0

    @property
    def period_s(self) -> float | None:
        """Duration of a scan; None until it is learnt."""
        return None if self._pace is None else self._pace.period_s

    def hear(self, payload: bytes) -> None:
        """Take a payload; the first that tells anything settles the format. ConfigError without the library for it."""
        kind = decoder_of(payload)
        if kind is None or self._kind not in (None, kind):  # other traffic, or damage at its begin
            self.losses.damaged += bool(payload.strip())
            return
        now = monotonic()
        if kind not in self._decoders:
            self._decoders[kind] = kind(self.losses)
        found = [(now, message) for message in self._decoders[kind].messages(payload)]
        if found:
            self._kind = kind
        self._heard += found

    def over(self, *, silent: bool = False) -> Iterator[tuple[int, Scan]]:
        """The scans that are over, and empty ones between them, with numbers from 0; all there are after a silence.

        Raises PlotFormatError for several radars of which none is chosen.
        """
        self._take(silent)
        if self._pace is None:
            return
        number = np.floor(self._progress).astype(np.int64)
        end = int(np.floor(self._latest + (1 if silent else -LATE)))
        for scan in self._due(number, end):
            rows = number == scan
            yield scan - self._first, self._scan(scan, self._waiting.only(rows))
        kept = number >= end
        self._waiting, self._progress = self._waiting.only(kept), self._progress[kept]

    def _due(self, number: np.ndarray, end: int) -> Iterator[int]:
        """The numbers of the next scans up to `end`; long pauses are shortened."""
        assert self._next is not None
        present = np.unique(number[(number >= self._next) & (number < end)])
        for scan in (*present.tolist(), end):
            yield from range(max(self._next, scan - MOST_EMPTY), scan)
            if scan < end:
                yield scan
            self._next = max(self._next, min(scan + 1, end))

    def _take(self, silent: bool) -> None:
        """Number what was heard; while the pace is not known, try to learn it."""
        heard = Messages.of([message for _, message in self._heard])
        if self._pace is None or self._choice is None:
            self._learn(heard, silent)
            return
        self._heard = []
        believed = self._clock.on_one_clock(self._copies.of(self._choice.of(heard)))
        self._keep(believed, self._pace.progress(believed))

    def _learn(self, heard: Messages, silent: bool) -> None:
        """Choose what is tracked, find its pace, and make the measurements of the first scans."""
        if not len(wanted(heard, self._settings)):
            self._wait(nothing_wanted(heard, self._settings))
            return
        choice = choose(heard, self._settings, self._name)
        chosen = _copies(Losses()).of(choice.of(heard))
        found = paced(chosen, self._settings.scan_s, Losses())
        if found is None:
            self._wait("no plots with a time")
            return
        self.lacks = None
        believed, pace = found
        progress = pace.progress(believed)
        if np.ptp(progress) < LEARNT_SCANS + LATE and not silent:
            return
        warn_of_others(choice, heard, self._settings, self._name)
        warn_of_assumed_errors(choice, self._settings, self._name)
        warn_of_unknown_turns(pace, believed, self._settings, self._name)
        self._choice, self._pace, self._heard = choice, pace, []
        self.losses.damaged += choice.damaged
        self._clock = Clock(self.losses, pace.disorder_s)
        self._clock.on_one_clock(self._copies.of(choice.of(heard)))
        self.plane = plane_of(choice, believed, self._settings, self._name)
        self._first = self._next = int(np.floor(progress[~believed.marks].min()))
        self._keep(believed, progress)
        plots = self._plots(self._waiting, np.floor(self._progress).astype(np.int64), Losses())
        self.found = measurements(plots, self._settings)

    def _wait(self, why: str) -> None:
        """Nothing can be tracked yet: keep the last KEPT_S of what was heard, and say once why."""
        if not self._heard:
            return
        self.lacks = why
        oldest = monotonic() - KEPT_S
        if self._heard[0][0] >= oldest:
            return
        if not self._warned:
            _log.warning("%s: for %.0f s there were %s", self._name, KEPT_S, why)
        self._warned = True
        self._heard = [one for one in self._heard if one[0] >= oldest]

    def _keep(self, messages: Messages, progress: Floats) -> None:
        """Keep plots until their scan is over; those of scans given out are late."""
        if len(progress):
            self._latest = max(self._latest, float(progress.max()))
        late = progress < (self._next or 0)
        self.losses.late += int((late & ~messages.marks).sum())
        kept = ~messages.marks & ~late
        self._waiting = self._waiting.and_then(messages.only(kept))
        self._progress = np.concatenate([self._progress, progress[kept]])

    def _plots(self, messages: Messages, scan: np.ndarray, losses: Losses) -> Plots:
        return plots_of(messages, scan, self._settings, self.plane, losses)

    def _scan(self, number: int, messages: Messages) -> Scan:
        """The scan with these plots; an empty one has the time of the last one and a period."""
        assert self.found is not None
        assert self.period_s is not None
        if not len(messages):
            self._time_s += self.period_s
            noise = self.found.R.mean(axis=0)
            return Scan(self._time_s, self.found.z[:0], self.found.R[:0], self.found.sensor, noise=noise)
        plots = self._plots(messages, np.full(len(messages), number), self.losses)
        self.plots += len(plots)
        ((_, scan),) = measurements(plots, self._settings)
        self._time_s = scan.t
        return scan


def _copies(losses: Losses) -> FirstCopies:
    """What leaves out late copies as long as they are no clock that was set back."""
    return FirstCopies(losses, JUMP_S, REMEMBERED)

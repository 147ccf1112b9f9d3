"""One picture beside each event: the frame nearest to its time, with the tracks."""

from __future__ import annotations

import logging
import os
import time
from collections import deque
from contextlib import suppress
from datetime import datetime, tzinfo
from pathlib import Path

from vidtrack.errors import Error
from vidtrack.output.annotated_picture import annotated_jpeg
from vidtrack.output.events.event import PICTURES, Event
from vidtrack.output.folder import replacing, writing
from vidtrack.output.intervals.day import day_folders
from vidtrack.output.linefile import Every
from vidtrack.output.sink import Step
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Limits
from vidtrack.traffic.lines import LineCounter

log = logging.getLogger(__name__)

_EVERY_S = 0.5  # between two pictures that are remembered
_KEPT_S = 10.0  # events are decided sooner than this after they happened
_PRUNE_S = 60.0


class EventPictures:
    """Sink that remembers the pictures of the last seconds, and writes them beside events when asked.

        pictures/2026-11-22/2026-11-22T14-03-07.250-ID.jpg

    root     folder above `pictures`
    counter  whose lines are drawn; None without any
    zone     of the days and of the clock on the pictures
    quality  of JPEG, 1 to 100
    limits   beyond which the oldest pictures are deleted

    The sink is one thread's, the rest another's.
    """

    def __init__(
        self,
        root: Path,
        counter: LineCounter | None,
        zone: tzinfo | None,
        quality: int,
        limits: Limits,
        reserve: Reserve,
    ) -> None:
        self._root = root
        self._counter, self._zone, self._quality = counter, zone, quality
        self._limits, self._reserve = limits, reserve
        self._recent: deque[Step] = deque(maxlen=round(_KEPT_S / _EVERY_S))
        self._due = Every(_PRUNE_S)

    def step(self, step: Step) -> None:
        """Remember the step, if the last one is old enough."""
        if step.frame is not None and (not self._recent or step.time_s - self._recent[-1].time_s >= _EVERY_S):
            self._recent.append(step)

    def close(self) -> None:
        """Do nothing: pictures of events that are still decided may be asked for."""

    def write(self, event: Event, time_s: float) -> str | None:
        """Write the picture of an event at a time of the run [s]; its path below `root`, None without one."""
        recent = list(self._recent)
        if not recent:
            return None
        step = min(recent, key=lambda one: abs(one.time_s - time_s))
        when = datetime.fromtimestamp(event.unix_s, self._zone)
        stamp = f"{when:%Y-%m-%dT%H-%M-%S}.{when.microsecond // 1000:03d}"
        path = Path(PICTURES, f"{when:%Y-%m-%d}", f"{stamp}-{event.id}.jpg")
        lines = self._counter.lines if self._counter else ()
        try:
            self._reserve.check_recordings(self._root)
            with writing(self._root / path):
                (self._root / path).parent.mkdir(parents=True, exist_ok=True)
            with replacing(self._root / path) as new:
                new.write_bytes(annotated_jpeg(step, lines, None, when, self._quality))
        except (Error, OSError) as error:
            log.warning("an event has no picture: %s", error)
            return None
        return path.as_posix()

    def prune(self) -> None:
        """Once a minute, delete the oldest pictures beyond the limits."""
        if not (self._limits and self._due()):
            return
        taken = 0.0
        days = [day for day in day_folders(self._root / PICTURES) if day.is_dir()]
        found = [entry for day in days for entry in os.scandir(day)]
        for entry in sorted(found, key=lambda entry: entry.name, reverse=True):
            with suppress(OSError):
                status = entry.stat()
                taken += status.st_size
                old = self._limits.seconds is not None and time.time() - status.st_mtime > self._limits.seconds
                if old or (self._limits.size is not None and taken > self._limits.size):
                    os.unlink(entry.path)
        for day in days:
            with suppress(OSError):
                day.rmdir()  # if it is empty

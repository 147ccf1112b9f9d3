"""The events of a live run: made of what its camera sees and of how it fares, and handed to their senders."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event as Flag
from threading import Thread
from time import monotonic, time
from typing import Any

import numpy as np

from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError
from vidtrack.output.events.address import parse_broker, parse_hook
from vidtrack.output.events.event import Event, Kind
from vidtrack.output.events.mqtt import Mqtt, State
from vidtrack.output.events.outbox import Outbox
from vidtrack.output.events.sender import Receiver, Sender
from vidtrack.output.events.webhook import Webhook, tls_context
from vidtrack.output.intervals.book import Passage, Totals
from vidtrack.output.sink import Step
from vidtrack.recording.event_pictures import EventPictures
from vidtrack.run.live.road_events import RoadEvents, prepare
from vidtrack.run.sinks import Subject
from vidtrack.traffic.measures.rows import Rows

log = logging.getLogger(__name__)

OUTBOX = "outbox"
"""Folder of the events that wait"""

_LOOK_S = 1.0  # between two looks at the camera's state


@dataclass(frozen=True, slots=True)
class Receivers:
    """Where events are sent; both addresses may contain a password.

    camera  its name in events; None: that of the address
    """

    mqtt: str | None = field(default=None, repr=False)
    webhook: str | None = field(default=None, repr=False)
    token: str | None = field(default=None, repr=False)
    camera: str | None = None

    def __bool__(self) -> bool:
        return self.mqtt is not None or self.webhook is not None

    def check(self, settings: Settings, folder: Path | None) -> None:
        """Raise ConfigError for what can be known to be wrong before a camera is opened.

        folder  of the results; None: a new one for each run
        """
        if self.token is not None and self.webhook is None:
            raise ConfigError("--webhook-token has no effect without --webhook")
        if self.token is not None and not (self.token.isascii() and self.token.isprintable()):
            raise ConfigError("the token of --webhook has a line break or a character that no HTTP header may have")
        if not self:
            if settings.events != type(settings.events)():
                raise ConfigError("the settings of events have no effect without --mqtt or --webhook")
            return
        if folder is None:
            raise ConfigError("--mqtt and --webhook need -o DIR: events that could not be sent wait there")
        if self.mqtt is not None:
            parse_broker(self.mqtt)
        if self.webhook is not None:
            parse_hook(self.webhook)


class LiveEvents:
    """The events of one camera. The senders work from the start on, also while the camera is waited for.

    folder   where events wait, and below which their pictures are
    trouble  returns why the camera does not deliver; None if it does
    after    why the process before this one ended; None: it did not crash
    tell     called with what goes wrong with a receiver

    Raises ConfigError, OutputError, FormatError.
    """

    def __init__(
        self,
        receivers: Receivers,
        camera: str,
        folder: Path,
        settings: Settings,
        trouble: Callable[[], str | None],
        after: str | None,
        tell: Callable[[str], None],
    ) -> None:
        self._camera = receivers.camera or camera
        self._trouble, self._patience_s = trouble, settings.live.timeout_s
        self._tell = tell
        self._problem = after
        self._counts: Callable[[], Totals] | None = None
        self._pictures: EventPictures | None = None
        self._road: RoadEvents | None = None
        self._made: list[str] = []
        self._ending = Flag()
        context = self._context(receivers, settings)
        targets = list(self._receivers(receivers, settings, context))
        limit = settings.events.queue_bytes
        self._outboxes = [Outbox(folder / OUTBOX / target.name, limit) for target in targets]
        self._senders = [Sender(*pair, tell) for pair in zip(targets, self._outboxes, strict=True)]
        if after is not None:
            self._say(on=True)
        self._watching = Thread(target=self._watch, name="problems", daemon=True)
        self._watching.start()

    @property
    def failing(self) -> dict[str, str]:
        """Why events are being lost now, by receiver."""
        return {sender.name: sender.failing for sender in self._senders if sender.failing is not None}

    @property
    def lost(self) -> dict[str, int]:
        """Number of events that were dropped unsent, by receiver, in all runs."""
        return {sender.name: sender.dropped for sender in self._senders}

    @property
    def reading(self) -> dict[str, dict[str, int]]:
        """Number of events sent in this run, waiting and dropped, by receiver."""
        return {one.name: {"sent": one.sent, "waiting": one.waiting, "dropped": one.dropped} for one in self._senders}

    def begin(self, subject: Subject, pictures: EventPictures | None, began_s: Callable[[], float]) -> None:
        """The camera delivers; `began_s` returns the Unix time of time_s 0. Raises ConfigError for a zone."""
        self._counts = subject.counter.totals if subject.counter else dict
        self._pictures, self._began_s = pictures, began_s
        self._coast_s = subject.settings.tracker.coast_s
        if subject.settings.output.site is not None:
            prepare()
        self.use(subject)

    def use(self, subject: Subject) -> None:
        """Go on at the site of the subject. Raises ConfigError for a zone that is not on the road."""
        self.end()
        self._road = None if subject.site is None else RoadEvents(subject, self._coast_s)

    def change(self, subject: Subject) -> None:
        """Go on at another site; one whose zones cannot be used is told of, and has no zone entries and conflicts."""
        try:
            self.use(subject)
        except ConfigError as error:
            self._road = None
            self._tell(f"{error}; zone entries and conflicts are not sent")

    def crossed(self, passages: Sequence[Passage]) -> None:
        """Make events of crossings."""
        for passage in passages:
            told: dict[str, Any] = {"line": passage.gate, "direction": passage.direction, "track_id": passage.track_id}
            speed = {
                "length_m": passage.length,
                "speed_kmh": 3.6 * passage.speed,
                "speed_sigma_kmh": 3.6 * float(np.hypot(passage.speed_sigma, passage.speed_shared)),
            }
            known = self._road is not None and self._road.metres
            self._make(Kind.CROSSING, passage.unix_s, told | (speed if known else {}))

    def step(self, steps: Sequence[Step], seen: Rows | None) -> None:
        """Look for zone entries and conflicts; `seen`: the tracks on the road, None without a calibration."""
        if self._road is None:
            return
        offset_s = self._began_s()
        for entry in self._road.entries(steps, seen):
            told = {"zone": entry.zone, "track_id": entry.track_id, "came": entry.came}
            self._make(Kind.ENTRY, offset_s + entry.time_s, told)
        self._came_close(self._road.conflicts(steps, seen))

    def end(self) -> None:
        """Make events of the conflicts that are not over: nobody looks on."""
        if self._road is not None:
            self._came_close(self._road.unfinished())

    def save(self) -> None:
        """Put what was made into the outboxes; what the disk has no room for is tried again."""
        for outbox in self._outboxes:
            outbox.add(self._made)
        self._made = []
        if self._pictures is not None:
            self._pictures.prune()

    def close(self, until_s: float) -> None:
        """End the senders by a monotonic time; what is not sent waits for the next run."""
        self._ending.set()
        self._watching.join(max(0.0, until_s - monotonic()))
        for sender in self._senders:
            sender.end()
        for sender in self._senders:
            sender.join(until_s)

    def _came_close(self, conflicts: Iterable[tuple[float, dict[str, Any]]]) -> None:
        for time_s, told in conflicts:
            self._make(Kind.CONFLICT, self._began_s() + time_s, told)

    def _make(self, kind: Kind, unix_s: float, content: Mapping[str, Any]) -> None:
        event = Event(kind, self._camera, unix_s, content)
        picture = None
        if self._pictures is not None:
            picture = self._pictures.write(event, unix_s - self._began_s())
        self._made.append(event.as_line(picture))

    def _watch(self) -> None:
        """Tell of trouble that lasts, and of its end."""
        since_s: float | None = None
        while not self._ending.wait(_LOOK_S):
            why = self._trouble()
            if why is None:
                since_s = None
                if self._problem is not None:
                    self._problem = None
                    self._say(on=False)
                continue
            since_s = monotonic() if since_s is None else since_s
            if self._problem is None and monotonic() - since_s >= self._patience_s:
                self._problem = why
                self._say(on=True)

    def _say(self, *, on: bool) -> None:
        line = Event(Kind.PROBLEM, self._camera, time(), {"on": on, "why": self._problem}).as_line()
        for outbox in self._outboxes:
            outbox.add([line])

    def _state(self) -> State:
        return State(self._problem, None if self._counts is None else self._counts())

    def _receivers(self, receivers: Receivers, settings: Settings, context: Any) -> Iterable[Receiver]:
        events = settings.events
        if receivers.mqtt is not None:
            broker = parse_broker(receivers.mqtt)
            yield Mqtt(broker, self._camera, self._state, events.discovery, events.timeout_s, context)
        if receivers.webhook is not None:
            yield Webhook(parse_hook(receivers.webhook), receivers.token, events.timeout_s, context)

    @staticmethod
    def _context(receivers: Receivers, settings: Settings) -> Any:
        file = settings.events.ca_file
        try:
            return tls_context(file)
        except OSError as error:
            raise ConfigError(f"events.ca_file = {file} cannot be used: {error.strerror or error}") from None

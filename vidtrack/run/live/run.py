"""A live run: tracks one camera into a folder of results until it is stopped. Read this file first in `live`."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import asdict
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any

from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError, FormatError
from vidtrack.output.folder import usable
from vidtrack.output.intervals.days import zone_of
from vidtrack.output.linked import refuse_link
from vidtrack.output.lock import exclusive
from vidtrack.output.parquet import memory_of_c
from vidtrack.output.sink import Step
from vidtrack.output.status import Account, StatusBoard, trouble_of
from vidtrack.recording.event_pictures import EventPictures
from vidtrack.recording.recorder import Beginning, NoRecorder, Place, Recorder
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Limits
from vidtrack.run.live.checkpoint import Checkpoint, CheckpointFile, NoCheckpointFile
from vidtrack.run.live.counting import COUNTS, counter_of, counting_of
from vidtrack.run.live.events import OUTBOX, LiveEvents
from vidtrack.run.live.limits import part_sizes, retention_of
from vidtrack.run.live.outputs import LiveExtras, Outputs, lock_extras, lock_folder
from vidtrack.run.live.site import FollowedSite
from vidtrack.run.run import recorded
from vidtrack.run.sinks import Subject
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, kept, video_steps
from vidtrack.traffic.metres import UsedSite
from vidtrack.video.frame import Frame
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import Connection, connection_to
from vidtrack.video.live.source import LiveSource
from vidtrack.video.live.stats import LiveStats
from vidtrack.video.resources import frame_by_frame
from vidtrack.video.span import Span

log = logging.getLogger(__name__)

_HOUR_S = 3600.0
_END_S = 1.3  # from `stop` to the end of the run
_GOODBYE_S = 0.3  # least time to send the last events
_LEAST_S = 0.5  # least time to finish after the last frame


class LiveRun:
    """Context manager that iterates over the steps of a camera and writes the results.

    name    of the source, without credentials
    folder  of the results
    board   current status, for other threads
    counts  folder of the counts by interval; None without counting lines and site

    After the first picture only `stop` ends the iteration: a lost camera is reopened without limit, and results that
    cannot be written are counted.
    Raises SourceError, ConfigError, FormatError, OutputError at the start.

    What cannot be finished in time is left to a thread. A process that ends soon after the run ends by `leave`.

    stats  of the camera, which other threads may read before the first picture; None: of the run alone
    after  why the process before this one ended, which is told as an event; None: it did not crash
    """

    def __init__(
        self,
        address: str,
        settings: Settings,
        output: Path | None = None,
        extras: LiveExtras | None = None,
        *,
        force: bool = False,
        connect: Callable[[], Connection] | None = None,
        stats: LiveStats | None = None,
        after: str | None = None,
    ) -> None:
        extras, live = extras or LiveExtras(), settings.live
        refuse_link(settings.output, "live runs")
        extras.receivers.check(settings, output)
        if live.replace_state and extras.state is None:
            raise ConfigError("setting live.replace_state has no effect without --state")
        self._settings = settings = _from_anywhere(settings)
        self._address = parse_address(address, live.timeout_s)
        self.name = self._address.name
        self._stats = stats = stats or LiveStats()
        roll_s = live.roll_s or (_HOUR_S if live.limited or settings.output.site else None)
        retention = retention_of(live)
        self._outputs: Outputs | None = None
        self._until_s: float | None = None  # monotonic time of the end; None: not stopped
        self._stale_s = 2 * live.timeout_s
        self._in_work = False  # during a frame the checkpoint is inconsistent and must not be saved
        with ExitStack() as locks, ExitStack() as stack:  # on an error below, everything already open is closed
            lock_extras(extras, output, locks)
            self._status: Callable[[], Mapping[str, Any]] = lambda: {"state": stats.state}
            self._events = self._open_events(extras, output, after, locks)
            self._checkpoint_file = (
                NoCheckpointFile()
                if extras.state is None
                else CheckpointFile(extras.state, stats.warn, live.replace_state)
            )
            self._recorder = (
                NoRecorder()
                if extras.record is None
                else Recorder(extras.record, settings, roll_s, retention, Reserve(live.reserve_bytes), stats.warn)
            )
            stack.callback(self._recorder.close)
            self._source = source = stack.enter_context(self._open_source(connect, stats))
            stack.enter_context(frame_by_frame(settings.detector.kind))
            stack.enter_context(memory_of_c())
            self._checkpoint = self._restored(explain=extras.explain)
            if extras.state or extras.record:
                self._checkpoint.gather()  # raises ConfigError for a detector that cannot be saved
            if retention.has_sizes:
                retention.refuse_small(*part_sizes(settings, source.like, recorded=extras.record is not None))
            self._site = self._followed(stats.warn)
            self._at = None if self._site is None else self._site.used  # the site that is tracked at
            counter = counter_of(settings, source.width, source.height, self._at)
            shown, scene = self._address.shown, self._checkpoint.detector.scene
            self.folder = lock_folder(output, self.name, extras, locks, force=force, in_parts=roll_s is not None)
            retention.results.append(self.folder)
            zone = zone_of(live.zone)
            self.board = StatusBoard(shown, self._account, source.latency_s, settings.output, counter, zone)
            self._status = lambda: asdict(self.board.now())
            subject = Subject(shown, settings, source.like.shape, source.fps, scene, self._reading, counter, None)
            subject = subject if self._site is None else subject.at(self._site.used)
            self.counts = None if counter is None else (extras.lasting or self.folder) / COUNTS
            told = None if self._events is None else self._events.crossed
            counting = None if self.counts is None else counting_of(subject, self.counts, self._began_s, told)
            pictures = None
            if self._events is not None:
                pictures = self._event_pictures(extras.lasting or self.folder, subject)
                self._events.begin(subject, pictures, self._began_s)
            self._outputs = Outputs(
                self.folder,
                subject,
                extras,
                roll_s,
                retention,
                counting,
                stats.warn,
                self._site,
                self._events,
                pictures,
            )
            self._open, self._locks = stack.pop_all(), locks.pop_all()

    def __iter__(self) -> Iterator[Step]:
        assert self._outputs is not None
        return recorded(self._steps(), (*self._outputs.sinks, self.board))

    def _steps(self) -> Iterator[Step]:
        """Each frame with its tracks; between two steps the checkpoint is consistent."""
        checkpoint = self._checkpoint
        for step in video_steps(self._frames(), checkpoint.detector, checkpoint.tracker, self._settings):
            checkpoint.note(step)
            self._in_work = False
            yield step

    def stop(self) -> None:
        """End the iteration after the current frame. Safe in any thread and in signal handlers."""
        self._until_s = monotonic() + _END_S
        self._source.stop()

    def __enter__(self) -> LiveRun:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._outputs is not None
        now_s = monotonic()
        self._until_s = until_s = max(self._until_s or now_s + _END_S, now_s + _LEAST_S)
        with self._locks:
            self._open.close()
            self.board.close()
            self._outputs.close(until_s)
            self._checkpoint_file.close(None if self._in_work else self._checkpoint, until_s)

    def _open_source(self, connect: Callable[[], Connection] | None, stats: LiveStats) -> LiveSource:
        """Open the camera; numbers and times continue from a saved state."""
        found = self._checkpoint_file.found
        opened = partial(
            LiveSource,
            self._address,
            self._settings.live,
            self._recorder,
            max_fps=self._settings.source.max_fps,
            connect=connect or connection_to(self._address, self._settings),
            stats=stats,
        )
        if found is None:
            return opened(first=self._checkpoint_file.first)
        since_s = found["time_s"] + max(0.0, time.time() - found["unix_s"])
        return opened(
            first=found["frame"] + 1,
            origin_s=monotonic() - since_s,
            like=Frame.blank((found["height"], found["width"]), found["coloured"]),
        )

    def _open_events(
        self, extras: LiveExtras, output: Path | None, after: str | None, locks: ExitStack
    ) -> LiveEvents | None:
        """The events and their senders, which end before `locks` does; None if nobody is to be told."""
        place = extras.lasting or output
        if not extras.receivers or place is None:
            return None
        locks.enter_context(exclusive(usable(place / OUTBOX)))
        events = LiveEvents(extras.receivers, self.name, place, self._settings, self._trouble, after, self._stats.warn)
        locks.callback(lambda: events.close(max(self._until_s or 0.0, monotonic() + _GOODBYE_S)))
        return events

    def _event_pictures(self, root: Path, subject: Subject) -> EventPictures | None:
        """The pictures of events; None if they are not wanted."""
        live = self._settings.live
        if not self._settings.events.pictures:
            return None
        limits = Limits(live.keep_pictures_s, live.keep_pictures_bytes)
        quality, reserve = self._settings.output.jpeg_quality, Reserve(live.reserve_bytes)
        return EventPictures(root, subject.counter, zone_of(live.zone), quality, limits, reserve)

    def _trouble(self) -> str | None:
        """Why the camera does not deliver, with the last problem of a lost one; None if it does."""
        status, problems = self._status(), list(self._stats.problems)
        trouble = trouble_of(status, self._stale_s)
        return f"{trouble}: {problems[-1][1]}" if problems and status["state"] != "running" else trouble

    def _followed(self, tell: Callable[[str], None]) -> FollowedSite | None:
        """The site of the run, whose file may change; None without one. Raises ConfigError."""
        site, source = self._settings.output.site, self._source
        return None if site is None else FollowedSite(site, source.width, source.height, tell)

    def _restored(self, explain: bool) -> Checkpoint:
        """Detector and tracker, restored from the saved state of an earlier run if there is one."""
        file = self._checkpoint_file
        checkpoint = self._new_checkpoint(explain)
        if file.found is not None:
            try:
                checkpoint.restore(file.found)
            except FormatError as error:
                file.set_aside(error)
                checkpoint = self._new_checkpoint(explain)
        if file.first:
            checkpoint.tracker.register.next_id = file.first
        return checkpoint

    def _new_checkpoint(self, explain: bool) -> Checkpoint:
        source, settings = self._source, self._settings
        tracker = build_blob_tracker(settings.tracker, (source.width, source.height), explain=explain)
        return Checkpoint(build_detector(settings), tracker, source.like)

    def _frames(self) -> Iterator[Frame]:
        """The frames to track; before each one the checkpoint goes to the recording and the state file."""
        checkpoint, recorder, span = self._checkpoint, self._recorder, Span.of(self._settings.source)
        for frame in self._source:
            if frame is None or not span.begun(frame.time_s):
                continue
            if span.over(frame.time_s):
                break
            place = self._source.place
            if self._site is not None and self._site.used is not self._at:
                self._use(self._site.used, place)
            recorder.log_frame(frame, place, self._beginning() if recorder.begins(place) else None)
            self._checkpoint_file.offer(checkpoint)
            self._in_work = True
            yield frame

    def _beginning(self) -> Beginning:
        """What the repetition of a recording begins with, now."""
        return Beginning(self._checkpoint.gather(), None if self._at is None else self._at.text)

    def _use(self, site: UsedSite, place: Place) -> None:
        """Track at another site: with other masks from the next part of the recording on, which has the site's text."""
        was = () if self._at is None else self._at.masked
        if site.masked == was:
            self._at = site
        elif self._recorder.may_change(place):
            self._at = site
            try:
                mask = kept(self._settings, site.masked, self._source.width, self._source.height)
            except ConfigError as error:
                log.warning("%s; masks stay as they were", error)
                return
            self._checkpoint.detector.keep(mask)

    def _reading(self) -> Mapping[str, Any]:
        """The run's counters, for the summary and the page."""
        source, stats = self._source, self._source.stats
        began = datetime.fromtimestamp(self._began_s(), UTC)
        return {
            "fps": round(source.fps, 6),
            "fps_in": round(stats.rate(monotonic()), 2),
            "width": source.width,
            "height": source.height,
            "began": began.isoformat(timespec="milliseconds"),
            "frames_received": stats.received,
            "frames_read": stats.frames_read,
            "frames_dropped": stats.frames_dropped,
            "decode_errors": stats.decode_errors,
            "reconnects": stats.reconnects,
            "stalls": stats.stalls,
            "truncated": False,
            **self._checkpoint.tracker.rates.as_dict(),
            "latency_ms": self.board.latency_ms(),
            "lost": self._lost(),
            **({} if self._events is None else {"events": self._events.reading}),
        }

    def _began_s(self) -> float:
        """Unix time of time_s 0, by the wall clock as it is now."""
        return time.time() - self._source.latency_s(0.0)

    def _failing(self) -> dict[str, str]:
        """Why an output cannot be written now, by output."""
        outputs = {} if self._outputs is None else self._outputs.failing
        own = {"recording": self._recorder.failing, "state": self._checkpoint_file.failing}
        events = {} if self._events is None else self._events.failing
        return outputs | {name: why for name, why in own.items() if why is not None} | events

    def _lost(self) -> dict[str, int]:
        """Number of frames, packets and states not written, and of events not sent, by output."""
        outputs = {} if self._outputs is None else self._outputs.lost
        events = {} if self._events is None else self._events.lost
        return outputs | {"recording": self._recorder.lost, "state": self._checkpoint_file.lost} | events

    def _account(self) -> Account:
        stats = self._source.stats
        return Account(stats.state, self._reading(), list(stats.problems), self._failing())


def _from_anywhere(settings: Settings) -> Settings:
    """The settings with the whole path of the site, which is looked for in the run's summary.json."""
    if settings.output.site is None:
        return settings
    output = settings.output.model_copy(update={"site": settings.output.site.absolute()})
    return settings.model_copy(update={"output": output})

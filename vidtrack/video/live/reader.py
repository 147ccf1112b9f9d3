"""The thread that reads a camera and reconnects it."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from threading import Event, Thread
from time import monotonic
from typing import Any

import av

from vidtrack.config.live import LiveSettings
from vidtrack.errors import SourceError
from vidtrack.video.frame import Frame
from vidtrack.video.live.backoff import Backoff
from vidtrack.video.live.clock import CaptureClock
from vidtrack.video.live.connection import Connection, Refused, Stalled
from vidtrack.video.live.mailbox import Mailbox
from vidtrack.video.live.packet_sink import PacketSink, Place
from vidtrack.video.live.stats import LiveStats
from vidtrack.video.max_rate import MaxRate
from vidtrack.video.planes import to_frame

log = logging.getLogger(__name__)

_TRIES = 3
_EDGE_S = 0.003  # a packet after a longer wait has just arrived
_HARDLY_MORE = 1.05  # of the largest rate; to leave out of 25 that jitter what is beyond 25 would only tear gaps
_BEHIND_S = 1.0  # without such a packet for longer, decoding is too slow and skips to the next key picture


@dataclass(frozen=True, slots=True)
class Shot:
    """A received picture.

    frame  its planes; time_s is on the monotonic clock, index is not set yet
    fps    nominal rate of the stream, None if unknown
    place  place of its packet in the recording
    """

    frame: Frame
    fps: float | None
    place: Place


class Reader:
    """Connects, reads, decodes, and reconnects with increasing pauses, until `stop`.

    connect  opens a Connection
    shots    queue for pictures; closed with an error if the source cannot be opened at the start
    max_fps  no more than so many pictures a second are delivered; None: all
    alive_s  monotonic time of the thread's last activity
    """

    def __init__(
        self,
        connect: Callable[[], Connection],
        shots: Mailbox[Shot],
        stats: LiveStats,
        settings: LiveSettings,
        recorder: PacketSink,
        clock: CaptureClock,
        max_fps: float | None,
    ) -> None:
        self._connect = connect
        self._shots = shots
        self._stats = stats
        self._settings = settings
        self._backoff = Backoff(settings.backoff_s, settings.backoff_longest_s, Random())
        self._recorder = recorder
        self._clock = clock
        self._max_fps = max_fps
        self._rate = MaxRate(max_fps)
        self._blind_s = settings.timeout_s if max_fps is None else max(settings.timeout_s, 2 / max_fps)
        self._stopping = Event()
        self._failures = 0  # since the last picture
        self._reason = ""  # of the last failure
        self._connections = 0
        self.alive_s = monotonic()
        # A daemon: FFmpeg cannot always be interrupted, and the program must be able to end.
        self._thread = Thread(target=self._run, name="camera", daemon=True)
        self._thread.start()

    def stop(self, timeout_s: float) -> None:
        """Stop the thread once FFmpeg returns; wait at most timeout_s for it."""
        self._stopping.set()
        self._thread.join(timeout_s)

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._read()
            except SourceError as error:
                if self._stopping.is_set():
                    break
                self._failures += 1
                never_seen = self._stats.received == 0
                tries = math.inf if self._settings.retry_first else _TRIES
                if never_seen and (isinstance(error, Refused) or self._failures >= tries):
                    self._shots.close(error)
                    break
                gives_up = never_seen and tries == _TRIES
                self._report_failure(error, "trying again" + ("" if gives_up else " for as long as it takes"))
                self._wait()
        self._stats.state = "ended"

    def _report_failure(self, error: SourceError, then: str) -> None:
        """Warn of the first failure; before the next picture only a change of the reason is noted."""
        self._stats.stalls += isinstance(error, Stalled)
        if self._failures == 1:
            self._stats.warn(f"{error}; {then}")
        elif str(error) != self._reason:
            self._stats.note(str(error))
        self._reason = str(error)

    def _wait(self) -> None:
        self._stats.state = "waiting"
        until = monotonic() + self._backoff.next_s()
        while not self._stopping.is_set() and (left := until - monotonic()) > 0:
            self.alive_s = monotonic()
            self._stopping.wait(min(left, self._settings.timeout_s))

    def _read(self) -> None:
        """Run one connection until `stop`; every other end is an error."""
        self._stats.state = "connecting"
        self.alive_s = monotonic()
        connection = self._connect()
        try:
            self._connections += 1
            self._clock.reconnected()
            self._read_packets(connection)
        finally:
            self._recorder.end_part()
            connection.close()

    def _read_packets(self, connection: Connection) -> None:
        """Decode all packets; deliver pictures only after the packets that FFmpeg buffered while probing."""
        live = skipping = False
        edge_s = pictured_s = asked_s = monotonic()
        for packet in connection.packets():
            if self._stopping.is_set():
                break
            now_s = self.alive_s = monotonic()
            if now_s - asked_s > _EDGE_S:
                edge_s = now_s
            slow = now_s - edge_s > _BEHIND_S
            live = live or slow or edge_s == now_s
            if packet.is_keyframe or (slow and not self._settings.every_frame):
                skipping = not packet.is_keyframe
            if self._recorder.cut(connection, packet):
                self._deliver(connection, connection.start_decoder_anew(), now_s)
            packet.opaque = self._recorder.place()
            unwanted = live and connection.is_intra and not self._wanted(now_s, now_s)
            pictures = [] if skipping or unwanted else self._decoded(connection, packet)
            self._recorder.take(packet, pictures, now_s)
            self._stats.frames_dropped += skipping
            if pictures:
                pictured_s = now_s
            elif unwanted:
                self._stats.left_out(now_s)
            elif now_s - pictured_s > self._blind_s:
                raise Stalled(f"no picture could be decoded for {self._blind_s:g} s; is the stream damaged?")
            if live:
                self._deliver(connection, pictures, now_s)
            asked_s = monotonic()

    def _decoded(self, connection: Connection, packet: av.Packet) -> list[av.VideoFrame]:
        """The undamaged pictures that the packet completes; a concealed one would look like traffic."""
        try:
            pictures = connection.decode(packet)
        except av.FFmpegError as error:
            self._stats.count_error(f"a picture cannot be decoded: {error.strerror}")
            return []
        for picture in pictures:
            if picture.is_corrupt:
                self._stats.count_error("a picture is damaged")
        return [picture for picture in pictures if not picture.is_corrupt]

    def _deliver(self, connection: Connection, pictures: list[av.VideoFrame], now_s: float) -> None:
        """Put pictures with their times into the queue."""
        for picture in pictures:
            self._report_stream(connection, picture)
            time_s = self._clock.time_s(connection.stamp_s(picture), now_s)
            self._stats.arrived(now_s)
            if not (connection.is_intra or self._wanted(time_s, now_s)):
                continue
            place: Any = picture.opaque or self._recorder.place()
            shot = Shot(to_frame(0, time_s, picture), connection.fps, place)
            if not self._stopping.is_set():
                self._stats.frames_dropped += self._shots.put(shot)

    def _wanted(self, time_s: float, now_s: float) -> bool:
        """Whether a picture of this time is looked at: all are if hardly more come lately than are wanted."""
        chosen = self._rate.chooses(time_s)
        return chosen or (self._max_fps is not None and 0 < self._stats.rate(now_s) <= _HARDLY_MORE * self._max_fps)

    def _report_stream(self, connection: Connection, picture: av.VideoFrame) -> None:
        """Report changes of the stream when pictures arrive again."""
        if self._stats.state == "running":
            return
        self._stats.state = "running"
        what = f"{picture.width}x{picture.height} {connection.codec}"
        if self._connections > 1:
            self._stats.reconnects += 1
            log.warning("pictures come again: %s", what)
        else:
            log.info("connected: %s", what)
        self._failures = 0
        self._backoff.reset()

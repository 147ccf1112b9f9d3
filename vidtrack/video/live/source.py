"""A live source as an iterator of the newest frames, with capture times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from time import monotonic
from types import TracebackType

from vidtrack.config.live import LiveSettings
from vidtrack.video.clock import FALLBACK_FPS
from vidtrack.video.frame import Frame
from vidtrack.video.live.address import Address
from vidtrack.video.live.clock import CaptureClock
from vidtrack.video.live.connection import Connection
from vidtrack.video.live.mailbox import Mailbox
from vidtrack.video.live.packet_sink import NoPacketSink, PacketSink, Place
from vidtrack.video.live.reader import Reader, Shot
from vidtrack.video.live.stats import LiveStats
from vidtrack.video.planes import matched

IDLE_S = 0.25
"""s; an iteration returns None after so long without a frame."""

_NEWEST, _EVERY = 2, 16  # frames that may wait for the tracker
_STUCK = 4  # time-outs without activity after which a reader thread is replaced
_LATE_S = 5.0  # with every frame tracked, a longer delay gives a warning
_END_S = 0.3  # time for a thread to end


class LiveSource:
    """Frames of a live source; None after IDLE_S without a frame. Iterate from one thread.

    like           a frame of the size and kind of all frames
    width, height  of the first picture [px]; later ones of another size are scaled to it
    fps            nominal frames/s
    stats          counts of frames and problems
    place          place of the last frame in the recording
    origin_s       monotonic time of time_s = 0

    settings   of the capture
    recorder   receives the packets; None: no recording
    max_fps    of more pictures a second than this those between are not delivered; None: all are
    first      number of the first frame
    origin_s   None: the first picture has time 0
    like       all frames are converted to its size and kind; None: those of the first frame
    connect    opens a connection; None: to the address, by FFmpeg
    stats      filled from the first attempt on; None: new ones

    Opening waits for the first picture. Raises SourceError if the source refuses, or without
    live.retry_first fails three times before that.
    """

    def __init__(
        self,
        address: Address,
        settings: LiveSettings,
        recorder: PacketSink | None = None,
        *,
        max_fps: float | None = None,
        first: int = 0,
        origin_s: float | None = None,
        like: Frame | None = None,
        connect: Callable[[], Connection] | None = None,
        stats: LiveStats | None = None,
    ) -> None:
        self._address = address
        self._settings = settings
        self._max_fps = max_fps
        self._connect = connect or (lambda: Connection(address, settings.timeout_s, settings.ffmpeg))
        self._recorder = recorder or NoPacketSink()
        self._shots: Mailbox[Shot] = Mailbox(_EVERY if settings.every_frame else _NEWEST, waits=settings.every_frame)
        self._clock = CaptureClock(patient=settings.every_frame)
        self._index = first
        self._told_size = self._told_late = self._stopped = False
        self.stats = stats or LiveStats()
        self.place: Place = (0, 0)
        self._reader = self._read_on()
        shot = self._first_shot()
        self._waiting: Shot | None = shot
        self.like = like or shot.frame
        self.origin_s = shot.frame.time_s if origin_s is None else origin_s
        self.height, self.width = self.like.shape
        self.fps = shot.fps or FALLBACK_FPS

    def __iter__(self) -> LiveSource:
        return self

    def __next__(self) -> Frame | None:
        if self._stopped:
            raise StopIteration
        shot, self._waiting = self._waiting or self._shots.get(IDLE_S), None
        if shot is None:
            self._watch()
            return None
        self.place = shot.place
        frame = replace(shot.frame, index=self._index, time_s=shot.frame.time_s - self.origin_s)
        self._index += 1
        self.stats.frames_read += 1
        if self._settings.every_frame and not self._told_late and self.latency_s(frame.time_s) > _LATE_S:
            self._told_late = True
            self.stats.warn(f"the tracker is {_LATE_S:g} s behind; use a smaller --scale, or let frames be dropped")
        if frame.shape != self.like.shape and not self._told_size:
            self._told_size = True
            size = f"{frame.shape[1]}x{frame.shape[0]}"
            self.stats.warn(f"pictures are {size} now; scaled to {self.width}x{self.height} as before")
        return matched(frame, self.like)

    def latency_s(self, time_s: float) -> float:
        """Age [s] of a frame with this time."""
        return monotonic() - self.origin_s - time_s

    def stop(self) -> None:
        """End the iteration soon; safe from any thread and from signal handlers."""
        self._stopped = True

    def __enter__(self) -> LiveSource:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Stop reading."""
        self._shots.close()
        self._reader.stop(_END_S)

    def _read_on(self) -> Reader:
        return Reader(
            self._connect, self._shots, self.stats, self._settings, self._recorder, self._clock, self._max_fps
        )

    def _first_shot(self) -> Shot:
        try:
            while (shot := self._shots.get(IDLE_S)) is None:
                self._watch()
        except BaseException:
            self.close()
            raise
        return shot

    def _watch(self) -> None:
        """Replace a reader thread that hangs in a driver without time-out."""
        if monotonic() - self._reader.alive_s > _STUCK * self._settings.timeout_s:
            self.stats.stalls += 1
            self.stats.warn(f"reading {self._address.shown} hangs in the system; it is opened anew")
            self._reader.stop(0.0)
            self._reader = self._read_on()

"""Records a camera's packets, the tracked frames and the tracker's state, so that a run can be repeated exactly."""

from __future__ import annotations

import logging
import shutil
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path
from threading import RLock
from time import monotonic

import av

from vidtrack.config.settings import Settings
from vidtrack.errors import StoppedEarly
from vidtrack.output.folder import usable, writing
from vidtrack.output.linefile import LineFile
from vidtrack.recording.muxer import Muxer
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Retention, new_part
from vidtrack.recording.source import FRAMES, FRAMES_HEADER, SETTINGS, STATE, VIDEO
from vidtrack.state import State, write_state
from vidtrack.traffic.metres import SITE_COPY
from vidtrack.video.frame import Frame
from vidtrack.video.live.connection import Connection
from vidtrack.video.live.packet_sink import NoPacketSink, Place

log = logging.getLogger(__name__)

_RETRY_S = 5.0  # after a failed write
_WARN_S = 60.0  # between two warnings of a continuing loss
_END_S = 0.5  # for the reader to finish its packet at the end
_NOWHERE: Place = (-1, 0)


@dataclass(frozen=True, slots=True)
class Beginning:
    """What the repetition of a part begins with.

    state  checkpoint before the first tracked frame
    site   text of the site's file; None without a site
    """

    state: State
    site: str | None


class NoRecorder(NoPacketSink):
    """Records nothing: a run without --record."""

    lost = 0
    failing: str | None = None

    def begins(self, place: Place) -> bool:
        """False."""
        return False

    def may_change(self, place: Place) -> bool:
        """True."""
        return True

    def log_frame(self, frame: Frame, place: Place, beginning: Beginning | None) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


class Recorder:
    """Records packets, the list of tracked frames, and the checkpoint before the first of them, in parts.

    A new part begins with each connection, and at a key picture when `roll_s` of the clock has passed or the part is
    large. After a write error, recording pauses and resumes in a new part.

    reserve  of the disk, which is left to results
    tell     called with what goes wrong

    lost     packets that could not be written
    failing  why nothing can be recorded now; None: it can

    The tracker's thread calls `log_frame`; the reader's thread calls the other methods and writes all files.
    Raises OutputError if nothing can be written into `root`.
    """

    def __init__(
        self,
        root: Path,
        settings: Settings,
        roll_s: float | None,
        retention: Retention,
        reserve: Reserve,
        tell: Callable[[str], None] = log.warning,
    ) -> None:
        self.lost = 0
        self.failing: str | None = None
        self._wanted = False  # a part, with the next key picture
        self._root = usable(root)
        self._reserve = reserve
        self._tell = tell
        self._state_bytes = 0  # of the last state written, which every part has
        retention.recorded.append(root)
        self._settings = settings.model_dump_json(indent=2)
        self._roll_s = roll_s
        self._retention = retention
        self._writing = RLock()  # on a slow disk the reader may still hold it when the run ends
        self._muxer: Muxer | None = None
        self._folders: dict[int, Path] = {}
        self._part = 0
        self._period = 0
        self._retry_s = 0.0
        self._warned_s = -_WARN_S
        self._logged = _NOWHERE[0]
        self._to_write: deque[tuple[int, Beginning | str]] = deque()
        self._list: LineFile | None = None
        self._listed = _NOWHERE[0]

    def cut(self, connection: Connection, packet: av.Packet) -> bool:
        """Begin a new part with this packet if no part is open, or if one is due and this is a key picture."""
        with self._writing:
            begins = self._muxer is None and monotonic() >= self._retry_s
            if not begins and not (self._muxer is not None and packet.is_keyframe and self._due(self._muxer)):
                return False
            self.end_part()
            try:
                self._reserve.check_recordings(self._root)
                self._begin(connection)
            except StoppedEarly as error:
                self._pause(str(error))
            except (OSError, av.FFmpegError) as error:
                self._pause(error.strerror or str(error))
            return True

    def place(self) -> Place:
        """Number of the part, and number of the next packet in it."""
        with self._writing:
            return _NOWHERE if self._muxer is None else (self._part, self._muxer.packets)

    def take(self, packet: av.Packet, pictures: list[av.VideoFrame], arrived_s: float) -> None:
        """Write a packet, and the entries that the tracker has logged since the last one."""
        with self._writing:
            if self._muxer is None:
                self.lost += 1
                return
            try:
                self._reserve.check_recordings(self._root)
                self._muxer.take(packet, pictures, arrived_s)
                self._write_log()
            except (StoppedEarly, av.FFmpegError) as error:
                self._pause(str(error))
                return
            if self._muxer.error is not None:
                self._pause(self._muxer.error.strerror or str(self._muxer.error))
            else:
                self.failing = None

    def end_part(self) -> None:
        """End the part."""
        with self._writing:
            muxer, self._muxer = self._muxer, None
            if muxer is None:
                return
            try:
                muxer.close()
            except (OSError, av.FFmpegError) as error:
                log.warning("the end of a recording is lost: %s", error.strerror)

    def begins(self, place: Place) -> bool:
        """Whether the frame at this place is the first tracked frame of its part."""
        return place[0] not in (self._logged, _NOWHERE[0])

    def may_change(self, place: Place) -> bool:
        """Whether another site may be used from the frame at this place on: its part has the new one, or it is in none.

        If not, a part begins with the next key picture.
        """
        may = place[0] == _NOWHERE[0] or self.begins(place)
        self._wanted |= not may and place[0] == self._part  # else one has begun, and its frames come soon
        return may

    def log_frame(self, frame: Frame, place: Place, beginning: Beginning | None) -> None:
        """Log the frame that is tracked next; `beginning` if it `begins` a part."""
        part, packet = place
        if part == _NOWHERE[0]:
            return
        if beginning is not None:
            self._logged = part
            self._to_write.append((part, beginning))
        self._to_write.append((part, f"{frame.index},{frame.time_s!r},{packet}\n"))

    def close(self) -> None:
        """Write the last log entries; call it after stopping the reader."""
        if not self._writing.acquire(timeout=_END_S):
            log.warning("the end of the recording is lost: the disk does not answer")
            return
        try:
            self.end_part()
            self._retry_s = inf  # a packet that the reader still delivers begins no part
            self._write_log()
            self._end_list()
        except StoppedEarly as error:
            log.warning("%s", error)
        finally:
            self._writing.release()

    def _due(self, muxer: Muxer) -> bool:
        limit = self._retention.recordings_part
        large = limit is not None and muxer.size + self._state_bytes > limit
        return large or self._wanted or self._period != self._now()

    def _now(self) -> int:
        """Number of the current period of `roll_s` seconds."""
        return 0 if self._roll_s is None else int(time.time() // self._roll_s)

    def _begin(self, connection: Connection) -> None:
        folder = new_part(self._root)
        self._wanted = False
        self._part += 1
        self._folders[self._part] = folder
        self._period = self._now()
        (folder / SETTINGS).write_text(self._settings)
        self._muxer = Muxer(folder / VIDEO, connection)
        self._folders.pop(self._part - 3, None)  # its last frame was tracked long ago

    def _pause(self, why: str) -> None:
        self.lost += 1
        self.failing = why
        self._retry_s = monotonic() + _RETRY_S
        self.end_part()
        folder = self._folders.get(self._part)
        if folder is not None and not (folder / FRAMES).exists():  # without frames.csv a part cannot be repeated
            del self._folders[self._part]
            shutil.rmtree(folder, ignore_errors=True)
        if monotonic() - self._warned_s > _WARN_S:
            self._warned_s = monotonic()
            self._tell(f"recording pauses: {why}; tracking goes on")

    def _end_list(self) -> None:
        ended, self._list = self._list, None
        if ended is not None:
            ended.close()

    def _write_log(self) -> None:
        """Write the logged beginnings and frames to their parts."""
        while self._to_write:
            part, entry = self._to_write.popleft()
            if not isinstance(entry, str):
                self._begin_list(part, entry)
            elif self._list is not None and part == self._listed:
                self._list.add(entry)

    def _begin_list(self, part: int, beginning: Beginning) -> None:
        self._end_list()
        folder = self._folders.get(part)
        if folder is None:  # its pictures could not be written
            return
        with writing(folder):
            if beginning.site is not None:
                (folder / SITE_COPY).write_text(beginning.site, encoding="utf-8")
            write_state(folder / STATE, beginning.state)
            self._state_bytes = (folder / STATE).stat().st_size
        self._list = LineFile(folder / FRAMES, FRAMES_HEADER)
        self._listed = part

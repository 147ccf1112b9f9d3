"""A recording as a source: the frames that the live run tracked, with their times."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any

import av

from vidtrack.errors import FormatError, SourceError
from vidtrack.state import State, read_state
from vidtrack.traffic.metres import SITE_COPY
from vidtrack.video.clock import FALLBACK_FPS
from vidtrack.video.frame import Frame
from vidtrack.video.planes import matched, to_frame
from vidtrack.video.stats import SourceStats

log = logging.getLogger(__name__)

VIDEO, FRAMES, STATE, SETTINGS = "video.mkv", "frames.csv", "state.npz", "settings.json"
FRAMES_HEADER = "frame,time_s,packet\n"


def is_recording(path: str) -> bool:
    """Whether the path is a folder written by --record, or one part of it."""
    folder = Path(path)
    return folder.is_dir() and bool(_parts(folder))


def recorded_settings(path: str) -> dict[str, Any]:
    """Settings of the run that made the recording, with the site as it was then. Raises FormatError."""
    parts = _parts(Path(path))
    file = parts[0] / SETTINGS
    try:
        settings: dict[str, Any] = json.loads(file.read_text())
    except (OSError, ValueError) as error:
        raise FormatError(f"cannot read {file}: {error}") from None
    copy = parts[0] / SITE_COPY
    if copy.is_file():
        settings["output"]["site"] = str(copy)
        for part in parts[1:]:
            if (part / SITE_COPY).is_file() and (part / SITE_COPY).read_bytes() != copy.read_bytes():
                log.warning(
                    "%s was recorded with another site than %s, whose site is used; repeat it alone", part, copy
                )
                break
    return settings


def part_order(part: Path) -> tuple[str, int]:
    """Sort key of a part: the time in its name, and its number among parts of the same time."""
    time_utc, _, number = part.name.partition("Z")
    return time_utc, int(number[1:]) if number[1:].isdecimal() else 1


class Recording:
    """Iterates, once, over the tracked frames of a recording, with their numbers and times.

    name, place, width, height, fps, frames, stats  as for Source
    like     a frame with the size and colour format of all frames
    restore  called with the live run's state before the first frame of each part; set it before iterating

    Raises SourceError if it holds no tracked frame, FormatError if it is damaged.
    """

    def __init__(self, path: str) -> None:
        self._parts = [part for part in _parts(Path(path)) if _row_count(part)]
        if not self._parts:
            raise SourceError(f"the recording {path} holds no frame that was tracked")
        state = read_state(self._parts[0] / STATE)
        self.like = Frame.blank((state["height"], state["width"]), state["coloured"])
        self.place = Path(path)
        self.name = self.place.resolve().name
        self.height, self.width = self.like.shape
        self.fps = FALLBACK_FPS
        self.frames = sum(_row_count(part) for part in self._parts)
        self.stats = SourceStats()
        self.restore: Callable[[State], None] = lambda state: None

    def __iter__(self) -> Iterator[Frame]:
        last = -1
        for part in self._parts:
            self.restore(read_state(part / STATE))
            for frame in self._replayed(part):
                if frame.index <= last:
                    self.stats.warn(f"another run begins with {part}: its frames and tracks are numbered anew")
                last = frame.index
                self.stats.frames_read += 1
                yield matched(frame, self.like)

    def close(self) -> None:
        """Do nothing: the iteration closes its files."""

    def _replayed(self, part: Path) -> Iterator[Frame]:
        """The frames listed in one part's frames.csv."""
        wanted = _rows(part)
        try:
            with av.open(f"file:{part / VIDEO}") as container:
                coder = container.streams.video[0].codec_context
                coder.thread_type = "SLICE"
                coder.copy_opaque = True
                for number, packet in enumerate(container.demux(video=0)):
                    packet.opaque = number
                    for picture in _decoded(coder, packet):
                        if picture.opaque in wanted:
                            frame, time_s = wanted[picture.opaque]
                            yield to_frame(frame, time_s, picture)
        except (av.FFmpegError, IndexError) as error:
            self.stats.mark_truncated(f"the end of {part / VIDEO} cannot be read: {error}")


def _decoded(coder: av.VideoCodecContext, packet: av.Packet) -> list[av.VideoFrame]:
    """The pictures of a packet; none of a damaged packet, whose frames were not tracked."""
    try:
        return list(coder.decode(packet if packet.size else None))
    except av.FFmpegError:
        return []


def _parts(folder: Path) -> list[Path]:
    candidates = [folder, *sorted((entry for entry in folder.iterdir() if entry.is_dir()), key=part_order)]
    return [part for part in candidates if (part / VIDEO).is_file() and (part / STATE).is_file()]


def _row_count(part: Path) -> int:
    return len(_rows(part))


def _rows(part: Path) -> dict[int, tuple[int, float]]:
    """Number and time of each tracked frame, by the number of its packet."""
    try:
        lines = (part / FRAMES).read_text(encoding="ascii").split("\n")
        rows = [line.split(",") for line in lines[1:-1]]  # a kill may have cut the last line
        found = {int(packet): (int(frame), float(time_s)) for frame, time_s, packet in rows}
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise FormatError(f"cannot read {part / FRAMES}: {error.strerror}") from None
    except ValueError as error:
        raise FormatError(f"{part / FRAMES} is damaged: {error}") from None
    times = [time_s for _, time_s in found.values()]
    if not all(isfinite(time_s) for time_s in times) or any(b <= a for a, b in pairwise(times)):
        raise FormatError(f"{part / FRAMES} is damaged: its times do not increase")
    return found

"""Frames from video files, image folders and globs, read ahead."""

from __future__ import annotations

import difflib
import glob
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import closing
from itertools import chain
from math import ceil
from pathlib import Path
from types import TracebackType

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import SourceError
from vidtrack.video.container import VideoFile
from vidtrack.video.frame import Frame
from vidtrack.video.pictures import ImageSequence, images_in, images_like
from vidtrack.video.planes import matched, to_frame
from vidtrack.video.readahead import ReadAhead
from vidtrack.video.span import ROUNDING_S, Span
from vidtrack.video.stats import SourceStats

_DEPTH = 4  # frames read ahead: enough to even out key frames, 50 MB at 4K
_KEPT_BYTES = 200_000_000  # of an opening; ten seconds of 640x360 at 25 frames/s are 86 MB


def open_source(path: str, settings: SourceSettings) -> Source:
    """Open a video file, an image folder or a glob of images; its first picture is decoded at once.

    Raises SourceError for an input that is missing, unreadable, empty or not a video.
    """
    stats = SourceStats()
    try:
        return Source(path, settings, stats)
    except OSError as error:
        raise SourceError(f"cannot read {path}: {error.strerror}") from None


def open_part(path: str, settings: SourceSettings) -> Source:
    """Open the part of a video file from `start_s` to `end_s`, decoded from the key picture before it.

    The frames have the times of the whole file; they are numbered from that key picture. Raises as `open_source`.
    """
    stats = SourceStats()
    try:
        return Source(path, settings, stats, from_s=settings.start_s)
    except OSError as error:
        raise SourceError(f"cannot read {path}: {error.strerror}") from None


def duration_s(path: str, settings: SourceSettings | None = None) -> float | None:
    """Length of a video file, in the times that `open_source` gives [s]; its warnings are left to that.

    None where it does not state one, and for images. Raises as `open_source`.
    """
    if not Path(path).is_file():
        return None
    video = VideoFile(Path(path), settings or SourceSettings(), SourceStats(told=True))
    try:
        return video.duration_s
    finally:
        video.close()


class Excerpts:
    """Frames of spans of time out of an input, with the times that `open_source` gives them; for one thread.

    Raises SourceError as `open_source`.
    """

    def __init__(self, path: str, settings: SourceSettings) -> None:
        try:
            self._pictures = _pictures(path, settings, SourceStats(told=True))
        except OSError as error:
            raise SourceError(f"cannot read {path}: {error.strerror}") from None

    def between(self, begin_s: float, end_s: float) -> Iterator[Frame]:
        """The frames from begin to end; their numbers are not known, and are 0."""
        return (to_frame(0, *picture) for picture in self._pictures.between(begin_s, end_s))

    def close(self) -> None:
        """Close the file."""
        self._pictures.close()


class Source:
    """The frames of an input from `start_s` to `end_s`, read in a thread of their own; iterate once.

    No more than `max_fps` a second come, with the numbers and times that they have among all.

    name           default name of the run
    place          the file, or the folder of the images
    width, height  of the first picture [px]; later ones of another size are scaled to it
    fps            nominal frames/s; each frame has its own time
    frames         expected number, for progress bars only; None if unknown
    before         number of the last frame before the span; None: there is none, or it is not read yet
    stats          counts of frames and problems

    Iterating raises SourceError if the span of time holds no frame.
    """

    def __init__(self, path: str, settings: SourceSettings, stats: SourceStats, from_s: float = 0.0) -> None:
        self._path, self._settings = path, settings
        self._pictures = pictures = _pictures(path, settings, stats, from_s)
        self._span = Span.of(settings)
        self.name = pictures.name
        self.place = pictures.place
        self.fps = pictures.fps
        self.stats = stats
        frames = (to_frame(*picture) for picture in pictures)
        first = next(frames, None)
        if first is None:
            pictures.close()
            raise SourceError(f"no picture of {pictures.name} can be decoded")
        self._first = first
        self.height, self.width = first.shape
        self._looked_at_fps = settings.looked_at_fps(self.fps)
        self.frames = None if pictures.frames is None else self._expected(pictures.frames)
        self.before: int | None = None
        self._reduce: Callable[[Frame], Frame] = lambda frame: frame
        self._ahead = ReadAhead(self._reduced(self._alike(self._in_span(chain([first], frames)), first)), _DEPTH)
        self._opened: deque[Frame] = deque()  # frames of the opening, kept for the reading

    def __iter__(self) -> Source:
        return self

    def __next__(self) -> Frame:
        frame = self._opened.popleft() if self._opened else next(self._ahead)
        self.stats.frames_read += 1
        return frame

    def __enter__(self) -> Source:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def reduce_by(self, reduce: Callable[[Frame], Frame]) -> None:
        """From now on the thread that reads passes frames through `reduce`; a few that it has read come as they are.

        `reduce` returns a frame with the same picture, or with a smaller one in memory of its own.
        """
        reduce(self._first)  # it may note the size, which is for one thread
        self._reduce = reduce

    def opening(self, seconds: float, end_s: float | None, every_s: float = 0.0) -> Iterator[Frame]:
        """The frames of its first seconds, at most to end_s, before it is iterated.

        They are kept until then if they are few or small. Others are read twice: their numbers are 0, and some of those
        less than `every_s` apart may be missing.
        """
        begin_s = self._span.start_s
        end_s = begin_s + seconds if end_s is None else min(end_s, begin_s + seconds)
        size = (end_s - begin_s) * self._looked_at_fps * self._reduce(self._first).nbytes
        if end_s <= self._span.end_s and size <= _KEPT_BYTES:
            yield from self._kept(end_s)
            return
        with closing(_pictures(self._path, self._settings, SourceStats(told=True))) as again:
            for picture in again.between(begin_s, end_s, every_s):
                yield matched(to_frame(0, *picture), self._first)

    def _kept(self, end_s: float) -> Iterator[Frame]:
        """The frames to end_s, each kept for the reading; so is the one after them, since it is read by then.

        There are fewer where pictures come so much faster than the stated rate that they would be too large.
        """
        held = 0
        for frame in map(self._own, self._ahead):
            self._opened.append(frame)
            held += frame.nbytes
            if frame.time_s > end_s + ROUNDING_S or held > _KEPT_BYTES:
                break
            yield frame

    def _own(self, frame: Frame) -> Frame:
        """The frame, reduced if possible, in memory of its own."""
        small = self._reduce(frame)
        return small.copy() if small.whole is None else small

    def close(self) -> None:
        """Stop reading; may be called at any time and again."""
        self._opened.clear()
        self._ahead.close()
        self._pictures.close()

    def _expected(self, pictures: int) -> int:
        """How many frames come of so many pictures in the input."""
        return ceil(len(self._span.frames(self.fps, pictures)) * self._looked_at_fps / self.fps - 1e-6)

    def _in_span(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        empty = True
        last_s = 0.0
        for frame in frames:
            last_s = frame.time_s
            if self._span.over(last_s):
                break
            if self._span.begun(last_s):
                empty = False
                yield frame
            else:
                self.before = frame.index
        if empty:
            where = f"between {self._span}" if self._settings.max_fps is None else f"to look at between {self._span}"
            raise SourceError(f"{self.name} has no frame {where}; the last one read is at {last_s:g} s")

    def _reduced(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        return (self._reduce(frame) for frame in frames)  # as it is when the frame is read

    def _alike(self, frames: Iterator[Frame], first: Frame) -> Iterator[Frame]:
        """All frames converted to the size and kind of the first, with one warning."""
        told = False
        for frame in frames:
            if frame.shape != first.shape and not told:
                told = True
                size = f"{frame.shape[1]}x{frame.shape[0]}"
                self.stats.warn(f"frame {frame.index} is {size}; scaled to {self.width}x{self.height} like the first")
            yield matched(frame, first)


def _pictures(
    path: str, settings: SourceSettings, stats: SourceStats, from_s: float = 0.0
) -> VideoFile | ImageSequence:
    place = Path(path)
    if "://" in path:  # the address stays out of the message: it may hold a password
        raise SourceError("a stream is not a file; read it with vidtrack live")
    if place.is_dir():
        return ImageSequence(images_in(place), settings, stats)
    if place.exists():
        return VideoFile(place, settings, stats, from_s)
    if glob.has_magic(path):
        return ImageSequence(images_like(path), settings, stats)
    raise SourceError(_missing(place))


def _missing(path: Path) -> str:
    """The message for a missing file, with the nearest existing name."""
    if not path.parent.is_dir():
        return f"cannot open {path}: there is no folder {path.parent}"
    names = [entry.name for entry in path.parent.iterdir()]
    near = difflib.get_close_matches(path.name, names, n=1)
    hint = f"; did you mean {path.parent / near[0]}?" if near else ""
    return f"cannot open {path}: no such file or folder{hint}"

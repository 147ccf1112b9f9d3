"""What a sink gets: everything known about one frame, once."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

from vidtrack.arrays.types import Floats
from vidtrack.output.in_picture import moved, seen
from vidtrack.scan import Scan
from vidtrack.tracks import Tracks

if TYPE_CHECKING:  # radar runs have no pictures, and must not need OpenCV
    from vidtrack.video.foreground import Foreground
    from vidtrack.video.frame import Frame


@dataclass(frozen=True, slots=True)
class Step:
    """One frame, or one scan of a radar, through the whole pipeline.

    index       frame number from 0, or the scan's number
    scan, tracks   in pixels of the scene, which are those of the first picture, or in the radar's plane
    frame, foreground   None for stored detections and radar plots, which have no picture
    stage_s     seconds spent in each stage
    motion      (2, 3) from the scene to this picture [px]; None: the camera is where it was in the first one
    warnings    what the user should know, said for the first time
    """

    index: int
    time_s: float
    scan: Scan
    tracks: Tracks
    frame: Frame | None
    foreground: Foreground | None
    stage_s: Mapping[str, float]
    motion: Floats | None = None
    warnings: tuple[str, ...] = ()

    @property
    def shown(self) -> Tracks:
        """The tracks in pixels of this picture, as users see them."""
        return moved(self.tracks, self.motion)

    def in_picture(self) -> Step:
        """The step with scan and tracks where they are in this picture."""
        if self.motion is None:
            return self
        return replace(self, scan=seen(self.scan, self.motion), tracks=self.shown, motion=None)


class Sink(Protocol):
    """Something that reads steps: a table, a video, a recording."""

    def step(self, step: Step) -> None:
        """Take one frame's results."""

    def close(self) -> None:
        """Write what is left; results stay valid if it is never called."""


def close_together(*sinks: Sink) -> None:
    """Close the sinks side by side, for most of it is encoding. All are closed, whatever one raises.

    The last is closed in the calling thread: OpenCV loads its font anew for each thread that writes with it.
    """
    *others, last = sinks
    with ExitStack() as closed, ThreadPoolExecutor() as pool:
        for sink in others:
            closed.callback(pool.submit(sink.close).result)
        last.close()

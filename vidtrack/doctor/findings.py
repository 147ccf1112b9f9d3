"""The measurements of a source, as plain data."""

from __future__ import annotations

from dataclasses import dataclass

from vidtrack.video.quality.flicker import Flicker
from vidtrack.video.quality.light import Light
from vidtrack.video.quality.shake import Shake
from vidtrack.video.quality.timing import Timing


@dataclass(frozen=True, slots=True)
class Reception:
    """Faults while reading the source.

    header_fps     rate in the header [1/s]; None without one
    fps_assumed    whether the rate is unknown
    truncated      whether the file lacks its end
    decode_errors  number of damaged pictures
    dropped        number of pictures dropped because decoding was too slow
    reconnects, stalls   of a live source
    gone           whether a live source was lost at the end
    """

    header_fps: float | None
    fps_assumed: bool
    truncated: bool = False
    decode_errors: int = 0
    dropped: int = 0
    reconnects: int = 0
    stalls: int = 0
    gone: bool = False


@dataclass(frozen=True, slots=True)
class Speed:
    """Processing times on this machine.

    decode_s  time to read and decode a picture [s]; None for a live source
    track_s   time to detect and track in a picture [s]
    """

    decode_s: float | None
    track_s: float

    @property
    def rate(self) -> float:
        """Pictures per second that can be tracked."""
        return 1 / ((self.decode_s or 0.0) + self.track_s)


@dataclass(frozen=True, slots=True)
class Objects:
    """Moving objects. Sizes are the longer side of a box, in source pixels.

    tracks         number of tracks that travelled
    missed         number of further tracks that only finer settings find
    median_px, smallest_px   median and 10th percentile of the sizes of both; None without any
    least_px       least size that the settings can detect
    step           source pixels per pixel of the processed picture
    motion_share   mean share of the picture that moves
    restless_share share of the picture that often moves outside tracks
    restless_box   left, top, width, height of the largest such region [source px]; None without one
    """

    tracks: int
    missed: int
    median_px: float | None
    smallest_px: float | None
    least_px: float
    step: int
    motion_share: float
    restless_share: float
    restless_box: tuple[int, int, int, int] | None


@dataclass(frozen=True, slots=True)
class Findings:
    """All measurements of a source.

    source         without credentials
    kind           "video", "recording" (of a live run), "live" or "detections"
    width, height  px
    fps            nominal rate of a run [1/s]
    timing         None with fewer than two pictures
    blockiness     1 without visible blocks of compression

    The fields after `timing` are None for stored detections, which have no pictures.
    """

    source: str
    kind: str
    width: int
    height: int
    fps: float
    reception: Reception
    timing: Timing | None
    light: Light | None = None
    flicker: Flicker | None = None
    shake: Shake | None = None
    blockiness: float | None = None
    objects: Objects | None = None
    speed: Speed | None = None

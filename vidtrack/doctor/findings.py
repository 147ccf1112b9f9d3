"""What the doctor found out about a source, as plain data."""

from __future__ import annotations

from dataclasses import dataclass

from vidtrack.video.quality.flicker import Flicker
from vidtrack.video.quality.light import Light
from vidtrack.video.quality.shake import Shake
from vidtrack.video.quality.timing import Timing


@dataclass(frozen=True, slots=True)
class Reception:
    """What went wrong while the source was read.

    header_fps     rate that it states; None if it states none
    fps_assumed    nothing tells the rate
    truncated      a file without its end
    decode_errors  damaged pictures
    dropped        pictures that came too fast to be decoded
    reconnects, stalls   of a live source
    gone           it was not there any more at the end
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
    """What this machine can do.

    decode_s  seconds to read and decode a picture; None where the camera sets the pace
    track_s   seconds to find and track what moves in it
    """

    decode_s: float | None
    track_s: float

    @property
    def rate(self) -> float:
        """Pictures per second that can be tracked."""
        return 1 / ((self.decode_s or 0.0) + self.track_s)


@dataclass(frozen=True, slots=True)
class Objects:
    """What moves. Sizes are the longer side of a box, in source pixels.

    tracks         that went somewhere
    missed         more of them that finer settings find
    median_px, smallest_px   size of both; the smallest one in ten; None without any
    least_px       size that the settings can see
    step           source pixels per pixel of the processed picture
    motion_share   of the picture, in motion in the average frame
    restless_share of the picture: it moves often, and no track explains it
    restless_box   left, top, width, height of the largest such place [source px]; None without one
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
    """A source at a glance.

    source, kind   as it may be shown; "video", "live" or "detections"
    width, height  px
    fps            rate that a run would take for nominal [1/s]
    timing         None with fewer than two pictures
    blockiness     1 without blocks of compression

    What follows `timing` is None for stored detections, which have no pictures.
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

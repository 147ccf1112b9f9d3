"""What a sink gets: everything known about one frame, once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats
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
        return _moved(self.tracks, self.motion)

    def in_picture(self) -> Step:
        """The step with scan and tracks where they are in this picture."""
        if self.motion is None:
            return self
        return replace(self, scan=_seen(self.scan, self.motion), tracks=self.shown, motion=None)


class Sink(Protocol):
    """Something that reads steps: a table, a video, a recording."""

    def step(self, step: Step) -> None:
        """Take one frame's results."""

    def close(self) -> None:
        """Write what is left; results stay valid if it is never called."""


def _moved(tracks: Tracks, to_picture: Floats | None) -> Tracks:
    """The tracks as the picture shows them; to_picture (2, 3), None: they lie on it."""
    if to_picture is None:
        return tracks
    x, turn = tracks.x.copy(), np.eye(tracks.x.shape[1])
    for columns in (list(tracks.position), list(tracks.velocity)):
        turn[np.ix_(columns, columns)] = to_picture[:, :2]
    x = x @ turn.T
    x[:, list(tracks.position)] += to_picture[:, 2]
    return replace(tracks, x=x, P=turn @ tracks.P @ turn.T, box=affine.boxes(to_picture, tracks.box))


def _seen(scan: Scan, to_picture: Floats) -> Scan:
    """The measurements of positions as the picture shows them."""
    z = affine.points(to_picture, scan.z)
    box = scan.box
    if box is not None:
        box = affine.boxes(to_picture, np.hstack([scan.z + box[:, :2], box[:, 2:]]))
        box[:, :2] -= z
    return replace(scan, z=z, R=to_picture[:, :2] @ scan.R @ to_picture[:, :2].T, box=box, lasting=None, surveyed=None)

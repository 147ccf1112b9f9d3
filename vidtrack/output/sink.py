"""The interface of sinks: each receives a `Step` per frame or scan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats
from vidtrack.scan import Scan
from vidtrack.tracks import Tracks

if TYPE_CHECKING:  # radar runs must not load OpenCV
    from vidtrack.video.foreground import Foreground
    from vidtrack.video.frame import Frame


HALF_PX = 0.5
"""Pixel 0 covers -0.5 to 0.5."""
_UNLIMITED = (-np.inf, -np.inf, np.inf, np.inf)


@dataclass(slots=True)
class Step:
    """The results of the whole pipeline for one frame or one radar scan.

    index       frame number from 0, or the scan's number
    scan, tracks   in pixels of the scene, which is the first picture, or in metres (radar)
    frame, foreground   None for stored detections and radar plots; the frame's picture is whole if an output of the run
                shows it (`Extras.shows`), else it may be the detector's reduction
    stage_s     processing time of each stage [s]
    motion      (2, 3) affine map from the scene to this picture [px]; None: identity
    warnings    new warnings for the user
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
        """The tracks in pixels of this picture."""
        return _moved(self.tracks, self.motion)

    def having(self, tracks: Tracks) -> Step:
        """The step with these tracks, and without pictures."""
        return Step(self.index, self.time_s, self.scan, tracks, None, None, self.stage_s, self.motion, self.warnings)

    def in_picture(self) -> Step:
        """The step with scan and tracks in pixels of this picture."""
        if self.motion is None:
            return self
        return replace(self, scan=_seen(self.scan, self.motion), tracks=self.shown, motion=None)


def seen(steps: Sequence[Step]) -> Floats:
    """(N, 4) left, top, right and lower edges of what all tracks were measured by, step by step [px of the scene].

    NaN where a track has no measurement of its own, and where the edge of what is surveyed cuts it. By what the
    outlines of blobs are too wide, they are moved in.
    """
    tracks = np.repeat(np.arange(len(steps)), [len(step.tracks) for step in steps])  # step of each track
    edge = np.full((len(tracks), 4), np.nan)
    taken = np.concatenate([step.tracks.measurement for step in steps])
    alone = np.concatenate([step.tracks.group for step in steps]) < 0
    boxed = np.array([step.scan.box is not None for step in steps], bool)
    own = np.flatnonzero((taken >= 0) & alone & boxed[tracks])
    if len(own) == 0:
        return edge
    of, scans = tracks[own], [step.scan for step in steps]
    start = np.cumsum([0, *(len(scan) for scan in scans)])
    row = start[of] + taken[own]
    z = np.concatenate([scan.z for scan in scans])[row]
    box = np.concatenate([np.zeros((len(scan), 4)) if scan.box is None else scan.box for scan in scans])[row]
    rim, pixel = (np.array([getattr(scan, name) for scan in scans])[of, None] for name in ("rim", "pixel"))
    limits = np.array([_UNLIMITED if scan.surveyed is None else scan.surveyed for scan in scans])[of]
    low = z + box[:, :2]
    high = low + box[:, 2:]
    low = np.where(low < limits[:, :2] + pixel, np.nan, low)
    high = np.where(high > limits[:, 2:] - pixel, np.nan, high)
    edge[own] = np.hstack([low + rim, high - rim]) - HALF_PX
    return edge


class Sink(Protocol):
    """An output of a run: a table, a video, a recording."""

    def step(self, step: Step) -> None:
        """Receive the results of one frame or scan."""

    def close(self) -> None:
        """Write the rest and close; results stay valid if it is never called."""


def in_other_scene(step: Step, plane: Floats) -> Step:
    """The step with a scene of other coordinates; plane (2, 3) maps the step's scene to the other one [px]."""
    shown = affine.IDENTITY if step.motion is None else step.motion
    return replace(
        step,
        scan=replace(_seen(step.scan, plane), surveyed=step.scan.surveyed),
        tracks=_moved(step.tracks, plane),
        motion=affine.after(shown, affine.inverse(plane)),
    )


def _moved(tracks: Tracks, to_picture: Floats | None) -> Tracks:
    """The tracks in pixels of the picture; to_picture (2, 3), None: identity."""
    if to_picture is None:
        return tracks
    x, turn = tracks.x.copy(), np.eye(tracks.x.shape[1])
    for columns in (list(tracks.position), list(tracks.velocity)):
        turn[np.ix_(columns, columns)] = to_picture[:, :2]
    x = x @ turn.T
    x[:, list(tracks.position)] += to_picture[:, 2]
    return replace(tracks, x=x, P=turn @ tracks.P @ turn.T, box=affine.boxes(to_picture, tracks.box))


def _seen(scan: Scan, to_picture: Floats) -> Scan:
    """The measurements, which are positions, in pixels of the picture; to_picture (2, 3)."""
    z = affine.points(to_picture, scan.z)
    box = scan.box
    if box is not None:
        box = affine.boxes(to_picture, np.hstack([scan.z + box[:, :2], box[:, 2:]]))
        box[:, :2] -= z
    return replace(scan, z=z, R=to_picture[:, :2] @ scan.R @ to_picture[:, :2].T, box=box, lasting=None, surveyed=None)

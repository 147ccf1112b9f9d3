"""rerun recording of a radar run, scan by scan, in metres: x east, y north, z up."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from vidtrack.arrays.types import Floats
from vidtrack.config.settings import Settings
from vidtrack.estimate.sensor import POSITION
from vidtrack.output.rerun.recording import RerunRecording, colours, gates
from vidtrack.output.sink import Step
from vidtrack.tracks import Status, Tracks


class RadarRerun(RerunRecording):
    """Sink that records the radar, plots, tracks, gates, trails, statuses, times and decisions.

    target  FILE.rrd, "spawn" or "serve"; the last two are for this machine only

    Raises OutputError if the file cannot be written or the viewer cannot be started.
    """

    INDEX: ClassVar[str] = "scan"
    TIME: ClassVar[str] = "scan_time"

    def __init__(self, target: str, settings: Settings) -> None:
        view = rrb.Spatial3DView(name="radar", origin="/world")
        super().__init__(target, settings, view, "plots", settings.radar.trail_s)
        self._static("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        self._static("world/radar", rr.Points3D([settings.radar.position], radii=-6.0, labels=["radar"]))

    def _draw(self, step: Step) -> None:
        scan, tracks = step.scan, step.tracks
        position, R = (scan.sensor or POSITION).locate(scan.z, scan.R)
        self._log("world/plots", rr.Points3D(_in_space(position), colors=(255, 160, 0), radii=-2.0))
        self._log("world/tracks", _points(tracks))
        ellipses = gates(scan, tracks, R)
        height = np.broadcast_to(_in_space(tracks.xy)[:, None, 2:], (*ellipses.shape[:2], 1))
        self._log("world/gates", rr.LineStrips3D(np.concatenate([ellipses, height], axis=2), colors=(0, 255, 255)))
        paths = self._trails.paths()
        ink = colours(np.array(list(paths), np.int64))
        self._log("world/trails", rr.LineStrips3D([_in_space(p) for p in paths.values()], colors=ink, radii=-1.5))


def _points(tracks: Tracks) -> rr.Points3D:
    grey = (tracks.status == Status.TENTATIVE)[:, None]
    return rr.Points3D(
        _in_space(tracks.xy),
        labels=[
            f"{i} {Status(s).name.lower()}" for i, s in zip(tracks.id.tolist(), tracks.status.tolist(), strict=True)
        ],
        colors=np.where(grey, np.uint8(170), colours(tracks.id)),
        radii=-4.0,
    )


def _in_space(position: Floats) -> Floats:
    """(N, 3) positions from (N, 2 or 3); positions in the plane get height 0."""
    return np.column_stack([position, np.zeros((len(position), 3 - position.shape[1]))])

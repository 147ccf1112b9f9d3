"""rerun recording of a video run: pictures, masks, blobs and tracks, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from vidtrack.arrays.types import Floats
from vidtrack.config.settings import Settings
from vidtrack.output.rerun.recording import RerunRecording, colours, gates
from vidtrack.output.sink import Step
from vidtrack.scan import Scan
from vidtrack.tracks import Status, Tracks
from vidtrack.traffic.lines import Line
from vidtrack.video.frame import Image


class RerunSink(RerunRecording):
    """Sink that records pictures, masks, blobs, tracks, gates, trails, statuses, times and decisions.

    target  FILE.rrd, "spawn" or "serve"
    shape   (H, W) of the source

    Raises OutputError if the file cannot be written or the viewer cannot be started.
    """

    def __init__(self, target: str, shape: tuple[int, int], settings: Settings, lines: Sequence[Line] = ()) -> None:
        super().__init__(target, settings, _view(shape), "blobs", settings.output.trail_s)
        self._output = settings.output
        self._next_picture_s = -np.inf
        if lines:
            strips = [[[line.x1, line.y1], [line.x2, line.y2]] for line in lines]
            names = [line.name for line in lines]
            self._static("world/lines", rr.LineStrips2D(strips, labels=names, colors=(255, 220, 0)))

    def background(self, picture: Image) -> None:
        """Record one (H, W, 3) picture for all times, for steps without frames."""
        self._static("world/frame", _jpeg(picture, self._output.jpeg_quality))

    def _draw(self, step: Step) -> None:
        if step.time_s >= self._next_picture_s:
            self._next_picture_s = step.time_s + self._output.rerun_picture_s
            self._pictures(step)
        trails = self._trails.paths(step.motion)
        step = step.in_picture()
        self._log("world/blobs", _blobs(step.scan))
        self._log("world/tracks", _boxes(step.tracks))
        ellipses = gates(step.scan, step.tracks, step.scan.R)
        self._log("world/gates", rr.LineStrips2D(ellipses, colors=(0, 255, 255), draw_order=25))
        self._log("world/trails", _paths(trails))

    def _pictures(self, step: Step) -> None:
        if step.frame is None:
            return
        self._log("world/frame", _jpeg(step.frame.bgr(), self._output.jpeg_quality))
        if step.foreground is not None:
            mask = step.foreground.full_size(step.frame.shape)
            # PNG: the viewer keeps a SegmentationImage uncompressed in memory.
            png = cv2.imencode(".png", mask, [cv2.IMWRITE_PNG_BILEVEL, 1])[1]
            self._log("mask", rr.EncodedImage(contents=png.tobytes(), media_type="image/png"))


def _view(shape: tuple[int, int]) -> rrb.Container:
    bounds = rrb.VisualBounds2D(x_range=[0, shape[1]], y_range=[0, shape[0]])
    return rrb.Vertical(
        rrb.Spatial2DView(name="scene", origin="/world", visual_bounds=bounds),
        rrb.Spatial2DView(name="disturbance", contents=["/mask", "/world/blobs"], visual_bounds=bounds),
    )


def _jpeg(picture: Image, quality: int) -> rr.EncodedImage:
    jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return rr.EncodedImage(contents=jpeg.tobytes(), media_type="image/jpeg")


def _blobs(scan: Scan) -> rr.Boxes2D:
    box = np.tile([-1.0, -1.0, 2.0, 2.0], (len(scan), 1)) if scan.box is None else scan.box
    centers = scan.z[:, :2] + box[:, :2] + box[:, 2:] / 2
    return rr.Boxes2D(centers=centers, half_sizes=box[:, 2:] / 2, colors=(255, 160, 0), draw_order=20)


def _boxes(tracks: Tracks) -> rr.Boxes2D:
    known = ~np.isnan(tracks.box).any(axis=1)
    box, ids, status = tracks.box[known], tracks.id[known], tracks.status[known]
    grey = (status == Status.TENTATIVE)[:, None]
    return rr.Boxes2D(
        centers=box[:, :2] + box[:, 2:] / 2,
        half_sizes=box[:, 2:] / 2,
        labels=[f"{i} {Status(s).name.lower()}" for i, s in zip(ids.tolist(), status.tolist(), strict=True)],
        colors=np.where(grey, np.uint8(170), colours(ids)),
        class_ids=ids % 65536,  # class ids have 16 bits
        draw_order=30,
    )


def _paths(paths: dict[int, Floats]) -> rr.LineStrips2D:
    return rr.LineStrips2D(list(paths.values()), colors=colours(np.array(list(paths), np.int64)), radii=-1.5)

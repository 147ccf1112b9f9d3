"""What the tracker sees and decides, frame by frame, in rerun; the only module that imports it."""

from __future__ import annotations

import logging
import os
import socket
import sysconfig
from collections.abc import Sequence

import cv2
import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from vidtrack.config import Settings
from vidtrack.errors import OutputError, StoppedEarly
from vidtrack.output.draw import colour
from vidtrack.output.linefile import Every
from vidtrack.output.sink import Step
from vidtrack.output.trails import Trails
from vidtrack.scan import Floats, Ints, Scan, Status, Tracks
from vidtrack.traffic.lines import Line
from vidtrack.video.frame import Image

_log = logging.getLogger(__name__)

_ADDRESS = ("127.0.0.1", 9876)
_FRAME = "frame"
_TIME = "video_time"
_LANES = 200
"""Lanes of track life: hundreds of entities make the viewer slow, so track i uses lane i modulo this."""

_GATE = 9.21
"""Chi-square quantile of 0.99 with two degrees of freedom."""

_STATES = {"tentative": (255, 200, 0), "confirmed": (0, 200, 80), "coasting": (120, 120, 255), "merged": (255, 0, 160)}
_GONE = "gone"


def _open(target: str, shape: tuple[int, int]) -> rr.RecordingStream:
    """A recording that goes to a file, to a viewer that it starts ("spawn"), or is served on loopback ("serve").

    shape  (H, W) of the pictures

    Raises OutputError when the file cannot be written or the viewer not be started.
    """
    recording = rr.RecordingStream("vidtrack")
    layout = _layout(shape)
    try:
        if target == "spawn":
            # The viewer is installed beside this Python, which need not be on the path.
            os.environ["PATH"] += os.pathsep + sysconfig.get_path("scripts")
            recording.spawn(memory_limit="2GB", default_blueprint=layout)
        elif target == "serve":
            socket.create_server(_ADDRESS).close()  # rerun itself only logs that the port is taken
            # RecordingStream.serve_grpc would listen on every interface, without a password.
            host, port = _ADDRESS
            server = rr.GrpcServerSink(bind_ip=host, port=port, server_memory_limit="256MB", newest_first=True)
            recording.set_sinks(server, default_blueprint=layout)
            _log.info("serving on %s:%d; watch with: rerun --connect", host, port)
        else:
            recording.save(target, default_blueprint=layout)
    except (OSError, RuntimeError) as error:
        raise OutputError(f"cannot open the recording {target}: {error}; give --rerun another place") from None
    return recording


def _layout(shape: tuple[int, int]) -> rrb.Blueprint:
    bounds = rrb.VisualBounds2D(x_range=[0, shape[1]], y_range=[0, shape[0]])
    pictures = rrb.Vertical(
        rrb.Spatial2DView(name="scene", origin="/world", visual_bounds=bounds),
        rrb.Spatial2DView(name="disturbance", contents=["/mask", "/world/blobs"], visual_bounds=bounds),
    )
    plots = rrb.Vertical(
        rrb.StateTimelineView(name="track life", origin="/tracks"),
        rrb.TimeSeriesView(name="blobs and tracks", origin="/plots/count"),
        rrb.TimeSeriesView(name="milliseconds", origin="/plots/ms"),
        rrb.TextLogView(name="decisions", origin="/log"),
        rrb.TextDocumentView(name="settings", origin="/settings"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(pictures, plots, column_shares=[3, 2]), rrb.TimePanel(timeline=_TIME), collapse_panels=True
    )


class RerunSink:
    """Sink that records pictures, masks, blobs, tracks, gates, trails, lives, times and decisions.

    target  FILE.rrd, "spawn" or "serve"; the last two reach the own machine only
    shape   (H, W) of the source
    """

    def __init__(self, target: str, shape: tuple[int, int], settings: Settings, lines: Sequence[Line] = ()) -> None:
        self._recording = _open(target, shape)
        self._output = settings.output
        self._trails = Trails(settings.output.trail_s)
        self._next_picture_s = -np.inf
        self._due = Every(1.0)
        self._life: dict[int, str] = {}
        self._lanes: set[int] = set()
        self._stages: list[str] = []
        text = f"```json\n{settings.model_dump_json(indent=2)}\n```"
        self._static("settings", rr.TextDocument(text, media_type="text/markdown"))
        self._static("plots/count", rr.SeriesLines(names=["blobs", "tentative", "tracks"]))
        if lines:
            strips = [[[line.x1, line.y1], [line.x2, line.y2]] for line in lines]
            names = [line.name for line in lines]
            self._static("world/lines", rr.LineStrips2D(strips, labels=names, colors=(255, 220, 0)))

    def background(self, picture: Image) -> None:
        """Show one (H, W, 3) picture at all times, for steps without frames."""
        self._static("world/frame", _jpeg(picture, self._output.jpeg_quality))

    def step(self, step: Step) -> None:
        """Record one frame. Batches are recorded when empty too: rerun shows the latest until there is a newer."""
        self._recording.set_time(_FRAME, sequence=step.index)
        self._recording.set_time(_TIME, duration=step.time_s)
        if step.time_s >= self._next_picture_s:
            self._next_picture_s = step.time_s + self._output.rerun_picture_s
            self._pictures(step)
        self._trails.step(step.tracks)
        self._log("world/blobs", _blobs(step.scan))
        self._log("world/tracks", _boxes(step.tracks))
        self._log("world/gates", _gates(step.scan, step.tracks))
        self._log("world/trails", _paths(self._trails.paths()))
        self._log_life(step.tracks)
        self._log_numbers(step)
        for event in step.tracks.events:
            self._log("log", rr.TextLog(f"track {event.track_id}: {event.kind}: {event.reason}", level="INFO"))
        if self._due():
            self._flush()

    def close(self) -> None:
        """Finish the recording. Raises StoppedEarly when the disk refused some of it."""
        try:
            self._flush()
        finally:
            self._recording.disconnect()

    def _flush(self) -> None:
        # rerun writes in a thread of its own; only here does it tell that the disk is full.
        try:
            self._recording.flush()
        except RuntimeError as error:
            raise StoppedEarly(f"the rerun recording is incomplete: {error}; is the disk full?") from None

    def _log(self, path: str, what: rr.AsComponents) -> None:
        self._recording.log(path, what)

    def _static(self, path: str, what: rr.AsComponents) -> None:
        self._recording.log(path, what, static=True)

    def _pictures(self, step: Step) -> None:
        if step.frame is None:
            return
        self._log("world/frame", _jpeg(step.frame.bgr(), self._output.jpeg_quality))
        if step.foreground is not None:
            mask = step.foreground.full_size(step.frame.shape)
            # PNG: a SegmentationImage is small on disk but raw in the viewer's memory.
            png = cv2.imencode(".png", mask, [cv2.IMWRITE_PNG_BILEVEL, 1])[1]
            self._log("mask", rr.EncodedImage(contents=png.tobytes(), media_type="image/png"))

    def _log_life(self, tracks: Tracks) -> None:
        """A change of state on the track's lane; nothing while it stays."""
        now = {i: Status(s).name.lower() for i, s in zip(tracks.id.tolist(), tracks.status.tolist(), strict=True)}
        ended = dict.fromkeys(self._life.keys() - now.keys(), _GONE)
        for track_id, state in sorted(ended.items()) + list(now.items()):
            if self._life.get(track_id) != state:
                lane = track_id % _LANES
                if lane not in self._lanes:
                    self._lanes.add(lane)
                    colours = [*_STATES.values(), (90, 90, 90)]
                    self._static(f"tracks/{lane}", rr.StateConfiguration(values=[*_STATES, _GONE], colors=colours))
                self._log(f"tracks/{lane}", rr.StateChange(state=state))
        self._life = now

    def _log_numbers(self, step: Step) -> None:
        tentative = int(np.count_nonzero(step.tracks.status == Status.TENTATIVE))
        self._log("plots/count", rr.Scalars([len(step.scan), tentative, len(step.tracks) - tentative]))
        if list(step.stage_s) != self._stages:
            self._stages = list(step.stage_s)
            self._static("plots/ms", rr.SeriesLines(names=self._stages))
        self._log("plots/ms", rr.Scalars([1e3 * seconds for seconds in step.stage_s.values()]))


def _jpeg(picture: Image, quality: int) -> rr.EncodedImage:
    jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return rr.EncodedImage(contents=jpeg.tobytes(), media_type="image/jpeg")


def _colours(ids: Ints) -> np.ndarray:
    """(T, 3) red, green, blue, as in the annotated video."""
    return np.array([colour(i) for i in ids.tolist()], np.uint8).reshape(-1, 3)[:, ::-1]


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
        colors=np.where(grey, np.uint8(170), _colours(ids)),
        class_ids=ids % 65536,  # class ids have 16 bits
        draw_order=30,
    )


def _gates(scan: Scan, tracks: Tracks) -> rr.LineStrips2D:
    """(T, 33, 2) 99 % ellipses of S = P + R after the update, R of the track's own measurement or of an average one.

    The gate that the next scan will see is larger by the process noise.
    """
    cov = tracks.xy_cov[:, :2, :2]
    if len(scan):
        R = scan.R[:, :2, :2]
        own = tracks.measurement
        cov = cov + np.where((own >= 0)[:, None, None], R[own], R.mean(axis=0))
    angle = np.linspace(0, 2 * np.pi, 33)
    circle = np.sqrt(_GATE) * np.stack([np.cos(angle), np.sin(angle)])
    ellipses = tracks.xy[:, None, :2] + np.swapaxes(np.linalg.cholesky(cov) @ circle, 1, 2)
    return rr.LineStrips2D(ellipses, colors=(0, 255, 255), draw_order=25)


def _paths(paths: dict[int, Floats]) -> rr.LineStrips2D:
    return rr.LineStrips2D(list(paths.values()), colors=_colours(np.array(list(paths), np.int64)), radii=-1.5)

"""The common part of rerun recordings of video and radar runs: statuses, numbers, times and decisions."""

from __future__ import annotations

import logging
import os
import socket
import sys
import sysconfig
from pathlib import Path
from typing import ClassVar

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.settings import Settings
from vidtrack.errors import OutputError, StoppedEarly
from vidtrack.output.colours import colour
from vidtrack.output.linefile import Every
from vidtrack.output.sink import Step
from vidtrack.output.trails import Trails
from vidtrack.scan import Scan
from vidtrack.tracks import Status, Tracks

_log = logging.getLogger(__name__)

_ADDRESS = ("127.0.0.1", 9876)
_DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
_LANES = 200
"""Lanes of track status: hundreds of entities slow the viewer down, so track i uses lane i modulo this."""

_CIRCLE = 33
"""Points of an ellipse."""

_GATE = 9.21
"""Chi-square quantile of 0.99 with two degrees of freedom."""

_STATES = {"tentative": (255, 200, 0), "confirmed": (0, 200, 80), "coasting": (120, 120, 255), "merged": (255, 0, 160)}
_GONE = "gone"


class RerunRecording:
    """Sink that records statuses, numbers, times and decisions of tracks. Subclasses draw the scan in `_draw`.

    target    FILE.rrd; "spawn" starts a viewer; "serve" serves viewers of this machine on loopback
    view      the spatial view, shown with the time series
    measured  name of the measurements: blobs, boxes or plots
    trail_s   length of the trails [s]

    Raises OutputError if the file cannot be written or the viewer cannot be started.
    """

    INDEX: ClassVar[str] = "frame"
    TIME: ClassVar[str] = "video_time"

    def __init__(
        self, target: str, settings: Settings, view: rrb.View | rrb.Container, measured: str, trail_s: float
    ) -> None:
        self._recording = _open(target, self._layout(view, measured))
        self._lost = "is the disk full?" if target.endswith(".rrd") else "was the viewer closed?"
        self._trails = Trails(trail_s)
        self._due = Every(1.0)
        self._life: dict[int, str] = {}
        self._lanes: set[int] = set()
        self._stages: list[str] = []
        text = f"```json\n{settings.model_dump_json(indent=2)}\n```"
        self._static("settings", rr.TextDocument(text, media_type="text/markdown"))
        self._static("plots/count", rr.SeriesLines(names=[measured, "tentative", "tracks"]))

    def step(self, step: Step) -> None:
        """Record one step. Empty batches are recorded too, because rerun shows the latest one until a newer comes."""
        self._recording.set_time(self.INDEX, sequence=step.index)
        self._recording.set_time(self.TIME, duration=step.time_s)
        self._trails.step(step.tracks)
        self._draw(step)
        self._log_life(step.tracks)
        self._log_numbers(step)
        for event in step.tracks.events:
            self._log("log", rr.TextLog(f"track {event.track_id}: {event.kind}: {event.reason}", level="INFO"))
        if self._due():
            self._flush()

    def close(self) -> None:
        """Finish the recording. Raises StoppedEarly if part of it could not be written."""
        try:
            self._flush()
        finally:
            self._recording.disconnect()

    def _flush(self) -> None:
        # rerun writes in its own thread and reports a full disk only here.
        try:
            self._recording.flush()
        except RuntimeError as error:
            raise StoppedEarly(f"the rerun recording is incomplete: {error}; {self._lost}") from None

    def _log(self, path: str, what: rr.AsComponents) -> None:
        self._recording.log(path, what)

    def _static(self, path: str, what: rr.AsComponents) -> None:
        self._recording.log(path, what, static=True)

    def _draw(self, step: Step) -> None:
        """Record the scan and the tracks in the spatial view."""
        raise NotImplementedError

    def _layout(self, view: rrb.View | rrb.Container, measured: str) -> rrb.Blueprint:
        plots = rrb.Vertical(
            rrb.StateTimelineView(name="track life", origin="/tracks"),
            rrb.TimeSeriesView(name=f"{measured} and tracks", origin="/plots/count"),
            rrb.TimeSeriesView(name="milliseconds", origin="/plots/ms"),
            rrb.TextLogView(name="decisions", origin="/log"),
            rrb.TextDocumentView(name="settings", origin="/settings"),
        )
        return rrb.Blueprint(
            rrb.Horizontal(view, plots, column_shares=[3, 2]),
            rrb.TimePanel(timeline=self.TIME),
            collapse_panels=True,
        )

    def _log_life(self, tracks: Tracks) -> None:
        """Record changes of status on the tracks' lanes."""
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


def colours(ids: Ints) -> np.ndarray:
    """(T, 3) red, green, blue of track ids, as in the annotated video."""
    return np.array([colour(i) for i in ids.tolist()], np.uint8).reshape(-1, 3)[:, ::-1]


def gates(scan: Scan, tracks: Tracks, R: Floats) -> NDArray[np.float32]:
    """(T, 33, 2) 99 % ellipses of S = P + R after the update; R is of the track's measurement, else the average.

    R  (M, d, d) covariances of the measured positions

    The gate of the next scan is larger by the process noise.
    """
    cov = tracks.xy_cov[:, :2, :2]
    if len(scan):
        own, R = tracks.measurement, R[:, :2, :2]
        cov = cov + np.where((own >= 0)[:, None, None], R[own], R.mean(axis=0))
    angle = np.linspace(0, 2 * np.pi, _CIRCLE)
    circle = np.sqrt(_GATE) * np.stack([np.cos(angle), np.sin(angle)])
    return (tracks.xy[:, None, :2] + np.swapaxes(np.linalg.cholesky(cov) @ circle, 1, 2)).astype(np.float32)


def _refuse_without_display() -> None:
    """Raise OutputError if no viewer runs and there is no display to start one on."""
    with socket.socket() as probe:
        runs = probe.connect_ex(_ADDRESS) == 0
    if not runs and sys.platform == "linux" and not any(os.environ.get(name) for name in _DISPLAYS):
        raise OutputError(
            "no display for the viewer; record a FILE.rrd here and open it with `rerun FILE.rrd` elsewhere"
        )


def _open(target: str, layout: rrb.Blueprint) -> rr.RecordingStream:
    """A recording to a file, to a new viewer ("spawn"), or served on loopback ("serve").

    Raises OutputError if the file cannot be written or the viewer cannot be started.
    """
    recording = rr.RecordingStream("vidtrack")
    try:
        if target == "spawn":
            _refuse_without_display()
            # The viewer is installed beside this Python, which may not be on the path.
            os.environ["PATH"] += os.pathsep + sysconfig.get_path("scripts")
            recording.spawn(memory_limit="2GB", default_blueprint=layout)
        elif target == "serve":
            socket.create_server(_ADDRESS).close()  # rerun only logs that the port is taken
            # RecordingStream.serve_grpc listens on every interface, without a password.
            host, port = _ADDRESS
            server = rr.GrpcServerSink(bind_ip=host, port=port, server_memory_limit="256MB", newest_first=True)
            recording.set_sinks(server, default_blueprint=layout)
            _log.info("serving on %s:%d; watch with: rerun --connect", host, port)
        else:
            recording.save(target, default_blueprint=layout)
            recording.send_recording_name(Path(target).stem)  # distinguishes cameras in one viewer
    except (OSError, RuntimeError) as error:
        raise OutputError(f"cannot open the recording {target}: {error}; choose another place") from None
    return recording

"""Clips of counted crossings: a second of the source around each, with the track drawn into it."""

from __future__ import annotations

import json
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.config.load import parse
from vidtrack.errors import Error, FormatError, SourceError
from vidtrack.output.colours import colour
from vidtrack.output.draw import GREY, LINE, Pen
from vidtrack.traffic.measures.runs import Recording
from vidtrack.traffic.validation.audit_events import CountedEvents, Event
from vidtrack.video.frame import Frame, Image
from vidtrack.video.source import Excerpts

WIDTH, HEIGHT = 640, 360
"""px; of each picture of a clip"""
_HALF_S = 0.5
"""s before and after a crossing, of a clip"""
_FRAMES = 13
"""Most pictures of a clip"""
_PATH_S = 2.0
"""s before and after, of the drawn path"""
_ROOM = 2.2
"""Size of the view, in sizes of what it must show"""
_LEAST = 0.22
"""Its least width, as a share of the picture's"""
_THUMB = (160, 90)
_QUALITY = [cv2.IMWRITE_JPEG_QUALITY, 82]
_KEPT = 64
"""Clips that are kept for the next who asks"""
_SAME_S = 1e-3
"""s; rows whose times differ by less are of one frame"""
_BOX = ("left_px", "top_px", "width_px", "height_px")
_COLUMNS = ("time_s", "track_id", "x_px", "y_px", *_BOX)


@dataclass(frozen=True, slots=True)
class Clip:
    """Pictures of WIDTH x HEIGHT side by side as one JPEG.

    frames  their number
    moment  number of the one in which the vehicle passes
    thumb   this one, small, as JPEG
    """

    strip: bytes
    frames: int
    moment: int
    thumb: bytes


class Clips:
    """Cuts clips from the sources of the runs; any thread may ask, one at a time is served.

    source  where the video of the runs is now; None: where it was when they were tracked
    """

    def __init__(self, counted: CountedEvents, source: str | None) -> None:
        self._counted = counted
        self._source = source
        self._runs: dict[Path, _Run] = {}
        self._made: OrderedDict[Event, Clip] = OrderedDict()
        self._lock = Lock()

    def why_not(self) -> str:
        """Why there are no clips, in words; "" where the first run's source can be opened."""
        if not self._counted.recordings:
            return self._counted.gone
        try:
            with self._lock:
                self._run(self._counted.recordings[0]).pictures.between(0, 0)
        except Error as error:
            return f"{error}; --video SOURCE tells where the video is now"
        return ""

    def clip(self, event: Event) -> Clip:
        """The clip of an event. Raises SourceError where the source or the run is gone, or is another one."""
        with self._lock:
            clip = self._made.pop(event, None) or self._cut(event)
            self._made[event] = clip
            while len(self._made) > _KEPT:
                self._made.popitem(last=False)
            return clip

    def _run(self, recording: Recording) -> _Run:
        return self._runs.setdefault(recording.folder, _Run(recording.folder, self._source))

    def _cut(self, event: Event) -> Clip:
        recording = self._counted.recording_of(event)
        if recording is None:
            raise SourceError(self._counted.gone)
        run = self._run(recording)
        t = event.time_s - recording.offset_s
        frames = list(run.pictures.between(t - _HALF_S, t + _HALF_S))
        if not frames:
            raise SourceError(f"{run.source} has no picture at {t:.3f} s")
        height, width = frames[0].shape
        if (width, height) != recording.size:
            raise SourceError(f"{run.source} is {width}x{height}, and was {recording.size[0]}x{recording.size[1]}")
        chosen = np.unique(np.linspace(0, len(frames) - 1, min(len(frames), _FRAMES)).round().astype(int))
        frames = [frames[k] for k in chosen.tolist()]
        rows = run.rows(t - _PATH_S, t + _PATH_S)
        scale = np.array(recording.size) / self._counted.size
        gates = {name: (np.array(line) + 0.5) * scale - 0.5 for name, line in self._counted.gates.items()}
        scene = _Scene(event, t, rows, gates)
        view = scene.view(width, height)
        pictures = [scene.drawn(frame, view) for frame in frames]
        moment = int(np.argmin([abs(frame.time_s - t) for frame in frames]))
        thumb = cv2.resize(pictures[moment], _THUMB, interpolation=cv2.INTER_AREA)
        return Clip(_jpeg(np.hstack(pictures)), len(pictures), moment, _jpeg(thumb))


class _Run:
    """A run's source and tracks, opened when they are needed."""

    def __init__(self, folder: Path, source: str | None) -> None:
        self._folder = folder
        self._moved_to = source

    @cached_property
    def pictures(self) -> Excerpts:
        """The source. Raises SourceError where it is gone."""
        try:
            summary = json.loads((self._folder / "summary.json").read_text(encoding="utf-8"))
            settings = parse(summary["settings"]).source
            self.source = str(self._moved_to or summary["source"])
        except (OSError, ValueError, KeyError, TypeError):
            raise FormatError(f"{self._folder / 'summary.json'} cannot be read") from None
        return Excerpts(self.source, settings)

    def rows(self, begin_s: float, end_s: float) -> dict[str, Floats]:
        """The columns of the tracks in a span of time."""
        path = self._folder / "tracks.parquet"
        if path.is_file():
            span = [("time_s", ">=", begin_s), ("time_s", "<=", end_s)]
            table = pq.read_table(path, columns=list(_COLUMNS), filters=span)
        else:
            t = self._table["time_s"].to_numpy()
            table = self._table.filter(pa.array((t >= begin_s) & (t <= end_s)))
        return {name: np.asarray(table[name].to_numpy(), float) for name in _COLUMNS}

    @cached_property
    def _table(self) -> pa.Table:
        options = pyarrow.csv.ConvertOptions(include_columns=list(_COLUMNS))
        return pyarrow.csv.read_csv(self._folder / "tracks.csv", convert_options=options)


class _Scene:
    """What is drawn over the pictures of an event: its gate, its track, and the boxes of others in grey.

    t     of the event, in the run's time [s]
    rows  (N,) columns of the tracks around it
    """

    def __init__(self, event: Event, t: float, rows: dict[str, Floats], gates: dict[str, Floats]) -> None:
        self._event, self._gates = event, gates
        self._time, self._id = rows["time_s"], rows["track_id"]
        self._xy, self._box = (np.column_stack([rows[name] for name in names]) for names in (("x_px", "y_px"), _BOX))
        self._ours = self._id == event.track_id
        self._near = np.abs(self._time - t) <= _HALF_S

    def view(self, width: int, height: int) -> tuple[int, int, int, int]:
        """Left, top, width and height of the part of the picture that shows the track."""
        box = self._box[self._ours & self._near]
        box = box[np.isfinite(box[:, 0])]
        if len(box):
            low, high = box[:, :2].min(axis=0), (box[:, :2] + box[:, 2:]).max(axis=0)
        else:
            gate = self._gates.get(self._event.gate, np.array([[0, 0], [width, height]]))
            low, high = gate.min(axis=0), gate.max(axis=0)
        aspect = WIDTH / HEIGHT
        wide = max(_ROOM * (high[0] - low[0]), _ROOM * aspect * (high[1] - low[1]), _LEAST * width)
        wide = min(wide, width, height * aspect)
        tall = wide / aspect
        left, top = np.clip((low + high) / 2 - [wide / 2, tall / 2], 0, [width - wide, height - tall])
        return round(left), round(top), max(int(wide), 1), max(int(tall), 1)

    def drawn(self, frame: Frame, view: tuple[int, int, int, int]) -> Image:
        """(HEIGHT, WIDTH, 3) that part of a picture with the gates, the path and the boxes."""
        left, top, width, height = view
        part = frame.bgr()[top : top + height, left : left + width]
        how = cv2.INTER_AREA if width > WIDTH else cv2.INTER_CUBIC
        picture = np.asarray(cv2.resize(part, (WIDTH, HEIGHT), interpolation=how), np.uint8)
        pen, ink = Pen(picture), colour(self._event.track_id)
        scale = np.array([WIDTH / width, HEIGHT / height])

        def here(points: Floats) -> Floats:
            return (points + 0.5 - [left, top]) * scale - 0.5

        for name, line in self._gates.items():
            pen.path(here(line), LINE, 2 if name == self._event.gate else 1)
        path = self._xy[self._ours]
        if len(path) > 1:
            pen.path(here(path[np.isfinite(path[:, 0])]), ink)
        if len(self._time):
            off = np.abs(self._time - frame.time_s)
            now = (off < _SAME_S + off.min()) & np.isfinite(self._box[:, 0])
            for mine, one in ((False, GREY), (True, ink)):
                for box in self._box[now & (self._ours == mine)]:
                    pen.box(np.concatenate([here(box[:2]), box[2:] * scale]), one)
        return picture


def _jpeg(picture: NDArray[Any]) -> bytes:
    return cv2.imencode(".jpg", picture, _QUALITY)[1].tobytes()

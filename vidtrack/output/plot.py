"""tracks.png: where the traffic went, over the scene without traffic."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from vidtrack.output.draw import Pen, colour, draw_lines
from vidtrack.output.folder import writing
from vidtrack.output.sink import Step
from vidtrack.scan import Floats
from vidtrack.traffic.lines import Line
from vidtrack.video.frame import Image

_SIDE = 960
"""Pixels; smaller pictures are enlarged to about this, or their numbers could not be read."""

_NUMBERED = 150
"""Most tracks that get their number; in a longer run the last ones do."""


class TrajectoryPlot:
    """Sink that draws each confirmed track as it moves, so memory does not grow with the run.

    shape  (H, W) of the source
    scene  gives the (H, W, 3) background when the run ends; None: plain grey
    """

    def __init__(
        self, path: Path, shape: tuple[int, int], scene: Callable[[], Image] | None = None, lines: Sequence[Line] = ()
    ) -> None:
        self._path = path
        self._scene = scene
        self._lines = lines
        self._shape = shape
        self._zoom = max(1, round(_SIDE / max(shape)))
        # Colour times opacity, and opacity: anti-aliased strokes then blend exactly.
        self._layer = np.zeros((shape[0] * self._zoom, shape[1] * self._zoom, 4), np.uint8)
        self._pen = Pen(self._layer)
        self._last: dict[int, Floats] = {}
        self._ends: dict[int, Floats] = {}

    def step(self, step: Step) -> None:
        """Extend the trajectories of one frame's confirmed tracks; a coasted gap becomes a straight line."""
        tracks = step.tracks
        seen = tracks.seen
        alive = set(tracks.id.tolist())
        for track_id in self._last.keys() - alive:
            self._ends[track_id] = self._last.pop(track_id)
        while len(self._ends) > _NUMBERED:
            del self._ends[next(iter(self._ends))]
        for track_id, xy in zip(tracks.id[seen].tolist(), tracks.xy[seen], strict=True):
            before = self._last.setdefault(track_id, xy)
            if np.abs(xy - before).max() * self._zoom >= 1.0:
                self._pen.path(np.stack([before, xy]) * self._zoom, (*colour(track_id), 255), width=2)
                self._last[track_id] = xy

    def close(self) -> None:
        """Write the picture."""
        size = (self._layer.shape[1], self._layer.shape[0])
        scene = np.full((*self._shape, 3), 60, np.uint8) if self._scene is None else self._scene()
        enlarged = cv2.resize(scene, size, interpolation=cv2.INTER_CUBIC)
        clear = 1.0 - self._layer[:, :, 3:] / np.float32(255)
        picture = (enlarged * clear + self._layer[:, :, :3]).clip(0, 255).astype(np.uint8)
        pen = Pen(picture)
        zoom = self._zoom
        draw_lines(pen, [Line(k.name, zoom * k.x1, zoom * k.y1, zoom * k.x2, zoom * k.y2) for k in self._lines])
        self._number(pen)
        with writing(self._path):
            self._path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())

    def _number(self, pen: Pen) -> None:
        """Each track's number at its end, or in the nearest free place above or below."""
        free = np.ones(self._layer.shape[:2], bool)
        for track_id, xy in sorted((self._ends | self._last).items()):
            width, height = pen.size(str(track_id))
            x = int(np.clip(xy[0] * self._zoom, 0, max(0, free.shape[1] - width)))
            end = int(np.clip(xy[1] * self._zoom, height, free.shape[0]))
            places = np.arange(height, free.shape[0] + 1, 2)
            for y in places[np.argsort(np.abs(places - end), kind="stable")]:
                if free[y - height : y, x : x + width].all():
                    free[y - height : y, x : x + width] = False
                    pen.label(str(track_id), x, y, colour(track_id))
                    break

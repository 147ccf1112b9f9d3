"""tracks.png: the paths of all tracks over the background; scene.jpg: the background alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.compiled import kernel
from vidtrack.output.colours import colour
from vidtrack.output.draw import Patch, Pen, draw_lines
from vidtrack.output.folder import replacing
from vidtrack.output.scene import write_scene
from vidtrack.output.sink import Step
from vidtrack.tracks import Tracks
from vidtrack.traffic.lines import Line
from vidtrack.video.frame import Image

_SIDE = 960
"""px; smaller pictures are enlarged so that their longer side is about this, for readable ids."""

_BATCH = 50
"""Frames drawn together: one call per stroke costs as much as one per segment."""

_NUMBERED = 150
"""Largest number of ids drawn; the last tracks get them."""


class TrajectoryPlot:
    """Sink that draws the confirmed tracks during the run, so that memory does not grow.

    shape   (H, W) of the source
    scene   returns the (H, W, 3) background at the end of the run, for scene.jpg beside the plot; None: plain grey
    totals  returns the counts by line and direction at the end of the run; None: lines show names only
    """

    def __init__(
        self,
        path: Path,
        shape: tuple[int, int],
        scene: Callable[[], Image] | None = None,
        lines: Sequence[Line] = (),
        totals: Callable[[], Mapping[str, Mapping[str, int]]] | None = None,
    ) -> None:
        self._path = path
        self._scene = scene
        self._lines = lines
        self._totals = totals
        self._shape = shape
        self._zoom = max(1, round(_SIDE / max(shape)))
        # Premultiplied colour and opacity, which blend anti-aliased strokes exactly.
        self._layer = np.zeros((shape[0] * self._zoom, shape[1] * self._zoom, 4), np.uint8)
        self._pen = Pen(self._layer)
        self._stepped = False  # there is no scene before the first frame
        self._waiting: list[Tracks] = []
        self._id, self._xy = np.empty(0, np.int64), np.empty((0, 2))  # last drawn point of each current track
        self._ends: dict[int, Floats] = {}

    def step(self, step: Step) -> None:
        """Extend the paths by one frame's confirmed tracks; a coasted gap becomes a straight line."""
        self._stepped = True
        self._waiting.append(step.tracks)
        if len(self._waiting) == _BATCH:
            self._draw()

    def _draw(self) -> None:
        """Draw one stroke per track, from its last drawn point."""
        if not self._waiting:
            return
        ids = np.concatenate([self._id, *(t.id[t.seen] for t in self._waiting)])
        xy = np.concatenate([self._xy, *(t.xy[t.seen] for t in self._waiting)])
        order = np.argsort(ids, kind="stable")
        self._id, start = np.unique(ids[order], return_index=True)
        paths = np.split(xy[order], start[1:]) if len(start) else []
        for track_id, path in zip(self._id.tolist(), paths, strict=True):
            self._pen.path(path * self._zoom, (*colour(track_id), 255), width=2)
            self._ends.pop(track_id, None)
            self._ends[track_id] = path[-1].copy()  # a view would keep the whole batch in memory
        self._xy = np.array([path[-1] for path in paths]).reshape(-1, 2)
        alive = np.isin(self._id, self._waiting[-1].id)
        self._id, self._xy = self._id[alive], self._xy[alive]
        self._ends = dict(list(self._ends.items())[-_NUMBERED:])
        self._waiting.clear()

    def close(self) -> None:
        """Write the pictures."""
        self._draw()
        size = (self._layer.shape[1], self._layer.shape[0])
        scene = np.full((*self._shape, 3), 60, np.uint8)
        if self._scene and self._stepped:
            scene = self._scene()
            write_scene(self._path.parent, scene)
        picture = np.asarray(cv2.resize(scene, size, interpolation=cv2.INTER_CUBIC), dtype=np.uint8)
        _lay_over(self._layer, picture)
        pen = Pen(picture)
        zoom = self._zoom
        enlarged = [Line(k.name, zoom * k.x1, zoom * k.y1, zoom * k.x2, zoom * k.y2) for k in self._lines]
        self._number(pen, draw_lines(pen, enlarged, self._totals() if self._totals else None))
        with replacing(self._path) as new:  # a partial file would look complete
            new.write_bytes(cv2.imencode(".png", picture)[1].tobytes())

    def _number(self, pen: Pen, taken: Sequence[Patch]) -> None:
        """Draw each track's id at its end, or at the nearest free place above or below."""
        free = np.ones(self._layer.shape[:2], bool)
        for patch in taken:
            free[patch] = False
        for track_id, xy in sorted(self._ends.items()):
            width, height = pen.size(str(track_id))
            x = int(np.clip(xy[0] * self._zoom, 0, max(0, free.shape[1] - width)))
            end = int(np.clip(xy[1] * self._zoom, height, free.shape[0]))
            places = np.arange(height, free.shape[0] + 1, 2)
            for y in places[np.argsort(np.abs(places - end), kind="stable")]:
                if free[y - height : y, x : x + width].all():
                    free[y - height : y, x : x + width] = False
                    pen.label(str(track_id), x, y, colour(track_id))
                    break


@kernel
def _lay_over(layer: Image, picture: Image) -> None:
    """Blend a layer (h, w, 4), premultiplied colours and opacity, over the picture (h, w, 3); both uint8."""
    white = np.float32(255)
    for y in range(picture.shape[0]):
        for x in range(picture.shape[1]):
            clear = np.float32(1) - np.float32(layer[y, x, 3]) / white
            if clear < 1:
                for c in range(3):
                    picture[y, x, c] = min(np.float32(picture[y, x, c]) * clear + np.float32(layer[y, x, c]), white)

"""Draws tracks on pictures: one colour per track id, dashed without a measurement."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats
from vidtrack.output.colours import Colour, colour
from vidtrack.tracks import Status, Tracks
from vidtrack.traffic.lines import Line, counted
from vidtrack.video.frame import Image

BLACK: Colour = (0, 0, 0)
WHITE: Colour = (255, 255, 255)
GREY: Colour = (170, 170, 170)
LINE: Colour = (0, 220, 255)
_LUMA = (0.114, 0.587, 0.299)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


Patch = tuple[slice, slice]
"""Rows and columns of a picture."""


class Pen:
    """Draws on one picture, with strokes and letters scaled to its size."""

    def __init__(self, picture: Image) -> None:
        self.picture = picture
        height = min(picture.shape[:2])
        self.width = max(1, round(height / 450))
        self.text_scale = max(0.35, height / 1600)

    def path(self, points: ArrayLike, ink: Colour, width: int = 1) -> None:
        """A polyline through (n, 2) points."""
        corners = np.round(np.asarray(points, dtype=float) * 8).astype(np.int32)
        cv2.polylines(self.picture, [corners], False, ink, width * self.width, cv2.LINE_AA, shift=3)

    def box(self, box: Floats, ink: Colour, dashed: bool = False) -> None:
        """A rectangle left, top, width, height."""
        left, top, width, height = box
        corners = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]]) + np.array([left, top])
        if not dashed:
            self.path(corners, ink)
            return
        dash = 5.0 * self.width
        for a, b in pairwise(corners):
            ends = np.linspace(0, 1, 2 * max(1, round(np.hypot(*(b - a)) / dash / 2)) + 1)[:, None] * (b - a) + a
            for i in range(0, len(ends) - 1, 2):
                self.path(ends[i : i + 2], ink)

    def size(self, text: str) -> tuple[int, int]:
        """Width and height of a label in pixels."""
        (width, height), _ = cv2.getTextSize(text, _FONT, self.text_scale, self.width)
        return width + 4, height + 2

    def label(self, text: str, left: float, bottom: float, ink: Colour) -> Patch:
        """Black or white text on a coloured patch inside the picture; returns the patch."""
        width, height = self.size(text)
        x = int(np.clip(left, 0, max(0, self.picture.shape[1] - width)))
        y = int(np.clip(bottom, height, self.picture.shape[0]))
        cv2.rectangle(self.picture, (x, y - height), (x + width, y), ink, -1)
        text_ink = BLACK if np.dot(ink, _LUMA) > 100 else WHITE
        cv2.putText(self.picture, text, (x + 2, y - 2), _FONT, self.text_scale, text_ink, self.width, cv2.LINE_AA)
        return slice(y - height, y), slice(x, x + width)


def draw_trails(pen: Pen, paths: Mapping[int, Floats]) -> None:
    """The recent path of each track."""
    for track_id, path in paths.items():
        pen.path(path, colour(track_id))


def draw_tracks(pen: Pen, tracks: Tracks) -> None:
    """Boxes and ids: tentative thin and grey, coasting dashed, one label for tracks that share a blob."""
    boxes = np.where(np.isnan(tracks.box), np.hstack([tracks.xy[:, :2] - 3, np.full((len(tracks), 2), 6)]), tracks.box)
    for track_id, status, box, group in zip(tracks.id.tolist(), tracks.status, boxes, tracks.group, strict=True):
        if status == Status.TENTATIVE:
            pen.box(box, GREY)
            continue
        pen.box(box, colour(track_id), dashed=status == Status.COASTING)
        if group < 0:
            pen.label(str(track_id), box[0], box[1], colour(track_id))
    for group in np.unique(tracks.group[tracks.group >= 0]):
        members = tracks.group == group
        low = boxes[members, :2].min(axis=0) - 2
        high = (boxes[members, :2] + boxes[members, 2:]).max(axis=0) + 2
        pen.box(np.concatenate([low, high - low]), WHITE)
        pen.label("+".join(map(str, np.sort(tracks.id[members]))), low[0], low[1], WHITE)


def draw_lines(pen: Pen, lines: Sequence[Line], totals: Mapping[str, Mapping[str, int]] | None = None) -> list[Patch]:
    """Counting lines with their names and, given totals, their counts; returns the patches of the labels."""
    for line in lines:
        pen.path([[line.x1, line.y1], [line.x2, line.y2]], LINE)
    named = {line.name: line for line in reversed(lines)}.values()  # the first part of each
    return [pen.label(counted(k.name, (totals or {}).get(k.name, {})), k.x1, k.y1, LINE) for k in named]


def moved_lines(lines: Sequence[Line], motion: Floats | None) -> list[Line]:
    """The lines in the current picture; motion (2, 3) from the scene to the picture, None: identity."""
    if motion is None:
        return list(lines)
    ends = [affine.points(motion, np.array([[k.x1, k.y1], [k.x2, k.y2]])).ravel().tolist() for k in lines]
    return [Line(k.name, x1, y1, x2, y2) for k, (x1, y1, x2, y2) in zip(lines, ends, strict=True)]


def draw_clock(pen: Pen, clock: str, facts: Iterable[str] = ()) -> None:
    """Time and other text in the lower left corner."""
    pen.label("  ".join([clock, *facts]), 0, pen.picture.shape[0], GREY)


def media_clock(time_s: float) -> str:
    """A media time as minutes and seconds."""
    minutes, seconds = divmod(time_s, 60)
    return f"{int(minutes)}:{seconds:06.3f}"

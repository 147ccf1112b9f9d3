"""Stored detections (MOTChallenge det.txt) as scans: tracks without pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vidtrack.config import SourceSettings
from vidtrack.errors import SourceError
from vidtrack.formats import read_mot
from vidtrack.scan import Floats, Scan
from vidtrack.video.sequence import read_sequence_info, untimed_rate
from vidtrack.video.stats import SourceStats

SIGMA_SHARE = 0.05  # standard deviation of a box centre over the box's width and height
SIGMA_FLOOR_PX = 0.5
_LINES_LOOKED_AT = 20


def is_detections(path: str) -> bool:
    """Whether a .txt or .csv file holds detections: one of its first lines has six numbers or more."""
    place = Path(path)
    if place.suffix.lower() not in (".txt", ".csv") or not place.is_file():
        return False
    with place.open(encoding="utf-8", errors="replace") as file:
        return any(_has_six_numbers(line) for _, line in zip(range(_LINES_LOOKED_AT), file, strict=False))


def open_detections(path: str, settings: SourceSettings) -> Detections:
    """Read a MOT file of detections. Raises SourceError if it cannot be read, FormatError naming a bad line."""
    return Detections(Path(path), settings)


class Detections:
    """Iterates over (index, time_s, Scan), one scan a frame, in order.

    name, width, height, fps, frames, stats   as for Source; without seqinfo.ini the size is what holds all boxes

    z is the centre of a box, R the square of SIGMA_SHARE of its width and height (at least SIGMA_FLOOR_PX).
    The score is the share of the file's detections that do not score higher: scales differ between
    detectors, only the order counts. Frames without a line are empty scans, up to the sequence's length.
    """

    def __init__(self, path: Path, settings: SourceSettings) -> None:
        try:
            table = read_mot(path)
        except OSError as error:
            raise SourceError(f"cannot read {path}: {error.strerror}") from None
        if table.box is None or not len(table):
            raise SourceError(f"{path} holds no detections")
        order = np.argsort(table.frame, kind="stable")
        self._frame, self._box = table.frame[order], table.box[order]
        self._score = _rank(table.conf)[order]
        self.stats = SourceStats()
        info = read_sequence_info(path.parent)
        self.name = info.name or path.stem
        self.fps = untimed_rate(info, settings, self.stats)
        right, bottom = np.ceil((self._box[:, :2] + self._box[:, 2:]).max(axis=0)).astype(int)
        self.width, self.height = info.width or int(right), info.height or int(bottom)
        length = max(info.length or 0, int(self._frame[-1]) + 1)
        self._span = _frames_between(settings, self.fps, length)
        self.frames = len(self._span)

    def __iter__(self) -> Iterator[tuple[int, float, Scan]]:
        bounds = np.searchsorted(self._frame, [self._span, np.add(self._span, 1)]).T
        for index, (first, end) in zip(self._span, bounds, strict=True):
            self.stats.frames_read += 1
            yield index, index / self.fps, self._scan(index / self.fps, slice(first, end))

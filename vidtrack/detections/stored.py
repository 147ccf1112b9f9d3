"""Stored detections (MOTChallenge det.txt) as scans."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.associate.methods import STRENGTH
from vidtrack.config.settings import DetectionSettings, Settings
from vidtrack.detections.parameters import Chains, Parameters, estimate_parameters, natural_rate
from vidtrack.errors import ConfigError, SourceError
from vidtrack.estimate.noise import BOX_JITTER
from vidtrack.formats import read_mot
from vidtrack.scan import Scan
from vidtrack.tracking.boxes import box_scan, doubles
from vidtrack.video.sequence import read_sequence_info, untimed_rate
from vidtrack.video.span import Span
from vidtrack.video.stats import SourceStats

_LINES_LOOKED_AT = 20


def is_detections(path: str) -> bool:
    """Whether a .txt or .csv file contains detections: one of its first lines has six numbers or more."""
    place = Path(path)
    if place.suffix.lower() not in (".txt", ".csv") or not place.is_file():
        return False
    with place.open(encoding="utf-8", errors="replace") as file:
        return any(_has_six_numbers(line) for _, line in zip(range(_LINES_LOOKED_AT), file, strict=False))


def open_detections(path: str, settings: Settings) -> Detections:
    """Read a MOT file of detections.

    Raises SourceError if it cannot be read or has no frame in the span, FormatError for a bad line, ConfigError for a
    method that needs scores if there are none.
    """
    return Detections(Path(path), settings)


class Detections:
    """Iterates over (index, time_s, Scan), one scan per frame, in order.

    name, place, width, height, fps, frames, stats   as for Source; without seqinfo.ini the size contains all boxes
    settings   of detections, with None replaced by estimates from the file
    pace       seconds of scan time per second of the settings. An unknown rate is estimated from the boxes, so that
               the tracks do not depend on the assumed rate

    Duplicate boxes of an object in a frame are left out. z is the centre of a box, R is from `box_noise`. The score is
    the share of the file's detections with at most this score, because only the order is comparable between detectors.
    If all scores are equal or missing, scans have none. Frames without a line are empty scans, up to the sequence's
    length.
    """

    def __init__(self, path: Path, settings: Settings) -> None:
        try:
            table = read_mot(path)
        except OSError as error:
            raise SourceError(f"cannot read {path}: {error.strerror}") from None
        if table.box is None or not len(table):
            raise SourceError(f"{path} holds no detections")
        order = np.argsort(table.frame, kind="stable")
        frame, box, conf = table.frame[order], table.box[order], table.conf[order]
        start = np.searchsorted(frame, np.arange(frame[0], frame[-1] + 2))
        single = ~doubles(start, box, conf)
        self._frame, self._box, self._score = frame[single], box[single], _rank(conf[single])
        self._ranked = conf.min() < conf.max()
        if settings.tracker.method in STRENGTH and not self._ranked:
            raise ConfigError(
                f"{path} has no scores that differ, by which {settings.tracker.method} chooses; "
                "take another method (gnn, jpda, mht)"
            )
        self.stats = SourceStats()
        info = read_sequence_info(path.parent)
        self.place = path
        self.name = info.name or path.stem
        self.fps = untimed_rate(info, settings.source, self.stats)
        chains = Chains.of(self._frame, self._box, self._score)
        rate = (natural_rate(chains) if self.stats.fps_assumed else None) or self.fps
        self.pace = rate / self.fps
        self.settings = _completed(settings.detections, estimate_parameters(chains, rate, settings.tracker.hold_s))
        right, bottom = np.ceil((self._box[:, :2] + self._box[:, 2:]).max(axis=0)).astype(int)
        self.width, self.height = info.width or int(right), info.height or int(bottom)
        length = max(info.length or 0, int(self._frame[-1]) + 1)
        span = Span.of(settings.source)
        self._frames = span.frames(self.fps, length)
        self.frames = len(self._frames)
        if not self._frames:
            raise SourceError(f"{path} has no frame between {span}; the last one is at {(length - 1) / self.fps:g} s")

    def __iter__(self) -> Iterator[tuple[int, float, Scan]]:
        for index in self._frames:
            rows = slice(*np.searchsorted(self._frame, [index, index + 1]))
            time_s = index / self.fps
            self.stats.frames_read += 1
            score = self._score[rows] if self._ranked else None
            yield index, time_s, box_scan(time_s, self._box[rows], score, self.settings.jitter or BOX_JITTER)

    def close(self) -> None:
        """Do nothing: the file has been read completely."""


def _completed(settings: DetectionSettings, parameters: Parameters) -> DetectionSettings:
    """The settings with None replaced by the estimated parameters."""
    open_ones = {name: value for name, value in asdict(parameters).items() if getattr(settings, name) is None}
    return settings.model_copy(update=open_ones)


def _rank(score: Floats) -> Floats:
    """(N,) share of all values that are at most each value: 1 for the best, equal for ties."""
    return np.searchsorted(np.sort(score), score, side="right") / len(score)


def _has_six_numbers(line: str) -> bool:
    fields = line.replace(",", " ").split()
    try:
        return len([float(field) for field in fields]) >= 6
    except ValueError:
        return False

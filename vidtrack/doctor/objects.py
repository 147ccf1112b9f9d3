"""Measures moving objects: their sizes, the share of the picture that moves, and motion without travel."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Mask
from vidtrack.config.settings import Settings
from vidtrack.config.video import BlobSettings
from vidtrack.doctor.findings import Objects
from vidtrack.output.sink import Step
from vidtrack.tracking.boxes import best_cover, longer, widened
from vidtrack.tracks import TENTATIVE
from vidtrack.video.background.picture import reduction
from vidtrack.video.blobs.blobs import find_blobs
from vidtrack.video.foreground import Foreground

_SETTLE_S = 2.0  # for the ghosts of the first picture to disappear
_GOES = 0.2  # object sizes; least travel of an object
_OFTEN = 0.2  # share of the frames
_ENOUGH_S = 3.0  # least duration: in less, an unconfirmed vehicle moves as often as a tree
_SMALL = 10  # percentile
_PIECE = 0.3  # share of a box inside another one, of which it is then a piece
_LASTING_S = 1.0  # least duration of a small object; noise is shorter
_FINE_MAJORITY_PX, _FINE_AREA_PX = 3, 6  # of the finer detector
_MARGIN = 0.25  # of a box's size, around it: motion there is the vehicle's shadow or glare


def least_px(settings: Settings, shape: tuple[int, int]) -> float:
    """Side [source px] of the smallest square that passes the majority filter and the least area of a blob."""
    step = reduction(shape[0], settings.source.scale)
    area = settings.blobs.min_area_share * shape[0] * shape[1] / step**2
    if settings.detector.kind == "disturbance":
        area = max(area, settings.detector.disturbance.majority_px**2 / 2)
    return math.sqrt(area) * step


def finer(settings: Settings, shape: tuple[int, int]) -> Settings:
    """Settings that detect smaller objects, at twice the resolution if the picture is reduced."""
    step = max(1, reduction(shape[0], settings.source.scale) // 2)
    disturbance = settings.detector.disturbance.model_copy(update={"majority_px": _FINE_MAJORITY_PX})
    detector = settings.detector.model_copy(update={"kind": "disturbance", "disturbance": disturbance})
    share = _FINE_AREA_PX * step**2 / (shape[0] * shape[1])
    return settings.model_copy(
        update={
            "source": settings.source.model_copy(update={"scale": 1 / step}),
            "detector": detector,
            "blobs": settings.blobs.model_copy(update={"min_area_share": share}),
        }
    )


class ObjectMeter:
    """Measures the steps of a run, and of one with finer settings over the same frames."""

    def __init__(self, settings: Settings, shape: tuple[int, int]) -> None:
        self._least_px = least_px(settings, shape)
        self._step = reduction(shape[0], settings.source.scale)
        self._sizes: dict[int, list[float]] = defaultdict(list)  # by track
        self._missed_sizes: dict[int, list[float]] = defaultdict(list)
        self._boxes: Floats = np.empty((0, 4))  # of all tracks of the newest frame
        self._begun_s: float | None = None
        self._frames = 0  # since the scene has settled, and their duration:
        self._watched_s = 0.0
        self._motion = 0.0
        self._restless: NDArray[np.int32] = np.empty((0, 0), np.int32)

    def take(self, step: Step) -> None:
        """Add a step of the run."""
        assert step.foreground is not None
        self._boxes = widened(step.tracks.box, _MARGIN)
        self._collect(step, np.ones(len(step.tracks), bool), self._sizes)
        if self._begun_s is None:
            self._begun_s = step.time_s
            self._restless = np.zeros(step.foreground.mask.shape, np.int32)
        self._watched_s = step.time_s - self._begun_s - _SETTLE_S
        if self._watched_s < 0:
            return
        moving = step.foreground.reduced(self._restless.shape) > 0
        self._frames += 1
        self._motion += float(moving.mean())
        moving &= ~_covered(step, moving.shape)
        self._restless += moving

    def take_fine(self, step: Step) -> None:
        """Add the step of the finer run: its small objects that are not pieces of objects in the run."""
        box = step.tracks.box
        cover = best_cover(box, self._boxes)[1]
        small = longer(box) < 2 * self._least_px
        self._collect(step, small & (cover < _PIECE), self._missed_sizes)

    def result(self) -> Objects:
        """The measurements of all frames so far."""
        seen = [float(np.median(sizes)) for sizes in self._sizes.values()]
        lasting = _LASTING_S * self._frames / max(self._watched_s, _LASTING_S)
        missed = [float(np.median(sizes)) for sizes in self._missed_sizes.values() if len(sizes) >= lasting]
        sizes = seen + missed
        share, box = self._restless_place()
        return Objects(
            tracks=len(seen),
            missed=len(missed),
            median_px=float(np.median(sizes)) if sizes else None,
            smallest_px=float(np.percentile(sizes, _SMALL)) if sizes else None,
            least_px=self._least_px,
            step=self._step,
            motion_share=self._motion / max(1, self._frames),
            restless_share=share,
            restless_box=box,
        )

    def _collect(self, step: Step, among: Mask, sizes: dict[int, list[float]]) -> None:
        """Add the sizes of the confirmed tracks, `among` (T,), that have travelled."""
        tracks = step.tracks
        size = longer(tracks.box)
        confirmed = among & tracks.seen & (tracks.status != TENTATIVE)
        shown = confirmed & (tracks.travel > size + 2 * self._least_px)
        for track, px in zip(tracks.id[shown].tolist(), size[shown].tolist(), strict=True):
            sizes[track].append(px)

    def _restless_place(self) -> tuple[float, tuple[int, int, int, int] | None]:
        if self._watched_s < _ENOUGH_S:
            return 0.0, None
        often = np.where(self._restless > _OFTEN * self._frames, np.uint8(255), np.uint8(0))
        places = find_blobs(Foreground(often, often.astype(np.float32), self._step), BlobSettings(min_area_share=0))
        if not len(places):
            return 0.0, None
        left, top, width, height = places.box[places.area.argmax()].astype(int).tolist()
        return float((often > 0).mean()), (left, top, width, height)


def _covered(step: Step, shape: tuple[int, int]) -> Mask:
    """(h, w) the boxes of tracks that are confirmed or have travelled, with a margin."""
    assert step.foreground is not None
    going = (step.tracks.status != TENTATIVE) | (step.tracks.travel > _GOES * longer(step.tracks.box))
    boxes = widened(step.shown.box[going], _MARGIN) / step.foreground.step
    covered = np.zeros(shape, bool)
    corners = np.column_stack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]])
    for left, top, right, bottom in np.maximum(corners, 0).astype(int):
        covered[top : bottom + 1, left : right + 1] = True
    return covered

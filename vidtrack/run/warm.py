"""Compiles the kernels of a video run before they are needed, by a short run over drawn traffic."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vidtrack.arrays.types import Ints
from vidtrack.beside import help_beside
from vidtrack.compiled import CACHE
from vidtrack.config.settings import Settings, SourceSettings
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, video_steps
from vidtrack.video.blobs.blobs import Blobs
from vidtrack.video.blobs.explain import explain
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame, Image

_HEIGHT, _WIDTH = 144, 192
_FPS, _PICTURES = 10, 120
_SIZE = np.array([30, 16])  # px, of a vehicle
_LANES = np.array([[20, 4], [32, -5], [60, 7], [90, -6], [104, 4]])  # upper edge [px], px a picture
_SHIFTED_S = 8.0  # from then on the camera has moved


def warm() -> None:
    """Compile what `vidtrack track VIDEO` needs, and keep it for later runs; a second call finds it compiled.

    The tracker comes first, then blobs, then the detector: a run that begins at the same time needs them the other way
    round, and two processes that need the same kernels in the same order wait for each other.
    """
    settings = Settings()
    masks = [_drawn(np.zeros((_HEIGHT, _WIDTH), np.uint8), k, 255) for k in range(_PICTURES)]
    tracker = build_blob_tracker(settings.tracker, (_WIDTH, _HEIGHT), smooth=bool(settings.output.smooth))
    for k, mask in enumerate(masks):
        tracker.predict(k / _FPS)
        tracker.step(_labelled(mask, settings).scan(k / _FPS))
    tracker = build_blob_tracker(settings.tracker, (_WIDTH, _HEIGHT))
    for k, mask in enumerate(masks):
        foreground = Foreground(mask, mask.astype(np.float32), 1, weak=mask)
        tracker.step(explain(foreground, tracker.predict(k / _FPS), tracker.road, settings.blobs).scan(k / _FPS))
    tracker = build_blob_tracker(settings.tracker, (_WIDTH, _HEIGHT))
    for _ in video_steps(_frames(), build_detector(settings), tracker, settings):
        pass
    halved = build_detector(Settings(source=SourceSettings(scale=0.5)))  # as 720 and 1080 rows are
    for frame in islice(_frames(), 2):
        halved.apply(frame, np.empty((0, 4)))


def warm_beside() -> None:
    """Start `warm` in a process of its own, for the first run on a machine with a second core."""
    if CACHE:
        help_beside(f"from {__name__} import warm; warm()")


def _labelled(mask: Image, settings: Settings) -> Blobs:
    """Each region of a mask (h, w) as a blob, without a kernel of our own."""
    label, count = ndimage.label(mask)
    top, left, below, right = np.empty((4, count))
    for i, (rows, columns) in enumerate(ndimage.find_objects(label)):
        top[i], left[i], below[i], right[i] = rows.start, columns.start, rows.stop, columns.stop
    box = np.column_stack([left, top, right - left, below - top])
    cov = np.zeros((count, 2, 2))
    cov[:, [0, 1], [0, 1]] = box[:, 2:] ** 2 / 12
    return Blobs(box[:, :2] + box[:, 2:] / 2, cov, box, box[:, 2] * box[:, 3], np.full(count, 255.0), 1, settings.blobs)


def _frames() -> Iterator[Frame]:
    """Traffic on a road with edges, and a camera that moves once."""
    noise = np.random.default_rng(0)
    ground = np.kron(noise.integers(60, 160, (_HEIGHT // 8 + 1, _WIDTH // 8 + 1)), np.ones((8, 8)))
    grey = np.full((_HEIGHT // 2, _WIDTH // 2), 128, np.uint8)
    for k in range(_PICTURES):
        at = 3 * (k / _FPS > _SHIFTED_S)
        picture = _drawn(ground[at : at + _HEIGHT, at : at + _WIDTH].copy(), k, 220)
        luma = (picture + noise.normal(0, 1, picture.shape)).astype(np.uint8)
        chroma = _decoded(grey, padded=bool(k % 2))
        yield Frame(k, k / _FPS, _decoded(luma, padded=bool(k % 2)), chroma, chroma)


def _decoded(plane: Image, padded: bool) -> Image:
    """The plane as decoders give it: read-only, and its rows may be padded."""
    rows = np.pad(plane, ((0, 0), (0, 8)))[:, : plane.shape[1]] if padded else plane.copy()
    rows.flags.writeable = False
    return rows


def _drawn(picture: NDArray, k: int, level: int) -> NDArray:
    """The picture with the vehicles of its number, in place; each lane has one vehicle after the other."""
    for left, top in _places(k):
        picture[top : top + _SIZE[1], max(left, 0) : max(left + _SIZE[0], 0)] = level
    return picture


def _places(k: int) -> Ints:
    """(N, 2) left and upper edges of the vehicles in picture k."""
    way = _WIDTH + 2 * _SIZE[0]
    left = (k * _LANES[:, 1]) % way - _SIZE[0]
    return np.column_stack([left, _LANES[:, 0]])

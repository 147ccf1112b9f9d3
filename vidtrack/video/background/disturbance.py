"""The disturbance map, made robust: what differs from the learnt scene by more than its measured noise."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.config import DisturbanceSettings
from vidtrack.errors import Error
from vidtrack.scan import Floats
from vidtrack.video.background.distance import disturbance
from vidtrack.video.background.exposure import gain
from vidtrack.video.background.majority import majority
from vidtrack.video.background.picture import NO_CHROMA, VIDEO_BLACK, Picture, kept, reduce, reduction, smooth, to_bgr
from vidtrack.video.background.regions import fill_holes, find_ghosts, paint
from vidtrack.video.background.scene import Scene, adopt, learn, start
from vidtrack.video.background.shadow import SHADOW, mark_shadow
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame, Image
from vidtrack.video.runs import find_runs

_GAIN_STEP = 0.02  # smaller changes of exposure are left to learning
_FIRST_S = 0.1  # plain averaging after a start
_UNSURE_S = 10.0  # after a start ghosts are many: for so long
_UNSURE_GHOST_S = 0.3  # they need only so much cover
_SHADOW_S, _UNSURE_SHADOW_S = 5.0, 1.0  # shadow that lies longer is the ghost of a bright vehicle, or the sun moved
_SUDDEN_SHARE, _SUDDEN_S = 0.25, 0.2  # of the picture, in at most this time: traffic does not come so fast


class Disturbance:
    """The scene learnt from what is not traffic, and the map of what differs from it."""

    def __init__(self, settings: DisturbanceSettings, scale: float | None = None, keep: Image | None = None) -> None:
        """scale: processed over source size; keep (any size): there is no foreground where it is black."""
        self._settings = settings
        self._scale = scale
        self._keep_image = keep
        self._guard = np.ones(2 * (2 * settings.guard_px + 1,), np.uint8)
        self._shape: tuple[int, int] | None = None

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; what covers a `known` box (K, 4) [source px] is never absorbed by the scene."""
        if self._shape is None:
            self._open(frame)
        picture = smooth(reduce(frame, self._step))
        dt = frame.time_s - self._time_s
        self._time_s = frame.time_s
        if self._settings.exposure:
            self._follow_exposure(picture)
        strength, hit = self._disturbed(picture)
        mask = self._cleaned(hit)
        if self._whole_picture_changed(mask, dt):
            mask[:] = 0
            if self._time_s - self._steady_s > self._settings.relearn_s:
                self._start(picture)
            return Foreground(mask, strength, self._step)
        if self._settings.ghosts:
            self._heal_ghosts(picture, mask)
        self._learn(picture, mask, hit, dt)
        if math.floor(self._time_s) != math.floor(self._time_s - dt):  # once a second is often enough
            self._absorb(picture, hit, known)
        return Foreground(mask, strength, self._step)

    def scene(self) -> Image:
        """(H, W, 3) the learnt scene in source size, blue-green-red."""
        if self._shape is None:
            raise Error("there is no scene before the first frame; call apply first")
        return to_bgr(Picture(*self._scene[:3]), self._shape, self._step, self._black == 0)

    def _open(self, frame: Frame) -> None:
        """Settle what the first frame decides: size, black level, and the scene to begin with."""
        self._shape = frame.shape
        self._step = reduction(frame.shape[0], self._scale)
        self._black = np.float32(0 if frame.full_range else VIDEO_BLACK)
        self._time_s = frame.time_s
        picture = smooth(reduce(frame, self._step))
        self._keep = kept(self._keep_image, picture.luma.shape)
        self._start(picture)

    def _start(self, picture: Picture) -> None:
        self._scene: Scene = start(picture)
        self._start_s = self._steady_s = self._time_s
        self._frames = 0
        self._share = 0.0

    @property
    def _unsure(self) -> bool:
        return self._time_s - self._start_s < _UNSURE_S

    def _follow_exposure(self, picture: Picture) -> None:
        g = gain(picture.luma, self._scene, self._black)
        if abs(g - 1) > _GAIN_STEP:
            luma = self._scene.luma
            np.clip((luma - self._black) * g + self._black, 0, 255, out=luma)

    def _disturbed(self, picture: Picture) -> tuple[NDArray[np.float32], Image]:
        """Strength, and hits: 1 disturbed, SHADOW, or 0."""
        s = self._settings
        strength = np.empty(picture.luma.shape, np.float32)
        hit = np.empty(picture.luma.shape, np.uint8)
        seen = picture if s.chroma else Picture(picture.luma, NO_CHROMA, NO_CHROMA)
        thresholds = np.float32([s.luma_threshold, s.noise_factor, s.chroma_threshold])
        disturbance(seen, self._scene, *thresholds, strength, hit)
        if s.shadow:
            mark_shadow(seen, self._scene, self._black, hit)
        return strength, hit

    def _cleaned(self, hit: Image) -> Image:
        if self._keep is not None:
            hit &= self._keep
        mask = np.empty_like(hit)
        majority(hit, self._settings.majority_px, mask)
        if self._settings.holes:
            fill_holes(mask)
        if self._keep is not None:
            mask &= self._keep
        return mask

    def _whole_picture_changed(self, mask: Image, dt: float) -> bool:
        """Whether the light or the view changed: more is foreground than traffic covers, or it came all at once.

        `_steady_s` is the last time it was not so, and `_share` the foreground's share of the picture then.
        """
        share = np.count_nonzero(mask) / mask.size
        lasting = self._steady_s < self._time_s - dt
        sudden = (dt <= _SUDDEN_S or lasting) and share - self._share > _SUDDEN_SHARE
        if sudden or share > self._settings.relearn_share:
            return True
        self._steady_s, self._share = self._time_s, share
        return False

    def _heal_ghosts(self, picture: Picture, mask: Image) -> None:
        settled_s = min(self._settings.ghost_s, _UNSURE_GHOST_S) if self._unsure else self._settings.ghost_s
        row, begin, end = find_ghosts(mask, picture.luma, self._scene, np.float32(settled_s))
        adopt(picture, self._scene, row, begin, end)
        paint(mask, row, begin, end, 0)

    def _learn(self, picture: Picture, mask: Image, hit: Image, dt: float) -> None:
        """Average what is neither foreground, nor close to it, nor shadow."""
        s = self._settings
        covered = (cv2.dilate(mask, self._guard) if s.guard_px else mask) | (hit & SHADOW)
        if not s.selective:
            covered[:] = 0
        self._frames += 1
        weight = -math.expm1(-dt / s.learn_s)
        if self._time_s - self._start_s < _FIRST_S:
            weight = max(weight, 1 / self._frames)
        rates = np.float32([weight, -math.expm1(-dt / s.noise_s), dt])
        learn(picture, self._scene, covered, *rates)

    def _absorb(self, picture: Picture, hit: Image, known: Floats) -> None:
        """Take for scene what has stood for absorb_s, unless the tracker knows it for a vehicle, and lasting shadow."""
        covered_s = self._scene.covered_s
        left, top, width, height = (np.asarray(known, dtype=float).reshape(-1, 4) / self._step).T
        for x0, y0, x1, y1 in np.stack([left, top, left + width + 1, top + height + 1], axis=1).clip(0).astype(int):
            inside = covered_s[y0:y1, x0:x1]
            np.minimum(inside, self._settings.absorb_s / 2, out=inside)
        shadow_s = _UNSURE_SHADOW_S if self._unsure else _SHADOW_S
        lasting = (covered_s >= self._settings.absorb_s) | ((hit == SHADOW) & (covered_s >= shadow_s))
        row, begin, end = find_runs(lasting.view(np.uint8))
        adopt(picture, self._scene, row, begin, end)

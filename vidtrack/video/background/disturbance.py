"""The disturbance map: pixels that differ from the learnt scene by more than the scene's measured noise."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.video import DisturbanceSettings
from vidtrack.video.background.beam import is_dark, mark_beams, shows_lamps
from vidtrack.video.background.change import Change
from vidtrack.video.background.distance import brightest, contrast, disturbance, haziness, strong, veil
from vidtrack.video.background.exposure import follow_gain, follow_tint, relit
from vidtrack.video.background.majority import majority
from vidtrack.video.background.patches import patched
from vidtrack.video.background.picture import Picture, View, is_coloured, smooth
from vidtrack.video.background.regions import fill_holes, find_ghosts, paint
from vidtrack.video.background.scene import Scene, absorb, adopt, learn, no_scene, spare, start, uncovered
from vidtrack.video.background.shadow import SOFT, Sunlight, find_dark, mark_shadow, reclaim
from vidtrack.video.background.veil import Air, Haze, VeilByPlace, even
from vidtrack.video.camera.camera import Camera
from vidtrack.video.camera.canvas import lay, mark_unseen, settled
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame, Image
from vidtrack.video.span import ROUNDING_S

_FIRST_S = 0.1  # after a start, while all frames weigh the same in the average
_UNSURE_S = 10.0  # after a start, while ghosts are frequent
_UNSURE_GHOST_S = 0.3  # cover that makes a ghost during that time
_SHADOW_S, _UNSURE_SHADOW_S = 5.0, 1.0  # shadow that lies longer is the ghost of a bright vehicle, or the sun moved
_LIFT = 0.5  # grey levels a second by which the darkest luminance seen is forgotten
_GAP_S = 2.0  # after a longer gap between frames the scene is as uncertain as after a start, and no cover is counted
PREVIEW_EVERY_S = 0.2
"""Seconds between pictures of the preview."""
_KNOWN_S = np.float32(0.1)  # cover under known vehicles: below all limits, but not the 0 of pixels that were seen free


class Disturbance:
    """The scene, learnt from pixels without traffic, and the map of differences from it."""

    STATE = (
        "_view",
        "_change",
        "_camera",
        "_scene",
        "_time_s",
        "_start_s",
        "_frames",
        "_contrast",
        "_hazy",
        "_veil",
        "_brightest",
        "_sunlight",
        "_veil_by_place",
        "_coloured",
        "_dark",
        "_previewed",
    )
    ADDED: ClassVar = {
        "_previewed": lambda found: False,
        "_dark": lambda found: is_dark(found._scene.luma, np.float32(found._view.black)),
        "_brightest": lambda found: brightest(found._scene.luma),
    }

    def __init__(self, settings: DisturbanceSettings, view: View) -> None:
        self._settings = settings
        self._camera = Camera(settings.still_s)
        self._view = view
        self._thresholds = tuple(
            np.float32(level) for level in (settings.luma_threshold, settings.noise_factor, settings.chroma_threshold)
        )
        self._change = Change(settings.relearn_share)
        self._guard = np.ones(2 * (2 * settings.guard_px + 1,), np.uint8)
        self._contrast, self._hazy, self._veil, self._brightest = np.float32(1), np.float32(0), 0.0, np.float32(255)
        self._sunlight = Sunlight()
        self._veil_by_place = VeilByPlace()
        self._coloured, self._dark = True, False
        self._scene = no_scene()
        self._time_s = self._start_s = 0.0
        self._previewed = False  # since the start
        self._frames = 0  # learnt since the start
        self._changed_s = 0.0  # how long the picture has been another one

    def preview(self, frames: Iterable[Frame]) -> None:
        """Learn the scene from a video's first seconds, before `apply` gets the first frame.

        They are run backwards, so the scene is that of the first frame, but for what stands in it all the time.
        """
        pictures: list[tuple[float, Picture]] = []
        for frame in frames:
            if not pictures or frame.time_s > pictures[-1][0] + PREVIEW_EVERY_S - ROUNDING_S:
                pictures.append((frame.time_s, smooth(self._view.reduce(frame))))
        if len(pictures) < 2:
            return
        nothing, stands = np.empty((0, 4)), self._settings.registration
        for time_s, picture in reversed(pictures):
            self._apply(picture, -time_s, nothing)
            stands &= not self._camera.moves
        learnt = [
            picture for time_s, picture in pictures if time_s <= -self._start_s
        ]  # since the light or view changed
        self._rewind(*pictures[0])
        if stands and self._previewed and self._settings.patches:
            black = np.float32(self._view.black)
            shown = [relit(picture, self._scene, black) for picture in learnt] if self._settings.exposure else learnt
            self._scene = patched(self._scene, shown)

    def reduced(self, frame: Frame) -> Frame:
        """The frame with no more of its picture than `preview` and `apply` look at; itself, if they look at all of it.

        Any thread may call it, once it has returned for the first frame.
        """
        return self._view.reduced_frame(frame)

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; pixels in `known` boxes (K, 4) [scene px] are never absorbed into the scene."""
        return self._apply(smooth(self._view.reduce(frame)), frame.time_s, known)

    def _apply(self, picture: Picture, time_s: float, known: Floats) -> Foreground:
        if not self._scene.luma.size:
            self._scene = self._start(picture, time_s)
        dt, self._time_s = time_s - self._time_s, time_s
        if dt > _GAP_S:
            self._start_s, self._previewed = time_s, False
        known = self._camera.on_canvas(known, self._view.step)
        if self._settings.registration:
            self._scene = self._camera.follow(picture.luma, self._scene, known, time_s)
        shown = picture
        if self._camera.lost_s > 0:
            self._changed_s = self._camera.lost_s
            self._change.skip(time_s)
            nothing = np.zeros_like(picture.luma)
            mask, weak, strength = nothing, nothing, np.zeros(picture.luma.shape, np.float32)
        elif self._camera.moves:
            shown, span = lay(picture, self._camera.motion, self._scene)
            mask, weak, strength = self._map(shown, known, dt, span)
        else:
            mask, weak, strength = self._map(picture, known, dt)
        if not self._camera.trusted:
            mask = np.zeros_like(mask)
        if self._changed_s == 0 and self._is_new_second(dt):
            self._judge_light(picture)
        place, motion = self._camera.place, self._camera.motion
        anew = self._changed_s > self._settings.relearn_s
        elsewhere = anew and self._camera.lost_s > 0
        if anew:
            self._scene = self._start(picture, time_s)
        warnings = self._camera.warnings()
        return self._view.foreground(mask, strength, place, motion, weak, warnings, elsewhere, shown, dark=self._dark)

    def _rewind(self, time_s: float, picture: Picture) -> None:
        """Begin with this picture, the last of the preview, and the scene learnt from it."""
        lost = self._camera.lost_s > 0 or not self._camera.trusted or self._changed_s > 0
        scene = self._start(picture, time_s) if lost else self._scene
        if self._camera.moves:
            scene = settled(scene, self._camera.motion, self._view.reduced)
        self._scene = uncovered(scene)
        self._camera = Camera(self._settings.still_s)
        self._change = Change(self._settings.relearn_share)
        self._time_s = self._start_s = time_s
        self._frames, self._changed_s, self._previewed = 0, 0.0, not lost

    def _map(
        self, picture: Picture, known: Floats, dt: float, span: Ints | None = None
    ) -> tuple[Image, Image, NDArray[np.float32]]:
        """Mask, weak mask and strength; free pixels are learnt. The mask is empty while the whole picture changes.

        span  (h, 2) columns from which to which the picture shows each row of the canvas; None: all of it
        """
        s, scene = self._settings, self._scene
        if s.exposure:
            follow_gain(picture, scene, np.float32(self._view.black))
            follow_tint(picture, scene, np.float32(self._view.black))
        strength, hit, weak_hit = self._disturbed(picture, scene, dt)
        mask, weak = np.empty_like(hit), np.empty_like(hit)
        majority(hit, s.majority_px, mask)
        majority(weak_hit, s.majority_px, weak)
        fits = s.registration and self._camera.fits  # nobody looked, if not
        self._changed_s = self._change.lasted_s(mask, self._time_s, fits)
        if self._changed_s > 0:
            return np.zeros_like(mask), weak, strength
        if s.holes:
            fill_holes(mask)
        if s.veil and not self._camera.moves:
            self._veil_by_place.learn(picture.luma, mask, min(dt, _GAP_S))
        spare(scene.covered_s, known, _KNOWN_S)
        if s.ghosts:
            self._heal_ghosts(picture, scene, mask)
        self._learn(picture, scene, mask, hit, dt, span)
        if self._is_new_second(dt):
            self._absorb(picture, scene, hit)
        return mask, weak, strength

    def keep(self, mask: Image | None) -> None:
        """Find no foreground where a mask (h, w) is dark."""
        self._view.keep = mask

    def scene(self) -> Image:
        """(H, W, 3) the learnt scene as the first picture showed it, in source size, blue-green-red."""
        scene = self._scene
        if not self._camera.at_home:
            scene = settled(scene, affine.inverse(self._camera.place), self._view.reduced)
        return self._view.enlarge(Picture(*scene[:3]))

    def _start(self, picture: Picture, time_s: float) -> Scene:
        self._time_s = self._start_s = time_s
        self._frames, self._previewed = 0, False
        self._change.restart(time_s)
        self._camera.restart()
        scene = start(picture)
        self._judge_scene(scene)
        self._veil = veil(picture.luma) or 0.0
        self._veil_by_place = VeilByPlace()
        return scene

    def _is_new_second(self, dt: float) -> bool:
        """For what is often enough once a second."""
        return math.floor(self._time_s) != math.floor(self._time_s - dt)

    def _judge_light(self, picture: Picture) -> None:
        """Contrast, haze, colour and darkness of the scene in view; a canvas has black rims where nothing was seen."""
        moves = self._camera.moves
        in_view = settled(self._scene, self._camera.motion, self._view.reduced) if moves else self._scene
        self._judge_scene(in_view)
        haze = veil(picture.luma)
        self._veil = self._veil if haze is None else min(self._veil + _LIFT, haze)

    def _judge_scene(self, scene: Scene) -> None:
        luma = scene.luma
        self._contrast, self._hazy, self._brightest = contrast(luma), haziness(luma), brightest(luma)
        self._coloured = is_coloured(Picture(*scene[:3]))
        self._dark = is_dark(luma, np.float32(self._view.black))

    def _air(self, picture: Picture) -> Air:
        """What the air does to the light at each place; a canvas that grows has no places of its own."""
        s, clear = self._settings, self._view.black
        lifted = clear + self._hazy * max(0.0, self._veil - clear)  # a veil that does not blur is the scene's own light
        share = self._hazy if s.haze else np.float32(0)
        haze = Haze(share, np.float32(clear), np.float32(lifted), self._brightest)
        shape = picture.luma.shape
        return self._veil_by_place.air(haze, shape) if s.veil and not self._camera.moves else even(haze, shape)

    @property
    def _unsure(self) -> bool:
        return self._time_s - self._start_s < _UNSURE_S

    def _disturbed(self, picture: Picture, scene: Scene, dt: float) -> tuple[NDArray[np.float32], Image, Image]:
        """Strength, hits (1 disturbed, SHADOW, BEAM, or 0), and hits above a lower threshold."""
        s = self._settings
        strength = np.empty(picture.luma.shape, np.float32)
        weak, hit = np.empty((2, *picture.luma.shape), np.uint8)
        seen = picture if s.chroma else picture.grey()
        floor, factor, chroma = self._thresholds
        floor *= self._contrast if s.contrast else np.float32(1)
        disturbance(seen, scene, floor, factor, chroma, np.float32(s.weak), strength, weak, hit)
        if s.shadow:
            told = seen if self._coloured else seen.grey()
            air = self._air(picture)
            count = mark_shadow(told, scene, air, self._sunlight.tolerance, weak)
            self._sunlight.learn(count, weak.size, dt)
        black = np.float32(self._view.black)
        if s.beams and self._dark and shows_lamps(seen.luma, black):
            mark_beams(seen, scene, black, weak)
        strong(weak, hit)
        if s.shadow and s.amid:
            reclaim(hit)
        if s.shadow and s.dark:
            find_dark(told, scene, air.black, hit)
        return strength, hit, weak

    def _heal_ghosts(self, picture: Picture, scene: Scene, mask: Image) -> None:
        """Remove ghosts (objects in the scene, not in the picture) from mask and scene."""
        settled_s = min(self._settings.ghost_s, _UNSURE_GHOST_S) if self._unsure else self._settings.ghost_s
        row, begin, end = find_ghosts(mask, picture.luma, scene, np.float32(settled_s))
        adopt(picture, scene, row, begin, end)
        paint(mask, row, begin, end, 0)

    def _learn(self, picture: Picture, scene: Scene, mask: Image, hit: Image, dt: float, span: Ints | None) -> None:
        """Average the pixels that are neither foreground, nor near foreground, nor shadow."""
        s = self._settings
        covered = np.asarray(cv2.dilate(mask, self._guard), np.uint8) if s.guard_px else mask.copy()
        if not s.selective:
            covered = hit = np.zeros_like(mask)
        if span is not None:
            mark_unseen(covered, span)
        self._frames += 1
        weight = -math.expm1(-dt / s.learn_s)
        if self._time_s - self._start_s < _FIRST_S:
            weight = max(weight, 1 / self._frames)
        noise_weight, seen_s = -math.expm1(-dt / s.noise_s), min(dt, _GAP_S)
        learn(picture, scene, covered, hit, np.float32(weight), np.float32(noise_weight), np.float32(seen_s))

    def _absorb(self, picture: Picture, scene: Scene, hit: Image) -> None:
        """Absorb pixels covered for absorb_s, and lasting shadow, into the scene."""
        s = self._settings
        cast = self._previewed and self._sunlight.tolerance is not SOFT
        shadow_s = _UNSURE_SHADOW_S if self._unsure and not cast else _SHADOW_S
        absorb(picture, scene, hit, np.float32(s.absorb_s), np.float32(s.steady_s), np.float32(shadow_s))

"""Camera motion by registration of each picture with the learnt scene; a still camera is checked with few points."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats, Mask
from vidtrack.compiled import kernel
from vidtrack.video.background.scene import Levels, Scene
from vidtrack.video.camera.alignment import FEWEST, Fit, agreement, align, edges_seen, leap, pyramid
from vidtrack.video.camera.canvas import fitting, recut, settled
from vidtrack.video.camera.points import CELLS, Points, choose, no_points, shifted
from vidtrack.video.frame import Image

_GOOD = 0.5  # share of the points that fit
_AGREED = 0.8  # share of the points that must tell of a motion; seen: .84 to 1 of true motions, up to .73 of lamps
_THERE = 0.5  # share of the edges; where more are at their place, the scene is seen, in whatever light
_STRANGE = 0.3  # with a smaller share the view has changed; a vehicle before the camera leaves more
_SURE = 0.9  # the same if the search starts from the last motion only; a stripe of the road too far .66 to .84 fit
_LEAST_PX = 0.75  # displacement of a corner from which the picture is resampled
_EVERY = 7  # every n-th point at full size is used for a still camera
_CHOSEN_S, _HELD_S = 1.0, 10.0  # period of the choice of points while the camera moves, and while it is still
_TRY_S = 0.3  # between searches from rest
_FRESH = 0.8  # share of the points that fit; with less the points are outdated
_DRIFT_PX = 0.3  # displacement of a still camera that counts as drift
_STILL_PX = 0.5
_HOLD_S = 0.5  # after a longer loss, time of successful registration before the camera is trusted
_LATELY_S, _RESTLESS_S = 10.0, 3.0  # a camera that was lost for so many of the last seconds is restless
_LARGEST = 0.25  # largest displacement, share of the picture's longer side; beyond it the view has changed


_MOVED_AWAY = (
    "the camera has moved by more than a quarter of the picture; nothing is reported until it stands still, "
    "and tracks and counting lines begin anew where it looks then"
)
_RESTLESS = "the camera does not hold still and cannot be followed; nothing is reported while it moves like this"


class Camera:
    """The maps between picture, canvas and scene, in processed pixels.

    motion  (2, 3) from canvas to picture; the identity while the camera is still
    place   (2, 3) from canvas to scene (the first picture)
    moves   whether pictures must be resampled on the canvas
    fits    whether the last registration succeeded
    lost_s  s since registration was lost; 0 while it succeeds
    """

    STATE = (
        *("motion", "place", "moves", "fits", "lost_s"),
        *("_points", "_chosen_s", "_still", "_still_s", "_tried_s", "_time_s", "_trusted_s", "_lately_s"),
        *("_away", "_strange", "_told"),
    )

    def __init__(self, still_s: float) -> None:
        """still_s: a camera counts as still after so long without motion."""
        self._rest_s = still_s
        self.motion = self.place = affine.IDENTITY
        self.moves = False
        self.fits = True
        self.lost_s = 0.0
        self._points = no_points()
        self._chosen_s = -np.inf
        self._still = affine.IDENTITY  # motion and time of the last rest
        self._still_s = 0.0
        self._tried_s = -np.inf  # last search from rest
        self._time_s = 0.0
        self._trusted_s = -np.inf  # when it can be trusted again
        self._lately_s = 0.0  # for how long it was lost lately
        self._away = False  # whether it looks elsewhere now
        self._strange = False  # whether the last search found nothing of the scene
        self._told: tuple[str, ...] = ()

    @property
    def trusted(self) -> bool:
        """Whether registration has succeeded for long enough."""
        return self._time_s >= self._trusted_s

    @property
    def at_home(self) -> bool:
        """Whether canvas, scene and picture have the same coordinates, as until the first motion."""
        return not self.moves and affine.is_identity(self.place)

    def on_canvas(self, box: Floats, step: int) -> Floats:
        """Boxes (K, 4) of the scene [source px] on the canvas [processed px]."""
        if self.at_home:
            return box / step
        return affine.boxes(affine.inverse(affine.rescaled(self.place, float(step))), box) / step

    def restart(self) -> None:
        """The last picture becomes the scene; after a change of view, with new coordinates.

        If registration was lost again and again, as on snow flakes, points are chosen once the scene has been learnt.
        """
        self.place = affine.IDENTITY if self._away else affine.after(self.place, affine.inverse(self.motion))
        self.motion = affine.IDENTITY
        self.moves = self._away = False
        self.lost_s = 0.0
        self._points = no_points()
        self._chosen_s = -np.inf
        if self._lately_s > _RESTLESS_S:
            self._chosen_s, self._trusted_s = self._time_s, self._time_s + _CHOSEN_S + _HOLD_S

    def follow(self, luma: Image, scene: Scene, known: Floats, time_s: float) -> Scene:
        """Register the picture (h, w) with the scene; returns the scene, on another canvas if necessary.

        known  (K, 4) boxes of vehicles expected here, on the canvas
        """
        if self._points.start[1] < FEWEST and time_s - self._chosen_s > _CHOSEN_S:
            self._choose(scene, time_s)
        if not self.moves and self._points.start[1] < FEWEST:  # too few points
            self.fits, self.lost_s, self._time_s = False, 0.0, time_s
            return scene
        scene = (self._track if self.moves else self._watch)(luma, scene, known, time_s)
        self._notice_loss(luma, time_s)
        return scene

    def warnings(self) -> tuple[str, ...]:
        """New warnings for the user."""
        if not self._away and self._lately_s < _RESTLESS_S:
            return ()
        due = [text for text, holds in ((_MOVED_AWAY, self._away), (_RESTLESS, self._lately_s > _RESTLESS_S)) if holds]
        new = tuple(text for text in due if text not in self._told)
        self._told += new
        return new

    def _notice_loss(self, luma: Image, time_s: float) -> None:
        """Note lost registration or too large a motion; the camera is trusted again once it holds still."""
        h, w = luma.shape
        dt, self._time_s = min(time_s - self._time_s, 1.0), time_s
        if self.moves:
            moved = affine.displacement(affine.after(self.motion, affine.inverse(self.place)), w, h, affine.IDENTITY)
            self._away = moved > _LARGEST * max(h, w)
        lost = self._away or (not self.fits and (self.moves or self._strange or not self.trusted))
        self.lost_s = self.lost_s + dt if lost else 0.0
        if self.lost_s > _HOLD_S:
            self._trusted_s = time_s + _HOLD_S
        self._lately_s = self._lately_s * math.exp(-dt / _LATELY_S) + dt * lost

    def _watch(self, luma: Image, scene: Scene, known: Floats, time_s: float) -> Scene:
        """Check a still camera for motion, with few points."""
        some = _free(self._points, scene.covered_s, known, self._points.start[1], _EVERY)
        fit = align([luma], self._points, some, affine.IDENTITY, _EVERY)
        self.fits = fit.share > _GOOD or edges_seen(luma, self._points) > _THERE
        moved = self._off(fit, luma) > _LEAST_PX
        if (moved or not self.fits) and time_s - self._tried_s > _TRY_S:
            self._tried_s = time_s
            fit = self._search(luma, scene, known)
            if self._begins(fit, luma, scene, known):
                self.moves = self.fits = True
                self._still_s = time_s
                return self._moved(luma, scene, fit, time_s)
            self.fits = self.fits or fit.share > _GOOD
            self._strange = fit.share < _STRANGE
        if time_s - self._chosen_s > _HELD_S:
            self._check_drift(luma, scene, known, time_s)
        return scene

    def _begins(self, fit: Fit, luma: Image, scene: Scene, known: Floats) -> bool:
        """Whether a still camera has begun to move like this."""
        if fit.share <= _GOOD or self._off(fit, luma) <= _LEAST_PX:
            return False
        free = _free(self._points, scene.covered_s, known, self._points.start[1], 1)
        return agreement(luma, self._points, free, fit.motion) > _AGREED

    def _check_drift(self, luma: Image, scene: Scene, known: Floats, time_s: float) -> None:
        """Check for slow drift, which the scene learns but the points do not."""
        free = _free(self._points, scene.covered_s, known, self._points.start[1], 1)
        fit = align([luma], self._points, free, affine.IDENTITY)
        drifted = fit.share > _GOOD and self._off(fit, luma) > _DRIFT_PX
        if drifted:
            self.place = affine.after(self.place, affine.inverse(fit.motion))
        if drifted or fit.share < _FRESH:
            self._choose(scene, time_s)
        self._chosen_s = time_s

    def _track(self, luma: Image, scene: Scene, known: Floats, time_s: float) -> Scene:
        """Register the picture of a moving camera."""
        fit = self._search(luma, scene, known)
        self.fits = fit.share > _GOOD
        if self.fits:
            scene = self._moved(luma, scene, fit, time_s)
        if time_s - self._chosen_s > _CHOSEN_S:
            self._choose(scene, time_s)
        if self.fits and time_s - self._still_s > self._rest_s:
            scene = settled(scene, self.motion, (luma.shape[0], luma.shape[1]))
            self.restart()
            self._choose(scene, time_s)
        return scene

    def _search(self, luma: Image, scene: Scene, known: Floats) -> Fit:
        """The best fit, from the last motion or from phase correlation."""
        free = _free(self._points, scene.covered_s, known, len(self._points.x), 1)
        pictures = pyramid(luma, len(CELLS))
        fit = self._sane(align(pictures[:2], self._points, free, self.motion), luma)
        if fit.share > _SURE:
            return fit
        starts = (self.motion, leap(scene.luma, luma, self.motion))
        fits = (self._sane(align(pictures, self._points, free, start), luma) for start in starts)
        return max(fit, *fits, key=lambda found: found.share)

    def _moved(self, luma: Image, scene: Scene, fit: Fit, time_s: float) -> Scene:
        """Accept a fit; returns the scene, on another canvas if necessary."""
        self.motion = fit.motion
        h, w = luma.shape
        cut = fitting(scene, fit.motion, (h, w))
        if cut is not None:
            left, top = cut[:2]
            scene = recut(scene, *cut)
            self._points = shifted(self._points, -left, -top)
            begin = affine.shift(left, top)
            self.motion, self.place, self._still = (
                affine.after(each, begin) for each in (self.motion, self.place, self._still)
            )
        if affine.displacement(self.motion, w, h, self._still) > _STILL_PX:
            self._still, self._still_s = self.motion, time_s
        return scene

    def _off(self, fit: Fit, luma: Image) -> float:
        return affine.displacement(fit.motion, luma.shape[1], luma.shape[0], affine.IDENTITY)

    def _sane(self, fit: Fit, luma: Image) -> Fit:
        """The fit, with share 0 if the motion is implausible."""
        h, w = luma.shape
        jump = affine.displacement(fit.motion, w, h, self.motion)
        return fit if jump < _LARGEST * max(h, w) else fit._replace(share=0.0)

    def _choose(self, scene: Scene, time_s: float) -> None:
        self._points = choose(scene)
        self._chosen_s = time_s


@kernel
def _free(points: Points, covered_s: Levels, box: Floats, end: int, every: int) -> Mask:
    """(N,) points outside the boxes (K, 4) that were free when last seen; of every n-th point up to `end`."""
    h, w = covered_s.shape
    free = np.zeros(len(points.x), np.bool_)
    for k in range(0, end, every):
        x, y = points.x[k], points.y[k]
        i, j = int(x + np.float32(0.5)), int(y + np.float32(0.5))
        free[k] = 0 <= i < w and 0 <= j < h and covered_s[j, i] == 0
        for left, top, width, height in box:
            free[k] &= not (left <= x <= left + width and top <= y <= top + height)
    return free

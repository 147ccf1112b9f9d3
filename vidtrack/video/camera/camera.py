"""The camera's motion: each picture is laid on the learnt scene, cheaply while it stands still."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats, Mask
from vidtrack.compiled import kernel
from vidtrack.video.background.scene import Levels, Scene
from vidtrack.video.camera.alignment import FEWEST, Fit, align, leap, pyramid
from vidtrack.video.camera.canvas import fitting, recut, settled
from vidtrack.video.camera.points import CELLS, Points, choose, no_points, shifted
from vidtrack.video.frame import Image

_GOOD = 0.5  # share of the points that fit
_STRANGE = 0.3  # less is another view, and no vehicle before the camera
_SURE = 0.65  # the same where the camera is sought close to where it was only
_LEAST_PX = 0.75  # that a corner of the picture is off, before it is laid on the scene
_EVERY = 7  # of the points at full size are enough to watch a camera that stands
_CHOSEN_S, _HELD_S = 1.0, 10.0  # points are chosen anew that often while the camera moves, and while it stands
_TRY_S = 0.3  # between two searches that find nothing
_FRESH = 0.8  # share of the points that fit, as long as they are those of this hour
_DRIFT_PX = 0.3  # a camera that has moved so much while it was taken for still has drifted, and the scene with it
_STILL_PX = 0.5
_HOLD_S = 0.5  # a camera that was lost for longer must be followed, or stand, for so long before it is trusted
_LATELY_S, _RESTLESS_S = 10.0, 3.0  # one that was lost for so many of the last seconds never holds still
_LARGEST = 0.25  # share of the picture's longer side by which it may be off; farther, the view is another


_MOVED_AWAY = (
    "the camera has moved by more than a quarter of the picture; nothing is reported until it stands still, "
    "and tracks and counting lines begin anew where it looks then"
)
_RESTLESS = "the camera does not hold still and cannot be followed; nothing is reported while it moves like this"


class Camera:
    """Where the picture is on the canvas, and the canvas in the scene; all in processed pixels.

    motion  (2, 3) from canvas to picture; the identity while the camera stands
    place   (2, 3) from canvas to scene, the first picture
    moves   whether the picture has to be laid on the canvas
    fits    whether the last picture could be
    lost_s  s for which nobody has known where the camera looks; 0 while it is known
    """

    STATE = (
        *("motion", "place", "moves", "fits", "lost_s"),
        *("_points", "_chosen_s", "_still", "_still_s", "_tried_s", "_time_s", "_trusted_s", "_lately_s"),
        *("_away", "_strange", "_told"),
    )

    def __init__(self, still_s: float) -> None:
        """still_s: a camera that has stood still for so long is only watched."""
        self._rest_s = still_s
        self.motion = self.place = affine.IDENTITY.copy()
        self.moves = False
        self.fits = True
        self.lost_s = 0.0
        self._points = no_points()
        self._chosen_s = -np.inf
        self._still = affine.IDENTITY.copy()  # where the camera last came to rest, and when
        self._still_s = 0.0
        self._tried_s = -np.inf  # last search without success
        self._time_s = 0.0
        self._trusted_s = -np.inf  # when it can be trusted again
        self._lately_s = 0.0  # for how long it was lost lately
        self._away = False  # whether it looks elsewhere now
        self._strange = False  # whether the last search found nothing of the scene
        self._told: tuple[str, ...] = ()

    @property
    def trusted(self) -> bool:
        """Whether it has been known for a while where the camera looks."""
        return self._time_s >= self._trusted_s

    @property
    def at_home(self) -> bool:
        """Whether canvas, scene and picture are the same, as they are until the camera moves."""
        return np.array_equal(self.place, affine.IDENTITY) and not self.moves

    def on_canvas(self, box: Floats, step: int) -> Floats:
        """Boxes (K, 4) of the scene [source px] on the canvas [processed px]."""
        return (box if self.at_home else affine.boxes(affine.inverse(affine.rescaled(self.place, step)), box)) / step

    def restart(self) -> None:
        """The last picture is the scene now; of another view, it is a scene of its own."""
        self.place = affine.IDENTITY.copy() if self._away else affine.after(self.place, affine.inverse(self.motion))
        self.motion = affine.IDENTITY.copy()
        self.moves = self._away = False
        self.lost_s = 0.0
        self._points = no_points()
        self._chosen_s = -np.inf

    def follow(self, luma: Image, scene: Scene, known: Floats, time_s: float) -> Scene:
        """Find out how the picture (h, w) lies on the scene; returns the scene, on another canvas where it must be.

        known  (K, 4) boxes of vehicles expected here, on the canvas
        """
        if self._points.start[1] < FEWEST and time_s - self._chosen_s > _CHOSEN_S:
            self._choose(scene, time_s)
        if not self.moves and self._points.start[1] < FEWEST:  # nothing to hold on to
            self.fits, self.lost_s, self._time_s = False, 0.0, time_s
            return scene
        scene = (self._track if self.moves else self._watch)(luma, scene, known, time_s)
        self._notice_loss(luma, time_s)
        return scene

    def warnings(self) -> tuple[str, ...]:
        """What the user should know and was not told yet."""
        if not self._away and self._lately_s < _RESTLESS_S:
            return ()
        due = [text for text, holds in ((_MOVED_AWAY, self._away), (_RESTLESS, self._lately_s > _RESTLESS_S)) if holds]
        new = tuple(text for text in due if text not in self._told)
        self._told += new
        return new

    def _notice_loss(self, luma: Image, time_s: float) -> None:
        """A camera that moves nobody knows where, or too far, is lost, and not trusted until it has held still."""
        h, w = luma.shape
        dt, self._time_s = min(time_s - self._time_s, 1.0), time_s
        if self.moves:
            moved = affine.displacement(affine.after(self.motion, affine.inverse(self.place)), w, h)
            self._away = moved > _LARGEST * max(h, w)
        lost = self._away or (not self.fits and (self.moves or self._strange or not self.trusted))
        self.lost_s = self.lost_s + dt if lost else 0.0
        if self.lost_s > _HOLD_S:
            self._trusted_s = time_s + _HOLD_S
        self._lately_s = self._lately_s * math.exp(-dt / _LATELY_S) + dt * lost

    def _watch(self, luma: Image, scene: Scene, known: Floats, time_s: float) -> Scene:
        """Is the camera where it was? A few points tell."""
        some = _free(self._points, scene.covered_s, known, self._points.start[1], _EVERY)
        fit = align([luma], self._points, some, affine.IDENTITY, _EVERY)
        self.fits = fit.share > _GOOD
        moved = self._off(fit, luma) > _LEAST_PX
        if (moved or not self.fits) and time_s - self._tried_s > _TRY_S:
            fit = self._search(luma, scene, known)
            self.fits = fit.share > _GOOD
            if self.fits and self._off(fit, luma) > _LEAST_PX:
                self.moves = True
                self._still_s = time_s
                return self._moved(luma, scene, fit, time_s)
            if not self.fits:
                self._tried_s, self._strange = time_s, fit.share < _STRANGE
        if time_s - self._chosen_s > _HELD_S:
            self._check_drift(luma, scene, known, time_s)
        return scene

    def _check_drift(self, luma: Image, scene: Scene, known: Floats, time_s: float) -> None:
        """Has the scene, which learns, crept along with the camera? The points have not."""
        free = _free(self._points, scene.covered_s, known, self._points.start[1], 1)
        fit = align([luma], self._points, free, affine.IDENTITY)
        drifted = fit.share > _GOOD and self._off(fit, luma) > _DRIFT_PX
        if drifted:
            self.place = affine.after(self.place, affine.inverse(fit.motion))
        if drifted or fit.share < _FRESH:
            self._choose(scene, time_s)
        self._chosen_s = time_s

    def _track(self, luma: Image, scene: Scene, known: Floats, time_s: float) -> Scene:
        """Where has the camera moved to?"""
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
        """The best fit from the last motion on, or from where phase correlation sees the picture."""
        free = _free(self._points, scene.covered_s, known, len(self._points.x), 1)
        pictures = pyramid(luma, len(CELLS))
        fit = self._sane(align(pictures[:2], self._points, free, self.motion), luma)
        if fit.share > _SURE:
            return fit
        starts = (self.motion, leap(scene.luma, luma, self.motion))
        fits = (self._sane(align(pictures, self._points, free, start), luma) for start in starts)
        return max(fit, *fits, key=lambda found: found.share)

    def _moved(self, luma: Image, scene: Scene, fit: Fit, time_s: float) -> Scene:
        """Take over a fit."""
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
        return affine.displacement(fit.motion, luma.shape[1], luma.shape[0])

    def _sane(self, fit: Fit, luma: Image) -> Fit:
        """The fit, of no share if no camera jumps like that."""
        h, w = luma.shape
        jump = affine.displacement(fit.motion, w, h, self.motion)
        return fit if jump < _LARGEST * max(h, w) else fit._replace(share=0.0)

    def _choose(self, scene: Scene, time_s: float) -> None:
        self._points = choose(scene)
        self._chosen_s = time_s


@kernel
def _free(points: Points, covered_s: Levels, box: Floats, end: int, every: int) -> Mask:
    """(N,) points that nothing covered when last seen, and none of the boxes (K, 4) covers; only every so many'th up
    to the end is looked at.
    """
    h, w = covered_s.shape
    free = np.zeros(len(points.x), np.bool_)
    for k in range(0, end, every):
        x, y = points.x[k], points.y[k]
        i, j = int(x + np.float32(0.5)), int(y + np.float32(0.5))
        free[k] = 0 <= i < w and 0 <= j < h and covered_s[j, i] == 0
        for left, top, width, height in box:
            free[k] &= not (left <= x <= left + width and top <= y <= top + height)
    return free

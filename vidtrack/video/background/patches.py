"""Patches of the first scene that are taken from pictures in which the road is free there.

Where vehicles queue, a scene that is learnt from a few seconds contains some of them. Background initialisation by
patches that continue what is known around them (after Colombari and Fusiello 2010) finds the road between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import FRESH_NOISE, Scene
from vidtrack.video.frame import Image

_SIDE = 8  # px of a patch
_ALIKE = 15  # grey levels, of luminance and both chromas together, within which pixels are the same
_HIDDEN = 0.5  # share of the pictures that do not show the scene, above which a patch is doubted
_MOST = 0.3  # share of the patches, above which the light or the view has changed, not the traffic; it bounds the time
_BESIDE = 0.2  # share of the known patches around that a picture may hide, and still show the road between them
_ELSE = 0.5  # share of a picture that differs, above which it is of another light or view
_PICTURES = 2  # that must show a patch alike
_APART = 3  # px over which steps are taken
_SIDES = ((-1, 0), (1, 0), (0, -1), (0, 1))
_AROUND = (*_SIDES, (-1, -1), (-1, 1), (1, -1), (1, 1))

Place = tuple[int, int]
Planes = NDArray[np.int16]


class Patch(NamedTuple):
    """roughness  mean step of brightness in it and over its border; planes  (c, 8, 8) what it shows"""

    roughness: float
    planes: Planes


def patched(scene: Scene, pictures: Sequence[Picture]) -> Scene:
    """The scene of a standing camera, with patches of its pictures where most of them do not show it.

    Of the pictures that show the scene around a patch the one is looked for that is smoothest there, with its border to
    what is known. If more pictures are like it than like the scene, their median is taken. What is found is known for
    the patches beside it; the smoothest come first.

    pictures  of the size of the scene, and in its light
    """
    work = _Patchwork(scene, pictures)
    if work.known.mean() < 1 - _MOST:
        return scene
    best = {place: work.best(place) for place in work.doubted()}
    waiting = [(patch.roughness, place) for place, patch in best.items() if patch is not None]
    heapify(waiting)
    while waiting:
        roughness, place = heappop(waiting)
        patch = best[place]
        if work.known[place] or patch is None or patch.roughness != roughness:
            continue  # looked at again since then
        work.put(place, patch.planes)
        for beside in work.around(place):
            if not work.known[beside]:
                best[beside] = again = work.best(beside)
                if again is not None:
                    heappush(waiting, (again.roughness, beside))
    return work.scene()


class _Patchwork:
    """The scene in patches, and the pictures from which they are taken.

    known   (i, j) where the scene is right
    hidden  (i, j, T) share of a patch that a picture does not show as the scene has it
    """

    def __init__(self, scene: Scene, pictures: Sequence[Picture]) -> None:
        self._scene = scene
        now = _whole(Picture(*(np.rint(plane).astype(np.uint8) for plane in scene[:3])))
        self._now = _planes(now).astype(np.int16)
        differs = [(picture, _unlike(picture, now)) for picture in map(_whole, pictures)]
        like = [(picture, unlike) for picture, unlike in differs if cv2.countNonZero(unlike) <= _ELSE * unlike.size]
        self._pictures = [picture for picture, _ in like]
        rows, columns = (side // _SIDE for side in now.luma.shape)
        self.hidden = np.empty((rows, columns, len(like)), np.float32)
        unseen = np.zeros(now.luma.shape, np.int16)
        for t, (_, unlike) in enumerate(like):
            unseen += unlike & 1
            self.hidden[..., t] = cv2.resize(unlike, (columns, rows), interpolation=cv2.INTER_AREA) / np.float32(255)
        often = unseen.reshape(rows, _SIDE, columns, _SIDE).max((1, 3))
        self.known = often <= _HIDDEN * len(like)
        self._shown: dict[Place, Image] = {}
        self._changed = np.zeros(now.luma.shape, bool)

    def doubted(self) -> list[Place]:
        """The patches that are not known."""
        return [(i, j) for i, j in np.argwhere(~self.known).tolist()]

    def around(self, place: Place, ways: Sequence[Place] = _AROUND) -> list[Place]:
        """The patches beside this one."""
        beside = ((place[0] + i, place[1] + j) for i, j in ways)
        rows, columns = self.known.shape
        return [(i, j) for i, j in beside if 0 <= i < rows and 0 <= j < columns]

    def best(self, place: Place) -> Patch | None:
        """The best patch; None without one that is sure."""
        known = [beside for beside in self.around(place) if self.known[beside]]
        if not any(beside in known for beside in self.around(place, _SIDES)):
            return None
        free = self.hidden[tuple(np.transpose(known))].mean(0) <= _BESIDE
        if free.sum() < _PICTURES:
            return None
        shown, now = self._of_pictures(place)[free], self._now[:, *_pixels(place)]
        roughness = self._roughness(place, shown)
        least, smoothest = float(roughness.min()), shown[roughness.argmin()]
        alike, same = (_distance(shown, patch).mean((1, 2)) < _ALIKE / 2 for patch in (smoothest, now))
        if alike.sum() < _PICTURES:
            return None
        if _distance(smoothest, now).mean() < _ALIKE / 2:
            return Patch(least, now)
        return Patch(least, np.median(shown[alike], 0).astype(np.int16)) if alike.sum() > same.sum() else None

    def put(self, place: Place, patch: Planes) -> None:
        """Take a patch (c, 8, 8) for the scene; it is known then."""
        rows, columns = _pixels(place)
        self._changed[rows, columns] = (patch != self._now[:, rows, columns]).any()
        self._now[:, rows, columns] = patch
        self.hidden[place] = (_distance(self._of_pictures(place), patch) > _ALIKE).mean((1, 2))
        self.known[place] = True
        del self._shown[place]

    def scene(self) -> Scene:
        """The scene with the patches that were put."""
        scene = Scene(*(plane.copy() for plane in self._scene))
        h, w = scene.luma.shape
        y, x = np.nonzero(self._changed[:h, :w])
        scene.luma[y, x], scene.noise[y, x] = self._now[0, y, x], FRESH_NOISE
        for plane, now in zip((scene.cb, scene.cr), self._now[1:], strict=False):
            plane[y // 2, x // 2] = now[y, x]
        return scene

    def _of_pictures(self, place: Place) -> Planes:
        """(T, c, 8, 8) what the pictures show there."""
        if place not in self._shown:
            rows, columns = _pixels(place)
            half = slice(rows.start // 2, rows.stop // 2), slice(columns.start // 2, columns.stop // 2)
            planes = zip(((rows, columns), half, half), zip(*self._pictures, strict=True), strict=True)
            self._shown[place] = _planes(Picture(*(np.stack([plane[part] for plane in of]) for part, of in planes)))
        return self._shown[place].astype(np.int16)

    def _roughness(self, place: Place, patch: Planes) -> NDArray[np.float64]:
        """(n,) mean step of brightness in patches (n, c, 8, 8), and over their border to what is known."""
        down = _distance(patch[..., _APART:, :], patch[..., :-_APART, :])
        right = _distance(patch[..., _APART:], patch[..., :-_APART])
        top, left = place[0] * _SIDE, place[1] * _SIDE
        borders = []
        for i, j in self.around(place, _SIDES):
            if not self.known[i, j]:
                continue
            if j == place[1]:
                inner, outer = (1, top - 2) if i < place[0] else (-2, top + _SIDE + 1)
                border = _distance(patch[..., inner, :], self._now[:, outer, left : left + _SIDE], axis=1)
            else:
                inner, outer = (1, left - 2) if j < place[1] else (-2, left + _SIDE + 1)
                border = _distance(patch[..., inner], self._now[:, top : top + _SIDE, outer], axis=1)
            borders.append(border.mean(1))
        return np.asarray((down.mean((1, 2)) + right.mean((1, 2))) / 2 + np.mean(borders, 0))


def _pixels(place: Place) -> tuple[slice, slice]:
    """Rows and columns of a patch."""
    top, left = place[0] * _SIDE, place[1] * _SIDE
    return slice(top, top + _SIDE), slice(left, left + _SIDE)


def _whole(picture: Picture) -> Picture:
    """The picture with its last rows and columns repeated up to whole patches."""
    h, w = picture.luma.shape
    down, right = -h % _SIDE, -w % _SIDE
    if down == right == 0:
        return picture
    luma = np.pad(picture.luma, ((0, down), (0, right)), "edge")
    if not picture.cb.size:
        return picture._replace(luma=luma)
    half = ((0, (h + down) // 2 - len(picture.cb)), (0, (w + right) // 2 - picture.cb.shape[1]))
    return Picture(luma, *(np.pad(plane, half, "edge") for plane in picture[1:]))


def _planes(picture: Picture) -> Image:
    """(..., c, h, w) luminance, and both chromas if there are any, of pictures (..., h, w)."""
    h, w = picture.luma.shape[-2:]
    chroma = [plane.repeat(2, -2).repeat(2, -1)[..., :h, :w] for plane in picture[1:] if plane.size]
    return np.stack([picture.luma, *chroma], -3)


def _distance(a: Planes, b: Planes, axis: int = -3) -> Planes:
    """The sum of the differences of planes along their axis."""
    return np.abs(a - b).sum(axis, dtype=np.int16)


def _unlike(picture: Picture, other: Picture) -> Image:
    """(h, w) 255 where two pictures differ, else 0."""
    distance = cv2.absdiff(picture.luma, other.luma)
    if picture.cb.size:
        chroma = cv2.add(cv2.absdiff(picture.cb, other.cb), cv2.absdiff(picture.cr, other.cr))
        distance = cv2.add(distance, cv2.resize(chroma, distance.shape[::-1], interpolation=cv2.INTER_NEAREST))
    return np.asarray(cv2.threshold(distance, _ALIKE, 255, cv2.THRESH_BINARY)[1])

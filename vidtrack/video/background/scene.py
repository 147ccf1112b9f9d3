"""The scene without traffic, learnt as running averages of luminance, its noise, and chroma."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.picture import Picture
from vidtrack.video.frame import Image
from vidtrack.video.runs import Runs

Levels = NDArray[np.float32]

FRESH_NOISE = np.float32(1.5)  # grey levels assumed before any were measured
SHADOW, BEAM = np.uint8(2), np.uint8(3)  # values of a hit where the scene is seen in less light, or more
RELIT = np.uint8(2)  # the bit that both have
NEVER = np.float32(-1000)  # unlike any luminance
UNKNOWN = np.float32(1e4)  # noise of what was never in the picture
FREE = np.uint8(0)  # value of what is covered by nothing
UNSEEN = np.uint8(1)  # value of what is covered by nothing, but outside the picture
_SURPRISE = np.float32(4)  # a deviation counts as at most this many times the noise: one bird is not noise
_NONE, _ALL = np.float32(0), np.float32(1)
_STEADY = np.float32(10)  # grey levels; what covers the scene is the same as long as it changes by less
_QUIET = np.float32(1)  # grey levels; noise below it limits deviations as if it were this


class Scene(NamedTuple):
    """The state of each pixel, float32 (h, w), chroma at half size.

    luma, cb, cr  running averages
    noise         running average of |Y - luma|
    covered_s     seconds since the pixel was last free
    former        luma before the last adoption of the picture; NEVER without one
    cover         running average of the luminance while covered
    steady_s      seconds for which `cover` has hardly changed
    """

    luma: Levels
    cb: Levels
    cr: Levels
    noise: Levels
    covered_s: Levels
    former: Levels
    cover: Levels
    steady_s: Levels


def no_scene() -> Scene:
    """The scene before the first frame."""
    return Scene(*np.empty((8, 0, 0), np.float32))


def start(picture: Picture) -> Scene:
    """The scene from the first frame; an average over seconds would contain smeared traffic."""
    luma, cb, cr = (plane.astype(np.float32) for plane in picture)
    shape = luma.shape
    return uncovered(Scene(luma, cb, cr, np.full(shape, FRESH_NOISE), *np.empty((4, *shape), np.float32)))


def uncovered(scene: Scene) -> Scene:
    """The scene without memory of what covered it."""
    covered_s, cover, steady_s = np.zeros((3, *scene.luma.shape), np.float32)
    never = np.full(scene.luma.shape, NEVER)
    return scene._replace(covered_s=covered_s, former=never, cover=cover, steady_s=steady_s)


@kernel
def learn(
    picture: Picture,
    scene: Scene,
    covered: Image,
    hit: Image,
    weight: np.float32,
    noise_weight: np.float32,
    dt: np.float32,
) -> None:  # fmt: skip
    """Update the running averages where covered (h, w) uint8 is 0 and hit is not RELIT; elsewhere count the seconds.

    Where covered is UNSEEN nothing changes.
    luma += weight (Y - luma), chroma alike, noise += noise_weight (|Y - luma| - noise).
    """
    h, w = covered.shape
    taken = np.zeros(w + w % 2, np.uint8)  # not 0: not learnt
    for y in range(h):
        for x in range(w):  # without a choice it is vectorised
            taken[x] = covered[y, x] | (hit[y, x] & RELIT) * np.uint8(covered[y, x] != UNSEEN)
        most = FREE
        for x in range(w):
            most = max(most, taken[x])
        for x in range(w):
            noise = scene.noise[y, x]
            d = np.float32(picture.luma[y, x]) - scene.luma[y, x]
            deviation = min(abs(d), _SURPRISE * max(noise, _QUIET))
            scene.luma[y, x] += (weight if taken[x] == 0 else _NONE) * d
            scene.noise[y, x] = noise + (noise_weight if taken[x] == 0 else _NONE) * (deviation - noise)
        if most == FREE:
            scene.covered_s[y], scene.steady_s[y] = _NONE, _NONE
        else:
            _count(picture.luma[y], scene, y, taken, weight, dt)
        if len(picture.cb) > 0 and y % 2 == 0:
            taken[-1] = taken[w - 1]  # beyond the last pixel of an odd row
            for x in range(len(taken) // 2):  # four pixels share one of chroma; the upper two decide
                share = weight if taken[2 * x] | taken[2 * x + 1] == 0 else _NONE
                scene.cb[y // 2, x] += share * (np.float32(picture.cb[y // 2, x]) - scene.cb[y // 2, x])
                scene.cr[y // 2, x] += share * (np.float32(picture.cr[y // 2, x]) - scene.cr[y // 2, x])


@inlined
def _count(luma: Image, scene: Scene, y: int, taken: Image, weight: np.float32, dt: np.float32) -> None:
    """Count the seconds of cover in row y, where taken (w,) is not 0, and average the cover."""
    for x in range(len(luma)):
        passed = _NONE if taken[x] == UNSEEN else dt
        scene.covered_s[y, x] = _NONE if taken[x] == 0 else scene.covered_s[y, x] + passed
    for x in range(len(luma)):
        change = np.float32(luma[x]) - scene.cover[y, x]
        steady = abs(change) < max(_STEADY, _SURPRISE * scene.noise[y, x])
        share = weight if steady else _ALL
        scene.cover[y, x] += (share if taken[x] > UNSEEN else _NONE) * change
        lasted = scene.steady_s[y, x] + dt if steady else _NONE
        known = lasted if taken[x] > UNSEEN else scene.steady_s[y, x]
        scene.steady_s[y, x] = _NONE if taken[x] == 0 else known


@kernel
def adopt(picture: Picture, scene: Scene, row: Runs, start: Runs, stop: Runs) -> None:
    """Replace the scene by the picture on the runs (row, start, stop), as in `start`."""
    for k in range(len(row)):
        for x in range(start[k], stop[k]):
            _adopt(picture, scene, row[k], x)


@kernel
def absorb(
    picture: Picture, scene: Scene, hit: Image, absorb_s: np.float32, steady_s: np.float32, shadow_s: np.float32
) -> None:
    """Replace the scene by the picture where it was covered for absorb_s, or for steady_s without change.

    steady_s, shadow_s  seconds of cover that suffice for unchanged cover, and for shadow
    """
    h, w = hit.shape
    least = min(absorb_s, steady_s, shadow_s)
    for y in range(h):
        for x in range(w):
            covered_s = scene.covered_s[y, x]
            if covered_s < least:
                continue
            steady = min(covered_s, scene.steady_s[y, x])
            if covered_s >= absorb_s or steady >= steady_s or (covered_s >= shadow_s and hit[y, x] == SHADOW):
                _adopt(picture, scene, y, x)


@kernel
def spare(covered_s: Levels, box: Floats, longest_s: np.float32) -> None:
    """Limit the seconds of cover inside boxes (K, 4) left, top, width, height to longest_s."""
    h, w = covered_s.shape
    for left, top, width, height in box:
        begin, end = np.uint64(max(int(left), 0)), np.uint64(max(min(int(left + width + 1), w), 0))
        for y in range(max(int(top), 0), max(min(int(top + height + 1), h), 0)):
            for x in range(begin, end):  # without a sign it is vectorised
                covered_s[y, x] = min(covered_s[y, x], longest_s)


@inlined
def _adopt(picture: Picture, scene: Scene, y: int, x: int) -> None:
    scene.former[y, x] = scene.luma[y, x]
    scene.luma[y, x] = picture.luma[y, x]
    scene.noise[y, x] = FRESH_NOISE
    scene.covered_s[y, x] = np.float32(0)
    if len(picture.cb) > 0:
        scene.cb[y // 2, x // 2] = picture.cb[y // 2, x // 2]
        scene.cr[y // 2, x // 2] = picture.cr[y // 2, x // 2]

"""Shadow detection: the scene darkened by one factor."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import SHADOW, Levels, Scene
from vidtrack.video.background.veil import Air
from vidtrack.video.frame import Image
from vidtrack.video.runs import CORNERS, OBJECTS, Runs, connect, find_runs, find_stretches

_LIGHTEST = np.float32(0.97)  # share of the scene's light
_GREY_SHARE = np.float32(0.05)  # share of the scene's light in place of `texture_share` where there is no colour
_CHROMA = np.float32(4)  # grey levels by which each chroma plane may miss the factor
_LEFT, _ABOVE, _RIGHT, _BELOW = np.uint8(1), np.uint8(2), np.uint8(4), np.uint8(8)
_SIDES = np.array([bin(sides).count("1") for sides in range(16)])
_AMID = 3  # sides on which the vehicle is seen from amid it
_ENCLOSED = 4  # the same from amid its edges, where nearly all of it passes for shadow
_LIT = 0.3  # share of a region that is no shadow if there is a vehicle in it
_SOFT_PX = 5  # within which the edges of a shadow, and of what is beside it, are soft
_OWN = 0.05  # share of the pixels inside connected shadow with edges of their own, from which it is a dark vehicle
_FEW = 10.0  # px; fewer are no body
_EDGE, _EDGE_NOISE = np.float32(3), np.float32(2)  # luminance differences of an edge: grey levels, and times the noise
_NEUTRAL = np.float32(128)  # chroma of grey
_ONE, _TWO = np.uint64(1), np.uint64(2)  # columns without a sign are not counted from the end: loops are vectorised
_FULL_LIGHT = np.float32(1)
_BINS = 20  # of the share of light that is left, from 0 to 1
_HARDEST, _MILDEST = 5, 13  # the bins that the sun's shadows are in: there is always light of the sky
_DARKEST = np.float32(_HARDEST / _BINS)
_STRUCTURE = np.float32(6)  # luminance differences that a shadow leaves and a body hides; fewer tell nothing
_SEEN = np.float32(0.5)  # share of the structure by which it may be missed
_FORGET_S = 60.0  # time constant with which it is forgotten how dark the shadows were
_LEAST = 2e-3  # share of the picture, times seconds, of darkened structure before it tells of the light
_PEAK = 0.07  # least share of the darkened structure that is seen in two neighbouring bins, in sunlight
_TAIL = 0.05  # least share of that peak in the bins beside it that are shadow too


class Tolerance(NamedTuple):
    """Limits of the shadow test.

    darkest        least share of the scene's light
    faintest       the same where haze spreads the light of the sky
    chroma_share   share of the scene's colour by which the chroma planes may miss the factor, beside _CHROMA
    texture        grey levels by which luminance differences may miss the factor: soft edges
    texture_share  the same as a share of the scene's light
    """

    darkest: np.float32
    faintest: np.float32
    chroma_share: np.float32
    texture: np.float32
    texture_share: np.float32


SOFT = Tolerance(np.float32(0.5), np.float32(0.9), np.float32(0), np.float32(2), np.float32(0.22))
_HARD = Tolerance(np.float32(0.5), np.float32(0.5), np.float32(0.15), np.float32(6), np.float32(0.3))


class Sunlight:
    """Learns whether the sun casts hard shadows, and their darkness, from darkened structure of the scene.

    A body hides the structure. A shadow keeps it, and all shadows of the sun are equally dark.
    """

    STATE = ("_count",)

    def __init__(self) -> None:
        self._count = np.zeros(_BINS + 1)

    def learn(self, count: Floats, pixels: int, dt: float) -> None:
        """Take the counts of `mark_shadow` in a picture of so many pixels, dt [s] after the last one."""
        self._count = self._count * math.exp(-dt / _FORGET_S) + count * dt / pixels

    @property
    def tolerance(self) -> Tolerance:
        """The limits of the shadow test in this light."""
        count: list[float] = self._count.tolist()
        shadow, darkened = count[_HARDEST:_MILDEST], count[_BINS]
        pairs = [one + other for one, other in pairwise(shadow)]
        peak = max(pairs)
        least = pairs.index(peak)
        if darkened < _LEAST or peak < _PEAK * darkened:
            return SOFT
        while least > 0 and shadow[least - 1] > _TAIL * peak:
            least -= 1
        darkest = min(_HARD.darkest, np.float32((least + _HARDEST) / _BINS))
        return _HARD._replace(darkest=darkest, faintest=darkest)


@kernel
def mark_shadow(picture: Picture, scene: Scene, air: Air, tolerance: Tolerance, hit: Image) -> Floats:
    """Set hit (h, w) uint8 from 1 to SHADOW where luminance, colour and texture are the scene's times one factor r.

    r = (Y - black) / (B - black); texture is the luminance differences over +-1 px, across and down.
    Returns (_BINS + 1,): the number of pixels, by r, in which the scene's structure is seen, and that of all in which
    there is structure and less light. Each loop over the pixels of a stretch writes one array: it is vectorised then.
    """
    w, coloured, doubled = hit.shape[1], len(picture.cb) > 0, np.uint64(len(hit))
    count, seen = np.zeros(_BINS + 1), np.empty(w, np.uint8)
    r, missed, structure = np.empty(w, np.float32), np.empty(w, np.float32), np.empty(w, np.float32)
    off, tint = np.zeros(w, np.float32), np.zeros(w, np.float32)
    half = np.empty((w + 1) // 2, np.float32)
    cb, cr = np.empty(2 * len(half), np.float32), np.empty(2 * len(half), np.float32)
    scene_cb, scene_cr = np.empty(2 * len(half), np.float32), np.empty(2 * len(half), np.float32)
    share = tolerance.texture_share if coloured else _GREY_SHARE
    fainter = tolerance.faintest - tolerance.darkest
    row, start, stop = find_stretches(hit)
    for k in range(len(row)):
        y, begin, end = np.uint64(row[k]), np.uint64(start[k]), np.uint64(stop[k])
        for x in range(begin, end):
            light = scene.luma[y, x] - air.black[y, x]
            left = np.float32(picture.luma[y, x]) - air.black[y, x]
            r[x] = left / light if (light > 0) & (hit[y, x] != 0) else _FULL_LIGHT
        _compare_texture(picture.luma, scene.luma, y, begin, end, r, missed, structure)
        if coloured:
            if doubled != y // _TWO:
                doubled = y // _TWO
                _double(picture.cb, doubled, half, cb)
                _double(picture.cr, doubled, half, cr)
                _double(scene.cb, doubled, half, scene_cb)
                _double(scene.cr, doubled, half, scene_cr)
            for x in range(begin, end):
                off[x] = max(abs(cb[x] - r[x] * scene_cb[x]), abs(cr[x] - r[x] * scene_cr[x]))
            if tolerance.chroma_share > 0:
                for x in range(begin, end):
                    tint[x] = max(abs(scene_cb[x]), abs(scene_cr[x]))
        darkened = np.int32(0)
        for x in range(begin, end):
            dark = (r[x] < _LIGHTEST) & (structure[x] > _STRUCTURE)
            darkened += np.int32(dark)
            fits = (missed[x] < _SEEN * structure[x]) & (off[x] < _CHROMA)
            seen[x] = np.uint8(dark & (r[x] >= _DARKEST) & fits)
        if darkened > 0:
            count[_BINS] += darkened
            for x in range(begin, end):
                if seen[x] != 0:
                    count[int(r[x] * _BINS)] += 1
        for x in range(begin, end):
            light = scene.luma[y, x] - air.black[y, x]
            dark = (r[x] >= tolerance.darkest + air.spread[y, x] * fainter) & (r[x] < _LIGHTEST)
            fits = off[x] < _CHROMA + tolerance.chroma_share * tint[x]
            hit[y, x] += np.uint8(dark & fits & (missed[x] < tolerance.texture + share * light))
    return count


@inlined
def _double(chroma: NDArray, y: int, half: Levels, level: Levels) -> None:
    """Row y of a plane of chroma, in grey levels from grey: one value in half (w / 2,), two in level (w,)."""
    for x in range(len(half)):
        half[x] = np.float32(chroma[y, x]) - _NEUTRAL
    for x in range(len(half)):
        level[2 * x], level[2 * x + 1] = half[x], half[x]


@inlined
def _compare_texture(
    luma: Image, scene: Levels, y: np.uint64, begin: np.uint64, end: np.uint64, r: Levels,
    missed: Levels, structure: Levels,
) -> None:  # fmt: skip
    """`_texture` of row y in the columns from begin to end: fills missed and structure (w,) from r (w,)."""
    bottom, last = np.uint64(luma.shape[0]) - _ONE, np.uint64(luma.shape[1]) - _ONE
    up, down = max(y, _ONE) - _ONE, min(y + _ONE, bottom)
    for x in range(max(begin, _ONE), min(end, last)):
        missed[x], _ = _texture(luma, scene, up, y, down, x - _ONE, x, x + _ONE, r[x])
    for x in range(max(begin, _ONE), min(end, last)):
        _, structure[x] = _texture(luma, scene, up, y, down, x - _ONE, x, x + _ONE, r[x])
    for edge in (np.uint64(0), last):  # one-sided
        before, after = max(edge, _ONE) - _ONE, min(edge + _ONE, last)
        missed[edge], structure[edge] = _texture(luma, scene, up, y, down, before, edge, after, r[edge])


@inlined
def _texture(
    luma: Image, scene: Levels, up: int, y: int, down: int, before: int, x: int, after: int, r: np.float32
) -> tuple[np.float32, np.float32]:
    """Deviation of the luminance differences, over +-1 px across and down, from the scene's times r, and the latter."""
    across, along = r * (scene[y, after] - scene[y, before]), r * (scene[down, x] - scene[up, x])
    off_across = np.float32(luma[y, after]) - np.float32(luma[y, before]) - across
    off_along = np.float32(luma[down, x]) - np.float32(luma[up, x]) - along
    return abs(off_across) + abs(off_along), abs(across) + abs(along)


@kernel
def reclaim(hit: Image) -> None:
    """Set hit (h, w) uint8 from SHADOW back to 1 where the vehicle is visible on at least three of four sides.

    Dark paint passes the shadow test, but shadow lies beside a vehicle and not within it. The vehicle is visible on a
    side if a line of hits leads to a pixel that is not shadow. A region that is nearly all shadow stays shadow: the
    rest of it is soft edges.
    """
    row, start, stop = find_runs(hit, OBJECTS)
    label, count = connect(row, start, stop, CORNERS)
    whole, lit = np.zeros((2, count))
    for k in range(len(row)):
        whole[label[k]] += stop[k] - start[k]
        lit[label[k]] += _lit(hit, row[k], start[k], stop[k])
    vehicle = np.empty(count, np.bool_)
    for i in range(count):
        vehicle[i] = lit[i] >= _LIT * whole[i]
    _fill(hit, row, start, stop, label, vehicle, _AMID)


def find_dark(picture: Picture, scene: Scene, black: Levels, hit: Image) -> None:
    """Set hit (h, w) uint8 from SHADOW back to 1 where connected shadow is a dark vehicle.

    The inside of a shadow has the scene's edges, that of a vehicle others. These are where it is visible; what has them
    on all four sides is vehicle, too.
    """
    shadow = (hit == SHADOW).view(np.uint8)
    _find_dark(picture, scene, black, shadow, hit)


@kernel
def _find_dark(picture: Picture, scene: Scene, black: Levels, shadow: Image, hit: Image) -> None:
    """The same, for the pixels of shadow (h, w)."""
    row, start, stop = find_runs(shadow, OBJECTS)
    label, count = connect(row, start, stop, CORNERS)
    inside, own = np.zeros((2, count))
    edge = np.zeros(hit.shape, np.bool_)
    for k in range(len(row)):
        y = row[k]
        for x in range(start[k], stop[k]):
            if _is_inside(shadow, y, x):
                edge[y, x] = _is_own_edge(picture.luma, scene, black[y, x], y, x)
                inside[label[k]] += 1
                own[label[k]] += edge[y, x]
    dark, found = np.empty(count, np.bool_), False
    for i in range(count):
        dark[i] = own[i] > max(_OWN * inside[i], _FEW)
        found |= dark[i]
    if not found:
        return
    for k in range(len(row)):
        if dark[label[k]]:
            for x in range(start[k], stop[k]):
                if edge[row[k], x]:
                    hit[row[k], x] = 1
    _fill(hit, row, start, stop, label, dark, _ENCLOSED)


@inlined
def _lit(hit: Image, y: int, start: int, stop: int) -> np.int32:
    """Number of pixels in a run of row y that are no shadow."""
    lit = np.int32(0)
    for x in range(start, stop):
        lit += np.int32(hit[y, x] == 1)
    return lit


@inlined
def _is_inside(shadow: Image, y: int, x: int) -> bool:
    """Whether there is shadow (h, w) on all sides and across, farther off than edges are soft."""
    h, w = shadow.shape
    up, down, left, right = y - _SOFT_PX, y + _SOFT_PX, x - _SOFT_PX, x + _SOFT_PX
    if up < 0 or down >= h or left < 0 or right >= w:
        return False
    sides = shadow[up, x] & shadow[down, x] & shadow[y, left] & shadow[y, right]
    corners = shadow[up, left] & shadow[up, right] & shadow[down, left] & shadow[down, right]
    return (sides & corners) != 0


@inlined
def _is_own_edge(luma: Image, scene: Scene, black: np.float32, y: int, x: int) -> bool:
    """Whether there is an edge that is neither the scene's nor noise."""
    r = (np.float32(luma[y, x]) - black) / (scene.luma[y, x] - black)
    missed, structure = _texture(luma, scene.luma, y - 1, y, y + 1, x - 1, x, x + 1, r)
    return missed > _EDGE + _EDGE_NOISE * scene.noise[y, x] + _SEEN * structure


@inlined
def _fill(hit: Image, row: Runs, start: Runs, stop: Runs, label: Ints, vehicle: Mask, sides: int) -> None:
    """Set hit from SHADOW to 1 between pixels with 1, in runs (R,) of the regions with a `vehicle` (N,)."""
    h = len(hit)
    side = np.zeros(hit.shape, np.uint8)
    for k in range(len(row)):
        y, seen = row[k], start[k] > 0 and hit[row[k], start[k] - 1] == 1
        for x in range(start[k], stop[k]):
            above = y > 0 and hit[y - 1, x] != 0 and (hit[y - 1, x] == 1 or side[y - 1, x] & _ABOVE != 0)
            side[y, x] = np.uint8(seen) * _LEFT | np.uint8(above) * _ABOVE
            seen |= hit[y, x] == 1
    for k in range(len(row) - 1, -1, -1):
        y, seen = row[k], stop[k] < hit.shape[1] and hit[row[k], stop[k]] == 1
        for x in range(stop[k] - 1, start[k] - 1, -1):
            below = y < h - 1 and hit[y + 1, x] != 0 and (hit[y + 1, x] == 1 or side[y + 1, x] & _BELOW != 0)
            side[y, x] |= np.uint8(seen) * _RIGHT | np.uint8(below) * _BELOW
            seen |= hit[y, x] == 1
    for k in range(len(row)):
        if not vehicle[label[k]]:
            continue
        for x in range(start[k], stop[k]):
            if hit[row[k], x] == SHADOW and _SIDES[side[row[k], x]] >= sides:
                hit[row[k], x] = 1

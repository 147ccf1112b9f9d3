"""Segmentation of the foreground into vehicles: each region is a vehicle, a part of one, or several."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.config.video import BlobSettings
from vidtrack.tracking.picture.road import Road
from vidtrack.tracking.picture.sizes import SizeField
from vidtrack.tracks import TENTATIVE, Tracks
from vidtrack.video.blobs.blobs import Blobs, measured
from vidtrack.video.blobs.fragments import links, together
from vidtrack.video.blobs.nearest import nearest_box
from vidtrack.video.blobs.necks import half_width, parts
from vidtrack.video.blobs.regions import Regions, find_regions, of_labels, patch
from vidtrack.video.foreground import Foreground, enlargement
from vidtrack.video.frame import Image

_LARGE = 1.3  # typical widths or heights from which on a region may be several vehicles
_NECK = 0.5  # half width of a neck as a share of the smaller part's
_SHALLOW = 0.85  # the same where the sizes of the parts must speak for them
_SURE = 0.15  # no size field is more certain [ln size]
_ODD = 8.0  # ln; no vehicle is less likely than this for its size: there are lorries
_ANOTHER = 3.0  # ln; that another vehicle stands so close is less likely by this
_PART, _CUT_PART = 0.26, 0.11  # share of the typical box area that is a vehicle; where the border cuts it
_WITHIN, _PIECE = 0.6, 0.2  # share of a part in a predicted box, and of what is in the box in a part: a piece of it
_COVERED = 0.4  # share of a predicted box that is filled where its vehicle is
_OPEN = 0.72  # before a typical size is known: a region that fills less of its box may be several vehicles
_EQUAL, _FULL = 0.25, 0.5  # then a part's least share of the largest part's box, and of its own box
_LEAST_PX, _LEAST_HOLLOW_PX = 60, 300  # pixels of the mask; the shape of smaller regions is the grid's
_AT_EDGE = 1.0  # px of the mask; a region this close to the picture's edge is cut by it
_YOUNG_S = 0.15  # s; younger tentative tracks divide nothing


class _Measure:
    """Maps between mask and scene, the typical vehicle sizes at each place, and that of flakes [px of the mask]."""

    def __init__(self, foreground: Foreground, road: Road) -> None:
        place = affine.IDENTITY if foreground.place is None else foreground.place
        self._to_scene = affine.after(place, enlargement(foreground.step))
        self._to_mask = affine.inverse(self._to_scene)
        self.sizes = road.sizes
        self.flake = road.flake * affine.scale(self._to_mask)
        h, w = foreground.mask.shape
        self.edges = np.array([0.0, 0.0, w, h])
        if foreground.surveyed is not None and foreground.place is not None:
            low, high = foreground.surveyed.reshape(2, 2)
            left, top, width, height = self.predicted(np.concatenate([low, high - low])[None])[0]
            self.edges = np.array([left, top, left + width, top + height])

    def typical(self, box: Ints | Floats) -> Floats:
        """(N, 2) typical width and height [px of the mask] of vehicles at boxes (N, 4) of the mask; NaN if unknown."""
        return self.sizes.typical(affine.boxes(self._to_scene, box.astype(float))) * affine.scale(self._to_mask)

    def predicted(self, box: Floats) -> Floats:
        """Boxes (K, 4) of the scene, in pixels of the mask."""
        return affine.boxes(self._to_mask, box)

    def border(self, box: Ints) -> tuple[int, int, int, int]:
        """1 for each side (left, top, right, bottom) of a box (4,) [px of the mask] at the picture's border."""
        left, top, width, height = box
        low, high = self.edges[:2] + _AT_EDGE, self.edges[2:] - _AT_EDGE
        return (left < low[0], top < low[1], left + width > high[0], top + height > high[1])


def explain(foreground: Foreground, expected: Tracks, road: Road | None, settings: BlobSettings) -> Blobs:
    """Blobs of one vehicle each, by the shapes and sizes of regions and the predicted tracks.

    expected  tracks predicted to the time of the foreground, in the scene
    """
    measure = _Measure(foreground, road or Road(1, 1))
    regions = find_regions(foreground.mask, settings.min_area_share * foreground.mask.size)
    known = expected.status != TENTATIVE
    if settings.cut:
        regions = cut_at_necks(regions, measure, measure.predicted(expected.box[known]))
    if settings.divide and measure.sizes.known:
        dividing = expected.box[known | (expected.age_s > _YOUNG_S)]
        regions = divided(regions, measure.predicted(dividing), measure)
    box, area = (each.astype(float) for each in regions.extents())
    group, count = together(
        box, area, _links(regions, foreground.weak),
        measure.predicted(expected.box[known]), measure.typical(box), measure.flake,
        settings.pieces, settings.join_overlap, settings.join_gap,
    )  # fmt: skip
    return measured(regions.joined(group, count), foreground, settings)


def _links(regions: Regions, weak: Image | None) -> Ints:
    """(R,) group of each region: regions that weak foreground (h, w) links have the same number."""
    if weak is None or regions.total < 2:  # nothing to link
        return -1 - np.arange(regions.total)
    return links(*regions, weak)


def cut_at_necks(regions: Regions, measure: _Measure, predicted: Floats) -> Regions:
    """The regions; those large enough for several vehicles are cut at their necks.

    predicted  (K, 4) boxes of confirmed tracks [px of the mask]; of several vehicles in a region none is broken
    """
    box, area = regions.extents()
    typical = measure.typical(box)
    large = _larger(box, typical)
    hollow = np.isnan(typical[:, 0]) & (area < _OPEN * box[:, 2] * box[:, 3])
    for i in (large & (area >= _LEAST_PX) | hollow & (area >= _LEAST_HOLLOW_PX)).nonzero()[0].tolist():
        border = measure.border(box[i])
        depth = half_width(patch(regions, i, box[i]), border)
        if large[i]:
            least = typical[i] * np.sqrt(_CUT_PART if any(border) else _PART)
            cut, same = _cut(depth, _NECK, least, box[i])
            if cut is None:
                cut = None if same else _cut(depth, _SHALLOW, least, box[i])[0]
                if cut is None or not _likelier(cut, box[i], typical[i], measure.sizes):
                    continue
            if _breaks(cut, predicted):
                continue
        else:
            cut, _ = _cut(depth, _NECK, np.ones(2), box[i])
            if cut is None or not _alike(cut):
                continue
        regions = regions.parted(i, cut)
    return regions


def _larger(box: Ints, typical: Floats) -> Mask:
    """(N,) boxes (N, 4) that may be of several vehicles of typical (N, 2) widths and heights; none if unknown."""
    larger = box[:, 2:] > _LARGE * typical
    return larger[:, 0] | larger[:, 1]


def _cut(depth: NDArray[np.float32], neck: float, least: Floats, box: Ints) -> tuple[Regions | None, bool]:
    """The parts of a region, None: it has one; and whether it has the same at a neck of up to _SHALLOW."""
    label, count, same = parts(depth, neck, least, _SHALLOW)
    return of_labels(label, count, box) if count > 1 else None, same


def _breaks(cut: Regions, predicted: Floats) -> bool:
    """Whether two parts are pieces of one of several vehicles with these predicted boxes (K, 4).

    Where a vehicle looks like the road, as a white lorry on a crossing, it has a neck of its own; when another one
    touches it, both together are too large for one vehicle.
    """
    (left, top), (right, bottom) = predicted[:, :2].T[..., None], (predicted[:, :2] + predicted[:, 2:]).T[..., None]
    length = np.minimum(cut.stop, right) - np.maximum(cut.start, left)
    inside = np.where((cut.row >= top) & (cut.row < bottom), np.maximum(length, 0.0), 0.0)
    common = inside @ (cut.label[:, None] == np.arange(cut.total))  # (K, parts) pixels
    filled = common.sum(axis=1)
    there = filled > _COVERED * predicted[:, 2:].prod(axis=1)
    piece = (common >= _WITHIN * cut.areas()) & (common >= _PIECE * filled[:, None])
    return bool(there.sum() > 1 and (piece[there].sum(axis=1) > 1).any())


def _likelier(cut: Regions, box: Ints, typical: Floats, sizes: SizeField) -> bool:
    """Whether vehicles of the parts' sizes are likelier than one vehicle of the size of the region's box (4,)."""
    sigma = np.maximum(sizes.spread, _SURE)

    def surprise(size: Ints) -> Floats:
        return np.minimum(((np.log(size / typical) / sigma) ** 2).sum(axis=-1) / 2, _ODD)

    return bool(surprise(cut.boxes()[:, 2:]).sum() + _ANOTHER * (cut.total - 1) < surprise(box[2:]))


def _alike(cut: Regions) -> bool:
    """Whether the parts have similar sizes and each fills its box, as vehicles do."""
    box = cut.boxes()
    whole = box[:, 2] * box[:, 3]
    return bool((whole >= _EQUAL * whole.max()).all() and (cut.areas() > _FULL * whole).all())


def divided(regions: Regions, predicted: Floats, measure: _Measure) -> Regions:
    """The regions; those too large for one vehicle are divided among the predicted boxes (K, 4) [px of the mask].

    Vehicles nose to tail have no neck between them. Each pixel is assigned to the nearest box.
    """
    box = regions.boxes()
    for i in _larger(box, measure.typical(box)).nonzero()[0].tolist():
        label, count = nearest_box(patch(regions, i, box[i]), box[i], predicted)
        if count > 1:
            regions = regions.parted(i, of_labels(label, count, box[i]))
    return regions

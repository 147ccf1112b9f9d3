"""The one explanation of every blob: is it a vehicle, a piece of one, or several?"""

from __future__ import annotations

import numpy as np

from vidtrack.config import BlobSettings
from vidtrack.scan import TENTATIVE, Floats, Ints, Tracks
from vidtrack.video.blobs import Blobs, measured
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Image
from vidtrack.video.regions import Regions, find_regions, of_labels, patch
from vidtrack.video.vehicles.fragments import together
from vidtrack.video.vehicles.nearest import nearest_box
from vidtrack.video.vehicles.necks import parts
from vidtrack.tracking.road import Road
from vidtrack.tracking.sizes import SizeField

_LARGE = 1.3  # typical widths or heights from which on a region may be several vehicles
_NECK = 0.5  # half width of a neck as a share of the smaller part's
_SHALLOW = 0.85  # the same where the sizes of the parts must speak for them
_SURE = 0.15  # no size field is more certain [ln size]
_ODD = 8.0  # ln; no vehicle is less likely than this for its size: there are lorries
_ANOTHER = 3.0  # ln; that another vehicle stands so close is less likely by this
_PART, _CUT_PART = 0.26, 0.11  # share of the typical box area that is a vehicle; where the border cuts it
_OPEN = 0.72  # before a typical size is known: a region that fills less of its box may be several vehicles
_EQUAL, _FULL = 0.25, 0.5  # then a part's least share of the largest part's box, and of its own box
_LEAST_PX = 60  # pixels of the mask; smaller regions have no shape
_YOUNG_S = 0.15  # s; younger tentative tracks divide nothing


def explain(foreground: Foreground, expected: Tracks, road: Road | None, settings: BlobSettings) -> Blobs:
    """The foreground as blobs that are one vehicle each, as far as shapes, sizes and predictions tell.

    expected  tracks predicted to the time of the foreground
    """
    step = foreground.step
    sizes = road.sizes if road else SizeField(1, 1)
    regions = find_regions(foreground.mask, settings.min_area_share * foreground.mask.size)
    known = expected.status != TENTATIVE
    vehicles = expected.box[known] / step
    dividing = expected.box[known | (expected.age_s > _YOUNG_S)] / step
    if settings.cut:
        regions = cut_at_necks(regions, sizes, step, foreground.mask.shape)
    if settings.divide and sizes.known:
        regions = divided(regions, dividing, sizes, step)
    box = regions.boxes().astype(float)
    group, count = together(
        box, regions.areas().astype(float), vehicles, sizes.typical(box * step) / step,
        settings.join_overlap, settings.join_gap,
    )  # fmt: skip
    return measured(regions.joined(group, count), foreground, settings)


def cut_at_necks(regions: Regions, sizes: SizeField, step: int, shape: tuple[int, ...]) -> Regions:
    """The regions, those cut that are large enough for several vehicles and have necks between them."""
    box, area = regions.boxes(), regions.areas()
    typical = sizes.typical(box.astype(float) * step) / step
    large = (box[:, 2:] > _LARGE * typical).any(axis=1)
    hollow = np.isnan(typical[:, 0]) & (area < _OPEN * box[:, 2] * box[:, 3])
    for i in np.flatnonzero((large | hollow) & (area >= _LEAST_PX)):
        left, top, width, height = box[i]
        border = (left == 0, top == 0, left + width == shape[1], top + height == shape[0])
        inside = patch(regions, i, box[i])
        if large[i]:
            least = typical[i] * np.sqrt(_CUT_PART if any(border) else _PART)
            cut = _cut(inside, border, _NECK, least, box[i])
            if cut.count < 2:
                cut = _cut(inside, border, _SHALLOW, least, box[i])
                if not _likelier(cut, box[i], typical[i], sizes):
                    continue
        else:
            cut = _cut(inside, border, _NECK, np.ones(2), box[i])
            if not _alike(cut):
                continue
        regions = regions.parted(i, cut)
    return regions


def _cut(inside: Image, border: tuple[int, int, int, int], neck: float, least: Floats, box: Ints) -> Regions:
    label, count = parts(inside, border, neck, least)
    return of_labels(label, count, box)


def _likelier(cut: Regions, box: Ints, typical: Floats, sizes: SizeField) -> bool:
    """Whether vehicles of the parts' sizes explain a region better than one vehicle of the size of its box (4,)."""
    sigma = np.maximum(sizes.spread, _SURE)

    def surprise(size: Floats) -> Floats:
        return np.minimum(((np.log(size / typical) / sigma) ** 2).sum(axis=-1) / 2, _ODD)

    return bool(surprise(cut.boxes()[:, 2:]).sum() + _ANOTHER * (cut.count - 1) < surprise(box[2:]))


def _alike(cut: Regions) -> bool:
    """Whether parts are of like size and each fills its box, as vehicles do."""
    if cut.count < 2:
        return False
    box = cut.boxes()
    whole = box[:, 2] * box[:, 3]
    return bool((whole >= _EQUAL * whole.max()).all() and (cut.areas() > _FULL * whole).all())


def divided(regions: Regions, predicted: Floats, sizes: SizeField, step: int) -> Regions:
    """The regions, those divided among predicted boxes (K, 4) [px of the mask] that are too large for one vehicle.

    Vehicles nose to tail have no neck between them; each pixel goes to the box that it is nearest to.
    """
    box = regions.boxes()
    typical = sizes.typical(box.astype(float) * step) / step
    for i in np.flatnonzero((box[:, 2:] > _LARGE * typical).any(axis=1)):
        label, count = nearest_box(patch(regions, i, box[i]), box[i], predicted)
        if count > 1:
            regions = regions.parted(i, of_labels(label, count, box[i]))
    return regions

"""Grouping of regions that are pieces of one vehicle."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import inlined, kernel
from vidtrack.video.frame import Image
from vidtrack.video.runs import CORNERS, OBJECTS, Runs, components, connect, find_runs

_SPREAD = 1.2  # predicted boxes are taken this much larger about their centres before fragments are sought in them
_LIKE = 0.3  # share of the typical area that makes a piece a vehicle
_LIKE_BOX, _LIKE_FILL, _APART = 0.2, 0.6, 0.75  # before a typical size is known: share of the union's box, share of its
# own box that is filled, and the share of the union's box that two vehicles' boxes leave unfilled together
_SMALL = 0.35  # share of the typical area of a piece that needs no prediction
_WHOLE = 1.2  # typical areas of what pieces make together at most
_LESSER = 0.6  # of two linked pieces the smaller is less than this share of the larger, before sizes are known
_NEAR = 0.35  # typical sizes between such pieces at most
_FILLED = 0.25  # least share of a region of weak foreground that is foreground


@kernel
def links(row: Runs, start: Runs, stop: Runs, label: Ints, total: int, weak: Image) -> Ints:
    """(total,) group of each region of the runs (row, start, stop, label): the same number inside one weak region.

    weak (h, w) is the mask with lower thresholds. Its regions much larger than the foreground in them, as in flickering
    light, link nothing; what they do not link has a negative number of its own.
    """
    over, begin, end = find_runs(weak, OBJECTS)
    region, count = connect(over, begin, end, CORNERS)
    filled, whole = np.zeros(count), np.zeros(count)
    for k in range(len(over)):
        whole[region[k]] += end[k] - begin[k]
    inside = np.full(len(row), -1)
    for k in range(len(row)):
        i = _run_at(over, begin, end, row[k], start[k])
        if i >= 0:
            inside[k] = region[i]
            filled[region[i]] += stop[k] - start[k]
    link = np.empty(total, np.int64)
    for i in range(total):
        link[i] = -1 - i
    for k in range(len(row)):
        if inside[k] >= 0 and filled[inside[k]] > _FILLED * whole[inside[k]]:
            link[label[k]] = inside[k]
    return link


@inlined
def _run_at(row: Runs, start: Runs, stop: Runs, y: int, x: int) -> int:
    """Index of the run, of those in raster order, that holds the pixel (x, y); -1: none."""
    low, high = 0, len(row)  # the last run that begins there or before lies in low - 1
    while low < high:
        middle = (low + high) // 2
        if row[middle] < y or (row[middle] == y and start[middle] <= x):
            low = middle + 1
        else:
            high = middle
    return low - 1 if low > 0 and row[low - 1] == y and x < stop[low - 1] else -1


@kernel
def together(
    box: Floats,
    area: Floats,
    link: Ints,
    predicted: Floats,
    typical: Floats,
    flake: float,
    pieces: bool,
    overlap: float,
    gap: float,
) -> tuple[Ints, int]:
    """Group of each region (R,) and the number of groups; pieces of one vehicle have the same group.

    box (R, 4) and area (R,) of the regions, link (R,) the same number for regions that weak foreground links,
    predicted (K, 4) boxes of vehicles, typical (R, 2) width and height of vehicles at each region, all NaN while
    unknown, flake the longer side up to which regions are flakes or drops, which are pieces of nothing;
    pieces, overlap, gap: `blobs.pieces`, `join_overlap`, `join_gap`.

    Two regions are pieces of one vehicle if they are close together inside one predicted box; or if one is small and
    near the other, and both together are no larger than a vehicle; or if they are linked, not in two predicted boxes,
    and together no larger than a vehicle (while sizes are unknown: one is smaller than the other). Two regions that
    are each like a vehicle are not, unless a third one joins them and all fit into one vehicle. The nearest pieces are
    joined first; a third region between two vehicles joins the nearer one, not both.
    """
    vehicle = np.empty(len(box), np.int64)
    for i in range(len(box)):
        vehicle[i] = _only_vehicle(box[i], predicted, overlap)
    one, other, apart = [0 for _ in range(0)], [0 for _ in range(0)], [0.0 for _ in range(0)]  # pieces of one vehicle
    for i in range(len(box)):
        if max(box[i, 2], box[i, 3]) <= flake:
            continue
        for j in range(i):
            if max(box[j, 2], box[j, 3]) <= flake or _both_vehicles(i, j, box, area, typical):
                continue
            distance = _gap(box[i], box[j])
            same = vehicle[i] >= 0 and vehicle[i] == vehicle[j]
            two = vehicle[i] >= 0 and vehicle[j] >= 0 and vehicle[i] != vehicle[j]
            if (
                (same and distance <= gap * max(predicted[vehicle[i], 2], predicted[vehicle[i], 3]))
                or (pieces and _whole(box[i], box[j], typical[i]))
                or (pieces and link[i] == link[j] and not two and _fit(box[i], box[j], typical[i]))
            ):
                one.append(i)
                other.append(j)
                apart.append(distance)
    group, refused = np.arange(len(box)), np.zeros((len(box), len(box)), np.bool_)
    for k in _nearest_first(apart):
        a, b = min(group[one[k]], group[other[k]]), max(group[one[k]], group[other[k]])
        if a == b or refused[a, b]:  # groups that do not fit together never will: they only grow
            continue
        if not _one_vehicle(group, group[one[k]], group[other[k]], box, area, typical):
            refused[a, b] = refused[b, a] = True
            continue
        for i in range(len(box)):
            group[i] = a if group[i] == b else group[i]
            refused[a, i] = refused[i, a] = refused[a, i] or refused[b, i]
    return components(group)


@inlined
def _nearest_first(apart: list[float]) -> Ints:
    """(N,) indices by increasing distance, equal ones in their order: insertion, for they are few."""
    order = np.empty(len(apart), np.int64)
    for k in range(len(apart)):
        place = k
        while place > 0 and apart[order[place - 1]] > apart[k]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = k
    return order


@kernel
def _one_vehicle(group: Ints, a: int, b: int, box: Floats, area: Floats, typical: Floats) -> bool:
    """Whether the regions of groups a and b can be one vehicle: no two of them are vehicles, or all fit into one."""
    left, top, right, bottom = np.inf, np.inf, -np.inf, -np.inf
    usual = 0.0
    for i in range(len(box)):
        if group[i] == a or group[i] == b:
            usual = max(usual, typical[i, 0] * typical[i, 1])
            left, right = min(left, box[i, 0]), max(right, box[i, 0] + box[i, 2])
            top, bottom = min(top, box[i, 1]), max(bottom, box[i, 1] + box[i, 3])
    union = (right - left) * (bottom - top)
    for i in range(len(box)):
        if group[i] != a:
            continue
        for j in range(len(box)):
            if group[j] == b and _both_vehicles(i, j, box, area, typical):
                return union <= _WHOLE * usual
    return True


@inlined
def _whole(a: Floats, b: Floats, typical: Floats) -> bool:
    """Whether a small box and a near one together are no larger than a vehicle of typical (2,) width and height."""
    if np.isnan(typical[0]):
        return False
    usual = typical[0] * typical[1]
    small = min(a[2] * a[3], b[2] * b[3]) < _SMALL * usual
    return small and _union(a, b) <= _WHOLE * usual and _gap(a, b) <= _NEAR * max(typical[0], typical[1])


@inlined
def _fit(a: Floats, b: Floats, typical: Floats) -> bool:
    """Whether two linked boxes together are no larger than a vehicle of typical (2,) width and height."""
    if np.isnan(typical[0]):
        one, other = a[2] * a[3], b[2] * b[3]
        return min(one, other) < _LESSER * max(one, other)
    return _union(a, b) <= _WHOLE * typical[0] * typical[1]


@inlined
def _both_vehicles(i: int, j: int, box: Floats, area: Floats, typical: Floats) -> bool:
    """Whether two regions are each like a vehicle that stands where it does.

    Of two that share columns the upper one may be a part of the lower one: both are judged by the larger size.
    """
    a, b = box[i, 2] * box[i, 3], box[j, 2] * box[j, 3]
    if not np.isnan(typical[i, 0]):
        usual_a, usual_b = typical[i, 0] * typical[i, 1], typical[j, 0] * typical[j, 1]
        if _share_columns(box[i], box[j]):
            usual_a = usual_b = max(usual_a, usual_b)
        return a >= _LIKE * usual_a and b >= _LIKE * usual_b
    union = _union(box[i], box[j])
    filled = area[i] > _LIKE_FILL * a and area[j] > _LIKE_FILL * b
    return filled and min(a, b) >= _LIKE_BOX * union and a + b < _APART * union


@inlined
def _only_vehicle(box: Floats, predicted: Floats, most: float) -> int:
    """Index of the predicted box that contains most of this box (4,); -1 for none, or if others overlap it too."""
    vehicle, sharers = -1, 0
    for k in range(len(predicted)):
        share = _share_inside(box, predicted[k])
        sharers += share > 1 - most
        if share >= most and vehicle < 0:
            vehicle = k
    return vehicle if sharers == 1 else -1


@inlined
def _share_inside(box: Floats, other: Floats) -> float:
    """Share of a box's area inside the other box, enlarged by _SPREAD."""
    common = 1.0
    for axis in range(2):
        size = _SPREAD * other[axis + 2]
        low = other[axis] - (size - other[axis + 2]) / 2
        common *= max(min(box[axis] + box[axis + 2], low + size) - max(box[axis], low), 0.0)
    return common / (box[2] * box[3])


@inlined
def _share_columns(a: Floats, b: Floats) -> bool:
    """Whether two boxes have columns in common."""
    return a[0] < b[0] + b[2] and b[0] < a[0] + a[2]


@inlined
def _union(a: Floats, b: Floats) -> float:
    """Area of the bounding box of both."""
    wide = max(a[0] + a[2], b[0] + b[2]) - min(a[0], b[0])
    return wide * (max(a[1] + a[3], b[1] + b[3]) - min(a[1], b[1]))


@inlined
def _gap(a: Floats, b: Floats) -> float:
    """Distance between two boxes along the axis that separates them more; negative where they overlap."""
    across = max(a[0] - (b[0] + b[2]), b[0] - (a[0] + a[2]))
    return max(across, max(a[1] - (b[1] + b[3]), b[1] - (a[1] + a[3])))

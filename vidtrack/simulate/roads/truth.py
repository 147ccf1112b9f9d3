"""The truth of a road's video: boxes and visibilities in the picture, states on the ground."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.simulate.roads.stage import SUBPIXEL_BITS, Actor
from vidtrack.simulate.truth import Truth

CELLS = 64  # along the longer side of a box when areas are counted


@dataclass(frozen=True, slots=True, eq=False)
class RoadTruth:
    """One row a vehicle and frame, in the order of `boxes`.

    vehicle  (N,) index in the fleet
    xy       (N, 2) m; centre of the footprint
    speed    (N,) m/s; of that centre
    heading  (N,) rad; from east to north
    """

    boxes: Truth
    vehicle: Ints
    xy: Floats
    speed: Floats
    heading: Floats

    def ids(self, vehicles: int) -> Ints:
        """(vehicles,) the id of each vehicle of the fleet; 0: never seen."""
        ids = np.zeros(vehicles, np.int64)
        ids[self.vehicle] = self.boxes.id
        return ids


def numbered(vehicle: Ints) -> Ints:
    """(N,) ids 1, 2, ... of vehicles (N,) in the order of their first rows."""
    _, first, inverse = np.unique(vehicle, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[inverse] + 1


def visible_share(actor: Actor, nearer: list[Actor], picture: tuple[int, int]) -> float:
    """Share of the actor's silhouette that is in a picture of this size and behind none of the nearer ones."""
    size = np.array(picture, float)
    left_top, extent = actor.box[:2], actor.box[2:] - actor.box[:2]
    outside = (left_top < 0).any() or (actor.box[2:] > size).any()
    meets = [other for other in nearer if (other.box[:2] < actor.box[2:]).all() and (other.box[2:] > left_top).all()]
    if not outside and not meets:
        return 1.0
    scale = CELLS / extent.max()
    cells = np.ceil(extent * scale).astype(int)
    mask = np.zeros((cells[1], cells[0]), np.uint8)
    _cover(mask, actor, left_top, scale, 1)
    total = int(np.count_nonzero(mask))
    for other in meets:
        _cover(mask, other, left_top, scale, 0)
    low, high = np.rint((np.zeros(2) - left_top) * scale).astype(int), np.rint((size - left_top) * scale).astype(int)
    inside = mask[max(low[1], 0) : max(high[1], 0), max(low[0], 0) : max(high[0], 0)]
    return int(np.count_nonzero(inside)) / total if total else 0.0


def _cover(mask: cv2.typing.MatLike, actor: Actor, origin: Floats, scale: float, level: int) -> None:
    for polygon in actor.silhouette:
        fixed = np.rint(((polygon - origin) * scale - 0.5) * 2**SUBPIXEL_BITS).astype(np.int32)
        cv2.fillConvexPoly(mask, fixed, (level,), cv2.LINE_8, SUBPIXEL_BITS)

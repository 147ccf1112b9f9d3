"""Entries of vehicles into zones, as they happen; `measures/staying.py` finds the same in finished runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask

PAUSE_S = 1.0
"""s; a vehicle that was in the zone less than this before does not enter it again"""


@dataclass(frozen=True, slots=True)
class Entry:
    """A vehicle came into a zone.

    time_s  halfway between the last position outside and the first one inside
    came    whether it was seen outside before; else its track begins inside
    """

    time_s: float
    zone: str
    track_id: int
    came: bool


class ZoneEntries:
    """Looks at positions, one moment after the other.

    outlines  (V, 2) corners of each zone by its name, in the unit of the positions
    """

    def __init__(self, outlines: Mapping[str, Floats]) -> None:
        self._outlines = dict(outlines)
        self._id = np.empty(0, np.int64)
        self._inside_s = np.empty((0, len(outlines)))  # (T, Z) when each track was in each zone last
        self._last_s = 0.0

    def step(self, time_s: float, track_id: Ints, xy: Floats) -> list[Entry]:
        """The entries that T tracks at positions (T, 2) make; NaN where a position is not known."""
        _, now, before = np.intersect1d(track_id, self._id, assume_unique=True, return_indices=True)
        inside_s = np.full((len(track_id), len(self._outlines)), -np.inf)
        inside_s[now] = self._inside_s[before]
        came = np.zeros(len(track_id), bool)
        came[now] = True
        inside = np.column_stack([contains(outline, xy) for outline in self._outlines.values()])
        entered = inside & (time_s - inside_s >= PAUSE_S)
        inside_s[inside] = time_s
        names = list(self._outlines)
        middle_s = (time_s + self._last_s) / 2
        self._id, self._inside_s, self._last_s = track_id, inside_s, time_s
        return [
            Entry(middle_s if came[row] else time_s, names[zone], int(track_id[row]), bool(came[row]))
            for row, zone in np.argwhere(entered)
        ]


def contains(outline: Floats, xy: Floats) -> Mask:
    """(N,) whether points (N, 2) are in a polygon (V, 2): a ray to the right meets its sides an odd number of times."""
    (x1, y1), (x2, y2) = outline.T[:, :, None], np.roll(outline, -1, axis=0).T[:, :, None]
    x, y = xy.T
    with np.errstate(divide="ignore", invalid="ignore"):
        met = ((y1 > y) != (y2 > y)) & (x < x1 + (y - y1) / (y2 - y1) * (x2 - x1))
    return np.asarray(met.sum(axis=0) % 2 == 1)

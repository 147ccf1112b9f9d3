"""Counting lines across the legs of a simulated road, and the crossings of the true boxes' centres."""

from __future__ import annotations

import itertools
import tomllib
from pathlib import Path

import numpy as np
from score_events import Event

from vidtrack import formats

_BEYOND = 0.15  # share of a gate by which its line is longer at both ends: centres of boxes are above the road
_TOLERANCE = 25.0  # frames, 1 s


def leg_lines(site: Path) -> dict[str, np.ndarray]:
    """(2, 2) the ends of a line for each leg, across its entry and its exit."""
    gates = tomllib.loads(site.read_text(encoding="utf-8"))["gates"]
    ends: dict[str, list] = {}
    for name, gate in gates.items():
        ends.setdefault(name.rsplit("_", 1)[0], []).extend(gate["line"])
    lines = {}
    for leg, points in ends.items():
        start, stop = max(
            itertools.combinations(np.array(points), 2), key=lambda pair: np.linalg.norm(pair[1] - pair[0])
        )
        lines[leg] = np.array([start - _BEYOND * (stop - start), stop + _BEYOND * (stop - start)])
    return lines


def crossings(truth: Path, lines: dict[str, np.ndarray]) -> list[Event]:
    """The first crossing of each line by each target in each direction."""
    table = formats.read(truth)
    events = []
    for target in np.unique(table.id):
        rows = table.select(table.id == target)
        centre = rows.box[:, :2] + rows.box[:, 2:] / 2
        for leg, (start, stop) in lines.items():
            along = (stop - start) / np.linalg.norm(stop - start)
            side = (centre - start) @ np.array([-along[1], along[0]])
            within = (centre - start) @ along
            beyond = side >= 0
            crossed = (beyond[1:] != beyond[:-1]) & (within[1:] >= 0) & (within[1:] <= np.linalg.norm(stop - start))
            flat = abs(along[0]) > abs(along[1])
            step = np.diff(centre[:, 1] if flat else centre[:, 0])
            for way, name in ((1, "down" if flat else "right"), (-1, "up" if flat else "left")):
                when = np.flatnonzero(crossed & (np.sign(step) == way))
                if len(when):
                    events.append(Event(leg, float(rows.frame[when[0] + 1]), name, tolerance=_TOLERANCE))
    return events

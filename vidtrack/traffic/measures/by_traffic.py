"""What the traffic of runs says about a calibration, without a gate: sizes of vehicles, and their straight paths."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.rows import Reader, Rows
from vidtrack.traffic.measures.runs import open_day
from vidtrack.traffic.measures.stretches import Stretches
from vidtrack.traffic.site import Site
from vidtrack.traffic.vehicles.vehicles import Fitted, Vehicles


def by_traffic(runs: Sequence[str], site: Site) -> dict[str, Any]:
    """`scale` and `straightness` in plain data, None where there is too little traffic, of a calibrated site.

    Raises ConfigError, SourceError or FormatError for what cannot be used.
    """
    day = open_day(runs, site.camera.start)
    grounds = {size: calibrated(site.scaled(*size)) for size in sorted({one.size for one in day.recordings})}
    stretches, vehicles = Stretches(metres=True), Vehicles(grounds[min(grounds)])
    for _ in by_stretches(Reader(day, dict(grounds)), stretches, vehicles):
        pass
    return contradicting(vehicles.fitted(np.arange(len(stretches.lives().track)), np.empty(0, int), np.empty(0)))


def by_stretches(blocks: Iterable[Rows], stretches: Stretches, vehicles: Vehicles) -> Iterator[Rows]:
    """The rows with the numbers of stretches as those of tracks; stretches and vehicles take them in on the way."""
    for whole in blocks:
        rows = stretches.add(whole)
        vehicles.add(rows.track, rows.t, rows.xy, rows.edge)
        yield rows


def contradicting(found: Fitted | None) -> dict[str, Any]:
    """The same of what was found."""
    scale, straight = (None, None) if found is None else (found.scale, found.straightness)
    return {
        "scale": None if scale is None else scale.told(),
        "straightness": None if straight is None else straight.told(),
    }

"""radar.html of a radar run: its scans in polar coordinates about the radar, in one file that needs nothing else."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from vidtrack.output.folder import replacing
from vidtrack.output.radar_plot import located
from vidtrack.output.sink import Step

_MOST_PLOTS = 200_000
"""Plots on the page; of more, every second, third, ... is left in, so that a browser can draw them."""
_MOST_SCANS = 20_000
"""Scans on the page: the last ones of a feed that does not end."""

Map = dict[str, Any]


class RadarPage:
    """Sink that writes a page to look through a run scan by scan: plots, tracks with their ids, rings of equal range,
    lines of equal azimuth, and where the clutter is.

    radars   (x, y) of each radar; the first is the pole
    clutter  returns the clutter map as `low`, `high`, `density` and whether it is `polar`; None: there is none
    """

    def __init__(
        self, path: Path, radars: Sequence[tuple[float, float]], clutter: Callable[[], Map | None] | None = None
    ) -> None:
        self._path = path
        self._radars = radars
        self._clutter = clutter
        self._plots: deque[np.ndarray] = deque(maxlen=_MOST_SCANS)
        self._scans: deque[dict[str, Any]] = deque(maxlen=_MOST_SCANS)

    def step(self, step: Step) -> None:
        """Store the plots and tracks of one scan, in whole metres."""
        plots = located(step.scan)[:, :2] if len(step.scan) else np.empty((0, 2))
        self._plots.append(plots.round().astype(np.int32))
        xy = step.tracks.xy[:, :2].round().astype(int)
        tracks = np.column_stack([step.tracks.id, xy]).tolist()
        self._scans.append({"number": step.index, "time_s": round(step.time_s, 3), "tracks": tracks})

    def close(self) -> None:
        """Write the page."""
        ends = np.cumsum([0, *map(len, self._plots)])
        stride = max(1, -(-int(ends[-1]) // _MOST_PLOTS))
        scans = [
            scan | {"plots": plots[-first % stride :: stride].tolist()}
            for scan, plots, first in zip(self._scans, self._plots, ends[:-1].tolist(), strict=True)
        ]
        data = {"radars": [[float(x), float(y)] for x, y in self._radars], "scans": scans}
        data["clutter"] = None if self._clutter is None else self._clutter()
        page = (files("vidtrack.output") / "radar_page.html").read_text(encoding="utf-8")
        with replacing(self._path) as new:
            new.write_text(page.replace("/*DATA*/null", json.dumps(data, separators=(",", ":"))), encoding="utf-8")

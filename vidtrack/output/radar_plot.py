"""tracks.png of a radar run: plots and tracks in the horizontal plane, in kilometres."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.estimate.sensor import POSITION
from vidtrack.output.colours import colour
from vidtrack.output.folder import replacing
from vidtrack.output.sink import Step
from vidtrack.scan import Scan

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RINGS = 6
"""Most rings of equal range."""
_NUMBERED = 60
"""Largest number of ids drawn; more would be unreadable."""


class RadarPlot:
    """Sink that draws all plots in grey and each track in its colour, with its id at its end, over rings of equal
    range and lines of equal azimuth about the radar (a plan position indicator).

    radars  (x, y) of each radar
    """

    def __init__(self, path: Path, radars: Sequence[tuple[float, float]]) -> None:
        self._path = path
        self._radars = np.asarray(radars, float).reshape(-1, 2)
        self._plots: list[np.ndarray] = []
        self._tracks: dict[int, list[Floats]] = {}

    def step(self, step: Step) -> None:
        """Store the plots and tracks of one scan."""
        if len(step.scan):
            self._plots.append(located(step.scan)[:, :2].astype(np.float32))
        for track_id, xy in zip(step.tracks.id.tolist(), step.tracks.xy[:, :2], strict=True):
            self._tracks.setdefault(track_id, []).append(xy)

    def close(self) -> None:
        """Write the picture."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9, 9), layout="constrained")
        canvas = FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        if self._plots:
            axes.plot(*(np.concatenate(self._plots).T / 1000), ".", color="0.6", markersize=2, zorder=1)
        axes.plot(*(self._radars.T / 1000), "^", color="black", markersize=7, zorder=2)
        for track_id, points in self._tracks.items():
            x, y = np.array(points).T / 1000
            ink = tuple(0.8 * level / 255 for level in reversed(colour(track_id)))
            axes.plot(x, y, color=ink, linewidth=1.5, zorder=3)
            if len(self._tracks) <= _NUMBERED:
                axes.annotate(str(track_id), (x[-1], y[-1]), color=ink, fontsize=8, zorder=4)
        axes.set(xlabel="east, km", ylabel="north, km", title=f"{len(self._tracks)} tracks")
        axes.set_aspect("equal", adjustable="datalim")
        for radar in self._radars if len(self._radars) == 1 else ():
            _draw_scope(axes, radar / 1000)
        with replacing(self._path) as new:
            canvas.print_png(str(new))


def _draw_scope(axes: Axes, radar: Floats) -> None:
    """Draw rings at round ranges, labelled in km, and lines every 30 degrees of azimuth, within the limits."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle
    from matplotlib.ticker import MaxNLocator

    sides = np.array(axes.axis()).reshape(2, 2) - radar[:, None]
    far = float(np.hypot(*np.abs(sides).max(axis=1)))
    for ring in MaxNLocator(_RINGS).tick_values(0, far)[1:]:
        axes.add_artist(Circle((radar[0], radar[1]), ring, fill=False, color="0.85", linewidth=0.8, zorder=0))
        axes.annotate(f"{ring:g}", (radar[0], radar[1] + ring), color="0.5", fontsize=7, zorder=0, annotation_clip=True)
    for azimuth in np.radians(np.arange(0, 360, 30)):
        end = radar + 2 * far * np.array([np.sin(azimuth), np.cos(azimuth)])
        axes.add_artist(Line2D(*zip(radar, end, strict=True), color="0.92", linewidth=0.8, zorder=0))


def located(scan: Scan) -> Floats:
    """(M, d) positions of a scan's measurements."""
    return (scan.sensor or POSITION).locate(scan.z, scan.R)[0]

"""The lengths and classes of the whole tracks of a run, as `vidtrack measure` has them."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.rows import EDGE_COLUMNS, edges, numbers
from vidtrack.traffic.site import Site
from vidtrack.traffic.vehicles.naming import Named, whole_tracks
from vidtrack.traffic.vehicles.vehicles import Vehicles


class WholeTracks:
    """Takes the rows of a run in order of time.

    site  drawn for the run's pictures
    """

    def __init__(self, site: Site) -> None:
        self._size = site.camera.width, site.camera.height
        self._classes = site.classes
        self._vehicles = Vehicles(None if site.calibration is None else calibrated(site))

    def add(self, table: pa.Table) -> None:
        """Look at rows; those of runs of earlier versions have no edges, and tell nothing."""
        if not set(EDGE_COLUMNS) <= set(table.column_names):
            return
        column = {name: numbers(table, name) for name in ("time_s", "x_m", "y_m", *EDGE_COLUMNS)}
        xy = np.column_stack([column["x_m"], column["y_m"]])
        self._vehicles.add(table["track_id"].to_numpy(), column["time_s"], xy, edges(column, self._size))

    def named(self, track: Ints, length: Floats, sigma: Floats) -> Named:
        """Of tracks (T,), with the mean lengths of their rows and their standard deviations (T,) m."""
        tracks = int(track.max(initial=-1)) + 1
        nothing = np.empty(0, np.int64)
        found = self._vehicles.fitted(np.arange(tracks), nothing, np.empty(0))
        return whole_tracks(None if found is None else found.classes.of(track), length, sigma, self._classes)

"""The lengths and classes of the whole tracks of a run, as `vidtrack measure` has them."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from vidtrack.arrays.rows import make_room
from vidtrack.arrays.types import Ints
from vidtrack.traffic.boxes import partly_hidden
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.lengths import add_lengths, mean_length
from vidtrack.traffic.measures.blocks import side_by_side
from vidtrack.traffic.measures.rows import BOX, numbers_of, states, uncut_edges
from vidtrack.traffic.site import Site
from vidtrack.traffic.vehicles.naming import Named, likeliest, whole_tracks
from vidtrack.traffic.vehicles.vehicles import Vehicles


class WholeTracks:
    """Takes the rows of a run in order of time.

    site  drawn for the run's pictures
    """

    def __init__(self, site: Site) -> None:
        self._size = site.camera.width, site.camera.height
        self._classes = site.classes
        self._vehicles = Vehicles(None if site.calibration is None else calibrated(site))
        self._sums = np.zeros((0, 4))

    def add(self, table: pa.Table) -> None:
        """Look at the rows of whole pictures; those of runs of earlier versions have no edges, and tell less."""
        column, box = numbers_of(table), side_by_side(table, BOX)
        track, t = table["track_id"].to_numpy(), column["time_s"]
        hidden = partly_hidden(t, box, states(table)[1])
        make_room(self._sums, int(track.max(initial=-1)) + 1, 0.0)
        add_lengths(self._sums, track, column["length_m"], column["length_sigma_m"], hidden)
        self._vehicles.add(track, t, side_by_side(table, ("x_m", "y_m")), uncut_edges(table, self._size))

    def named(self, track: Ints) -> tuple[Named, list[str]]:
        """Of tracks (T,), and the likeliest of `classes.CLASSES`, however unsure."""
        nothing = np.empty(0, np.int64)
        found = self._vehicles.fitted(np.arange(len(self._sums)), nothing, np.empty(0))
        classes = None if found is None else found.classes.of(track)
        lengths = mean_length(self._sums[track])
        return whole_tracks(classes, *lengths, self._classes), likeliest(classes, *lengths)

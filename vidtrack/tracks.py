"""The output of the tracker: a snapshot of all tracks after each scan, in arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.decision import Choices, Event


class Status(IntEnum):
    """Status of a track in its life cycle."""

    TENTATIVE = 0
    CONFIRMED = 1
    COASTING = 2
    MERGED = 3


TENTATIVE, CONFIRMED, COASTING, MERGED = (int(status) for status in Status)
"""The statuses as plain integers: NumPy compares these ten times as fast as members of an enumeration."""


@dataclass(slots=True)
class Tracks:
    """A snapshot of all tracks at time t; rows are tracks.

    t              time [s]
    id             (T,) never reused
    status         (T,) values of Status
    x, P           (T, n), (T, n, n) state mean and covariance
    box            (T, 4) left, top, width, height, absolute; NaN if the sensor has no boxes
    group          (T,) number >= 0 common to tracks that share one blob; -1: not shared
    group_since_s  (T,) time the group was formed; NaN: not shared
    exchange       (T,) probability that the track has exchanged targets with others, while they were not resolved
    age_s          (T,) seconds since the track's first measurement
    travel         (T,) distance from the track's first position
    existence      (T,) probability that the track is a target
    measurement    (T,) index of this scan's measurement of largest weight; -1 for none
    nis            (T,) normalised innovation squared of this update; NaN for none
    position, velocity   columns of x, one per axis
    run            (T,) Monte Carlo run
    entered        (T,) whether the track came in over the border of the picture, or is coming in
    events         births, confirmations, merges, splits and deletions of this scan
    choices        reasons of the association; None unless the tracker has `explain`
    prior_x, prior_P, gain   (T, n), (T, n, n), (T, n, n) for smoothing, else None: the prediction for this scan, and
                   the smoother's gain P F' prior_P^-1 from the previous snapshot; NaN for new tracks
    """

    t: float
    id: Ints
    status: NDArray[np.int8]
    x: Floats
    P: Floats
    box: Floats
    group: Ints
    group_since_s: Floats
    age_s: Floats
    travel: Floats
    existence: Floats
    measurement: Ints
    nis: Floats
    position: tuple[int, ...] = (0, 2)
    velocity: tuple[int, ...] = (1, 3)
    run: Ints | None = None
    exchange: Floats | None = None
    entered: Mask | None = None
    events: tuple[Event, ...] = field(default=())
    choices: Choices | None = None
    prior_x: Floats | None = None
    prior_P: Floats | None = None  # noqa: N815
    gain: Floats | None = None

    def __len__(self) -> int:
        return len(self.id)

    def only(self, rows: NDArray[Any]) -> Tracks:
        """The tracks selected by a mask or by indices."""
        columns = (getattr(self, name) for name in self.__slots__)
        return Tracks(*(column[rows] if isinstance(column, np.ndarray) else column for column in columns))

    @property
    def seen(self) -> Mask:
        """(T,) whether the track has a measurement in this scan, its own or a shared one."""
        return np.asarray((self.measurement >= 0) | (self.status == MERGED))

    @property
    def xy(self) -> Floats:
        """(T, d) positions."""
        return self.x.take(self.position, axis=1)

    @property
    def v(self) -> Floats:
        """(T, d) velocities per second."""
        return self.x.take(self.velocity, axis=1)

    @property
    def xy_cov(self) -> Floats:
        """(T, d, d) position covariances."""
        index = list(self.position)
        return self.P[:, index][:, :, index]

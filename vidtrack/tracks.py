"""Tracks as the tracker shows them after each scan: a snapshot in arrays."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.decision import Choices, Event


class Status(IntEnum):
    """Where a track is in its life."""

    TENTATIVE = 0
    CONFIRMED = 1
    COASTING = 2
    MERGED = 3


TENTATIVE, CONFIRMED, COASTING, MERGED = (int(status) for status in Status)
"""The statuses as plain integers, with which NumPy compares ten times as fast as with members of an enumeration."""


@dataclass(frozen=True, slots=True)
class Tracks:
    """A snapshot of all tracks at time t; rows are tracks.

    t              time [s]
    id             (T,) never reused
    status         (T,) values of Status
    x, P           (T, n), (T, n, n) state mean and covariance
    box            (T, 4) left, top, width, height, absolute; NaN where the sensor has no boxes
    group          (T,) tracks that share one blob have the same number >= 0; -1 alone
    group_since_s  (T,) time the group was formed; NaN alone
    age_s          (T,) seconds since the track's first measurement
    travel         (T,) distance from where the track began
    existence      (T,) probability that the track is a target
    measurement    (T,) index of the heaviest measurement of this scan; -1 for none
    nis            (T,) normalised innovation squared of this update; NaN for none
    position, velocity   columns of x, one per axis
    run            (T,) Monte Carlo run
    events         births, confirmations, merges, splits and deletions of this scan
    choices        why each track took its measurement; None unless the tracker was told to explain
    prior_x, prior_P, gain   (T, n), (T, n, n), (T, n, n) for smoothing, else None: the prediction for this scan, and
                   the smoother's gain P F' prior_P^-1 from the snapshot before; NaN for tracks that are new in this one
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
    events: tuple[Event, ...] = field(default=())
    choices: Choices | None = None
    prior_x: Floats | None = None
    prior_P: Floats | None = None  # noqa: N815
    gain: Floats | None = None

    def __len__(self) -> int:
        return len(self.id)

    def only(self, rows: NDArray[Any]) -> Tracks:
        """The tracks of a mask or of indices."""
        columns = {column.name: getattr(self, column.name) for column in fields(self)}
        return replace(self, **{name: value[rows] for name, value in columns.items() if isinstance(value, np.ndarray)})

    @property
    def seen(self) -> Mask:
        """(T,) whether this scan shows the track, alone or in a blob it shares."""
        return np.asarray((self.measurement >= 0) | (self.status == MERGED))

    @property
    def xy(self) -> Floats:
        """(T, d) positions."""
        return self.x[:, list(self.position)]

    @property
    def v(self) -> Floats:
        """(T, d) velocities per second."""
        return self.x[:, list(self.velocity)]

    @property
    def xy_cov(self) -> Floats:
        """(T, d, d) position covariances."""
        index = list(self.position)
        return self.P[:, index][:, :, index]

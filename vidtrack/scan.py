"""The data types that all parts share: Scan (sensor to tracker), Decision (associator to estimator), Tracks."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.errors import ScanError

if TYPE_CHECKING:
    from vidtrack.estimate.sensor import Sensor

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Status(IntEnum):
    """Where a track is in its life."""

    TENTATIVE = 0
    CONFIRMED = 1
    COASTING = 2
    MERGED = 3


TENTATIVE, CONFIRMED, COASTING, MERGED = (int(status) for status in Status)
"""The statuses as plain integers, with which NumPy compares ten times as fast as with members of an enumeration."""


@dataclass(frozen=True, slots=True)
class Scan:
    """What a sensor saw at one time.

    t          time [s]
    z          (M, m) measurements, pixels or metres (radians for angles)
    R          (M, m, m) their covariances; (m, m) is taken for all of them
    sensor     the measurement model; None is "z is the position"
    noise      (m, m) covariance that a missed measurement would have had; some updates after a miss depend on it.
               None: R where one is given for all, else the mean of R, and nothing in an empty scan
    box        (M, 4) left, top, width, height, relative to z (a centroid is not a box centre); see `box_scan`
    amplitude  (M,) signal strength in units of the noise
    score      (M,) detector confidence
    label      (M,) class, -1 unknown; a track whose class is known takes no measurement of another
    lasting    (M, m, m) the part of R due to errors that persist from scan to scan; None: all are independent
    run        (M,) Monte Carlo run of each measurement, numbered from 0 without gaps; pairs form within equal runs only
    surveyed   (4,) left, top, right, bottom of what the sensor could see; None: the tracker's own bounds
    pixel      size of the sensor's pixel in the units of z, where there is one

    Raises ScanError for wrong shapes, NaN or infinite numbers, covariances that are not symmetric positive
    definite, boxes of negative size, and runs below 0.
    """

    t: float
    z: Floats
    R: Floats
    sensor: Sensor | None = None
    box: Floats | None = None
    amplitude: Floats | None = None
    score: Floats | None = None
    label: Ints | None = None
    run: Ints | None = None
    noise: Floats | None = None
    lasting: Floats | None = None
    surveyed: Floats | None = None
    pixel: float = 1.0

    def __post_init__(self) -> None:
        from vidtrack.usable import check_covariances, check_measurements  # loads the compiler; types do without

        z, R = np.asarray(self.z, dtype=float, order="C"), np.asarray(self.R, dtype=float, order="C")
        if z.shape == (0,):  # an empty list does not say how many components its measurements have
            z = z.reshape(0, *R.shape[-1:])
        if z.ndim != 2:
            raise ScanError(f"z must be (M, m), not {z.shape}; a single measurement is z[None]")
        count, dim = z.shape
        noise = None if self.noise is None else np.ascontiguousarray(self.noise, dtype=float)
        if R.shape == (dim, dim):
            noise = R.copy() if noise is None else noise
            R = np.repeat(R[None], count, axis=0)
        if R.shape != (count, dim, dim):
            raise ScanError(f"R must be ({count}, {dim}, {dim}) or ({dim}, {dim}) to match z, not {R.shape}")
        if not isfinite(self.t):
            raise ScanError(f"the scan's time is {self.t}; it must be a finite number of seconds")
        check_measurements(z, R)
        if noise is None and count:
            noise = R.sum(axis=0) / count
        if noise is not None and noise.shape != (dim, dim):
            raise ScanError(f"noise must be ({dim}, {dim}) to match z, not {noise.shape}")
        if noise is not None and (self.noise is not None or not count):  # not checked as part of R
            check_covariances(noise[None], "R" if self.noise is None else "noise")
        object.__setattr__(self, "noise", noise)
        object.__setattr__(self, "t", float(self.t))
        object.__setattr__(self, "z", z)
        object.__setattr__(self, "R", R)
        for name, shape, kind in (
            ("box", (count, 4), float),
            ("amplitude", (count,), float),
            ("score", (count,), float),
            ("label", (count,), np.int64),
            ("run", (count,), np.int64),
            ("lasting", (count, dim, dim), float),
        ):
            value = getattr(self, name)
            if value is None:
                continue
            value = np.asarray(value)
            if value.shape != shape:
                raise ScanError(f"{name} must be {shape} to match z, not {value.shape}")
            if not np.isfinite(value).all():
                i = int(np.argwhere(~np.isfinite(value))[0, 0])
                raise ScanError(
                    f"{name} of measurement {i} is not finite: {value[i]}; leave {name} out where it is unknown"
                )
            object.__setattr__(self, name, np.ascontiguousarray(value, dtype=kind))
        if self.box is not None and self.box[:, 2:].min(initial=0) < 0:
            i = int(np.argmin(self.box[:, 2:].min(axis=1)))
            raise ScanError(
                f"box of measurement {i} has a negative size: {self.box[i]}; it is left, top, width, height"
            )
        if self.run is not None and self.run.min(initial=0) < 0:
            i = int(np.argmin(self.run))
            raise ScanError(f"run of measurement {i} is {self.run[i]}; runs are numbered from 0")

    def __len__(self) -> int:
        return len(self.z)

    def weakened(self, inflation: float) -> Scan:
        """The scan with the lasting part of R multiplied by `inflation`, as a filter's update needs it."""
        if self.lasting is None:
            return self
        weak = copy(self)  # without validating it again
        object.__setattr__(weak, "R", self.R + (inflation - 1) * self.lasting)
        return weak


@dataclass(frozen=True, slots=True)
class Decision:
    """What an associator decided: how K successor rows come from T rows and M measurements.

    parent     (K,) the row each successor continues; 0..T-1 for one-scan methods
    row, measurement, beta   (B,) sparse weights over (successor, measurement), sorted by row
    beta0      (K,) weight of "not detected"; with the betas of its row it sums to one
    inflation  (K,) how much a miss widens the row: the missed branch has P + inflation K S K' (PDA, PSNF); None: zero
    spread     whether the scatter of the weighted measurements widens the row; generalized nearest neighbour uses
               their mean as if it were one measurement
    approximate  (K,) rows with approximate weights, because their cluster is too large for exact ones; None: no row
    """

    parent: Ints
    row: Ints
    measurement: Ints
    beta: Floats
    beta0: Floats
    inflation: Floats | None = None
    spread: bool = True
    approximate: Mask | None = None

    def without(self, rows: Mask) -> Decision:
        """The same decision with a plain miss, without inflation, in these rows (K,)."""
        if not np.count_nonzero(rows):
            return self
        stay = ~rows[self.row]
        beta0 = np.where(rows, 1.0, self.beta0)
        inflation = None if self.inflation is None else np.where(rows, 0.0, self.inflation)
        row, measurement, beta = self.row[stay], self.measurement[stay], self.beta[stay]
        return Decision(self.parent, row, measurement, beta, beta0, inflation, self.spread, self.approximate)

    def joined(self, other: Decision) -> Decision:
        """Both decisions about disjoint sets of rows as one."""
        row = np.concatenate([self.row, other.row])
        order = np.argsort(row, kind="stable")
        return Decision(
            self.parent,
            row.take(order),
            np.concatenate([self.measurement, other.measurement]).take(order),
            np.concatenate([self.beta, other.beta]).take(order),
            self.beta0 + other.beta0 - 1.0,
            _chosen(other.row, other.inflation, self.inflation),
            self.spread,
            _chosen(other.row, other.approximate, self.approximate),
        )


def _chosen(theirs: Ints, other: Any, own: Any) -> Any:
    """`own` with the values of `other` in the rows `theirs` (B,); None if the method has no such values."""
    if own is None:
        return None
    chosen = own.copy()
    chosen[theirs] = 0 if other is None else other[theirs]
    return chosen


class Event(NamedTuple):
    """A change in a track's life, with its reason in words."""

    t: float
    track_id: int
    kind: str  # "birth", "confirmed", "merge", "split", "delete"
    reason: str

    @classmethod
    def each(cls, t: float, ids: Ints, kind: str, reason: str) -> list[Event]:
        """The same event for each of these tracks (N,)."""
        return [cls(t, track, kind, reason) for track in ids.tolist()]


@dataclass(frozen=True, slots=True)
class Choices:
    """What was decided for each track of a scan, for `--decisions`. -1 and NaN where there is none.

    track_id, measurement, weight, d2, gate, runner_up, runner_up_d2   (T,)
    candidates, candidates_weight, candidates_d2   (T, C) what the gate admits, the C heaviest
    """

    track_id: Ints
    measurement: Ints
    weight: Floats
    d2: Floats
    gate: Floats
    runner_up: Ints
    runner_up_d2: Floats
    candidates: Ints
    candidates_weight: Floats
    candidates_d2: Floats

    def only(self, rows: NDArray[Any]) -> Choices:
        """The rows of a mask or of indices."""
        return Choices(*(getattr(self, column.name)[rows] for column in fields(self)))


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

"""The input of the tracker: the measurements of one time."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import ScanError

if TYPE_CHECKING:
    from vidtrack.estimate.sensor import Sensor


@dataclass(slots=True)
class Scan:
    """The measurements of a sensor at one time.

    t          time [s]
    z          (M, m) measurements, pixels or metres (radians for angles)
    R          (M, m, m) their covariances; (m, m) applies to all
    sensor     the measurement model; None: z is the position
    station    number of the tracker's station that made the scan
    noise      (m, m) covariance of a missed measurement, which some updates after a miss need.
               None: R if one is given for all, else the mean of R; in an empty scan none
    box        (M, 4) left, top, width, height, relative to z (a centroid is not a box centre); see `box_scan`
    amplitude  (M,) signal strength in units of the noise
    score      (M,) detector confidence
    label      (M,) class, -1 unknown; a track of known class takes no measurement of another class
    lasting    (M, m, m) the part of R due to errors that persist from scan to scan, for `noise.LASTING_S`; one that
               persists for longer counts in proportion. None: all are independent
    run        (M,) Monte Carlo run of each measurement, numbered from 0 without gaps; pairs form only within a run
    surveyed   (4,) left, top, right, bottom of the sensor's field of view; None: the tracker's bounds
    pixel      size of the sensor's pixel in units of z
    look       (M, 3) mean luminance and chroma of the objects, grey levels; None: not known
    rim        by how much boxes reach beyond the targets on each side, in units of z

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
    look: Floats | None = None
    surveyed: Floats | None = None
    pixel: float = 1.0
    rim: float = 0.0
    station: int = 0

    def __post_init__(self) -> None:
        from vidtrack.arrays.checks import check_covariances, check_measurements  # loads the compiler

        z, R = np.asarray(self.z, dtype=float, order="C"), np.asarray(self.R, dtype=float, order="C")
        if z.shape == (0,):  # an empty list has no number of components
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
        if noise is not None and (self.noise is not None or not count):  # otherwise checked as part of R
            check_covariances(noise[None], "R" if self.noise is None else "noise")
        self.noise = noise
        self.t = float(self.t)
        self.z = z
        self.R = R
        for name, shape, kind in (
            ("box", (count, 4), float),
            ("amplitude", (count,), float),
            ("score", (count,), float),
            ("label", (count,), np.int64),
            ("run", (count,), np.int64),
            ("lasting", (count, dim, dim), float),
            ("look", (count, 3), float),
        ):
            value = getattr(self, name)
            if value is None:
                continue
            value = np.asarray(value)
            if value.shape != shape:
                raise ScanError(f"{name} must be {shape} to match z, not {value.shape}")
            if np.count_nonzero(np.isfinite(value)) < value.size:
                i = int(np.argwhere(~np.isfinite(value))[0, 0])
                raise ScanError(
                    f"{name} of measurement {i} is not finite: {value[i]}; leave {name} out where it is unknown"
                )
            setattr(self, name, np.ascontiguousarray(value, dtype=kind))
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
        """The scan with the lasting part of R multiplied by `inflation`, for a filter's update."""
        if self.lasting is None:
            return self
        weak = object.__new__(Scan)  # without validating it again
        for name in self.__slots__:
            setattr(weak, name, getattr(self, name))
        weak.R = self.R + (inflation - 1) * self.lasting
        return weak

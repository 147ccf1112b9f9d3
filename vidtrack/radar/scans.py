"""Plots become scans: in the coordinates that the estimator works in, scan by scan, empty ones included."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vidtrack.config import RadarSettings
from vidtrack.estimate.sensor import POSITION, Sensor
from vidtrack.radar.plots import Plots
from vidtrack.radar.sensors import PositionRangeRate, RangeAzimuth, RangeAzimuthElevation
from vidtrack.scan import Floats, Ints, Scan

NONLINEAR = ("ekf", "ukf", "particle")
"""Estimators that take range and angles as they are; the others get positions, converted without bias."""


@dataclass(frozen=True, slots=True)
class Measurements:
    """Plots as a tracker takes them, in order of time.

    sensor     what z is
    dim        space dimensions
    scan       (N,) number of each plot's scan
    time_s     (N,) when each was measured
    z, R       (N, m), (N, m, m)
    amplitude  (N,) or None
    """

    sensor: Sensor
    dim: int
    scan: Ints
    time_s: Floats
    z: Floats
    R: Floats
    amplitude: Floats | None

    @property
    def count(self) -> int:
        """Number of scans, empty ones included."""
        return int(self.scan[-1] - self.scan[0]) + 1

    def __iter__(self) -> Iterator[tuple[int, Scan]]:
        """Number and content of each scan from the first to the last; an empty one's time is interpolated."""
        number, first, size = np.unique(self.scan, return_index=True, return_counts=True)
        time_s = np.add.reduceat(self.time_s, first) / size
        noise = self.R.mean(axis=0)
        for k, (start, end) in enumerate(zip(first, first + size, strict=True)):
            for empty in range(number[k - 1] + 1 if k else number[0], number[k]):
                between = float(np.interp(empty, number[k - 1 : k + 1], time_s[k - 1 : k + 1]))
                yield empty, Scan(between, self.z[:0], self.R[:0], self.sensor, noise=noise)
            amplitude = None if self.amplitude is None else self.amplitude[start:end]
            z, R = self.z[start:end], self.R[start:end]
            yield int(number[k]), Scan(float(time_s[k]), z, R, self.sensor, amplitude=amplitude, noise=noise)


def measurements(plots: Plots, settings: RadarSettings) -> Measurements:
    """Plots in the coordinates that the settings' estimator works in.

    Range and angles stay as they are for NONLINEAR estimators; the others get positions, converted without bias. A
    range rate stays a range rate and is linearised; alpha-beta, which knows positions only, does without it.
    """
    doppler = plots.doppler and settings.estimator != "alpha-beta"
    origin = settings.position[: plots.dim]
    R = np.einsum("ni,ij->nij", plots.sigma**2, np.eye(plots.sigma.shape[1]))
    z = plots.z
    if plots.doppler and not doppler:
        z, R = z[:, : plots.dim], R[:, : plots.dim, : plots.dim]
    sensor: Sensor = PositionRangeRate(origin) if doppler else POSITION
    if plots.polar:
        polar = (
            RangeAzimuth(settings.position[:2], doppler)
            if plots.dim == 2
            else RangeAzimuthElevation(settings.position, doppler)
        )
        if settings.estimator in NONLINEAR:
            sensor = polar
        else:
            position, cov = polar.locate(z, R)
            z = np.column_stack([position, z[:, plots.dim :]])
            R[:, : plots.dim, : plots.dim] = cov
    return Measurements(sensor, plots.dim, plots.scan, plots.time_s, z, R, plots.amplitude)


def clutter_density(found: Measurements) -> float:
    """Plots per scan and unit of measurement space: the upper bound that counts targets as clutter.

    The space is the box around all plots, each side at least the width of their errors.
    """
    width = np.sqrt(12 * np.diagonal(found.R, axis1=1, axis2=2).mean(axis=0))
    sides = np.maximum(np.ptp(found.z, axis=0), width)
    return float(len(found.z) / found.count / sides.prod())

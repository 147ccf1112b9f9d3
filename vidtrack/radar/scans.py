"""Scans from plots, in the coordinates of the estimator, with empty scans."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.radar import RadarSettings
from vidtrack.estimate.sensor import POSITION, Sensor
from vidtrack.radar.coordinates import sector
from vidtrack.radar.plots import Plots
from vidtrack.radar.rhythm import Rhythm, rhythm
from vidtrack.radar.sensors import PositionRangeRate, RangeAzimuth, RangeAzimuthElevation
from vidtrack.radar.sweep import Sweep
from vidtrack.scan import Scan

NONLINEAR = ("ekf", "ukf", "particle")
"""Estimators that use range and angles directly; the others use positions, converted without bias."""

SIMULTANEOUS_S = 1e-6
"""s; plots within this time count as simultaneous."""

REACH_SCANS = 4
"""The surveyed space extends beyond the plots by the distance that a target can cover in so many scans."""


class Span(NamedTuple):
    """A scan of a table of plots: its number, its time [s] and its rows."""

    number: int
    t: float
    rows: slice


def spans(scan: Ints, time_s: Floats) -> Iterator[Span]:
    """The scans of plots in order, from the first to the last; the times of empty ones are interpolated.

    scan (N,) number of each plot's scan, time_s (N,) their times
    """
    number, first, size = np.unique(scan, return_index=True, return_counts=True)
    mean_s = np.add.reduceat(time_s, first) / size
    for k, (start, end) in enumerate(zip(first.tolist(), (first + size).tolist(), strict=True)):
        for empty in range(number[k - 1] + 1 if k else number[0], number[k]):
            between = np.interp(empty, number[k - 1 : k + 1], mean_s[k - 1 : k + 1])
            yield Span(int(empty), float(between), slice(start, start))
        yield Span(int(number[k]), float(mean_s[k]), slice(start, end))


@dataclass(frozen=True)
class Measurements:
    """Plots as input of a tracker, in order of time.

    sensor     measurement model of z
    dim        space dimensions
    scan       (N,) number of each plot's scan
    time_s     (N,) time of each plot; if times within a scan differ, predictions are moved to them
    speed      prior standard deviation of a velocity [m/s]
    z, R       (N, m), (N, m, m)
    amplitude  (N,) or None
    """

    sensor: Sensor
    dim: int
    scan: Ints
    time_s: Floats
    speed: float
    z: Floats
    R: Floats
    amplitude: Floats | None

    @property
    def count(self) -> int:
        """Number of scans, empty ones included."""
        return int(self.scan[-1] - self.scan[0]) + 1

    @cached_property
    def rhythm(self) -> Rhythm:
        """How the scans follow each other."""
        return rhythm(self.scan, self.time_s)

    def __iter__(self) -> Iterator[tuple[int, Scan]]:
        """Number and scan, from the first to the last."""
        noise = self.R.mean(axis=0)
        for span in spans(self.scan, self.time_s):
            yield span.number, self.scan_of(span, noise)

    def scan_of(self, span: Span, noise: Floats, lag_s: float = 0.0, station: int = 0) -> Scan:
        """The scan of a span of these plots; noise (m, m) of a missed measurement.

        lag_s  s; the plots were measured so much before their times
        """
        z, R = self.z[span.rows], self.R[span.rows]
        amplitude = None if self.amplitude is None else self.amplitude[span.rows]
        sensor = self._at(self.time_s[span.rows] - span.t - lag_s, z, R) if len(z) else self.sensor
        return Scan(span.t, z, R, sensor, amplitude=amplitude, noise=noise, station=station)

    def _at(self, offset: Floats, z: Floats, R: Floats) -> Sensor:
        """The sensor of a scan with plots z (M, m), R, and time offsets (M,) from the scan's time."""
        if np.abs(offset).max() < SIMULTANEOUS_S:
            return self.sensor
        from scipy.spatial import KDTree

        return Sweep(self.sensor, KDTree(self.sensor.locate(z, R)[0]), offset, self.speed)


def measurements(plots: Plots, settings: RadarSettings) -> Measurements:
    """Plots in the coordinates of the settings' estimator.

    NONLINEAR estimators use range and angles directly; others use positions, converted without bias. A range rate is
    linearised; alpha-beta and groups use positions only. The errors grow by the targets' extent.
    """
    if settings.estimator == "alpha-beta" or settings.group_link_m is not None:
        plots = plots.without_range_rate()
    converted = plots.polar and settings.estimator not in NONLINEAR
    if not converted:
        plots = plots.of_extended_targets(settings.extent_m)
    z, R = plots.z, np.einsum("ni,ij->nij", plots.sigma**2, np.eye(plots.sigma.shape[1]))
    sensor: Sensor = PositionRangeRate(settings.position[: plots.dim]) if plots.doppler else POSITION
    if converted:
        position, cov = _polar(plots, settings).locate(z, R)
        z = np.column_stack([position, z[:, plots.dim :]])
        R[:, : plots.dim, : plots.dim] = cov + settings.extent_m**2 * np.eye(plots.dim)
    elif plots.polar:
        sensor = _polar(plots, settings)
    return Measurements(sensor, plots.dim, plots.scan, plots.time_s, settings.max_speed / 2, z, R, plots.amplitude)


def _polar(plots: Plots, settings: RadarSettings) -> Sensor:
    if plots.dim == 2:
        return RangeAzimuth(settings.position[:2], plots.doppler)
    return RangeAzimuthElevation(settings.position, plots.doppler)


def longest_coast(feeds: Sequence[Measurements]) -> float:
    """Longest time from scan to scan that is a pause of none of the feeds [s]; no track coasts for longer."""
    return max((found.rhythm.limit_s for found in feeds), default=np.inf)


def clutter_density(found: Measurements) -> float:
    """Plots per scan and unit of measurement space: an upper bound, because targets count as clutter."""
    return len(found.z) / found.count / surveyed(found)


def surveyed(found: Measurements) -> float:
    """Volume of the measurement space that is surveyed."""
    low, high = extent(found)
    return float((high - low).prod())


def extent(found: Measurements) -> tuple[Floats, Floats]:
    """Lowest and highest (m,) measurements of what is surveyed: the bounding box of all plots, and around it a margin
    that targets cross in a few scans. Without it the plots of a single target would fill the space, and appear as
    dense clutter.

    Of azimuths it is the smallest sector, from -pi..pi on, and at most a full turn; ranges begin at zero.
    """
    margin = _margin(found) / 2
    low, high = found.z.min(axis=0) - margin, found.z.max(axis=0) + margin
    for angle in found.sensor.angles:
        first, width = sector(found.z[:, angle])
        side = min(width + 2 * margin[angle], 2 * np.pi)
        low[angle], high[angle] = first + (width - side) / 2, first + (width + side) / 2
    if isinstance(found.sensor, RangeAzimuth | RangeAzimuthElevation):
        low[0] = max(low[0], 0.0)
    return low, high


def _margin(found: Measurements) -> Floats:
    """(m,) distance that a target with twice the speed's standard deviation covers in REACH_SCANS scans.

    An angle turns by that over the usual range; without ranges it may turn by as much as it likes.
    """
    step = 2 * REACH_SCANS * 2 * found.speed * found.rhythm.scan_s
    margin = np.full(found.z.shape[1], step)
    margin[list(found.sensor.angles)] = 2 * np.pi
    if isinstance(found.sensor, RangeAzimuth | RangeAzimuthElevation):
        margin[1 : found.dim] = np.minimum(step / np.median(found.z[:, 0]), np.pi)
    margin[found.dim :] = 4 * found.speed
    return margin + np.sqrt(12 * np.diagonal(found.R, axis1=1, axis2=2).mean(axis=0))

"""A radar that looks at flights: resolution cells, fluctuating echoes, misses, clutter, glint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from vidtrack.amplitude.densities import RAYLEIGH, Weibull, linear, swerling1
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.radar.coordinates import to_polar, wrap
from vidtrack.simulate.flight import Flight

GLINT_FACTOR = 5.0
"""A glint error's standard deviation over the usual one."""


@dataclass(frozen=True, slots=True)
class Patch:
    """A part of the coverage, between two corners, with `more` times as many false plots in addition."""

    low: tuple[float, ...]
    high: tuple[float, ...]
    more: float


@dataclass(frozen=True, slots=True)
class Radar:
    """What the radar can see and how well; range [m], azimuth [deg][, elevation [deg]].

    scan_s     time between scans
    low, high  limits of the coverage
    cell       resolution cell; targets nearer than that to each other give one plot
    sigma      standard deviations of a plot
    snr_db     mean signal to noise ratio of a target, Swerling I; None: each target is seen in each scan
    p_fa       probability that a resolution cell without a target exceeds the threshold
    clutter    amplitudes in such cells; sets the threshold
    glint      probability that a component of a plot has GLINT_FACTOR times its standard deviation
    place      (x, y, z) of the radar [m]
    start_s    time of the first scan
    patches    parts with more clutter
    """

    scan_s: float
    low: tuple[float, ...]
    high: tuple[float, ...]
    cell: tuple[float, ...]
    sigma: tuple[float, ...]
    snr_db: float | None = None
    p_fa: float = 0.0
    clutter: Weibull = RAYLEIGH
    glint: float = 0.0
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_s: float = 0.0
    patches: tuple[Patch, ...] = ()

    @property
    def dim(self) -> int:
        """2 without elevation, 3 with it."""
        return len(self.sigma)

    @property
    def cells(self) -> float:
        """Number of resolution cells."""
        return float(np.prod((np.array(self.high) - self.low) / self.cell))

    @property
    def threshold(self) -> float:
        """Amplitude that a plot exceeds, in units of the noise."""
        return float(self.clutter.threshold(self.p_fa)) if self.p_fa > 0 else 0.0

    def measures(self, xyz: Floats) -> Floats:
        """(K, dim) range, azimuth 0..360[, elevation] of positions (K, 3)."""
        polar = to_polar((xyz - self.place)[:, : self.dim])
        polar[:, 1:] = np.degrees(polar[:, 1:])
        polar[:, 1] %= 360
        return polar

    def covers(self, xyz: Floats) -> Mask:
        """(K,) positions (K, 3) inside the coverage."""
        polar = self.measures(xyz)
        return np.asarray(((polar >= self.low) & (polar <= self.high)).all(axis=1))


@dataclass(frozen=True, slots=True)
class Target:
    """A flight from start_s to end_s."""

    flight: Flight
    start_s: float = 0.0
    end_s: float = np.inf


@dataclass(frozen=True, slots=True)
class Seen:
    """Plots in order of scan and azimuth, and the truth.

    scan, time_s  (N,)
    z             (N, dim) range [m], azimuth [deg][, elevation [deg]]
    amplitude     (N,) NaN where the radar gives none
    times         (K,) of the scans
    states        (targets, K, 6) x, y, z, vx, vy, vz
    there         (targets, K) whether a target exists and is in the coverage
    merged        (targets, K) whether a target is nearer to another one than a resolution cell
    """

    radar: Radar
    scan: Ints
    time_s: Floats
    z: Floats
    amplitude: Floats
    times: Floats
    states: Floats
    there: Mask
    merged: Mask


def observe(radar: Radar, targets: Sequence[Target], scans: int, rng: Generator) -> Seen:
    """Let the radar look at the targets."""
    times: Floats = radar.start_s + radar.scan_s * np.arange(scans, dtype=float)
    states = np.stack([np.hstack(target.flight(times)) for target in targets])
    there = np.stack([
        (times >= target.start_s) & (times <= target.end_s) & radar.covers(xyz)
        for target, xyz in zip(targets, states[..., :3], strict=True)
    ])  # fmt: skip
    true = np.stack([radar.measures(xyz) for xyz in states[..., :3]])
    leader = _unresolved(true, there, np.array(radar.cell))
    echo_scan, echo, amplitude = _echoes(radar, true, there, leader, rng)
    false_scan, false, false_amplitude = _clutter(radar, scans, rng)
    scan = np.concatenate([echo_scan, false_scan])
    z = np.concatenate([echo, false])
    order = np.lexsort((z[:, 1], scan))
    together = (leader[None] == leader[:, None]) & there[None] & there[:, None]
    return Seen(
        radar,
        scan[order],
        times[scan[order]],
        z[order],
        np.concatenate([amplitude, false_amplitude])[order],
        times,
        states,
        there,
        together.sum(axis=0) > 1,
    )


def _unresolved(true: Floats, there: Mask, cell: Floats) -> Ints:
    """(targets, K) the first target among those that share one echo with each: neighbours, and theirs."""
    apart = np.abs(_differences(true[:, None], true[None]))
    near = (apart < cell).all(axis=-1) & there[:, None] & there[None]
    near |= np.eye(len(true), dtype=bool)[..., None]
    for _ in range(len(true)):
        near = np.einsum("ijk,jlk->ilk", near, near)
    return near.argmax(axis=0)


def _differences(a: Floats, b: Floats) -> Floats:
    """a - b in range, azimuth [deg][, elevation], the short way round."""
    difference = a - b
    difference[..., 1] = np.degrees(wrap(np.radians(difference[..., 1])))
    return difference


def _echoes(radar: Radar, true: Floats, there: Mask, leader: Ints, rng: Generator) -> tuple[Ints, Floats, Floats]:
    """Scan, measurement and amplitude of the targets' plots: an unresolved group is one, at its centre of power."""
    if radar.snr_db is None:
        strength = np.ones(there.shape)
    else:
        strength = swerling1(linear(radar.snr_db)).sample(rng, there.shape)
    power = np.where(there, strength**2, 0.0)
    k = np.broadcast_to(np.arange(there.shape[1]), there.shape)
    total, centre = np.zeros(there.shape), np.zeros(true.shape)
    np.add.at(total, (leader, k), power)
    np.add.at(centre, (leader, k), power[..., None] * _differences(true, true[leader, k]))
    amplitude = np.sqrt(total)
    threshold = 0.0 if radar.snr_db is None else radar.threshold
    target, scan = np.nonzero(amplitude > threshold)
    error = np.array(radar.sigma) * rng.standard_normal((len(scan), radar.dim))
    error *= np.where(rng.random(error.shape) < radar.glint, GLINT_FACTOR, 1.0)
    z = true[target, scan] + centre[target, scan] / total[target, scan, None] + error
    z[:, 1] %= 360
    return scan, z, np.where(radar.snr_db is None, np.nan, amplitude[target, scan])


def _clutter(radar: Radar, scans: int, rng: Generator) -> tuple[Ints, Floats, Floats]:
    """Scan, measurement and amplitude of false plots: Poisson in number, alike in all resolution cells of a part."""
    parts = (Patch(radar.low, radar.high, 1.0), *radar.patches)
    drawn = []
    for part in parts:
        cells = np.prod((np.array(part.high) - part.low) / radar.cell)
        false = np.repeat(np.arange(scans), rng.poisson(part.more * radar.p_fa * cells, scans))
        drawn.append((false, rng.uniform(part.low, part.high, (len(false), radar.dim))))
    scan, z = (np.concatenate(each) for each in zip(*drawn, strict=True))
    return scan, z, radar.clutter.sample(rng, len(scan), above=radar.threshold)

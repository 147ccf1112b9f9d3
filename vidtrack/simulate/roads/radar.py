"""A traffic radar beside the road: range, azimuth and Doppler of vehicles, with misses and false plots."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.radar.coordinates import to_polar, wrap
from vidtrack.simulate.roads.clip import RoadClip

SALT = 11
"""Of the radar's random numbers, so that the video of a seed does not depend on it."""


@dataclass(frozen=True, slots=True)
class TrafficRadar:
    """What the radar beside the camera sees, and how well.

    scan_s       time between scans
    farthest     m; largest range
    sector       rad; width of the sector about the camera's axis
    sigma        standard deviations in range [m], azimuth [rad] and Doppler [m/s]
    detected     probability that a scan detects a vehicle
    least        m/s; a slower range rate is not told from the road
    false        mean number of false plots a scan
    body         the echo's standard deviation along a vehicle, in its lengths
    """

    scan_s: float = 0.1
    farthest: float = 120.0
    sector: float = np.radians(100)
    sigma: tuple[float, float, float] = (0.4, np.radians(1.0), 0.15)
    detected: float = 0.9
    least: float = 0.7
    false: float = 0.5
    body: float = 0.15


def road_plots(clip: RoadClip, radar: TrafficRadar) -> Floats:
    """(N, 5) scan, time [s], range [m], azimuth [rad] from north, range rate [m/s], in order of time."""
    rng = np.random.default_rng((clip.seed, SALT))
    place, middle = clip.eye.position[:2], np.pi / 2 - clip.layout.azimuth
    rows = []
    for scan, t in enumerate(np.arange(0.0, float(clip.times[-1]) + 1e-9, radar.scan_s)):
        states = clip.history.at(float(t))
        ahead = np.column_stack([np.cos(states.heading), np.sin(states.heading)])
        length = clip.fleet.length[states.vehicle]
        from_radar = states.xy - place + (radar.body * length * rng.standard_normal(len(length)))[:, None] * ahead
        polar = to_polar(from_radar)
        rate = states.speed * np.sum(ahead * from_radar, axis=1) / polar[:, 0]
        seen = (polar[:, 0] < radar.farthest) & (np.abs(wrap(polar[:, 1] - middle)) < radar.sector / 2)
        seen &= (np.abs(rate) > radar.least) & (rng.random(len(rate)) < radar.detected)
        z = np.column_stack([polar, rate])[seen]
        z += np.array(radar.sigma) * rng.standard_normal(z.shape)
        count = rng.poisson(radar.false)
        false = np.column_stack([
            radar.farthest * np.sqrt(rng.random(count)),
            middle + radar.sector * (rng.random(count) - 0.5),
            rng.uniform(-20, 20, count),
        ])  # fmt: skip
        found = np.vstack([z, false])
        found[:, 0] = np.maximum(found[:, 0], 1.0)
        rows.append(np.column_stack([np.full((len(found), 2), (scan, t)), found]))
    return np.vstack(rows)


def write_road_plots(folder: Path, clip: RoadClip, radar: TrafficRadar | None = None) -> None:
    """Write radar.csv and radars.toml beside a road's video."""
    radar = radar or TrafficRadar()
    plots = road_plots(clip, radar)
    plots[:, 3] = np.degrees(wrap(plots[:, 3] - (np.pi / 2 - clip.layout.azimuth)))
    header = "scan,time_s,range_m,azimuth_deg,doppler_m_s"
    np.savetxt(folder / "radar.csv", plots, fmt="%d,%.6f,%.4f,%.6f,%.4f", header=header, comments="")
    x, y, height = clip.eye.position
    keys = {
        "x_m": x,
        "y_m": y,
        "height_m": height,
        "boresight_deg": 90 - np.degrees(clip.layout.azimuth),
        "sigma_range_m": radar.sigma[0],
        "sigma_azimuth_deg": np.degrees(radar.sigma[1]),
        "sigma_doppler_m_s": radar.sigma[2],
        "scan_s": radar.scan_s,
        "farthest_m": radar.farthest,
        "slowest_m_s": radar.least,
        "sector_deg": np.degrees(radar.sector),
        "detection_probability": min(radar.detected, 0.99),
    }
    lines = [f"{key} = {float(value):.6g}" for key, value in keys.items()]
    (folder / "radars.toml").write_text("\n".join(["[radars.radar]", *lines, ""]), encoding="utf-8")

"""Where things go: routes along roads, and how fast they are driven."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats
from vidtrack.simulate.scene import Path

KNOT_S = 1 / 120


def route(*waypoints: tuple[float, float], radius: float = 0.0) -> Floats:
    """A polyline (K, 2) through the waypoints, with a vertex about every pixel.

    Inner corners become curves that begin `radius` before the corner.
    """
    points = np.array(waypoints, dtype=float)
    pieces = [points[:1]]
    for before, corner, after in zip(points[:-2], points[1:-1], points[2:], strict=True):
        enter = corner + radius * _unit(before - corner)
        leave = corner + radius * _unit(after - corner)
        u = np.linspace(0, 1, 25)[:, None]
        pieces.append((1 - u) ** 2 * enter + 2 * u * (1 - u) * corner + u**2 * leave)
    coarse = np.concatenate([*pieces, points[-1:]])
    at = _distances(coarse)
    return _interpolate(np.linspace(0, at[-1], round(at[-1]) + 1), at, coarse)


def distance_to(line: Floats, point: tuple[float, float]) -> float:
    """How far along a polyline (K, 2) its vertex nearest to `point` is [px]."""
    return float(_distances(line)[np.linalg.norm(line - point, axis=1).argmin()])


def drive(line: Floats, t: Floats, s: Floats) -> Path:
    """Follow a polyline (K, 2) with travelled distance s (N,) [px] at times t (N,) [s]; beyond its ends straight on."""
    steps = np.diff(line, axis=0)
    at = _distances(line)
    middle = (at[1:] + at[:-1]) / 2
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    xy = _interpolate(s, at, line)
    xy += np.minimum(s, 0)[:, None] * _unit(steps[0]) + np.maximum(s - at[-1], 0)[:, None] * _unit(steps[-1])
    return Path(t, xy, np.interp(s, middle, heading))


def cruise(
    line: Floats, speed: float, s0: float, t0: float, duration_s: float, rng: Generator, vary: float = 0.06
) -> Path:
    """Follow a polyline at about `speed` [px/s], slowly varied by the share `vary`, being at distance s0 at time t0."""
    t = np.arange(0, duration_s + KNOT_S, KNOT_S)
    period, phase = rng.uniform(4, 8), rng.uniform(0, 2 * np.pi)
    w = 2 * np.pi / period
    travelled = speed * (t - vary / w * np.cos(w * t + phase))
    return drive(line, t, s0 + travelled - np.interp(t0, t, travelled))


def jerky(
    speed: float, duration_s: float, rng: Generator, share: float = 0.4, rate: float = 15.0
) -> tuple[Floats, Floats]:
    """Times and travelled distance under random along-track accelerations, constant over each 1/rate s.

    In units of 1/rate s: a ~ N(0, (share speed)^2) + 0.2 (speed - v). A share of 0.4 is 0.8 px at 2 px a
    frame, the multi-frame experiment on the crossing of paper 004. The vehicle never goes backwards.
    """
    steps = int(np.ceil(duration_s * rate)) + 1
    v = np.empty(steps + 1)
    v[0] = speed
    for k, a in enumerate(rng.normal(0, share * speed, steps)):
        v[k + 1] = max(v[k] + a + 0.2 * (speed - v[k]), 0.1 * speed)
    knots = np.arange(steps + 1) / rate
    t = np.arange(0, duration_s + KNOT_S, KNOT_S)
    v_t = np.interp(t, knots, v)
    return t, np.concatenate([[0.0], np.cumsum((v_t[1:] + v_t[:-1]) / 2 * KNOT_S)])


def sway(xy: tuple[float, float], amplitude: float, duration_s: float, rng: Generator) -> Path:
    """Leaves in the wind: two sines in x, one in y, about xy, `amplitude` px each way."""
    t = np.arange(0, duration_s + KNOT_S, KNOT_S)
    f, phase = rng.uniform(0.25, 0.6, 3), rng.uniform(0, 2 * np.pi, 3)
    wave = np.sin(2 * np.pi * f * t[:, None] + phase)
    offset = np.stack([0.7 * wave[:, 0] + 0.3 * wave[:, 1], 0.4 * wave[:, 2]], axis=-1)
    return Path(t, np.array(xy) + amplitude * offset, np.zeros(len(t)))


def _distances(line: Floats) -> Floats:
    """Distance (K,) of each vertex along a polyline (K, 2)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def _interpolate(s: Floats, at: Floats, line: Floats) -> Floats:
    """Points (N, 2) at distances s (N,) along a polyline (K, 2) whose vertices are at distances (K,)."""
    return np.stack([np.interp(s, at, line[:, axis]) for axis in (0, 1)], axis=-1)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))

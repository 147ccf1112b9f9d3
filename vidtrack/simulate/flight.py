"""Where aircraft fly: closed-form paths, so that the truth is exact at any time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays.types import Floats

G = 9.80665
"""m/s^2, the acceleration that manoeuvres are measured in."""

Flight = Callable[[Floats], tuple[Floats, Floats]]
"""Positions (K, 3) [m] and velocities (K, 3) [m/s] at times (K,) [s]; x east, y north, z up."""


@dataclass(frozen=True, slots=True)
class Leg:
    """A part of a flight.

    duration_s  the last leg of a flight goes on for ever
    accel       m/s^2 along the velocity
    turn        rad/s, clockwise as seen from above
    """

    duration_s: float
    accel: float = 0.0
    turn: float = 0.0


def fly(start: ArrayLike, velocity: ArrayLike, legs: Sequence[Leg] = (Leg(np.inf),)) -> Flight:
    """A flight of straight, accelerated and turning legs, from time 0."""
    entries = [(0.0, np.array(start, float), np.array(velocity, float))]
    for leg in legs[:-1]:
        t, p, v = entries[-1]
        p, v = _along(leg, p, v, np.array([leg.duration_s]))
        entries.append((t + leg.duration_s, p[0], v[0]))

    def states(times: Floats) -> tuple[Floats, Floats]:
        p, v = np.empty((len(times), 3)), np.empty((len(times), 3))
        current = np.searchsorted([entry[0] for entry in entries[1:]], times, side="right")
        for k, (leg, entry) in enumerate(zip(legs, entries, strict=True)):
            on = current == k
            p[on], v[on] = _along(leg, *entry[1:], times[on] - entry[0])
        return p, v

    return states


def weave(flight: Flight, amplitude: float, period_s: float, from_s: float) -> Flight:
    """The flight with a sine in its altitude from a time on."""

    def states(times: Floats) -> tuple[Floats, Floats]:
        p, v = flight(times)
        w = 2 * np.pi / period_s
        phase = w * np.maximum(times - from_s, 0)
        p[:, 2] += amplitude * np.sin(phase)
        v[:, 2] += np.where(times >= from_s, amplitude * w * np.cos(phase), 0)
        return p, v

    return states


def swing(flight: Flight, amplitude: ArrayLike, period_s: float, phase: float) -> Flight:
    """The flight with a sine of this amplitude (3,) [m] in its position, at all times; phase [rad] at time 0."""
    w, side = 2 * np.pi / period_s, np.array(amplitude, float)

    def states(times: Floats) -> tuple[Floats, Floats]:
        p, v = flight(times)
        angle = w * times + phase
        return p + np.outer(np.sin(angle), side), v + np.outer(w * np.cos(angle), side)

    return states


def sidestep(flight: Flight, offset: ArrayLike, near: float, times_s: Sequence[float], after: float = 1.0) -> Flight:
    """The flight displaced by `offset` [m], but by its share `near` in the middle, and by `after` of it at the end.

    times_s  the four times between which it comes nearer and goes away again, each along half a cosine
    """
    a, b, c, d = times_s

    def states(times: Floats) -> tuple[Floats, Floats]:
        p, v = flight(times)
        coming, going = np.clip((times - a) / (b - a), 0, 1), np.clip((times - c) / (d - c), 0, 1)
        share = 1 + (near - 1) * (1 - np.cos(np.pi * coming)) / 2 + (after - near) * (1 - np.cos(np.pi * going)) / 2
        slope = (near - 1) * np.sin(np.pi * coming) / (b - a) + (after - near) * np.sin(np.pi * going) / (d - c)
        slope *= np.pi / 2
        return p + share[:, None] * np.array(offset), v + slope[:, None] * np.array(offset)

    return states


def _along(leg: Leg, p: Floats, v: Floats, t: Floats) -> tuple[Floats, Floats]:
    """States (K, 3), (K, 3) after times t (K,) on a leg entered at p (3,) with v (3,)."""
    if leg.turn == 0:
        heading = v / np.linalg.norm(v)
        a = leg.accel * heading
        return p + np.outer(t, v) + np.outer(t**2 / 2, a), v + np.outer(t, a)
    s, c = np.sin(leg.turn * t), np.cos(leg.turn * t)
    right = np.array([v[1], -v[0], 0.0])  # a turn clockwise is a turn towards it
    level, climb = v * [1, 1, 0], v * [0, 0, 1]
    position = p + (np.outer(s, level) + np.outer(1 - c, right)) / leg.turn + np.outer(t, climb)
    return position, np.outer(c, level) + np.outer(s, right) + climb

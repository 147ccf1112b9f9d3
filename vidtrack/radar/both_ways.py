"""Antennas that sweep over a sector back and forth: a pass ends where the azimuth turns back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.radar.coordinates import sector
from vidtrack.radar.feeds.pace import FASTEST_S, LOOKED_AT, TARGETS_M_S, UNLIKELY, USUAL_S
from vidtrack.radar.rhythm import PASSES, SWEEPS

LOOKED_AT_S = 6 * USUAL_S
"""s; so much of the plots tells how long a pass takes: three times there and back of the slowest that is looked for."""
FOLLOWS = 0.9
"""Share of the azimuths' variance that a wave explains, 0.98 of it back and forth; 0.6 where the antenna jumps back."""
BALANCE = 0.75
"""Steps to one side for each to the other, at least; an antenna that jumps back has few plots on its way."""
TOGETHER = 8
"""Passes that together tell when the antenna turned: its rate is not quite even."""


class Wave(NamedTuple):
    """An azimuth that swings about its middle [rad], once in period_s."""

    period_s: float
    middle: float

    def turn(self, time_s: Floats) -> Floats:
        """(N,) directions, as numbers of length 1, that turn once in a period."""
        return np.asarray(np.exp(2j * np.pi * time_s / self.period_s))


def both_ways(time_s: Floats, range_m: Floats, azimuth: Floats, coarse_s: float) -> tuple[Ints, float] | None:
    """The pass of an antenna that sweeps back and forth that each of the plots (N,) is of, and its duration [s].

    time_s    (N,) s, in order, in steps of coarse_s, of which a pass lasts two
    range_m   (N,) m
    azimuth   (N,) rad
    None if azimuths do not swing, or do not go to one side in a pass and back in the next, or if it is targets that do:
    those of a radar that stares are seen all the time.
    """
    begin, width = sector(azimuth % (2 * np.pi))
    aside = np.angle(np.exp(1j * (azimuth - begin - width / 2)))
    wave = _wave(time_s, aside, coarse_s)
    if wave is None:
        return None
    number = np.floor(_passed(wave, time_s, aside)).astype(np.int64)
    if not _turns_back(time_s, aside, number) or _seen_all_the_time(time_s, range_m, number):
        return None
    return number, wave.period_s / 2


def _wave(time_s: Floats, aside: Floats, coarse_s: float) -> Wave | None:
    """The wave that angles (N,) follow best; None if they follow none."""
    begin = np.searchsorted(time_s, time_s[0] + LOOKED_AT_S)
    rows = np.unique(np.linspace(0, begin - 1, LOOKED_AT).astype(np.int64))
    time_s, aside = time_s[rows] - time_s[0], aside[rows]
    span_s, count = float(time_s[-1]), len(np.unique(time_s))
    fastest_s = 2 * max(FASTEST_S, 2 * coarse_s)
    spread = float(((aside - aside.mean()) ** 2).sum())
    if count <= PASSES or span_s < 2 * fastest_s or spread == 0:
        return None
    rates = np.arange(max(1 / (2 * USUAL_S), 1.5 / span_s), 1 / fastest_s, 0.2 / span_s)

    def swings(rate: float) -> tuple[float, float]:
        """The share of the variance that a wave of this rate explains, and its middle."""
        turn = 2 * np.pi * rate * time_s
        wave = np.column_stack([np.ones(len(turn)), np.cos(turn), np.sin(turn)])
        found = np.linalg.lstsq(wave, aside, rcond=None)[0]
        return 1 - float(((aside - wave @ found) ** 2).sum()) / spread, float(found[0])

    if not len(rates):
        return None
    best = max(rates.tolist(), key=lambda rate: swings(rate)[0])
    best = max((best + np.linspace(-0.15, 0.15, 13) / span_s).tolist(), key=lambda rate: swings(rate)[0])
    share, middle = swings(best)
    chance = 1 - np.exp(-2 * (np.log(len(rates)) + UNLIKELY) / (count - 3))
    return Wave(1 / best, middle) if share > max(FOLLOWS, chance) else None


def _passed(wave: Wave, time_s: Floats, aside: Floats) -> Floats:
    """(N,) passes since some turn of the antenna, which follows the angles (N,) for a few passes each."""
    turn = wave.turn(time_s)
    _, block = np.unique(np.floor(time_s / (TOGETHER / 2 * wave.period_s)), return_inverse=True)
    size = np.bincount(block)
    swing = (aside - wave.middle) * turn
    late = np.angle(np.bincount(block, swing.real) + 1j * np.bincount(block, swing.imag))
    late = np.interp(time_s, np.bincount(block, time_s) / size, np.unwrap(late))
    return 2 * time_s / wave.period_s - late / np.pi


def _turns_back(time_s: Floats, aside: Floats, number: Ints) -> bool:
    """Whether angles (N,) fall in passes of one kind, and rise in the others, from time to time."""
    _, member = np.unique(time_s, return_inverse=True)
    size = np.bincount(member)
    mean, of = np.bincount(member, aside) / size, np.bincount(member, number) / size
    within = np.diff(of) == 0
    rises, odd = np.diff(mean)[within] > 0, of[1:][within] % 2 == 1
    few, many = sorted((int(odd.sum()), int((~odd).sum())))
    if few < max(PASSES, BALANCE * many):
        return False
    share = float(rises[odd].mean()), float(rises[~odd].mean())
    return max(share) >= SWEEPS and min(share) <= 1 - SWEEPS


def _seen_all_the_time(time_s: Floats, range_m: Floats, number: Ints) -> bool:
    """Whether most plots have one of nearly their range at the next time of the same pass."""
    times, first = np.unique(time_s[:LOOKED_AT], return_index=True)
    seen = np.split(range_m[:LOOKED_AT], first[1:])
    speed = [
        np.abs(seen[k][:, None] - seen[k + 1]).min(axis=1) / (times[k + 1] - times[k])
        for k in np.flatnonzero(number[first[1:]] == number[first[:-1]]).tolist()
    ]
    return bool(speed) and bool(np.median(np.concatenate(speed)) < TARGETS_M_S)

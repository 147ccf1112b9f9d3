"""Which scan each message belongs to: by the turns of the antenna, or by time."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.radar.feeds.clock import JUMP_S, Clock
from vidtrack.radar.feeds.messages import NO_TARGET, Kind, Losses, Messages

FASTEST_S, USUAL_S, SLOWEST_S = 0.4, 20.0, 90.0
"""s; durations of a turn that are looked for: up to the second first, and if there is none, up to the third."""
ONCE_ROUND = 1.5
"""Turns of a slow antenna that its plots must last, for azimuths that hardly change follow a slow one for a while."""
MOST_IN_A_STEP = 0.7
"""Turns in a step of rounded times up to which they can be told from azimuths that stay."""
TARGETS_M_S = 1000.0
"""m/s; plots that follow each other at less may be of one target round the radar, and tell no slow antenna."""
ROTATES = 0.8
"""Mean resultant length from which the azimuths follow a turning antenna."""
RELATED = 0.5
"""Correlation of azimuths with the antenna's angles from which they follow it: of plots in a sector, in scans that come
in bursts, both stay near their means at some rate, but do not vary with each other."""
STAYS = 1e-6
"""Product of standard deviations of two directions, as numbers of length 1, up to which one of them does not vary."""
UNLIKELY = 6.0
"""Negative logarithm of the probability that azimuths at random seem to follow an antenna."""
ONE_BY_ONE = 0.9
"""Share of plots with their own time from which an antenna seems to turn."""
LOOKED_AT = 1000
"""Plots from which the duration of a turn is found."""
PULL, FARTHEST = 0.2, 0.05
"""Share of the deviation of an azimuth by which the antenna's angle is corrected, and the largest deviation used, in
turns: a false time must not turn the antenna."""
LONGEST_ROUND_S = 30.0
"""s; targets that report more rarely are missing in some scans."""

DISORDER_S = 5.0
"""s; so much later than others a message may come through a network and a recorder, even if the antenna turns fast."""
ONE_SCAN_S = 1.0
"""s; duration of a scan where all plots are of one time."""


class Pace(Protocol):
    """Numbers the scans of messages, batch after batch.

    period_s    duration of a scan
    disorder_s  by how much a message may be older than the one before; a clock that goes back further was set
    """

    period_s: float
    disorder_s: float

    def progress(self, messages: Messages) -> Floats:
        """(N,) scans that had passed at each message; its integer part is the number of the message's scan."""


class Turns:
    """Scans of a turning antenna: one a turn, from north to north.

    A message at azimuth a in the n-th turn sees the antenna at n + a / 2 pi turns. The antenna's angle follows the
    times and is pulled to the azimuths of marks and plots, so a plot just west of north stays in its scan however its
    time is rounded, and lost marks do no harm.

    period_s    duration of a turn
    disorder_s  a radar sends a plot before the antenna has turned once more
    beamed      the times of plots are those at which the antenna passed them; else the antenna follows the marks
                alone, and a scan holds the plots from one north mark to the next
    """

    def __init__(self, period_s: float, *, beamed: bool = True) -> None:
        self.period_s = period_s
        self.disorder_s = min(max(period_s, DISORDER_S), JUMP_S)
        self._beamed = beamed
        self._turn: float | None = None
        self._time = 0.0

    def progress(self, messages: Messages) -> Floats:
        """(N,) turns at each message."""
        azimuth = messages.v / (2 * math.pi) % 1
        turns = np.empty(len(messages))
        for k, (time, part, mark) in enumerate(
            zip(messages.time_s.tolist(), azimuth.tolist(), messages.marks.tolist(), strict=True)
        ):
            turns[k] = self._advance(time, part, mark)
        return turns

    def _advance(self, time: float, part: float, mark: bool) -> float:
        """The turns at a message at `part` of a turn; moves the antenna to its time."""
        follows = mark or self._beamed
        if self._turn is None:
            if not follows:
                return 0.0  # before the first mark
            self._turn, self._time = part + 1, time
        turn = self._turn + (time - self._time) / self.period_s
        self._time = time
        nearest = part + round(turn - part)
        if mark:
            self._turn = nearest
        elif follows:
            self._turn = turn + PULL * min(max(nearest - turn, -FARTHEST), FARTHEST)
        else:
            self._turn = turn
        return nearest if follows else turn + FARTHEST


class Rounds:
    """Scans of equal durations.

    start_s  begin of scan 0
    """

    def __init__(self, period_s: float, start_s: float) -> None:
        self.period_s = period_s
        self.disorder_s = JUMP_S
        self._start_s = start_s

    def progress(self, messages: Messages) -> Floats:
        """(N,) durations since the start at each message."""
        return np.asarray((messages.time_s - self._start_s) / self.period_s)


def paced(messages: Messages, scan_s: float | None, losses: Losses) -> tuple[Messages, Pace] | None:
    """The first messages of a feed that can be believed, and its pace; None: among them is no plot with a time.

    The clock is read twice: how far back it may go without having been set is known from the pace.
    """
    roughly = Clock(Losses()).on_one_clock(messages)
    if roughly.marks.all():
        return None
    pace = pace_of(roughly, scan_s)
    believed = Clock(losses, pace.disorder_s).on_one_clock(messages)
    if believed.marks.all():
        return None
    return believed, pace_of(believed, scan_s) if losses.resets else pace


def pace_of(messages: Messages, scan_s: float | None, coarse_s: float = 0.0) -> Pace:
    """The pace of a feed, from its first messages.

    scan_s    duration of a scan; None: from the marks of the antenna, else from the azimuths and times of the plots,
              else from how often targets report
    coarse_s  step of the times of plots, if they are rounded; a turn must last two
    """
    plots = messages.only(~messages.marks)
    period_s = scan_s or _stated(messages) or _found(plots, coarse_s)
    if period_s is not None and np.all(plots.kind == Kind.POLAR):
        beamed = bool(_follows(plots, period_s) > ROTATES * np.sinc(coarse_s / period_s))
        if beamed or messages.marks.any():
            return Turns(period_s, beamed=beamed)
    period_s = period_s or _usual(plots)
    return Rounds(period_s, float(plots.time_s.min()) - period_s / 2)


def is_unknown(pace: Pace, messages: Messages) -> bool:
    """Whether plots come one by one from all round, as from a turning antenna, but nothing tells how long a turn takes.

    Those of a radar that stares stay in some quarters.
    """
    plots = messages.only(~messages.marks)
    if isinstance(pace, Turns) or (plots.target != NO_TARGET).any() or (plots.kind != Kind.POLAR).any():
        return False
    quarters = np.unique(np.floor(plots.v / (np.pi / 2)) % 4)
    return len(quarters) == 4 and len(np.unique(plots.time_s)) >= ONE_BY_ONE * len(plots)


def _stated(messages: Messages) -> float | None:
    """The duration of a turn that service messages state, or that takes from mark to mark."""
    marks = messages.only(messages.marks)
    said = marks.u[np.isfinite(marks.u)]
    if len(said):
        return float(np.median(said))
    order = np.argsort(marks.time_s, kind="stable")
    time_s, turned = np.diff(marks.time_s[order]), np.diff(marks.v[order]) / (2 * np.pi) % 1
    turned = np.where(turned == 0, 1.0, turned)  # from north to north
    periods = time_s / turned
    periods = periods[(time_s > 0) & (periods > FASTEST_S)]
    return float(np.median(periods)) if len(periods) else None


def _found(plots: Messages, coarse_s: float) -> float | None:
    """The duration of a turn that the azimuths of plots follow best; None for targets with numbers, whose reports no
    beam times, and if they follow none.
    """
    if len(plots) < 2 or (plots.target != NO_TARGET).any() or (plots.kind != Kind.POLAR).any():
        return None
    quick = None if coarse_s and not are_apart(plots) else _peak(plots, FASTEST_S, USUAL_S, coarse_s)
    return quick or (_peak(plots, USUAL_S, SLOWEST_S, coarse_s) if are_apart(plots) else None)


def turn_within(plots: Messages, coarse_s: float) -> float | None:
    """The duration of a turn that is too short, below two steps of rounded times, to tell which turn a plot is of.

    plots in order of time
    """
    if len(plots) < 2 or not are_apart(plots):
        return None
    begin = _spread(plots, max(LOOKED_AT, int(np.searchsorted(plots.time_s, plots.time_s[0] + 3 * USUAL_S))))
    span = max(float(np.ptp(begin.time_s)), coarse_s)
    return _highest(begin, np.arange(0.5, MOST_IN_A_STEP, 0.2 * coarse_s / span) / coarse_s, coarse_s)


def are_apart(plots: Messages) -> bool:
    """Whether plots that follow each other are mostly too far apart to be of one target."""
    order = np.argsort(plots.time_s, kind="stable")
    step_m = np.abs(np.diff((plots.u * np.exp(1j * plots.v))[order]))
    step_s = np.diff(plots.time_s[order])
    later = step_s > 0
    return bool(later.any() and np.median(step_m[later] / step_s[later]) > TARGETS_M_S)


def _peak(plots: Messages, fastest_s: float, slowest_s: float, coarse_s: float) -> float | None:
    """The duration of a turn, of those between two, at the highest peak of the periodogram of azimuths.

    None for a peak that chance could make. Of times that are rounded to steps of coarse_s it is as much lower as the
    antenna turns in a step; faster turns than one in two steps look like slower ones.
    """
    begin = plots.only(plots.time_s <= plots.time_s.min() + 3 * slowest_s)
    begin = _spread(begin, len(begin) if coarse_s else LOOKED_AT)  # the rate of an antenna drifts
    span = max(float(np.ptp(begin.time_s)), FASTEST_S)
    fastest_s, slowest_s = max(fastest_s, 2 * coarse_s), min(slowest_s, max(span / ONCE_ROUND, USUAL_S))
    if fastest_s >= slowest_s:
        return None
    return _highest(begin, np.arange(1 / slowest_s, 1 / fastest_s, min(1 / slowest_s, 0.2 / span)), coarse_s)


def _spread(plots: Messages, count: int) -> Messages:
    """Up to LOOKED_AT of so many first plots, evenly: of a dense radar the first ones are of a turn or two."""
    count = min(count, len(plots))
    return plots.only(np.linspace(0, count - 1, min(count, LOOKED_AT)).astype(np.int64))


def _highest(plots: Messages, rate: Floats, coarse_s: float) -> float | None:
    """The duration of a turn at the highest peak, of these rates [1/s]; None for a peak that chance could make.

    Plots of one time count as one. Where they share times, or a turn is slow, azimuths must vary with the antenna.
    """
    seen, passed_s = np.exp(1j * plots.v), plots.time_s - plots.time_s[0]
    times = len(np.unique(passed_s))

    def score(rates: Floats) -> Floats:
        return np.array([abs((seen * np.exp(-2j * np.pi * one * passed_s)).mean()) for one in rates])

    left, height = np.sinc(coarse_s * rate), score(rate)
    at = int((height / left).argmax())
    chance = np.sqrt((np.log(len(rate)) + UNLIKELY) / times)
    if height[at] <= max(ROTATES * left[at], chance):
        return None
    if coarse_s == 0 and rate[0] >= 1 / USUAL_S and times >= ONE_BY_ONE * len(plots):
        return 1 / float(rate[at])
    near = rate[at] + np.linspace(-0.1, 0.1, 9) / max(float(passed_s.max()), FASTEST_S)
    near = np.clip(near, rate[0], rate[-1])
    best = float(near[score(near).argmax()])
    related = _correlation(seen, np.exp(2j * np.pi * best * passed_s))
    return 1 / best if related > max(RELATED * left[at], chance) else None


def _correlation(a: NDArray[np.complex128], b: NDArray[np.complex128]) -> float:
    """How much two series (N,) of directions, as numbers of length 1, vary with each other, 0 to 1; 0 if one stays."""
    spread = np.sqrt((1 - abs(a.mean()) ** 2) * (1 - abs(b.mean()) ** 2))
    return float(abs((a * b.conj()).mean() - a.mean() * b.mean().conj()) / spread) if spread > STAYS else 0.0


def _follows(plots: Messages, period_s: float) -> float:
    """How well times follow azimuths, 0 to 1: the mean over turns of the resultant length of their differences."""
    if not len(plots):
        return 0.0
    _, member = np.unique(np.floor((plots.time_s - plots.time_s[0]) / period_s), return_inverse=True)
    angle = np.exp(1j * (plots.v - 2 * np.pi * plots.time_s / period_s))
    count = np.bincount(member)
    length = np.hypot(np.bincount(member, angle.real), np.bincount(member, angle.imag))
    several = count > 1
    if not several.any():
        return 1.0
    return float(length[several].sum() / count[several].sum())


def _usual(plots: Messages) -> float:
    """The usual time between reports of a target, met by nine of ten targets; else between different times."""
    if (plots.target != NO_TARGET).any():
        steps = [np.median(step) for step in _steps_by_target(plots) if len(step)]
        return float(min(np.quantile(steps, 0.9), LONGEST_ROUND_S)) if steps else ONE_SCAN_S
    times = np.diff(np.unique(plots.time_s))
    return float(np.median(times)) if len(times) else ONE_SCAN_S


def _steps_by_target(plots: Messages) -> list[Floats]:
    order = np.lexsort((plots.time_s, plots.target))
    target, time_s = plots.target[order], plots.time_s[order]
    pieces = np.split(time_s, np.flatnonzero(np.diff(target)) + 1)
    steps = [np.diff(piece) for piece in pieces]
    return [step[step > 0] for step in steps]

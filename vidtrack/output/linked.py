"""Links broken tracks: joins a track that ends with one that begins soon after if motion and size agree."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np

from vidtrack.arrays.rows import starts
from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.assignment import assign
from vidtrack.associate.gate import quantile
from vidtrack.config.settings import OutputSettings
from vidtrack.errors import ConfigError
from vidtrack.estimate.motion.model import Motion
from vidtrack.output.sink import Sink, Step
from vidtrack.output.threaded import close_together
from vidtrack.tracking.boxes import absolute, longer
from vidtrack.tracking.register import Register
from vidtrack.tracks import COASTING, Tracks

PROBABILITY = 0.999
"""Probability that the parts of a broken track agree within the gate."""
SIZE_SIGMA = 0.2
"""Standard deviation of the logarithm of a width or height across a gap."""
ODDS = 5.0
"""Least likelihood ratio of one object against a new object that begins there by chance."""
JUMP, RARE = 0.25, 0.05
"""Standard deviation of a jump, in longer sides of the box, and how often tracks that break do so because of one: the
detector goes on with another part of the vehicle, or frames are missing."""
SETTLED = 6
"""Measurements after which a new track's velocity is known; its state is then retrodicted to its beginning."""


class Linked:
    """Passes steps on to `sinks` with broken tracks joined under the first id, and the gaps filled.

    motion     the tracker's motion model, which predicts across a gap from both sides
    longest_s  s; longest gap between the last measurement of one track and the first of the next

    Steps wait until no track exists or could continue, or until the end.
    """

    def __init__(self, *sinks: Sink, motion: Motion, longest_s: float) -> None:
        self._sinks = sinks
        self._motion = motion
        self._longest_s = longest_s
        self._waiting: deque[Step] = deque()
        self._there_s = -np.inf

    def step(self, step: Step) -> None:
        """Receive a step with confirmed tracks."""
        if len(step.tracks):
            self._there_s = step.time_s
        elif step.time_s - self._there_s > self._longest_s:
            self._release()
        self._waiting.append(step)

    def close(self) -> None:
        """Pass on the waiting steps."""
        try:
            self._release()
        finally:
            close_together(*self._sinks)

    def _release(self) -> None:
        steps = list(self._waiting)
        self._waiting.clear()
        for step in linked(steps, self._motion, self._longest_s):
            for sink in self._sinks:
                sink.step(step)


def refuse_link(settings: OutputSettings, where: str) -> None:
    """Raise ConfigError if output.link is set for a kind of input `where` tracks cannot be linked."""
    if settings.link:
        raise ConfigError(f"output.link has no effect in {where}: tracks are linked off line, by their boxes")


def linked(steps: list[Step], motion: Motion, longest_s: float) -> list[Step]:
    """The steps with broken tracks joined, and gaps of at most longest_s [s] filled."""
    if not any(step.tracks.seen.any() for step in steps):
        return steps
    ends = Ends(steps, motion)
    before, after = ends.links(longest_s)
    return ends.joined(steps, before, after) if len(before) else steps


class Ends:
    """First and last states of the tracks of some steps; rows are tracks, sorted by id.

    id (T,), first and last (T,) steps with a measurement; head and tail: states x (T, n), P (T, n, n) there, and boxes
    (T, 4) relative to the position
    """

    def __init__(self, steps: list[Step], motion: Motion) -> None:
        self.motion = motion
        self.time = np.array([step.time_s for step in steps])
        seen = [step.tracks.only(step.tracks.seen) for step in steps]
        at = np.repeat(np.arange(len(steps)), [len(tracks) for tracks in seen])
        columns = ("id", "x", "P", "box")
        ids, x, P, box = (np.concatenate([getattr(tracks, name) for tracks in seen]) for name in columns)
        self.extent = float(np.prod(np.max(box[:, :2] + box[:, 2:], axis=0) - box[:, :2].min(axis=0)))
        order = np.argsort(ids, kind="stable")
        self.id, begin, count = np.unique(ids[order], return_index=True, return_counts=True)
        first, last = order[begin], order[begin + count - 1]
        settled = order[begin + np.minimum(count, SETTLED) - 1]
        relative = absolute(box, -x[:, list(motion.position)])
        self.first, self.last = at[first], at[last]
        self.tail_x, self.tail_P, self.tail_box = x[last], P[last], relative[last]
        self.head_x, self.head_P, self.head_box = x[settled], P[settled], relative[first]
        back = self.time[self.first] - self.time[at[settled]]
        for dt in np.unique(back):
            rows = np.flatnonzero(back == dt)
            moved = self._moved(self.head_x[rows], self.head_P[rows], dt, self.head_box[rows])
            self.head_x[rows], self.head_P[rows] = moved

    def links(self, longest_s: float) -> tuple[Ints, Ints]:
        """Rows (L,) of tracks that end, and rows (L,) of their continuations at most longest_s [s] later.

        The one-to-one assignment of largest summed log-likelihood ratio: one object, which drove on or jumped, against
        a new one by chance.
        """
        before, after, gap = _within(self.time[self.last], self.time[self.first], longest_s)
        ratio = np.log(self.head_box[after, 2:] / self.tail_box[before, 2:]) / SIZE_SIGMA
        d2 = np.einsum("ki,ki->k", ratio, ratio)
        cost = d2 + 2 * ratio.shape[1] * np.log(SIZE_SIGMA) + self._chance(after, gap)
        for dt in np.unique(gap):
            k = np.flatnonzero(gap == dt)
            x, P = self._moved(self.tail_x[before[k]], self.tail_P[before[k]], dt, self.tail_box[before[k]])
            v, S = self.head_x[after[k]] - x, self.head_P[after[k]] + P
            nis, steady = _agreement(v, S)
            nis_jumped, jumped = _agreement(v, S + self._jump(before[k]))
            jumped -= 2 * np.log(RARE)
            d2[k] += np.where(jumped < steady, nis_jumped, nis)
            cost[k] += np.minimum(jumped, steady)
        limit = quantile(PROBABILITY, self.tail_x.shape[1] + ratio.shape[1])
        cost += 2 * np.log(ODDS)
        fits = (d2 <= limit) & (cost < 0)
        start = starts(before[fits], len(self.id))
        taken = assign(start, after[fits], cost[fits], np.zeros(len(self.id)), len(self.id))
        rows = np.flatnonzero(taken >= 0)
        return rows, taken[rows]

    def _chance(self, after: Ints, gap: Floats) -> Floats:
        """(K,) twice the log density of new tracks like rows `after` (K,) within `gap` (K,) [s].

        New tracks have the observed rate, are uniform over the extent of all boxes, and have the observed
        distributions of velocity and size.
        """
        velocity = list(self.motion.velocity)
        v, spread = self.head_x[:, velocity], self.head_P[:, velocity, velocity]
        speed2 = np.median((v**2).sum(axis=1) + spread.sum(axis=1)) / len(velocity)
        size = np.log(self.head_box[:, 2:])
        variance = size.var(axis=0) + SIZE_SIGMA**2
        alike = ((size - size.mean(axis=0)) ** 2 / variance).sum(axis=1) + np.log(variance).sum()
        rate = len(self.id) / (self.extent * np.ptp(self.time))
        return np.asarray(2 * np.log(gap * rate) - len(velocity) * np.log(2 * np.pi * speed2) - alike[after])

    def _jump(self, before: Ints) -> Floats:
        """(K, n, n) covariance of a jump of the tracks that end, rows `before` (K,): their velocities are new."""
        size = longer(self.tail_box[before])
        spread = (JUMP * size)[:, None, None] ** 2 * np.eye(len(self.motion.position))
        return self.motion.birth(self.tail_x[before][:, list(self.motion.position)], spread, size)[1]

    def _moved(self, x: Floats, P: Floats, dt: float, box: Floats) -> tuple[Floats, Floats]:
        """States x (K, n), P (K, n, n) of objects with these boxes, predicted by dt [s], which may be negative."""
        F = self.motion.transition(dt, x)
        Q = self.motion.process_noise(abs(dt), x, P, np.zeros(len(x), np.int64), longer(box))
        noisy = F @ (P + Q) @ np.swapaxes(F, 1, 2) if dt < 0 else F @ P @ np.swapaxes(F, 1, 2) + Q
        return (F @ x[:, :, None])[:, :, 0], noisy

    def joined(self, steps: list[Step], before: Ints, after: Ints) -> list[Step]:
        """The steps with rows `after` (L,) under the ids of rows `before` (L,), and with rows added in the gaps."""
        name, begins, ends = self.id.copy(), np.full(len(self.id), -1), np.full(len(self.id), len(steps))
        begins[after], ends[before] = self.first[after], self.last[before]
        bridges: dict[int, list[Tracks]] = {}
        for k in np.argsort(self.first[after], kind="stable"):
            a, b = int(before[k]), int(after[k])
            name[b] = name[a]
            row = steps[self.last[a]].tracks
            row = replace(row.only(row.id == self.id[a]), id=name[[a]])
            for i in range(self.last[a] + 1, self.first[b]):
                bridges.setdefault(i, []).append(self._bridge(row, a, b, self.time[i]))
        done = []
        for k, step in enumerate(steps):
            tracks = step.tracks
            rows = np.searchsorted(self.id, tracks.id).clip(max=len(self.id) - 1)
            known = self.id[rows] == tracks.id
            stays = ~known | ((begins[rows] <= k) & (k <= ends[rows]))
            prior_x = tracks.prior_x
            if prior_x is not None:  # the smoother does not go back over a gap
                prior_x = np.where((known & (begins[rows] == k))[:, None], np.nan, prior_x)
            tracks = replace(tracks, id=np.where(known, name[rows], tracks.id), prior_x=prior_x).only(stays)
            done.append(replace(step, tracks=_together(tracks, bridges.get(k, []))))
        return done

    def _bridge(self, row: Tracks, a: int, b: int, t: float) -> Tracks:
        """A row at t [s] in the gap between tracks a and b, from the predictions of both ends; `row` is a's last."""
        ahead, back = t - self.time[self.last[a]], t - self.time[self.first[b]]
        x0, P0 = self._moved(self.tail_x[[a]], self.tail_P[[a]], ahead, self.tail_box[[a]])
        x1, P1 = self._moved(self.head_x[[b]], self.head_P[[b]], back, self.head_box[[b]])
        share = P0 @ np.linalg.inv(P0 + P1)
        x, P = x0 + (share @ (x1 - x0)[:, :, None])[:, :, 0], P0 - share @ P0
        box = self.tail_box[[a]] + ahead / (ahead - back) * (self.head_box[[b]] - self.tail_box[[a]])
        return replace(
            row, t=t, status=np.array([COASTING], np.int8), x=x, P=(P + np.swapaxes(P, 1, 2)) / 2,
            box=absolute(box, x[:, list(self.motion.position)]), age_s=row.age_s + ahead,
            measurement=np.array([-1]), nis=np.array([np.nan]),
            prior_x=None if row.prior_x is None else np.full_like(row.prior_x, np.nan),
        )  # fmt: skip


def _agreement(v: Floats, S: Floats) -> tuple[Floats, Floats]:
    """(K,) v' S^-1 v, and -2 ln N(v; 0, S), of differences v (K, n) with covariances S (K, n, n)."""
    nis = np.einsum("ki,ki->k", v, np.linalg.solve(S, v[:, :, None])[:, :, 0])
    return nis, nis + np.linalg.slogdet(S)[1] + v.shape[1] * np.log(2 * np.pi)


def _within(ends: Floats, begins: Floats, longest_s: float) -> tuple[Ints, Ints, Floats]:
    """Rows (L,) that end, in order, rows (L,) that begin at most longest_s [s] later, and the gaps (L,) [s]."""
    order = np.argsort(begins, kind="stable")
    latest = np.nextafter(ends + longest_s, np.inf)
    low, high = (np.searchsorted(begins[order], t, side="right") for t in (ends, latest))
    before = np.repeat(np.arange(len(ends)), high - low)
    after = order[np.arange(len(before)) + np.repeat(high - np.cumsum(high - low), high - low)]
    gap = begins[after] - ends[before]
    rows = np.lexsort((after, before))
    rows = rows[gap[rows] <= longest_s]
    return before[rows], after[rows], gap[rows]


COLUMNS = (
    "id", "status", "x", "P", "box", "group", "group_since_s", "age_s", "travel", "existence", "measurement", "nis",
    "run", "exchange", "entered",
)  # fmt: skip


def _together(tracks: Tracks, more: list[Tracks]) -> Tracks:
    """The tracks and the rows of others, sorted by id."""
    if more:
        names = COLUMNS if tracks.prior_x is None else (*COLUMNS, *Register.LINKS)
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in (tracks, *more)]) for name in names
        }
        tracks = replace(tracks, **columns, choices=None)
    return tracks.only(np.argsort(tracks.id, kind="stable"))

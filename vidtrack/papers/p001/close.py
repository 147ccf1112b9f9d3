"""Two targets side by side, within the gate of a new track: the survey's figures 4 and 5. Metres, seconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.hard import Associator
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.papers import style
from vidtrack.papers.result import Result, Row
from vidtrack.scan import Scan
from vidtrack.tracking.deferred.forest import ForestRule
from vidtrack.tracking.methods import METHODS
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import Status, Tracks

RUNS = 500
SCANS, PERIOD_S, JUDGED = 30, 2.0, 10
"""Scans of a run, their period, and the number of last scans in which both tracks must be right."""
SPEED, APART, ACCEL = 150.0, 120.0, 1.0
SIGMA, DETECTION = 30.0, 0.9
RIGHT = 100.0
"""m; the nearest track within this distance follows a target."""
NAMES = ("nn", "split", "gnn", "mht")
WORDS = {
    "nn": "nearest neighbour",
    "split": "branching",
    "gnn": "global nearest neighbour",
    "mht": "multiple hypotheses",
}


@dataclass(frozen=True, slots=True)
class Pair:
    """truth and z (K, runs, 2, 2) of two targets in each run; seen (K, runs, 2): targets with a plot."""

    truth: Floats
    z: Floats
    seen: np.ndarray

    @classmethod
    def fly(cls, runs: int, seed: int) -> Pair:
        """Simulate two targets that go east, one APART north of the other, with white acceleration."""
        rng = np.random.default_rng(seed)
        x, v = np.zeros((runs, 2, 2)), np.tile([SPEED, 0.0], (runs, 2, 1))
        x[:, 1, 1] = APART
        path = []
        for _ in range(SCANS):
            path.append(x)
            a = ACCEL * rng.normal(size=x.shape)
            x, v = x + PERIOD_S * v + PERIOD_S**2 / 2 * a, v + PERIOD_S * a
        truth = np.stack(path)
        return cls(truth, truth + SIGMA * rng.normal(size=truth.shape), rng.random(truth.shape[:3]) < DETECTION)

    def tracked(self, rule: Associator | ForestRule) -> list[Tracks]:
        """Tracks of all runs, in one bank."""
        runs = np.repeat(np.arange(self.truth.shape[1]), 2).reshape(-1, 2)
        tracker = Tracker(
            ConstantVelocity(accel=2.0, speed=100.0),
            rule,
            gate=0.99,
            detection_probability=DETECTION,
            clutter_density=1e-7,
        )
        R = SIGMA**2 * np.eye(2)
        return [
            tracker.step(Scan(k * PERIOD_S, self.z[k, seen], R, run=runs[seen])) for k, seen in enumerate(self.seen)
        ]

    def right(self, steps: Sequence[Tracks]) -> np.ndarray:
        """(runs,) whether in the last JUDGED scans each target is followed by one track, a different one for each."""
        followers = []
        right = np.ones(self.truth.shape[1], bool)
        for truth, tracks in zip(self.truth[-JUDGED:], steps[-JUDGED:], strict=True):
            track, away = nearest(tracks, truth)
            followers.append(track)
            right &= (away < RIGHT).all(axis=1) & (track[:, 0] != track[:, 1])
        return right & (np.stack(followers) == followers[0]).all(axis=(0, 2))


def nearest(tracks: Tracks, truth: Floats) -> tuple[Ints, Floats]:
    """Id and distance (runs, 2) of the confirmed track nearest to each target of truth (runs, 2, 2)."""
    known = tracks.only(tracks.status != Status.TENTATIVE)
    assert known.run is not None
    order = np.argsort(known.run, kind="stable")
    run = known.run[order]
    place = np.arange(len(run)) - np.searchsorted(run, run)
    most = int(place.max(initial=0)) + 1
    xy, ids = np.full((len(truth), most, 2), np.inf), np.full((len(truth), most), -1)
    xy[run, place], ids[run, place] = known.xy[order], known.id[order]
    distance = np.linalg.norm(xy[:, None] - truth[:, :, None], axis=-1)
    best = distance.argmin(axis=2)
    return np.take_along_axis(ids, best, axis=1), distance.min(axis=2)


def reproduce(shown: str, paper: str, runs: int | None, seed: int) -> Result:
    """One run tracked by the method `shown`, and how often each method is right."""
    runs = RUNS if runs is None else runs
    pair = Pair.fly(runs, seed)
    steps = {name: pair.tracked(METHODS[name]()) for name in NAMES}
    right = {name: pair.right(steps[name]) for name in NAMES}
    run = int(np.argmax(right["split"] & ~right["nn"]))
    drawing, (ax, bars) = style.figure(2, panel=(6.4, 3.4))
    _draw(ax, pair, steps[shown], run)
    style.title(ax, f"{WORDS[shown]}, one run of {runs}")
    share = [100 * right[name].mean() for name in NAMES]
    y = np.arange(len(NAMES))[::-1]
    bars.barh(y, share, color=[style.RED if name == shown else style.FAINT for name in NAMES], height=0.6)
    for place, value in zip(y, share, strict=True):
        bars.text(value + 1, place, f"{value:.1f} %", va="center", fontsize=8, color=style.INK)
    bars.set_yticks(y, [WORDS[name] for name in NAMES])
    bars.tick_params(axis="y", length=0, labelcolor=style.INK)
    bars.set(xlabel="share of the runs (%)", xlim=(0, 112))
    style.title(bars, f"each target has its own track in the last {JUDGED} scans")
    rows: list[Row] = [
        {
            "method": name,
            "runs": runs,
            "both_right": float(right[name].mean()),
            "both_right_se": float(np.sqrt(right[name].mean() * (1 - right[name].mean()) / runs)),
            "tracks_at_the_end": float((steps[name][-1].status != Status.TENTATIVE).sum() / runs),
            "paper": {"nn": "one track wanders between the targets", "split": "two clear tracks"}.get(name, ""),
        }
        for name in NAMES
    ]
    verdict = (
        f"both targets have their own track at the end in {right['nn'].mean():.0%} of {runs} runs with nearest "
        f"neighbour, in {right['split'].mean():.0%} with branching, in {right['mht'].mean():.0%} with multiple "
        f"hypotheses; {paper}."
    )
    return Result(drawing, rows, verdict)


def _draw(ax: style.Axes, pair: Pair, steps: Sequence[Tracks], run: int) -> None:
    """Truth, plots and the confirmed tracks of one run, in km."""
    for target in range(2):
        ax.plot(*pair.truth[:, run, target].T / 1000, color=style.GREY, lw=1, ls=":", label="target" if target else "")
        seen = pair.seen[:, run, target]
        ax.plot(*pair.z[seen, run, target].T / 1000, ".", color=style.GREY, ms=4, label="plot" if target else "")
    rows = [(int(i), *xy) for tracks in steps for i, xy in zip(tracks.id, tracks.xy, strict=True)
            if _of(tracks, int(i), run)]  # fmt: skip
    names = sorted({row[0] for row in rows if sum(other[0] == row[0] for other in rows) > 3})
    for name, colour in zip(names, style.CYCLE * 3, strict=False):
        path = np.array([row[1:] for row in rows if row[0] == name]) / 1000
        ax.plot(*path.T, color=colour, lw=1.4)
        place = names.index(name)
        ax.text(path[-1, 0], path[-1, 1], "   " * place + f" {place + 1}", color=colour, fontsize=8, va="center")
    ax.set(xlabel="east (km)", ylabel="north (km)")
    style.legend(ax, loc="upper left")


def _of(tracks: Tracks, track: int, run: int) -> bool:
    assert tracks.run is not None
    row = int(np.flatnonzero(tracks.id == track)[0])
    return bool(tracks.run[row] == run and tracks.status[row] != Status.TENTATIVE)

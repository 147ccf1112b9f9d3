"""How ends of tracks that go on as others lie: what `vidtrack/traffic/measures/joins.py` takes for its densities.

    python tools/fit_joins.py CLIP...

Each CLIP is a folder of `vidtrack simulate`, with its tracks in CLIP/run, as in `ablate_measures.py`. A stretch is of
the true vehicle that is nearest to at least half of its rows, within 8 m. Of each vehicle two stretches that follow
each other are a pair, where the first ends between the gates and the second begins there within 20 s. Printed are the
gaps, and the likeliest share of pairs of two tracks whose ends another vehicle has drawn along, with the scales of such
ends; all pairs of one track are taken to be drawn along.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path
from unittest.mock import patch

import numpy as np
from ablate_measures import FPS, NEAR_M, seen
from scipy.optimize import minimize
from scipy.special import expit, logit

from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures import journeys
from vidtrack.traffic.measures.joins import ASTRAY_SCALES, LONGEST_S, OVERLAP_S, astray, on_course
from vidtrack.traffic.measures.rows import Reader
from vidtrack.traffic.measures.runs import open_day
from vidtrack.traffic.measures.stretches import End, Stretches
from vidtrack.traffic.site import read_site


def owners(clip: Path, vehicles: np.ndarray) -> np.ndarray:
    """(T,) the true vehicle of each stretch; -1: none."""
    site = read_site(clip / "site.toml")
    day = open_day([str(clip / "run")], site.camera.start)
    broken = Stretches(metres=True)
    rows: list[tuple[int, float, np.ndarray]] = []
    for block in Reader(day, {one.size: calibrated(site.scaled(*one.size)) for one in day.recordings}):
        numbered = broken.add(block)
        there = numbered.seen & np.isfinite(numbered.xy[:, 0])
        rows += zip(numbered.track[there].tolist(), numbered.t[there], numbered.xy[there], strict=True)
    near: list[list[int]] = [[] for _ in broken.lives().track]
    for track, t, xy in rows:
        low, high = np.searchsorted(vehicles[:, 0], round(t * FPS) + np.array([-0.5, 0.5]))
        far = np.linalg.norm(vehicles[low:high, 2:] - xy, axis=1)
        near[track].append(int(vehicles[low + far.argmin(), 1]) if far.min(initial=np.inf) < NEAR_M else -1)
    owner = np.full(len(near), -1)
    for track, numbers in enumerate(near):
        who, times = np.unique(numbers, return_counts=True)
        if len(who) and 2 * times.max() >= len(numbers):
            owner[track] = who[times.argmax()]
    return owner


def pairs(clip: Path) -> tuple[End, End, np.ndarray]:
    """The ends of the first stretches (N,), the beginnings of the second, and if both are of one track."""
    one = seen(clip)
    with patch.object(journeys, "joined", wraps=journeys.joined) as asked:
        journeys.journeys(one.gates, one.passing.passed(), one.lives, one.spans, True, one.allowed)
    lives, ends, begins = asked.call_args.args[:3]
    owner, found = owners(clip, one.vehicles), []
    for vehicle in np.unique(owner[owner >= 0]):
        mine = np.flatnonzero((owner == vehicle) & np.isfinite(lives.head.t))
        found += list(pairwise(mine[np.argsort(lives.head.t[mine])]))
    a, b = np.array(found, int).reshape(-1, 2).T
    chosen = ends[a] & begins[b] & (lives.head.t[b] - lives.tail.t[a] < LONGEST_S)
    a, b = a[chosen], b[chosen]
    return lives.tail.only(a), lives.head.only(b), lives.track[a] == lives.track[b]


def joined(ends: list[End]) -> End:
    return End(*(np.concatenate([getattr(end, name) for end in ends]) for name in ("t", "xy", "v", "spread")))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", nargs="+", type=Path)
    tails, heads, sames = zip(*map(pairs, parser.parse_args().clips), strict=True)
    tail, head, same = joined(list(tails)), joined(list(heads)), np.concatenate(sames)
    gap = head.t - tail.t
    k = np.flatnonzero(gap > -OVERLAP_S)
    shares = f"{np.mean(gap < -OVERLAP_S):.2f} overlap for longer than {OVERLAP_S:g} s, {np.mean(gap < 0):.2f} at all"
    print(
        f"{len(gap)} pairs, {same.sum()} of one track; {shares}; others have a mean gap of {gap[gap > 0].mean():.1f} s"
    )
    straight = on_course(tail, head, k, k)

    def surprise(given: np.ndarray) -> float:
        drawn = np.where(same[k], 1.0, expit(given[0]))
        density = (1 - drawn) * straight + drawn * astray(tail, head, k, k, np.exp(given[1:]))
        return float(-np.log(density).sum())

    start = np.array([logit(0.5), *np.log(ASTRAY_SCALES)])
    best = minimize(surprise, start, method="Nelder-Mead", options={"maxiter": 4000, "xatol": 1e-3, "fatol": 1e-4}).x
    apart, faster, pace = np.exp(best[1:])
    print(f"of two tracks {expit(best[0]):.2f} are drawn along: {apart:.1f} m, {faster:.1f} m/s of gap, {pace:.1f} m/s")


if __name__ == "__main__":
    main()

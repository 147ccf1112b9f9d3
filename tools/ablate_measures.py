"""What each rule of `vidtrack measure` is worth: crossings and trips of simulated roads, one rule left out at a time.

    python tools/ablate_measures.py CLIP...

Each CLIP is a folder of `vidtrack simulate`, with its tracks in CLIP/run, as in `score_measures.py`. A crossing is
right within 1 s at its gate and direction; a trip with both legs and both times within 5 s, as a turning count asks
for it.
The second table has the joins of stretches of which one passed an entry or an exit, as `joined` is told, and the
others: what probability they state, and how many of them are of one true vehicle, the one that is nearest to where the
one stretch ends, within 8 m, and also to where the other begins.
The third table has the passings by what they rest on, and those against their gates, out over an entry or in over an
exit: what probability they state, and how many are right within 5 s.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import numba
import numpy as np
import score_measures
from score_measures import FPS, paired, rows_of

from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures import beyond, joins, journeys, passing, rows, stretches, trips
from vidtrack.traffic.measures.crossings import REASONS, way_names
from vidtrack.traffic.measures.gates import Gates, gates_of
from vidtrack.traffic.measures.passing import Passing, reaches
from vidtrack.traffic.measures.rows import Reader
from vidtrack.traffic.measures.runs import open_day
from vidtrack.traffic.measures.stretches import End, Lives, Stretches
from vidtrack.traffic.site import read_site

CROSSING_S, TRIP_S = 1.0, 5.0
NEAR_M = 8.0
STATE = ("frame", "target_id", "x_m", "y_m")
BINS = (0.5, 0.65, 0.8, 0.9, 1.0)


def none_of(*shape_of: int) -> Any:
    """A rule that chooses nothing; its result has the length of that argument."""
    return lambda *given: np.zeros(len(given[shape_of[0]]), bool)


FOLLOW = stretches._follow
RULES: dict[str, dict[tuple[Any, str], Any]] = {
    "nothing": {},
    "breaks where the motion is that of another vehicle": {(stretches, "_OTHER"): np.inf},
    "joins": {(journeys, "_joins"): lambda *_: journeys._NONE},
    "joins of one track are likelier": {(joins, "SAME"): 1.0},
    "ends of two tracks that another vehicle has drawn along": {(joins, "_ASTRAY"): 0.0},
    "joins where the one begins up to 1 s before the other ends": {(joins, "OVERLAP_S"): 0.3},
    "joins of who passed a gate are surer": {(joins, "_SOUND"): joins._SOUND_BETWEEN},
    "movements that may not be": {(journeys, "_may"): lambda gates, _: np.ones((len(set(gates.legs)) + 1,) * 2, bool)},
    "to and fro within 2 s": {(passing, "_BACK_S"): 0.0},
    "the same over breaks of a track": {(journeys, "lasting"): lambda track, *_: np.ones(len(track), bool)},
    "a velocity kept beyond the border": {(rows, "_go_on"): lambda *_: None},
    "gates passed beside": {(journeys, "_needed"): none_of(1)},
    "gates passed beside within a gap": {(journeys, "reaches"): lambda metres: (reaches(metres)[0], 0.0)},
    "gates within a gap": {(journeys, "_across"): lambda *given: given[3].only(np.zeros(len(given[3]), bool))},
    "gates just beyond the end of a track": {(beyond, "_extended"): lambda g, end, free, *_: beyond._stood(
        g, end, *np.zeros((2, 0), int), *np.zeros((2, 0)), True)},
    "inferred passings only the right way": {(beyond, "_as_meant"): lambda gates, found: np.ones(len(found), bool)},
    "inferred passings only where nobody else passes": {(beyond, "_alone"): lambda found, _: np.ones(len(found), bool)},
    "gates where a track begins or ends": {(beyond, "_AT_M"): 0.0},
    "trips over gates the wrong way": {(trips, "against"): lambda passed, gates, vehicle, entry, exit_: (entry, exit_)},
    "two trips of a track that comes in again": {(journeys, "_comes_again"): none_of(2)},
}  # fmt: skip


class Seen(NamedTuple):
    """What the tracks of a clip passed, before anything is decided; true crossings, movements and vehicles: frame,
    number, x and y (N, 4), in order of frames."""

    gates: Gates
    passing: Passing
    lives: Lives
    spans: np.ndarray
    allowed: tuple[tuple[str, str], ...]
    crossed: list[tuple]
    moved: list[tuple]
    vehicles: np.ndarray


def seen(clip: Path) -> Seen:
    site = read_site(clip / "site.toml")
    day = open_day([str(clip / "run")], site.camera.start)
    grounds = {one.size: calibrated(site.scaled(*one.size)) for one in day.recordings}
    gates = gates_of(site, calibrated(site))
    broken, passes = Stretches(metres=True), Passing(gates, *reaches(metres=True))
    for block in Reader(day, dict(grounds)):
        passes.add(broken.add(block))
    events = rows_of(clip / "road_events.csv")
    crossed = [((e["place"], e["direction"]), float(e["time_s"])) for e in events if e["event"] == "crossing"]
    moved = [
        ((e["from_leg"], e["to_leg"]), float(e["time_s"]), float(e["end_s"]))
        for e in events
        if e["event"] == "movement"
    ]
    states = [[float(row[name]) for name in STATE] for row in rows_of(clip / "road_truth.csv")]
    vehicles = np.array(sorted(states))
    return Seen(gates, passes, broken.lives(), day.spans, site.movements.allowed, crossed, moved, vehicles)


def nearest(vehicles: np.ndarray, end: End, k: int) -> int:
    """The number of the true vehicle at the end of a stretch; -1: none."""
    low, high = np.searchsorted(vehicles[:, 0], round(end.t[k] * FPS) + np.array([-0.5, 0.5]))
    far = np.linalg.norm(vehicles[low:high, 2:] - end.xy[k], axis=1)
    return int(vehicles[low + far.argmin(), 1]) if far.min(initial=np.inf) < NEAR_M else -1


class Judged(NamedTuple):
    """counts  (6,) true, told and right crossings, then trips
    joins   (J, 3) probability, if it is right, if a stretch passed an entry or an exit
    passings  (P, 4) number of the reason, if it is against its gate, probability, if it is right
    """

    counts: np.ndarray
    joins: np.ndarray
    passings: np.ndarray


def judged(one: Seen) -> Judged:
    with patch.object(journeys, "joined", wraps=journeys.joined) as asked:
        found = journeys.journeys(one.gates, one.passing.passed(), one.lives, one.spans, True, one.allowed)
    passed, told = found.passings.passed, found.trips
    score_measures.TOLERANCE_S = CROSSING_S
    crossed = [(way, t) for way, t in zip(zip(*way_names(one.gates, passed), strict=True), passed.t, strict=True)]
    hits = len(paired(one.crossed, crossed))
    score_measures.TOLERANCE_S = TRIP_S
    right = np.isin(np.arange(len(passed)), [j for _, j in paired(one.crossed, crossed)])
    why = found.passings.reason, journeys.wrong_way(one.gates, passed)
    passings = np.column_stack([*why, found.passings.probability, right])
    who = np.flatnonzero(told.complete)
    legs = [[one.gates.legs[gate] for gate in passed.gate[end[who]]] for end in (told.entry, told.exit)]
    moved = list(zip(zip(*legs, strict=True), told.from_s[who], told.to_s[who], strict=True))
    met = len(paired(one.moved, moved))
    made, ends = found.joins, (one.lives.tail, one.lives.head)
    of = [
        [nearest(one.vehicles, end, k) for k in who] for end, who in zip(ends, (made.before, made.after), strict=True)
    ]
    gated = [bool(asked.call_args.args[3][[*pair]].any()) for pair in zip(made.before, made.after, strict=True)]
    joined = [(float(p), a == b != -1, g) for p, a, b, g in zip(made.probability, *of, gated, strict=True)]
    counts = np.array([len(one.crossed), len(crossed), hits, len(one.moved), len(moved), met])
    return Judged(counts, np.array(joined, float).reshape(-1, 3), passings)


@contextmanager
def without(rule: dict[tuple[Any, str], Any]) -> Iterator[None]:
    """Leave a rule out. The kernel of `stretches` is compiled anew where it is one of its rules, and not kept."""
    before = {place: getattr(*place) for place in rule}
    for (module, name), value in rule.items():
        setattr(module, name, value)
    if any(module is stretches for module, _ in rule):
        stretches._follow = numba.njit(error_model="numpy")(FOLLOW.py_func)
    try:
        yield
    finally:
        stretches._follow = FOLLOW
        for place, value in before.items():
            setattr(*place, value)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", nargs="+", type=Path)
    clips = parser.parse_args().clips
    whole = [seen(clip) for clip in clips]
    as_it_is: list[Judged] = []
    print("| left out | crossings: right of told | trips: right of told |")
    print("|---|---|---|")
    for name, rule in RULES.items():
        with without(rule):
            anew = any(module in (rows, stretches) for module, _ in rule)
            looked = [seen(clip) for clip in clips] if anew else whole
            results = [judged(one) for one in looked]
        true, told, right, moved, trips_, right_trips = sum(result.counts for result in results)
        if not rule:
            as_it_is = results
            print(f"of {true} crossings and {moved} trips:")
        print(f"| {name} | {right} of {told} | {right_trips} of {trips_} |", flush=True)
    print("\n| joins | probability | joins | its mean | right |")
    print("|---|---|---|---|---|")
    sure, good, gated = np.concatenate([result.joins for result in as_it_is]).T
    for name, chosen in (("passed an entry or an exit", gated == 1), ("others", gated == 0)):
        for low, high in pairwise(BINS):
            mine = chosen & (sure > low) & (sure <= high)
            if mine.any():
                means = f"{sure[mine].mean():.2f} | {good[mine].mean():.2f}"
                print(f"| {name} | {low:g} to {high:g} | {mine.sum()} | {means} |")
    print("\n| passings | number | probability stated | right |")
    print("|---|---|---|---|")
    reason, against, sure, good = np.concatenate([result.passings for result in as_it_is]).T
    kinds = [(name, (against == 0) & (reason == number)) for number, name in enumerate(REASONS)]
    for name, mine in (*kinds, ("against their gates", against == 1)):
        if mine.any():
            print(f"| {name} | {mine.sum()} | {sure[mine].mean():.2f} | {good[mine].mean():.2f} |")


if __name__ == "__main__":
    main()

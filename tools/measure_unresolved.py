"""How two targets that share plots are tracked: before, while and after they give one plot for both.

    python tools/measure_unresolved.py radar-unresolved --seeds 200-219
    python tools/measure_unresolved.py radar-parting --seeds 400-489 "" radar.unresolved=false

Each argument after the scenario is one choice of settings, as in measure_radar.py. The stretch is from the first to the
last scan with one plot for both. IDF1, GOSPA (order 2) and matches are within 1 km. NEES is of positions, with the
track nearest to a target in the scan, because which is which is not in the data; 2 is right. Two scenarios are only
here: `anywhere` is radar-unresolved with targets that are not 60 m apart in the stretch, but anywhere in a resolution
cell; those of `straight` never manoeuvre, and drift through the cell until they pass each other anywhere in it.

kept       runs in which the two tracks that follow the pair before the stretch are there in all its scans and after it
switches   identity switches over the whole run, and their largest number in one run
exchanged  of the kept pairs, the share that had exchanged targets by the end, with its standard error; what the tracker
           stated of it on average; and the Brier score of that with the score of one half, which is .25
"""

from __future__ import annotations

import argparse
import logging
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from vidtrack import formats, score
from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.run.radar import track_plots
from vidtrack.simulate.flight import fly, sidestep
from vidtrack.simulate.radar import Target
from vidtrack.simulate.radar_scenarios import COARSE, SCENARIOS, simulate_radar
from vidtrack.simulate.radar_write import write_radar
from vidtrack.tracks import TENTATIVE, Tracks

NEAR_M = 1000.0
PARTS = ("before", "during", "after")


class Outcome(NamedTuple):
    """One run: scores by part; whether both tracks were kept, had exchanged targets, and how probable that was."""

    idf1: list[float]
    nees: list[float]
    nees_whole: float
    gospa: float
    switches: float
    kept: bool
    exchanged: bool
    stated: float


def outcome(scenario: str, seed: int, settings: Settings) -> Outcome:
    """The outcome of one seed."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        seen = simulate_radar(scenario, seed)
        write_radar(seen, folder)
        truth = formats.read(folder / "truth.csv")
        steps = list(track_plots(folder / "plots.csv", settings))
    together = np.flatnonzero(seen.merged[0])
    first, last = int(together[0]), int(together[-1])
    result = table(steps)
    parts = [(-np.inf, first - 1), (first, last), (last + 1, np.inf)]
    scores = [score.evaluate(cut(result, *part), cut(truth, *part), max_distance=NEAR_M) for part in parts]
    whole = score.evaluate(result, truth, max_distance=NEAR_M)
    by_scan = dict(steps)
    pair = nearest(by_scan[first - 1], seen.states[:, first - 1, :2])
    end = by_scan[max(by_scan)]
    kept = len(pair) == 2 and all(set(pair) <= set(by_scan[scan].id) for scan in range(first, max(by_scan) + 1))
    exchanged, stated = False, np.nan
    if kept:
        place = [end.xy[end.id == one][0] for one in pair]
        there = [seen.states[k, -1, :2] for k in (0, 1)]
        straight, crossed = (sum(np.linalg.norm(place[k] - there[k ^ x]) for k in (0, 1)) for x in (0, 1))
        exchanged, stated = bool(crossed < straight), float(end.exchange[end.id == pair[0]][0])
    return Outcome(
        [float(one["idf1"]) for one in scores], [nees(cut(result, *part), truth) for part in parts],
        nees(result, truth), float(whole["gospa"]), float(whole["switches"]), kept, exchanged, stated,
    )  # fmt: skip


def add_scenarios() -> None:
    """Make the scenarios that are only here known by their names."""
    radar, _, scans, holds = SCENARIOS["radar-unresolved"]
    SCENARIOS["anywhere"] = radar, anywhere, scans, holds
    SCENARIOS["straight"] = radar, straight, scans, SCENARIOS["radar-parting"][3]  # some seconds in a cell are enough


def anywhere(rng: np.random.Generator) -> list[Target]:
    """Two aircraft as in radar-unresolved, of which one may be anywhere in the resolution cell about the other."""
    azimuth, course, r = *rng.uniform(0, 2 * np.pi, 2), rng.uniform(15e3, 30e3)
    line, along = (np.array([np.sin(angle), np.cos(angle), 0.0]) for angle in (azimuth, course))
    across = np.array([along[1], -along[0], 0.0])
    apart = in_cell(rng, line, r)
    velocity = rng.uniform(180, 220) * along
    return [
        Target(
            sidestep(
                fly(r * line + side * apart / 2 - 100 * velocity, velocity),
                side * 1200 * across, near=0.0, times_s=(20.0, 55.0, 145.0, 180.0),
            )
        )
        for side in (-1, 1)
    ]  # fmt: skip


def straight(rng: np.random.Generator) -> list[Target]:
    """Two aircraft on straight courses, 2 to 6 degrees apart, that pass each other anywhere in a resolution cell."""
    azimuth, course, r = *rng.uniform(0, 2 * np.pi, 2), rng.uniform(15e3, 30e3)
    angle, speed = np.radians(rng.uniform(2, 6)), rng.uniform(180, 220)
    line = np.array([np.sin(azimuth), np.cos(azimuth), 0.0])
    apart = in_cell(rng, line, r)
    pair = []
    for side in (-1, 1):
        own = course + side * angle / 2
        velocity = speed * np.array([np.sin(own), np.cos(own), 0.0])
        pair.append(Target(fly(r * line + side * apart / 2 - 100 * velocity, velocity)))
    return pair


def in_cell(rng: np.random.Generator, line: np.ndarray, r: float) -> np.ndarray:
    """A difference (3,) of two places that are in one cell, at r along the line (3,) from the radar."""
    side_m, side_deg = COARSE.cell
    at_range, at_azimuth = rng.uniform(-1, 1, 2) * (side_m, np.radians(side_deg) * r)
    return np.asarray(at_range * line + at_azimuth * np.array([line[1], -line[0], 0.0]))


def table(steps: list[tuple[int, Tracks]]) -> formats.Table:
    """The rows of all tracks that are confirmed at some time."""
    named = {one for _, tracks in steps for one in tracks.id[tracks.status != TENTATIVE].tolist()}
    rows = [(scan, tracks, np.isin(tracks.id, list(named))) for scan, tracks in steps]
    frame = np.concatenate([np.full(kept.sum(), scan) for scan, _, kept in rows])
    identity, xy, cov = (
        np.concatenate([getattr(t, one)[kept] for _, t, kept in rows]) for one in ("id", "xy", "xy_cov")
    )
    return formats.Table(frame, identity, xy, None, np.ones(len(frame)), cov, None, unit="m")


def cut(rows: formats.Table, first: float, last: float) -> formats.Table:
    """The rows of scans from `first` to `last`."""
    return rows.select((rows.frame >= first) & (rows.frame <= last))


def nees(result: formats.Table, truth: formats.Table) -> float:
    """Mean of the normalised squared errors of positions; tracks and targets are matched scan by scan."""
    found: list[np.ndarray] = []
    for scan in np.unique(result.frame):
        own, there = result.select(result.frame == scan), truth.xy[truth.frame == scan][:, :2]
        off = there[:, None] - own.xy
        target, track = linear_sum_assignment(np.linalg.norm(off, axis=-1))
        off = off[target, track]
        near = np.linalg.norm(off, axis=1) < NEAR_M
        assert own.cov is not None
        found.append(np.einsum("ni,ni->n", off, np.linalg.solve(own.cov[track], off[..., None])[..., 0])[near])
    return float(np.concatenate(found).mean()) if found else np.nan


def nearest(tracks: Tracks, xy: np.ndarray) -> list[int]:
    """The confirmed tracks that are together nearest to two places (2, 2), one of each; fewer if there are fewer."""
    known = np.flatnonzero(tracks.status != TENTATIVE)
    place, row = linear_sum_assignment(np.linalg.norm(xy[:, None] - tracks.xy[known], axis=-1))
    return [int(one) for one in tracks.id[known[row[np.argsort(place)]]]]


def show(name: str, found: list[Outcome]) -> None:
    """Print the means."""
    idf1 = np.nanmean([one.idf1 for one in found], axis=0)
    parts = np.array([one.nees for one in found])
    error = np.nanstd(parts, axis=0) / len(found) ** 0.5
    gospa, switches = (np.array([getattr(one, what) for one in found]) for what in ("gospa", "switches"))
    sys.stdout.write(f"{name or 'default'}\n    {', '.join(PARTS)}: IDF1 {idf1.round(3)}  ")
    sys.stdout.write(f"NEES {np.nanmean(parts, axis=0).round(2)} +- {error.round(2)}\n")
    over_all = np.array([one.nees_whole for one in found])
    sys.stdout.write(f"    NEES of whole runs {over_all.mean():.2f} +- {over_all.std() / len(found) ** 0.5:.2f}\n")
    kept = [one for one in found if one.kept]
    sys.stdout.write(f"    GOSPA {gospa.mean():.1f} +- {gospa.std():.1f} m, switches {switches.mean():.2f}, ")
    sys.stdout.write(f"at most {switches.max():.0f}, kept {len(kept)} of {len(found)}\n")
    if kept:
        true, stated = (np.array([getattr(one, what) for one in kept], float) for what in ("exchanged", "stated"))
        error, brier = (true.mean() * (1 - true.mean()) / len(true)) ** 0.5, ((stated - true) ** 2).mean()
        sys.stdout.write(f"    exchanged {true.mean():.3f} +- {error:.3f}, stated {stated.mean():.3f}")
        sys.stdout.write(f" ({stated.min():.2f} to {stated.max():.2f}), Brier {brier:.3f}\n")
    sys.stdout.flush()


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", choices=["radar-unresolved", "radar-parting", "anywhere", "straight"])
    parser.add_argument("choices", nargs="*", default=[""], metavar="A.B=VALUE;...")
    parser.add_argument("--seeds", default="200-219", metavar="FIRST-LAST")
    options = parser.parse_intermixed_args()
    logging.disable(logging.WARNING)
    add_scenarios()
    first, last = map(int, options.seeds.split("-"))
    for choice in options.choices:
        settings = load(assignments=[part for part in choice.split(";") if part])
        show(choice, [outcome(options.scenario, seed, settings) for seed in range(first, last + 1)])


if __name__ == "__main__":
    main()

"""Scores of `vidtrack radar` over many seeds of a simulated scenario, and how much settings change them.

    python tools/measure_radar.py radar-uneven --seeds 200-219 "" radar.clutter_map=false
    python tools/measure_radar.py radar-weaving --snr-db 13 --pfa 1e-3 "" "tracker.method=pda;radar.agile=0"

Each argument after the scenario is one choice of settings, separated by semicolons; "" is the default. Scenarios are
those of `vidtrack simulate`, and `opensky` (VIDTRACK_DATA; real air traffic, see track_opensky.py). A row has the mean
and the standard deviation over the seeds; below it, from the second choice on, the mean difference from the first one,
seed by seed, with its standard error. Rows of tracks count from their beginning if they are confirmed later, as in
tracks.csv. NEES is of positions and of velocities; 2 is right in the plane. `rms` is of both axes, m and m/s.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from track_opensky import aircraft, write_plots

from vidtrack import formats, score
from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.output.smoothed import smoothed_by
from vidtrack.run.radar import track_plots
from vidtrack.score.clear import correspondences
from vidtrack.score.matching import match_points
from vidtrack.simulate.radar_scenarios import SCENARIOS, simulate_radar
from vidtrack.simulate.radar_write import write_radar
from vidtrack.tracks import TENTATIVE, Tracks

NEAR_M = {"opensky": 2000.0}
SCORES = ("idf1", "switches", "gospa", "gospa_missed", "gospa_false", "tracks", "nees")
DIGITS = {"idf1": 3}


def drawn(scenario: str, seed: int, folder: Path, options: argparse.Namespace) -> tuple[Path, formats.Table]:
    """Plots and truth of a scenario."""
    if scenario == "opensky":
        truth = aircraft(Path(os.environ["VIDTRACK_DATA"], "opensky", "OpenSky_Plane_States.csv"))
        write_plots(folder / "plots.csv", truth, np.random.default_rng(seed))
        return folder / "plots.csv", truth
    write_radar(simulate_radar(scenario, seed, snr_db=options.snr_db, p_fa=options.pfa), folder)
    return folder / "plots.csv", formats.read(folder / "truth.csv")


def scored(plots: Path, truth: formats.Table, settings: Settings, near_m: float) -> dict[str, float]:
    """The scores of one run."""
    frames, states, ids, covs, v_covs, seen = [], [], [], [], [], set()
    for scan, tracks in _shown(plots, settings):
        frames.append(np.full(len(tracks), scan))
        ids.append(tracks.id)
        seen |= set(tracks.id[tracks.status != TENTATIVE].tolist())
        states.append(np.hstack([tracks.xy, tracks.v]))
        covs.append(tracks.xy_cov)
        v_covs.append(tracks.P[:, tracks.velocity][:, :, tracks.velocity])
    identity = np.concatenate(ids)
    kept = np.isin(identity, list(seen))
    frame, state = np.concatenate(frames)[kept], np.concatenate(states)[kept]
    dim = state.shape[1] // 2
    result = formats.Table(
        frame, identity[kept], state[:, :dim], None, np.ones(len(frame)), np.concatenate(covs)[kept], None, unit="m"
    )
    found = score.evaluate(result, truth, max_distance=near_m)
    scores = {name: float(found.get(name, np.nan)) for name in SCORES}
    if plots.with_name("truth.csv").exists():
        true_v = _velocities(plots.with_name("truth.csv"), dim)
        matched = match_points(result, truth, near_m, near_m)
        pairs = correspondences(matched, 0.5)
        error = state[matched.result[pairs], dim:] - true_v[matched.truth[pairs]]
        weighed = np.linalg.solve(np.concatenate(v_covs)[kept][matched.result[pairs]], error[..., None])[..., 0]
        scores["nees_v"] = float(np.mean((error * weighed).sum(axis=1)))
        scores["rms_v"] = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
        off = state[matched.result[pairs], :dim] - truth.xy[matched.truth[pairs], :dim]
        scores["rms"] = float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
    return scores


def _shown(plots: Path, settings: Settings) -> list[tuple[int, Tracks]]:
    """The scans and their tracks, smoothed if so set."""
    steps = list(track_plots(plots, settings))
    if settings.output.smooth:
        for k in range(len(steps) - 2, -1, -1):
            steps[k] = steps[k][0], smoothed_by(steps[k][1], steps[k + 1][1])
    return steps


def _velocities(truth: Path, dim: int) -> np.ndarray:
    table = np.genfromtxt(truth, delimiter=",", names=True)
    return np.column_stack([table[name] for name in ("vx_m_s", "vy_m_s", "vz_m_s")[:dim]])


def show(name: str, values: dict[str, np.ndarray], reference: dict[str, np.ndarray] | None) -> None:
    """Print mean and deviation, and the difference from the reference."""
    cells = (
        f"{key} {v.mean():.{DIGITS.get(key, 2)}f} +- {v.std():.{DIGITS.get(key, 2)}f}" for key, v in values.items()
    )
    sys.stdout.write(f"{name or 'default'}\n    {'  '.join(cells)}\n")
    if reference is not None:
        by = {key: v - reference[key] for key, v in values.items()}
        cells = (f"{key} {d.mean():+.3f} +- {d.std() / len(d) ** 0.5:.3f}" for key, d in by.items())
        sys.stdout.write(f"    difference: {'  '.join(cells)}\n")
    sys.stdout.flush()


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", choices=[*SCENARIOS, "opensky"])
    parser.add_argument("choices", nargs="*", default=[""], metavar="A.B=VALUE;...")
    parser.add_argument("--seeds", default="200-219", metavar="FIRST-LAST")
    parser.add_argument("--snr-db", type=float)
    parser.add_argument("--pfa", type=float)
    options = parser.parse_intermixed_args()
    logging.disable(logging.WARNING)
    first, last = map(int, options.seeds.split("-"))
    chosen = [load(assignments=[part for part in choice.split(";") if part]) for choice in options.choices]
    rows: list[list[dict[str, float]]] = [[] for _ in chosen]
    for seed in range(first, last + 1):
        with tempfile.TemporaryDirectory() as folder:
            plots, truth = drawn(options.scenario, seed, Path(folder), options)
            for own, settings in zip(rows, chosen, strict=True):
                own.append(scored(plots, truth, settings, NEAR_M.get(options.scenario, 1000.0)))
    values = [{key: np.array([row[key] for row in own]) for key in own[0]} for own in rows]
    for k, (choice, found) in enumerate(zip(options.choices, values, strict=True)):
        show(choice, found, values[0] if k else None)


if __name__ == "__main__":
    main()

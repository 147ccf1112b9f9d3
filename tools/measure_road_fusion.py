"""Radar, camera and both on one simulated road, each sensor failing in turn: GOSPA and IDF1 in metres.

    python tools/measure_road_fusion.py --seeds 3
    python tools/measure_road_fusion.py --cases night rain --first 50 --seeds 20

Rendered video, the whole detector, and plots with Doppler, of the same vehicles with exact truth. Below the means and
standard deviations of a case: both less the radar alone, clip by clip, with its standard error, and in how many clips
both are better.
"""

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from vidtrack import score
from vidtrack.config.load import load
from vidtrack.formats import Table
from vidtrack.radar.network.feed import read_feeds
from vidtrack.radar.network.network import Network
from vidtrack.radar.network.radars import read_radars
from vidtrack.run.road import ROAD, build_road_tracker, open_camera, road_steps
from vidtrack.simulate import simulate_road, write_road
from vidtrack.simulate.roads.radar import TrafficRadar, write_road_plots
from vidtrack.tracks import TENTATIVE

FPS, SIZE, WARM_S, CUTOFF_M = 10.0, (640, 360), 4.0, 5.0
RADAR = TrafficRadar()
CASES = {
    "day": ({}, RADAR),
    "night": ({"light": "night"}, RADAR),
    "rain": ({"weather": "rain"}, replace(RADAR, detected=0.6, false=3.0)),
    "queue": ({"flow": 1500.0}, replace(RADAR, least=3.0)),
    "radar blind half the time": ({}, replace(RADAR, detected=0.4)),
}
"""What the video has, and what the radar is like. `queue`: vehicles slower than 3 m/s are not told from the road."""


def tracked(folder: Path, settings, sensors: str) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """Time, ids and positions of confirmed tracks after the last scan of each tenth of a second."""
    network = None
    if "radar" in sensors:
        radars = read_radars(folder / "radars.toml")
        network = Network(read_feeds([str(folder / "radar.csv")], radars, settings.radar))
    opened = open_camera(str(folder / "video.avi"), folder / "site.toml", settings) if "camera" in sensors else None
    with opened or nullcontext() as camera:
        tracker = build_road_tracker(settings, network.feeds if network else (), camera)
        last = None
        for step in road_steps(network, camera, tracker):
            if last is not None and round(step.time_s * FPS) != round(last.time_s * FPS):
                yield from _confirmed(last)
            last = step
        yield from _confirmed(last)


def _confirmed(step) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    known = step.tracks.status != TENTATIVE
    yield step.time_s, step.tracks.id[known], step.tracks.xy[known]


def scored(clip, covers, rows) -> dict[str, float]:
    """GOSPA and IDF1 over the part of the road that both sensors cover, after the detector has learnt the scene."""
    frames, ids, places = {"truth": [], "result": []}, {"truth": [], "result": []}, {"truth": [], "result": []}
    for t, track, xy in rows:
        if t < WARM_S:
            continue
        frame = round(t * FPS)
        states = clip.history.at(min(t, float(clip.times[-1])))
        for name, who, at in (("truth", states.vehicle, states.xy), ("result", track, xy)):
            inside = covers(at)
            frames[name] += [frame] * int(inside.sum())
            ids[name].append(who[inside] + 1)
            places[name].append(at[inside])
    tables = {}
    for name in frames:
        xy = np.concatenate(places[name])
        tables[name] = Table(np.array(frames[name]), np.concatenate(ids[name]), xy, None, np.ones(len(xy)), unit="m")
    scores = score.evaluate(tables["result"], tables["truth"], max_distance=CUTOFF_M)
    return {"gospa_m": scores["gospa"], "idf1": scores["idf1"], "switches": scores["switches"]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--cases", nargs="*", default=list(CASES))
    parser.add_argument("--set", action="append", default=[])
    options = parser.parse_args()
    settings = load(assignments=options.set, base=ROAD)
    for case in options.cases:
        conditions, radar = CASES[case]
        found = {"radar": [], "camera": [], "radar camera": []}
        for seed in range(options.first, options.first + options.seeds):
            clip = simulate_road("road", seed=seed, fps=FPS, size=SIZE, seconds=options.seconds, **conditions)
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                write_road(clip, folder)
                write_road_plots(folder, clip, radar)
                with open_camera(str(folder / "video.avi"), folder / "site.toml", settings) as camera:
                    picture = camera.coverage
                sector = read_feeds([str(folder / "radar.csv")], read_radars(folder / "radars.toml"), settings.radar)
                both = [picture, sector[0].coverage]

                def covers(xy, both=both):
                    return np.prod([one.share(xy) for one in both], axis=0) > 0.01

                for sensors, rows in found.items():
                    rows.append(scored(clip, covers, tracked(folder, settings, sensors)))
        values = {
            sensors: {key: np.array([row[key] for row in rows]) for key in rows[0]} for sensors, rows in found.items()
        }
        for sensors, own in values.items():
            cells = (f"{key} {value.mean():.3f} +- {value.std():.3f}" for key, value in own.items())
            print(f"{case:28s} {sensors:14s}", "  ".join(cells), flush=True)
        by = {key: values["radar camera"][key] - alone for key, alone in values["radar"].items()}
        cells = (
            f"{key} {value.mean():+.3f} +- {value.std() / len(value) ** 0.5:.3f} (better in "
            f"{(value > 0 if key == 'idf1' else value < 0).sum()} of {len(value)})"
            for key, value in by.items()
        )
        print(f"{case:28s} {'both - radar':14s}", "  ".join(cells), flush=True)


if __name__ == "__main__":
    main()

"""Read exported files back by the readers of other projects, and compare each position with the run's table.

    python tools/check_exports.py RUN --peers-in DIR [--site SITE.toml]

RUN is a run at a site with `epsg` and `start`, at 25 frames/s, which Tactics2D takes for granted. The readers are
GeoPandas, MovingPandas, SUMO's sumolib and Tactics2D, in environments that pip makes in DIR. For .trj there is none
that runs here; tests/output/export reads it as SSAM's source does. SUMO has front bumpers, all others the middles of
the footprints, in longitude and latitude where the format has them.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pyproj
from peers.environment import python_of

from vidtrack.output.export.registry import export
from vidtrack.output.export.road_run import RoadRun, open_road_run

READERS = {"geojson": "readers", "geoparquet": "readers", "mf-json": "readers", "sumo": "readers", "level-x": "level_x"}
"""Formats with the environment that has their reader."""


def main() -> None:
    """Print a line a format."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument(
        "--peers-in", type=Path, required=True, metavar="DIR", help="folder of the readers' environments"
    )
    parser.add_argument("--site", type=Path, metavar="SITE.toml")
    arguments = parser.parse_args()
    run = open_road_run(arguments.run, arguments.site)
    for name, environment in READERS.items():
        with tempfile.TemporaryDirectory() as folder:
            export(run, name, Path(folder))
            found = read(python_of(environment, arguments.peers_in), name, Path(folder), run)
        expected = wanted(run, name)
        missing = len(expected.keys() - found.keys())
        off = max(np.hypot(*np.subtract(found[key], expected[key])) for key in expected.keys() & found.keys())
        print(f"{name}: {len(found)} positions read, {missing} missing, largest difference {off:.4f} m")


def wanted(run: RoadRun, name: str) -> dict[tuple[int, int], tuple[float, float]]:
    """The positions by track and millisecond, from the table of the run."""
    table = pq.read_table(run.folder / "tracks.parquet").to_pylist()
    until = dict(zip(run.vehicles.track.tolist(), run.vehicles.until.tolist(), strict=True))
    positions = {}
    for row in table:
        x, y, heading = row["x_m"], row["y_m"], row["heading_deg"]
        if x is None or row["frame"] > until[row["track_id"]]:
            continue
        if name == "sumo":
            if heading is None or row["length_m"] is None:
                continue
            ahead = row["length_m"] / 2
            x, y = x + ahead * np.sin(np.radians(heading)), y + ahead * np.cos(np.radians(heading))
        positions[row["track_id"], round(1000 * row["time_s"])] = (x, y)
    return positions


def read(python: Path, name: str, folder: Path, run: RoadRun) -> dict[tuple[int, int], tuple[float, float]]:
    """What the reader found, in metres of the site, by track and millisecond."""
    script = Path(__file__).parent / "peers" / "read_exports.py"
    done = subprocess.run([python, script, name, folder], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{name}: the reader failed\n{done.stderr}")
    rows = np.array(list(csv.reader(done.stdout.splitlines())), float)
    track, t, xy = rows[:, 0].astype(int), rows[:, 1], rows[:, 2:]
    if name == "mf-json":
        t = t - run.start.timestamp()
    if name in ("geojson", "mf-json"):
        to_metres = pyproj.Transformer.from_crs(4326, run.site.calibration.epsg, always_xy=True)
        xy = np.column_stack(to_metres.transform(*xy.T))
    if name == "level-x":
        with (folder / "00_tracksMeta.csv").open(newline="") as file:
            tracks = {int(row["trackId"]): int(row["vidtrackId"]) for row in csv.DictReader(file)}
        track = [tracks[number] for number in track]
    keys = zip(map(int, track), np.rint(1000 * t).astype(int).tolist(), strict=True)
    return dict(zip(keys, map(tuple, xy.tolist()), strict=True))


if __name__ == "__main__":
    main()

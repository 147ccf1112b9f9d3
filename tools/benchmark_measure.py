"""Time and memory of `vidtrack measure` on a day of synthetic tracks, beside reading the same columns alone, and of its
conflicts alone.

    python tools/benchmark_measure.py --vehicles 100000 -o DIR

Vehicles drive straight on for 8 s at 25 frames/s through a picture of 10 px/m: one half over four gates and two zones,
the other half across their ways. The run is written once (-o keeps it); reading, conflicts and measuring are each done
in a process of its own.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

FPS, LIFE_S, DAY_S, SCALE = 25, 8.0, 86400.0, 10.0
SITE = """[site]
name = "day"
start = 2026-06-01T00:00:00+00:00
width = 1280
height = 720
[calibration]
picture = [[0, 0], [1279, 0], [1279, 719], [0, 719], [640, 10], [640, 700], [20, 360], [1250, 360]]
ground = [[0, 72], [127.9, 72], [127.9, 0.1], [0, 0.1], [64, 71], [64, 2], [2, 36], [125, 36]]
[gates.in]
line = [[200, 20], [200, 700]]
role = "entry"
[gates.middle]
line = [[500, 20], [500, 700]]
[gates.bend]
line = [[700, 20], [760, 400], [700, 700]]
[gates.out]
line = [[1000, 20], [1000, 700]]
role = "exit"
[zones.box]
polygon = [[300, 100], [800, 100], [800, 600], [300, 600]]
[zones.end]
polygon = [[900, 100], [1200, 100], [1200, 600], [900, 600]]
[classes]
car = [3.0, 6.0]
lorry = [6.0, 18.0]
[report]
interval_s = 900
"""


def write_day(folder: Path, vehicles: int) -> None:
    """A run of one day in order of frames, as `vidtrack track --site` writes it."""
    rng = np.random.default_rng(0)
    start = np.sort(rng.uniform(0, DAY_S - LIFE_S, vehicles))
    north = np.arange(vehicles) % 2 == 1
    speed = np.where(north, rng.uniform(6, 8, vehicles), rng.uniform(11, 14, vehicles))
    lane = np.where(north, rng.uniform(20, 90, vehicles), rng.uniform(15, 55, vehicles))
    length = rng.uniform(3.5, 12, vehicles)
    steps = int(LIFE_S * FPS)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "site.toml").write_text(SITE)
    writer = None
    block = 4000
    waiting = np.empty((0, 2), np.int64)
    for first in range(0, vehicles, block):
        who = np.arange(first, min(first + block, vehicles))
        frames = np.ceil(start[who] * FPS).astype(np.int64)[:, None] + np.arange(steps)
        rows = np.column_stack([frames.ravel(), np.repeat(who, steps)])
        rows = np.vstack([waiting, rows])
        rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
        last = len(rows) if first + block >= vehicles else np.searchsorted(rows[:, 0], start[who[-1]] * FPS)
        rows, waiting = rows[:last], rows[last:]
        table = _rows(rows[:, 0], rows[:, 1], start, speed, lane, north, length, rng)
        writer = writer or pq.ParquetWriter(folder / "tracks.parquet", table.schema)
        writer.write_table(table, row_group_size=20_000)
    assert writer is not None
    writer.close()
    summary = {"frames": int(DAY_S * FPS), "media_s": DAY_S - 1 / FPS, "fps": FPS, "width": 1280, "height": 720}
    (folder / "summary.json").write_text(json.dumps(summary | {"settings": {"source": {"start_s": 0}}}))


def _rows(frame, who, start, speed, lane, north, length, rng) -> pa.Table:
    t, up, count = frame / FPS, north[who], len(frame)
    along, beside = 2 + speed[who] * (t - start[who]), lane[who] + 0.02 * rng.standard_normal(count)
    x, y = np.where(up, beside, along), np.where(up, along, beside)
    wide, high = np.where(up, 20, SCALE * length[who]), np.where(up, SCALE * length[who], 20)
    v = SCALE * speed[who]

    def noisy(value: float) -> np.ndarray:
        return np.round(value * (1 + 0.1 * rng.standard_normal(count)), 3)

    columns = {
        "frame": frame,
        "time_s": np.round(t, 6),
        "track_id": who,
        "status": pa.array(np.full(count, "confirmed")),
        "x_px": np.round(SCALE * x, 3),
        "y_px": np.round(720 - SCALE * y - 2, 3),
        "vx_px_s": np.round(np.where(up, 0, v), 3) + noisy(1.0),
        "vy_px_s": np.round(np.where(up, -v, 0), 3) + noisy(1.0),
        "sigma_x_px": noisy(0.7),
        "sigma_y_px": noisy(0.7),
        "left_px": np.round(SCALE * x - wide / 2, 3),
        "top_px": np.round(720 - SCALE * y - high / 2, 3),
        "width_px": wide,
        "height_px": high,
        "x_m": np.round(x, 3),
        "y_m": np.round(y, 3),
        "sigma_x_m": noisy(0.2),
        "sigma_y_m": noisy(0.2),
        "corr_xy_m": noisy(0.1),
        "speed_kmh": np.round(3.6 * speed[who] + 0.2 * rng.standard_normal(count), 3),
        "speed_sigma_kmh": noisy(1.5),
        "speed_shared_sigma_kmh": noisy(0.3),
        "heading_deg": np.round(np.where(up, 0, 90) + rng.standard_normal(count), 2),
        "length_m": np.round(length[who], 3),
        "length_sigma_m": noisy(0.4),
        "seen_left_px": np.round(SCALE * (x - length[who] / 2), 3),
        "seen_top_px": np.round(720 - SCALE * y - high / 2, 3),
        "seen_right_px": np.round(SCALE * (x + length[who] / 2), 3),
        "seen_bottom_px": np.round(720 - SCALE * y + high / 2, 3),
        "width_m": np.round(np.minimum(0.4 * length[who], 2.55), 3),
    }
    return pa.table(columns)


def read(folder: Path) -> None:
    """Read the columns that figures need, and nothing else."""
    from vidtrack.traffic.measures.blocks import blocks
    from vidtrack.traffic.measures.rows import EDGE_COLUMNS, ROAD_COLUMNS

    for table in blocks(folder, (*ROAD_COLUMNS, *EDGE_COLUMNS)):
        for name in table.column_names:
            table[name].combine_chunks()


def conflicts(folder: Path) -> None:
    """Read, and find all conflicts."""
    from vidtrack.traffic.calibration.calibrate import calibrated
    from vidtrack.traffic.measures.conflicts import Meeting
    from vidtrack.traffic.measures.rows import Reader
    from vidtrack.traffic.measures.runs import open_day
    from vidtrack.traffic.site import read_site

    site = read_site(folder / "site.toml")
    day = open_day([str(folder)], site.camera.start)
    reader, meeting = Reader(day, {one.size: calibrated(site) for one in day.recordings}), Meeting()
    for rows in reader:
        meeting.add(rows)
    print(len(meeting.conflicts(np.arange(len(reader.names[0])), day.spans)), "conflicts")


def measure(folder: Path) -> None:
    """Compute all tables."""
    from vidtrack.traffic.measures.measure import measured
    from vidtrack.traffic.site import read_site

    found = measured([str(folder)], read_site(folder / "site.toml"))
    print({name: len(table) for name, table in found.tables.items()})


PARTS = {"read": read, "conflicts": conflicts, "measure": measure}
WRITE = "write"  # in a process of its own, too: a process counts the memory of the one that started it


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vehicles", type=int, default=100_000)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--only", choices=(WRITE, *PARTS))
    options = parser.parse_args()
    if options.only == WRITE:
        write_day(options.output, options.vehicles)
        return
    if options.only:
        begin = time.perf_counter()
        PARTS[options.only](options.output)
        seconds, peak = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{options.only}: {seconds:.1f} s, {time.process_time():.1f} s of CPU, at most {peak:.0f} MB")
        return
    again = [sys.executable, __file__, "-o", str(options.output), "--vehicles", str(options.vehicles), "--only"]
    parts = [*PARTS, *PARTS] if (options.output / "summary.json").exists() else [WRITE, *PARTS, *PARTS]
    for only in parts:
        subprocess.run([*again, only], check=True)


if __name__ == "__main__":
    main()

"""Run folders with positions in metres, made without a tracker."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.output.tables import ROAD, VIDEO, schema

COLUMNS = (*VIDEO, *ROAD)
EAST, NORTH = 560_000.0, 5_800_000.0
FPS = 25.0
SITE = """
[site]
name = "road"
start = 2026-06-01T07:00:00+02:00
width = 640
height = 480
[calibration]
picture = [[100, 400], [500, 400], [400, 100], [200, 100]]
ground = [[560000, 5800000], [560030, 5800000], [560030, 5800060], [560000, 5800060]]
epsg = 25832
[classes]
car = [3.2, 5.4]
truck = [5.4, 15.0]
"""


def way(track, frames, *, length=4.5, heading_deg=30.0, speed=10.0, start=(EAST, NORTH), status="confirmed"):
    """Rows of a vehicle that drives straight on: a dict of columns."""
    frames = np.asarray(frames)
    t = frames / FPS
    heading = np.radians(heading_deg)
    count = len(frames)
    rows = {column.name: np.zeros(count) for column in COLUMNS}
    rows |= {
        "frame": frames,
        "time_s": t,
        "track_id": np.full(count, track),
        "status": np.full(count, status, object),
        "x_m": np.round(start[0] + speed * t * np.sin(heading), 3),
        "y_m": np.round(start[1] + speed * t * np.cos(heading), 3),
        "speed_kmh": np.full(count, 3.6 * speed),
        "heading_deg": np.full(count, heading_deg),
        "length_m": np.full(count, length),
        "length_sigma_m": np.full(count, 0.3),
        "width_m": np.full(count, 1.8),
        "class": np.full(count, "car", object),
    }
    return rows


def hide(rows, frames, *columns):
    """Empty cells in the given frames; without columns, in all of the road."""
    empty = np.isin(rows["frame"], frames)
    for name in columns or [column.name for column in ROAD]:
        rows[name] = np.where(empty, None if name == "class" else np.nan, rows[name])
    return rows


def table_of(*ways, columns=COLUMNS):
    """The rows of all vehicles in order of frame."""
    joined = {column.name: np.concatenate([way[column.name] for way in ways]) for column in columns}
    order = np.argsort(joined["frame"], kind="stable")
    return pa.Table.from_arrays(
        [pa.array(joined[column.name][order], column.kind, from_pandas=True) for column in columns],
        schema=schema(columns),
    )


def write_run(folder, *ways, site=SITE, columns=COLUMNS, fps=FPS, max_fps=None, every_s=0.0, **told):
    """A finished run; returns its folder."""
    run = folder / "run"
    run.mkdir(parents=True)
    (folder / "site.toml").write_text(site)
    pq.write_table(table_of(*ways, columns=columns), run / "tracks.parquet")
    settings = {"output": {"site": str(folder / "site.toml"), "every_s": every_s}, "source": {"max_fps": max_fps}}
    summary = {"fps": fps, "settings": settings, **told}
    (run / "summary.json").write_text(json.dumps(summary))
    return run


def usual_ways():
    """A car out of view for 0.4 s; a lorry that is guessed twice, the second time for good; one that is seen once."""
    car = hide(way(7, range(100)), range(40, 50))
    lorry = way(9, range(20, 71), length=10.0, heading_deg=210.0, start=(EAST + 20, NORTH + 40))
    hide(lorry, range(20, 23), "heading_deg", "length_m", "length_sigma_m", "width_m")
    hide(lorry, range(23, 25), "length_m", "length_sigma_m", "width_m")  # hidden by another one
    lorry["status"][10:13] = "coasting"
    lorry["status"][-10:] = "coasting"
    return car, lorry, way(11, [5])

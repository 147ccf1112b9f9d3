"""GeoParquet 1.1: the table of tracks with a point a row, in the site's own metres."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa

from vidtrack.arrays.types import Floats
from vidtrack.output.export.globe import system_of
from vidtrack.output.export.road_run import RoadRun
from vidtrack.output.parquet import write_parquet

_WKB_POINT = np.dtype([("order", "u1"), ("type", "<u4"), ("xy", "<f8", 2)])
"""Well-known binary of a point: little endian (1), kind of geometry (1), x, y."""


def write(run: RoadRun, folder: Path) -> None:
    """Write tracks.geo.parquet: all columns of tracks.parquet, the class, the time in UTC, and `geometry`."""
    system = system_of(run.site)
    geometry = {
        "encoding": "WKB",
        "geometry_types": ["Point"],
        "crs": None if system is None else system.to_json_dict(),
    }
    about = {"version": "1.1.0", "primary_column": "geometry", "columns": {"geometry": geometry}}
    tables = _with_points(run)
    first = next(tables)
    schema = first.schema.with_metadata({"geo": json.dumps(about)})

    def labelled() -> Iterator[pa.Table]:
        yield first.replace_schema_metadata(schema.metadata)
        yield from (table.replace_schema_metadata(schema.metadata) for table in tables)

    write_parquet(folder / "tracks.geo.parquet", schema, labelled())


def _with_points(run: RoadRun) -> Iterator[pa.Table]:
    for table in run.tables():
        kind = run.vehicles.kind[run.vehicles.row(table["track_id"].to_numpy())]
        if "class" in table.column_names:  # of the row; here it is that of the whole track
            table = table.drop_columns("class")
        table = table.append_column("class", pa.array(kind, pa.string()))
        if run.start is not None:
            since = np.round(1e6 * table["time_s"].to_numpy()).astype("timedelta64[us]")
            utc = np.datetime64(run.start.replace(tzinfo=None), "us") + since
            table = table.append_column("time_utc", pa.array(utc, pa.timestamp("us", "UTC")))
        xy = np.column_stack([table["x_m"].to_numpy(), table["y_m"].to_numpy()])
        yield table.append_column("geometry", wkb_points(xy))


def wkb_points(xy: Floats) -> pa.Array:
    """(N,) points (N, 2) in well-known binary."""
    points = np.empty(len(xy), _WKB_POINT)
    points["order"], points["type"], points["xy"] = 1, 1, xy
    offsets = np.arange(len(xy) + 1, dtype=np.int32) * _WKB_POINT.itemsize
    return pa.Array.from_buffers(pa.binary(), len(xy), [None, pa.py_buffer(offsets), pa.py_buffer(points.tobytes())])

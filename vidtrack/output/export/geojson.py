"""GeoJSON (RFC 7946): each way of a vehicle is a line, with times and speeds at its corners."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from vidtrack.output.export.globe import to_globe
from vidtrack.output.export.pieces import pieces
from vidtrack.output.export.road_run import RoadRun
from vidtrack.output.folder import replacing


def write(run: RoadRun, folder: Path) -> None:
    """Write tracks.geojson. A piece of one position is no line and is left out. Raises ConfigError without epsg."""
    degrees = to_globe(run.site, "geojson")
    start = None if run.start is None else run.start.isoformat()
    with replacing(folder / "tracks.geojson") as path, path.open("w", encoding="utf-8") as file:
        file.write('{"type": "FeatureCollection", "features": [')
        comma = "\n"
        for piece in pieces(run):
            if len(piece.rows) < 2:
                continue
            feature = {
                "type": "Feature",
                "id": piece.name,
                "geometry": {"type": "LineString", "coordinates": np.round(degrees(piece.rows.xy), 8).tolist()},
                "properties": {
                    "track_id": piece.track,
                    "piece": piece.number,
                    "class": piece.kind,
                    "start": start,
                    "time_s": np.round(piece.rows.time, 6).tolist(),
                    "speed_kmh": numbers(3.6 * piece.rows.speed, 3),
                },
            }
            file.write(comma + json.dumps(feature, allow_nan=False))
            comma = ",\n"
        file.write("\n]}\n")


def numbers(values: np.ndarray, decimals: int) -> list[float | None]:
    """For JSON, which has no NaN: null."""
    return [None if value != value else value for value in np.round(values, decimals).tolist()]

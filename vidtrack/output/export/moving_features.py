"""OGC Moving Features JSON (19-045r3): each way of a vehicle is a moving point in WGS84."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.output.export.geojson import numbers
from vidtrack.output.export.globe import to_globe
from vidtrack.output.export.pieces import Piece, pieces
from vidtrack.output.export.road_run import RoadRun
from vidtrack.output.folder import replacing

_WGS84 = {"type": "Name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
_CALENDAR = {"type": "Name", "properties": {"name": "urn:ogc:data:datetime:iso8601"}}


def write(run: RoadRun, folder: Path) -> None:
    """Write tracks.mf.json. A piece of one position does not move and is left out.

    Raises ConfigError for a site without epsg, or without the time of its first picture.
    """
    degrees = to_globe(run.site, "mf-json")
    start = run.start
    if start is None:
        raise ConfigError(
            f"mf-json needs dates, and the site {run.site.camera.name} has none: give [site] the time of the video's "
            "first picture, for example start = 2026-06-01T07:00:00+02:00"
        )
    with replacing(folder / "tracks.mf.json") as path, path.open("w", encoding="utf-8") as file:
        opening = {"type": "FeatureCollection", "crs": _WGS84, "trs": _CALENDAR}
        file.write(json.dumps(opening)[:-1] + ', "features": [')
        comma = "\n"
        for piece in pieces(run):
            if len(piece.rows) > 1:
                file.write(comma + json.dumps(_feature(piece, start, degrees(piece.rows.xy)), allow_nan=False))
                comma = ",\n"
        file.write("\n]}\n")


def _feature(piece: Piece, start: datetime, lonlat: Floats) -> dict[str, object]:
    first = np.datetime64(start.replace(tzinfo=None), "us")
    moments = first + np.round(1e6 * piece.rows.time).astype("timedelta64[us]")
    datetimes = [f"{moment}Z" for moment in np.datetime_as_string(moments, unit="us").tolist()]
    speed = {"type": "Measure", "form": "KMH", "values": numbers(3.6 * piece.rows.speed, 3), "interpolation": "Linear"}
    return {
        "type": "Feature",
        "id": piece.name,
        "properties": {"track_id": piece.track, "piece": piece.number, "name": piece.name, "class": piece.kind},
        "temporalGeometry": {
            "type": "MovingPoint",
            "datetimes": datetimes,
            "coordinates": np.round(lonlat, 8).tolist(),
            "interpolation": "Linear",
        },
        "temporalProperties": [{"datetimes": datetimes, "speed_kmh": speed}],
    }

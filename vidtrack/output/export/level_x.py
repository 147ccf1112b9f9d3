"""The tables of the level-X data sets (inD, rounD, exiD, uniD), which many planners and predictors read."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TextIO

import numpy as np
import pyarrow as pa

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.output.export.globe import system_of, to_globe
from vidtrack.output.export.pieces import Piece, pieces
from vidtrack.output.export.road_run import RoadRun, Vehicles
from vidtrack.output.folder import replacing
from vidtrack.output.tables import csv_text
from vidtrack.traffic.vehicles.classes import CLASSES, KINDS

_TRACKS = (
    *("recordingId", "trackId", "frame", "trackLifetime", "xCenter", "yCenter", "heading", "width", "length"),
    *("xVelocity", "yVelocity", "xAcceleration", "yAcceleration"),
    *("lonVelocity", "latVelocity", "lonAcceleration", "latAcceleration"),
)
_TRACKS_META = (
    *("recordingId", "trackId", "initialFrame", "finalFrame", "numFrames", "width", "length", "class"),
    *("vidtrackId", "vidtrackPiece", "vidtrackClass"),
)
_RECORDING_META = (
    *("recordingId", "locationId", "frameRate", "speedLimit", "weekday", "startTime", "duration"),
    *("numTracks", "numVehicles", "numVRUs", "latLocation", "lonLocation", "xUtmOrigin", "yUtmOrigin"),
    "orthoPxToMeter",
)
_WORDS = {
    **{word: word for word in ("car", "van", "truck", "bus", "truck_bus", "trailer")},
    **{word: word for word in ("motorcycle", "bicycle", "pedestrian")},
    **{"lorry": "truck", "lorry or bus": "truck_bus", "motorcycle or bicycle": "bicycle", "person": "pedestrian"},
}
"""The data sets' word for each class; readers refuse others."""
_RECORDING = 0


def write(run: RoadRun, folder: Path) -> None:
    """Write 00_tracks.csv, 00_tracksMeta.csv and 00_recordingMeta.csv.

    A `trackId` is that of a piece: readers count on frames without a gap. What is not known is an empty cell, but for
    class and size of a whole track. Raises ConfigError for a source without a frame rate, and for a run with rows
    of some frames only.
    """
    if not run.fps:
        raise ConfigError(f"level-x needs a frame rate, and the source of {run.folder} has none")
    if run.every_s:
        raise ConfigError(
            f"level-x has all frames, and {run.folder} has rows of one in {run.every_s:.3g} s: track without "
            "source.max_fps and output.every_s"
        )
    with (
        replacing(folder / "00_tracks.csv") as tracks_path,
        replacing(folder / "00_tracksMeta.csv") as meta_path,
        tracks_path.open("w", newline="", encoding="utf-8") as tracks,
        meta_path.open("w", newline="", encoding="utf-8") as meta,
    ):
        tracks.write(",".join(_TRACKS) + "\n")
        rows = csv.writer(meta, lineterminator="\n")
        rows.writerow(_TRACKS_META)
        number, last = -1, 0
        for number, piece in enumerate(pieces(run)):
            _write_track(tracks, number, piece)
            rows.writerow(_meta(number, piece, run.vehicles))
            last = max(last, int(piece.rows.frame[-1]))
    with replacing(folder / "00_recordingMeta.csv") as path, path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([_RECORDING_META, _recording(run, number + 1, last)])


def _write_track(file: TextIO, number: int, piece: Piece) -> None:
    rows = piece.rows
    count = len(rows)
    empty = np.full(count, np.nan)
    velocity = rows.speed[:, None] * rows.ahead
    columns = (
        *(np.full(count, _RECORDING), np.full(count, number), rows.frame, rows.frame - rows.frame[0]),
        *rows.xy.T,
        (90 - np.degrees(rows.heading)) % 360,  # there from east, anticlockwise
        *(rows.width, rows.length),
        *(*velocity.T, empty, empty),
        *(rows.speed, np.where(np.isnan(rows.heading), np.nan, 0.0), empty, empty),  # a heading is the way of motion
    )
    table = pa.table([pa.array(_rounded(column), from_pandas=True) for column in columns], list(_TRACKS))
    file.write(csv_text(table))


def _rounded(column: np.ndarray) -> np.ndarray:
    return np.round(column, 5) if column.dtype.kind == "f" else column


def _meta(number: int, piece: Piece, vehicles: Vehicles) -> tuple[object, ...]:
    """Readers need a class that they know and a size: else those of the likeliest class."""
    rows, (row,) = piece.rows, vehicles.row(np.array([piece.track]))
    likeliest = str(vehicles.likeliest[row])
    length, width, _ = KINDS[CLASSES.index(likeliest)].mean
    sides = (_mean(rows.width, width), _mean(rows.length, length))
    frames = (int(rows.frame[0]), int(rows.frame[-1]), len(rows))
    word = _WORDS.get(piece.kind.lower(), _WORDS[likeliest])
    return (_RECORDING, number, *frames, *sides, word, piece.track, piece.number, piece.kind)


def _mean(values: Floats, usual: float) -> float:
    known = values[np.isfinite(values)]
    return round(float(known.mean()), 3) if len(known) else usual


def _recording(run: RoadRun, tracks: int, last: int) -> tuple[object, ...]:
    start = run.site.camera.start
    weekday, hour = ("", "") if start is None else (start.strftime("%A").lower(), start.strftime("%H:%M"))
    lat = lon = origin = ""
    if system_of(run.site) is not None:
        (degrees,) = to_globe(run.site, "level-x")((run.corner + run.extent / 2)[None])
        lon, lat = (f"{value:.6f}" for value in degrees)
        origin = "0"  # xCenter and yCenter are coordinates of the system themselves
    duration = round((last + 1) / float(run.fps or 1), 3)
    return (
        *(_RECORDING, 0, run.fps, "", weekday, hour, duration),
        *(tracks, "", "", lat, lon, origin, origin, ""),
    )

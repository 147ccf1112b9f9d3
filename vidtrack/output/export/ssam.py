"""SSAM's trajectories (.trj, version 1.04): what it finds conflicts in.

Version 1.04, because SSAM reads heights from every later version, also where the file says that it has none.
"""

from __future__ import annotations

import json
import struct
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.output.export.road_run import RoadRun, Rows
from vidtrack.output.folder import replacing
from vidtrack.output.linefile import replace_text

_FORMAT, _DIMENSIONS, _TIMESTEP, _VEHICLE = range(4)
_VERSION = 1.04
_METRIC = 1
_VEHICLES = np.dtype(
    [
        *[("record", "u1"), ("vehicle", "<i4"), ("link", "<i4"), ("lane", "u1")],
        *[("front", "<f4", 2), ("rear", "<f4", 2), ("length", "<f4"), ("width", "<f4")],
        *[("speed", "<f4"), ("acceleration", "<f4")],
    ]
)


def write(run: RoadRun, folder: Path) -> None:
    """Write tracks.trj, and origin.json with the place of its (0, 0) in metres of the site.

    Numbers there have 24 bits, so places are counted from the south-west corner. Links and lanes are 0, not known:
    then SSAM tells kinds of conflicts by their angle. Accelerations are 0: those from video are too noisy to be of use.
    Rows without a heading or a length are left out: front and rear are not known.
    """
    origin = np.floor(run.corner)
    far = np.ceil(run.corner + run.extent - origin).astype(int) + 1
    with replacing(folder / "tracks.trj") as path, path.open("wb") as file:
        file.write(struct.pack("<Bcf", _FORMAT, b"L", _VERSION))
        file.write(struct.pack("<BBfiiii", _DIMENSIONS, _METRIC, 1.0, 0, 0, *far.tolist()))
        frame = -1
        for rows in run.batches():
            frame = _write_rows(file, rows.select(np.isfinite(rows.heading) & np.isfinite(rows.length)), origin, frame)
    replace_text(folder / "origin.json", json.dumps({"x_m": origin[0], "y_m": origin[1]}) + "\n")


def _write_rows(file: BinaryIO, rows: Rows, origin: Floats, frame: int) -> int:
    """Returns the last frame that has begun, which later rows may go on with."""
    records = np.zeros(len(rows), _VEHICLES)
    records["record"], records["vehicle"] = _VEHICLE, rows.track
    records["front"] = rows.front - origin
    records["rear"] = 2 * rows.xy - rows.front - origin
    records["length"], records["width"], records["speed"] = rows.length, rows.width, rows.speed
    frames, first = np.unique(rows.frame, return_index=True)
    for number, (start, end) in zip(frames.tolist(), pairwise([*first, len(rows)]), strict=True):
        if number != frame:
            file.write(struct.pack("<Bf", _TIMESTEP, rows.time[start]))
        file.write(records[start:end].tobytes())
        frame = number
    return frame

"""tracks.csv and tracks.parquet: one row per track and scan."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.csv

from vidtrack.arrays.covariance import correlation
from vidtrack.arrays.types import Floats
from vidtrack.output.linefile import Every, LineFile
from vidtrack.output.parquet import ParquetParts
from vidtrack.output.sink import Step, seen
from vidtrack.output.stated import all_stated
from vidtrack.tracks import Status

if TYPE_CHECKING:  # loads SciPy; needed only at calibrated sites
    from vidtrack.traffic.footprint import Footprints


@dataclass(frozen=True, slots=True)
class Column:
    """A column: name, unit ("1" for a pure number), type, and number of decimals in CSV."""

    name: str
    unit: str
    kind: pa.DataType
    decimals: int = 0


def _real(name: str, unit: str, decimals: int = 3) -> Column:
    return Column(name, unit, pa.float64(), decimals)


_TRACK = (_real("time_s", "s", 6), Column("track_id", "1", pa.int64()), Column("status", "1", pa.string()))

_VIDEO = (
    Column("frame", "1", pa.int64()),
    *_TRACK,
    _real("x_px", "px"),
    _real("y_px", "px"),
    _real("vx_px_s", "px/s"),
    _real("vy_px_s", "px/s"),
    _real("sigma_x_px", "px"),
    _real("sigma_y_px", "px"),
    _real("corr_xy", "1", 6),
    _real("left_px", "px"),
    _real("top_px", "px"),
    _real("width_px", "px"),
    _real("height_px", "px"),
    Column("group_id", "1", pa.int64()),
    _real("nis", "1"),
)

_RADAR = (
    Column("scan", "1", pa.int64()),
    *_TRACK,
    _real("x_m", "m"),
    _real("y_m", "m"),
    _real("vx_m_s", "m/s"),
    _real("vy_m_s", "m/s"),
    _real("sigma_x_m", "m"),
    _real("sigma_y_m", "m"),
    _real("corr_xy", "1", 6),
    _real("nis", "1"),
)
_RADAR_3D = (*_RADAR, _real("z_m", "m"), _real("vz_m_s", "m/s"), _real("sigma_z_m", "m"))


def _of_velocity(unit: str, decimals: int = 3) -> tuple[Column, ...]:
    """Columns of the covariance of (x, y, vx, vy) beyond the position's."""
    sigmas = (_real(f"sigma_v{axis}_{unit}_s", f"{unit}/s", decimals) for axis in "xy")
    return (*sigmas, *(_real(f"corr_{pair}", "1", 6) for pair in _PAIRS))


_PAIRS = {"vxy": (2, 3), "x_vx": (0, 2), "x_vy": (0, 3), "y_vx": (1, 2), "y_vy": (1, 3)}
"""Correlations besides `corr_xy`, with their rows in the covariance."""

_SEEN = ("seen_left_px", "seen_top_px", "seen_right_px", "seen_bottom_px")

VIDEO = (*_VIDEO, *_of_velocity("px"), *(_real(name, "px") for name in _SEEN))
"""Columns of video tracks. `group_id` is -1 without a shared blob; `nis` is empty without an update; `seen_` are edges
of the track's own measurement, in the scene."""

RADAR = (*_RADAR, *_of_velocity("m"), _real("exchange", "1", 6))
"""Columns of radar tracks in the plane: x east, y north; `exchange` is the probability of another track's target."""

RADAR_3D = (*_RADAR_3D, *_of_velocity("m"), _real("sigma_vz_m_s", "m/s"), _real("exchange", "1", 6))
"""Columns of radar tracks in space: z up."""

ROAD = (
    _real("x_m", "m"),
    _real("y_m", "m"),
    _real("sigma_x_m", "m"),
    _real("sigma_y_m", "m"),
    _real("corr_xy_m", "1", 6),
    _real("shared_sigma_x_m", "m"),
    _real("shared_sigma_y_m", "m"),
    _real("speed_kmh", "km/h"),
    _real("speed_sigma_kmh", "km/h"),
    _real("speed_shared_sigma_kmh", "km/h"),
    _real("heading_deg", "deg", 2),
    _real("length_m", "m"),
    _real("length_sigma_m", "m"),
    _real("width_m", "m"),
    Column("class", "1", pa.string()),
)
"""Columns of video tracks at a calibrated site; empty where the calibration is not valid."""

_STATUS_WORDS = np.array([status.name.lower() for status in Status])


def schema(columns: Sequence[Column]) -> pa.Schema:
    """Arrow schema with each column's unit in its metadata."""
    return pa.schema([pa.field(c.name, c.kind, metadata={"unit": c.unit}) for c in columns])


def layout(names: Sequence[str]) -> Sequence[Column]:
    """The layout of a table of tracks with these column names; VIDEO if none fits.

    Later columns may be missing: earlier versions did not write them.
    """
    kinds = ((_RADAR_3D, RADAR_3D), (_RADAR, RADAR))
    first, known = next((kind for kind in kinds if {c.name for c in kind[0]} <= set(names)), (_VIDEO, (*VIDEO, *ROAD)))
    return [*first, *(c for c in known if c.name in names and c not in first)]


def track_rows(steps: Sequence[Step], columns: Sequence[Column] = VIDEO, road: Footprints | None = None) -> pa.Table:
    """A table with these columns, rows in the order of the steps.

    road  computes the columns of ROAD, in coordinates of the scene, which do not move with the camera
    """
    steps = all_stated(steps)
    counts = [len(step.tracks) for step in steps]
    position, velocity = list(steps[0].tracks.position), list(steps[0].tracks.velocity)
    edge = seen(steps)
    on_road = {} if road is None else _road_values(steps, edge, road)
    steps = [step.in_picture() for step in steps]
    x, P, box = (stacked(steps, name) for name in ("x", "P", "box"))
    cov = P[:, position][:, :, position]
    sigma = np.sqrt(np.diagonal(cov, axis1=1, axis2=2))
    values = {
        "time_s": np.repeat([step.time_s for step in steps], counts),
        "track_id": stacked(steps, "id"),
        "status": _STATUS_WORDS[stacked(steps, "status")],
        "corr_xy": correlation(cov[:, 0, 1], sigma[:, 0] * sigma[:, 1]),
        "group_id": stacked(steps, "group"),
        "nis": stacked(steps, "nis"),
    }
    if any(column.name == "exchange" for column in columns):
        values["exchange"] = stacked(steps, "exchange")
    values["frame"] = values["scan"] = np.repeat([step.index for step in steps], counts)
    for unit in ("px", "m"):
        for k, axis in enumerate("xyz"[: len(position)]):
            values[f"{axis}_{unit}"] = x[:, position[k]]
            values[f"v{axis}_{unit}_s"] = x[:, velocity[k]]
            values[f"sigma_{axis}_{unit}"] = sigma[:, k]
            values[f"sigma_v{axis}_{unit}_s"] = np.sqrt(P[:, velocity[k], velocity[k]])
    plane = [*position[:2], *velocity[:2]]
    for name, (i, j) in _PAIRS.items():
        i, j = plane[i], plane[j]
        values[f"corr_{name}"] = correlation(P[:, i, j], np.sqrt(P[:, i, i] * P[:, j, j]))
    values |= on_road
    values |= zip(("left_px", "top_px", "width_px", "height_px"), box.T, strict=True)
    values |= zip(_SEEN, edge.T, strict=True)
    return pa.Table.from_arrays([_array(c, values[c.name]) for c in columns], schema=schema(columns))


def _road_values(steps: Sequence[Step], edge: Floats, road: Footprints) -> dict[str, np.ndarray]:
    """The values of ROAD, all (N,); edge (N, 4) px that were seen."""
    t = np.repeat([step.time_s for step in steps], [len(step.tracks) for step in steps])
    plane = [*steps[0].tracks.position[:2], *steps[0].tracks.velocity[:2]]
    x, P = stacked(steps, "x")[:, plane], stacked(steps, "P")[:, plane][:, :, plane]
    box = stacked(steps, "box")
    merged = stacked(steps, "status") == Status.MERGED
    rim = np.repeat([step.scan.rim for step in steps], [len(step.tracks) for step in steps])
    stand = road.place(stacked(steps, "id"), t, x[:, :2], x[:, 2:], P, box, merged, edge, rim)
    sigma = np.sqrt(np.diagonal(stand.xy_own, axis1=1, axis2=2))
    shared = np.linalg.norm(stand.xy_shared, axis=2)
    return {
        "x_m": stand.xy[:, 0],
        "y_m": stand.xy[:, 1],
        "sigma_x_m": sigma[:, 0],
        "sigma_y_m": sigma[:, 1],
        "corr_xy_m": correlation(stand.xy_own[:, 0, 1], sigma.prod(axis=1)),
        "shared_sigma_x_m": shared[:, 0],
        "shared_sigma_y_m": shared[:, 1],
        "speed_kmh": 3.6 * stand.speed,
        "speed_sigma_kmh": 3.6 * stand.speed_own_sigma,
        "speed_shared_sigma_kmh": 3.6 * np.linalg.norm(stand.speed_by_shared, axis=1),
        "heading_deg": np.degrees(stand.heading) % 360,
        "length_m": stand.length,
        "length_sigma_m": stand.length_sigma,
        "width_m": stand.width,
        "class": stand.kind,
    }


def stacked(steps: Sequence[Step], name: str) -> np.ndarray:
    """(N, ...) one attribute of all tracks, in the order of the steps."""
    return np.concatenate([getattr(step.tracks, name) for step in steps])


def _array(column: Column, values: np.ndarray) -> pa.Array:
    if column.kind == pa.float64():
        values = np.round(values, column.decimals)
    return pa.array(values, column.kind, from_pandas=True)  # NaN becomes an empty cell


class TrackTable:
    """Sink that writes tracks.csv every second, and tracks.parquet in parts.

    text  whether there is a tracks.csv
    """

    def __init__(
        self, folder: Path, columns: Sequence[Column] = VIDEO, road: Footprints | None = None, *, text: bool = True
    ) -> None:
        columns = columns if road is None else (*columns, *ROAD)
        self._columns, self._road = columns, road
        self._csv = LineFile(folder / "tracks.csv", ",".join(c.name for c in columns) + "\n") if text else None
        self._parquet = ParquetParts(folder / "tracks.parquet", schema(columns))
        self._waiting: list[Step] = []
        self._due = Every(1.0)

    def step(self, step: Step) -> None:
        """Receive one frame's confirmed tracks."""
        if len(step.tracks):
            self._waiting.append(step)
        if self._due():
            self._write()

    def close(self) -> None:
        """Write the rest, and join the parts of tracks.parquet."""
        try:
            self._write()
        finally:
            if self._csv is not None:
                self._csv.close()
        self._parquet.close()

    def _write(self) -> None:
        if not self._waiting:
            return
        table = track_rows(self._waiting, self._columns, self._road)
        self._waiting.clear()
        if self._csv is not None:
            self._csv.add(csv_text(table))
            self._csv.flush()
        self._parquet.add(table)


def csv_text(table: pa.Table) -> str:
    """The rows as lines of CSV, without a header."""
    text = io.BytesIO()
    options = pyarrow.csv.WriteOptions(include_header=False, quoting_style="none")
    pyarrow.csv.write_csv(table, text, options)
    return text.getvalue().decode()

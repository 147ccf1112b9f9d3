"""tracks.csv and tracks.parquet: one row per track and scan."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv

from vidtrack.output.linefile import Every, LineFile
from vidtrack.output.parquet import ParquetParts
from vidtrack.output.sink import Step
from vidtrack.scan import Status


@dataclass(frozen=True, slots=True)
class Column:
    """A column's name, unit ("1" for a pure number), kind and the decimals that are worth keeping."""

    name: str
    unit: str
    kind: pa.DataType
    decimals: int = 0


def _real(name: str, unit: str, decimals: int = 3) -> Column:
    return Column(name, unit, pa.float64(), decimals)


VIDEO = (
    Column("frame", "1", pa.int64()),
    _real("time_s", "s", 6),
    Column("track_id", "1", pa.int64()),
    Column("status", "1", pa.string()),
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
"""Columns of video tracks. `group_id` is -1 alone; `nis` is empty where there was no update."""

_STATUS_WORDS = np.array([status.name.lower() for status in Status])


def schema(columns: Sequence[Column]) -> pa.Schema:
    """Arrow schema with each column's unit in its metadata."""
    return pa.schema([pa.field(c.name, c.kind, metadata={"unit": c.unit}) for c in columns])


def video_rows(steps: Sequence[Step]) -> pa.Table:
    """Table with the columns VIDEO, rows in the order of the steps."""
    tracks = [step.tracks for step in steps]
    counts = [len(t) for t in tracks]
    x, P, box = (np.concatenate([getattr(t, name) for t in tracks]) for name in ("x", "P", "box"))
    position, velocity = list(tracks[0].position), list(tracks[0].velocity)
    cov = P[:, position][:, :, position]
    sigma = np.sqrt(cov[:, [0, 1], [0, 1]])
    values = [
        np.repeat([step.index for step in steps], counts),
        np.repeat([step.time_s for step in steps], counts),
        np.concatenate([t.id for t in tracks]),
        _STATUS_WORDS[np.concatenate([t.status for t in tracks])],
        *x[:, position].T,
        *x[:, velocity].T,
        *sigma.T,
        cov[:, 0, 1] / sigma.prod(axis=1),
        *box.T,
        np.concatenate([t.group for t in tracks]),
        np.concatenate([t.nis for t in tracks]),
    ]
    return pa.Table.from_arrays([_array(c, v) for c, v in zip(VIDEO, values, strict=True)], schema=schema(VIDEO))


def _array(column: Column, values: np.ndarray) -> pa.Array:
    if column.kind == pa.float64():
        values = np.round(values, column.decimals)
    return pa.array(values, column.kind, from_pandas=True)  # NaN becomes an empty cell


class TrackTable:
    """Sink that writes tracks.csv every second and tracks.parquet in parts."""

    def __init__(self, folder: Path) -> None:
        self._csv = LineFile(folder / "tracks.csv", ",".join(c.name for c in VIDEO) + "\n")
        self._parquet = ParquetParts(folder / "tracks.parquet", schema(VIDEO))
        self._waiting: list[Step] = []
        self._due = Every(1.0)

    def step(self, step: Step) -> None:
        """Take one frame's confirmed tracks."""
        if len(step.tracks):
            self._waiting.append(step)
        if self._due():
            self._write()

    def close(self) -> None:
        """Write what waits and make the one tracks.parquet."""
        try:
            self._write()
        finally:
            self._csv.close()
        self._parquet.close()

    def _write(self) -> None:
        if not self._waiting:
            return
        rows = video_rows(self._waiting)
        self._waiting.clear()
        self._csv.add(csv_text(rows))
        self._csv.flush()
        self._parquet.add(rows)


def csv_text(table: pa.Table) -> str:
    """The rows as lines, without a header."""
    text = io.BytesIO()
    options = pyarrow.csv.WriteOptions(include_header=False, quoting_style="none")
    pyarrow.csv.write_csv(table, text, options)
    return text.getvalue().decode()

"""A finished run of radar plots, a batch of rows at a time."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.errors import ConfigError, FormatError
from vidtrack.formats import damaged
from vidtrack.radar.plane import Plane, plane_of_run

_BATCH = 1 << 16
_NEEDED = ("scan", "time_s", "track_id", "status", "x_m", "y_m", "vx_m_s", "vy_m_s", "sigma_x_m", "sigma_y_m")


@dataclass(frozen=True, slots=True)
class RadarRun:
    """A run's table of tracks in metres.

    plane      where x = y = 0 is on the earth; None: not known
    sac, sic   of the radar, 0 if it has none
    rows       of the table
    """

    folder: Path
    plane: Plane | None
    sac: int
    sic: int
    rows: int

    def tables(self) -> Iterator[pa.Table]:
        """All rows in order of scan. Raises FormatError if the table is damaged."""
        path = self.folder / "tracks.parquet"
        try:
            with pq.ParquetFile(path) as file:
                for batch in file.iter_batches(_BATCH):
                    yield pa.Table.from_batches([batch])
        except (pa.ArrowInvalid, OSError) as error:
            raise damaged(path, error) from None


def open_radar_run(folder: Path, position: tuple[float, float, float] | None = None) -> RadarRun:
    """A finished run of `vidtrack radar`.

    position  latitude, longitude [degrees] and height [m] of x = y = 0; None: as the run knows it
    Raises FormatError for a folder that is no finished run, ConfigError for one of a video.
    """
    table = folder / "tracks.parquet"
    try:
        summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
        radar = summary["settings"].get("radar", {})
        names, rows = set(pq.read_schema(table).names), pq.read_metadata(table).num_rows
    except (OSError, pa.ArrowInvalid, ValueError, KeyError, TypeError) as error:
        raise FormatError(f"{folder} is not a finished run: {error}; vidtrack repair {folder} may help") from None
    if not set(_NEEDED) <= names:
        raise ConfigError(f"{folder} is not a run of vidtrack radar; CAT 062 is for radar's tracks")
    plane = Plane(*position) if position else plane_of_run(summary)
    return RadarRun(folder, plane, radar.get("sac") or 0, radar.get("sic") or 0, rows)

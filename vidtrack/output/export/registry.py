"""Names of the formats and where they are written. Modules are imported only when one is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vidtrack.output.export.road_run import RoadRun


@dataclass(frozen=True, slots=True)
class Format:
    """A module of this package whose `write(run, folder)` writes the format, and what it writes."""

    module: str
    writes: str


FORMATS = {
    "geojson": Format("geojson", "tracks.geojson: a line a vehicle, with times and speeds, in WGS84"),
    "geoparquet": Format("geoparquet", "tracks.geo.parquet: all columns and a point a row"),
    "mf-json": Format("moving_features", "tracks.mf.json: OGC Moving Features, in WGS84"),
    "level-x": Format("level_x", "00_tracks.csv and two tables of meta data, as inD has them"),
    "sumo": Format("sumo", "fcd.xml: floating car data"),
    "ssam": Format("ssam", "tracks.trj: trajectories to find conflicts in, version 1.04"),
}


def export(run: RoadRun, name: str, folder: Path) -> None:
    """Write the run in the format of that name. Raises ConfigError for what the format needs and the site lacks."""
    import_module(f"vidtrack.output.export.{FORMATS[name].module}").write(run, folder)

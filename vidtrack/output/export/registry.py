"""Names of the formats and where they are written. Modules are imported only when one is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vidtrack.output.export.radar_run import RadarRun
    from vidtrack.output.export.road_run import RoadRun
    from vidtrack.traffic.report.findings import Findings


@dataclass(frozen=True, slots=True)
class Format:
    """A module of this package whose `write(run, folder)` writes the format, and what it writes.

    measures  it takes what `vidtrack measure` found instead of a run, and returns what it left out
    radar     it takes a run of `vidtrack radar`, and returns what it wrote
    """

    module: str
    writes: str
    measures: bool = False
    radar: bool = False


FORMATS = {
    "geojson": Format("geojson", "tracks.geojson: a line a vehicle, with times and speeds, in WGS84"),
    "geoparquet": Format("geoparquet", "tracks.geo.parquet: all columns and a point a row"),
    "mf-json": Format("moving_features", "tracks.mf.json: OGC Moving Features, in WGS84"),
    "level-x": Format("level_x", "00_tracks.csv and two tables of meta data, as inD has them"),
    "sumo": Format("sumo", "fcd.xml: floating car data"),
    "ssam": Format("ssam", "tracks.trj: trajectories to find conflicts in, version 1.04"),
    "utdf": Format("utdf", "Volume.csv: turning counts of 15 minutes, from what was measured", measures=True),
    "asterix": Format("asterix", "tracks.ast: a run of vidtrack radar as ASTERIX CAT 062", radar=True),
}


def export(run: RoadRun | RadarRun | Findings, name: str, folder: Path) -> str | None:
    """Write the run in the format of that name, or the measures in one of theirs; some say what they wrote or left out.

    Raises ConfigError for what the format needs and the site lacks.
    """
    said: str | None = import_module(f"vidtrack.output.export.{FORMATS[name].module}").write(run, folder)
    return said

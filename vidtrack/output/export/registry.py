"""Names of the formats and where they are written. Modules are imported only when one is asked for."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vidtrack.output.export.road_run import RoadRun

FORMATS = {
    "geojson": "geojson",
    "geoparquet": "geoparquet",
    "mf-json": "moving_features",
    "level-x": "level_x",
    "sumo": "sumo",
    "ssam": "ssam",
}
"""Each format with the module of this package whose `write(run, folder)` writes it."""


def export(run: RoadRun, name: str, folder: Path) -> None:
    """Write the run in the format of that name. Raises ConfigError for what the format needs and the site lacks."""
    import_module(f"vidtrack.output.export.{FORMATS[name]}").write(run, folder)

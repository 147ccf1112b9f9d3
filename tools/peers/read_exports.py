"""Read exported files by the readers of other projects; run by tools/check_exports.py in their environments.

    python read_exports.py FORMAT FOLDER

Prints a line a position: track, time [s], x, y as the reader has them.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

Position = tuple[int, float, float, float]


def geojson(folder: Path) -> Iterator[Position]:
    """GeoPandas, by GDAL."""
    import geopandas

    table = geopandas.read_file(folder / "tracks.geojson")
    for track, times, line in zip(table.track_id, table.time_s, table.geometry, strict=True):
        numbers = times if not isinstance(times, str) else map(float, times.strip("[] ").split(","))
        for t, (x, y) in zip(numbers, line.coords, strict=True):
            yield int(track), float(t), x, y


def geoparquet(folder: Path) -> Iterator[Position]:
    """GeoPandas, by pyarrow and Shapely."""
    import geopandas

    table = geopandas.read_parquet(folder / "tracks.geo.parquet")
    assert table.crs is not None
    for track, t, point in zip(table.track_id, table.time_s, table.geometry, strict=True):
        yield int(track), t, point.x, point.y


def mf_json(folder: Path) -> Iterator[Position]:
    """MovingPandas."""
    import movingpandas

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it drops the zone
        ways = movingpandas.read_mf_json(str(folder / "tracks.mf.json"), traj_id_property="name")
    for way in ways.trajectories:
        for moment, point in way.df.geometry.items():
            yield int(str(way.id).split(".")[0]), moment.timestamp(), point.x, point.y


def sumo(folder: Path) -> Iterator[Position]:
    """SUMO's library."""
    import sumolib

    for step in sumolib.xml.parse(str(folder / "fcd.xml"), "timestep"):
        for vehicle in step.vehicle or []:
            yield int(vehicle.id), float(step.time), float(vehicle.x), float(vehicle.y)


def level_x(folder: Path) -> Iterator[Position]:
    """Tactics2D."""
    from tactics2d.dataset_parser import LevelXParser

    vehicles, _ = LevelXParser("inD").parse_trajectory("00", str(folder))
    for number, vehicle in vehicles.items():
        for stamp in vehicle.trajectory.frames:
            state = vehicle.trajectory.get_state(stamp)
            yield int(number), stamp / 1000, state.x, state.y


if __name__ == "__main__":
    for row in globals()[sys.argv[1].replace("-", "_")](Path(sys.argv[2])):
        print(*row, sep=",")

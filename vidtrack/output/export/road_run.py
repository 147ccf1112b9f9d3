"""The positions of a finished run on the road, a batch at a time."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.config.settings import SourceSettings
from vidtrack.errors import ConfigError, FormatError, SourceError
from vidtrack.formats import damaged
from vidtrack.output.export.whole_tracks import WholeTracks
from vidtrack.traffic.lengths import UNKNOWN
from vidtrack.traffic.measures.blocks import column_names, whole_pictures
from vidtrack.traffic.measures.rows import BOX, EDGE_COLUMNS
from vidtrack.traffic.metres import SITE_COPY
from vidtrack.traffic.site import Site, read_site

_BATCH = 1 << 16
"""Rows in memory at a time."""
_NEEDED = ("frame", "time_s", "track_id", "status", "x_m", "y_m", "speed_kmh", "heading_deg", "length_m", "width_m")


@dataclass(frozen=True, slots=True)
class Rows:
    """N positions in order of frame.

    frame, track   (N,)
    time           (N,) s since the video's first picture
    xy             (N, 2) m, middles of the footprints
    speed          (N,) m/s
    heading        (N,) rad, clockwise from north; NaN before the vehicle has moved
    length, width  (N,) m; NaN without a heading, and while others hide the vehicle from the first
    """

    frame: Ints
    track: Ints
    time: Floats
    xy: Floats
    speed: Floats
    heading: Floats
    length: Floats
    width: Floats

    def __len__(self) -> int:
        return len(self.frame)

    def select(self, rows: Ints | Mask | slice) -> Rows:
        """The given rows."""
        return Rows(*(getattr(self, name)[rows] for name in self.__slots__))

    @classmethod
    def of(cls, table: pa.Table) -> Rows:
        """The rows of a table with the columns of tracks.parquet."""
        value = {name: table[name].to_numpy() for name in table.column_names}
        return cls(
            frame=value["frame"],
            track=value["track_id"],
            time=value["time_s"],
            xy=np.column_stack([value["x_m"], value["y_m"]]),
            speed=value["speed_kmh"] / 3.6,
            heading=np.radians(value["heading_deg"]),
            length=value["length_m"],
            width=value["width_m"],
        )

    @property
    def ahead(self) -> Floats:
        """(N, 2) unit vectors along the vehicles."""
        return np.column_stack([np.sin(self.heading), np.cos(self.heading)])

    @property
    def front(self) -> Floats:
        """(N, 2) m, the middles of the front bumpers."""
        return self.xy + self.length[:, None] / 2 * self.ahead


@dataclass(frozen=True, slots=True)
class Vehicles:
    """The T tracks of a run that have positions, in order of their numbers.

    track     (T,)
    until     (T,) the last frame in which the track was seen; what follows is a guess that nothing confirmed
    length    (T,) m; NaN where it is not known
    kind      (T,) class of the whole track, as `vidtrack measure` has it
    likeliest (T,) of vidtrack's own classes the likeliest one, however unsure
    """

    track: Ints
    until: Ints
    length: Floats
    kind: np.ndarray
    likeliest: np.ndarray

    def row(self, track: Ints) -> Ints:
        """(N,) where tracks (N,) are in these arrays."""
        return np.searchsorted(self.track, track)


@dataclass(frozen=True, slots=True)
class RoadRun:
    """A finished run of a video at a calibrated site.

    fps         frames/s of the source; None where it says nothing
    every_s     s; from one picture with rows to the next, where there are not rows of all; 0: there are
    corner      (2,) m; west and south of all positions
    extent      (2,) m; of all positions, to the east and to the north
    rows, positions   in the table of tracks, and those of them with a position
    """

    folder: Path
    site: Site
    fps: float | None
    every_s: float
    vehicles: Vehicles
    corner: Floats
    extent: Floats
    rows: int
    positions: int

    @property
    def start(self) -> datetime | None:
        """Time of the video's first picture, in UTC."""
        start = self.site.camera.start
        return None if start is None else start.astimezone(UTC)

    def tables(self) -> Iterator[pa.Table]:
        """All columns of the rows that are exported, in order of frame.

        Rows without a position are left out, and those after a track was last seen.
        """
        last = -1
        for table in _batches(self.folder):
            frame = table["frame"].to_numpy()
            if len(frame) and (frame[0] < last or (np.diff(frame) < 0).any()):
                raise FormatError(f"{self.folder / 'tracks.parquet'} is damaged: its rows are not in order of frame")
            last = frame[-1] if len(frame) else last
            yield table.filter(pa.array(self._kept(table)))

    def batches(self) -> Iterator[Rows]:
        """What `tables` yields, as arrays."""
        return (Rows.of(table.select(_NEEDED)) for table in self.tables() if len(table))

    def _kept(self, table: pa.Table) -> Mask:
        known = _known(table)
        track, frame = table["track_id"].to_numpy(), table["frame"].to_numpy()
        known[known] = frame[known] <= self.vehicles.until[self.vehicles.row(track[known])]
        return known


def open_road_run(folder: Path, site: Path | None = None) -> RoadRun:
    """A run folder whose tracks have metres.

    site  its site.toml; None: as it was when the run began

    Raises ConfigError for a run without metres, a site that is not there or has other metres, FormatError for a folder
    that is no finished run, and SourceError where no vehicle was inside the calibration.
    """
    summary = _summary(folder)
    _check_columns(folder)
    drawn = read_site(_site_of(summary, folder) if site is None else site)
    if site is not None and (folder / SITE_COPY).is_file() and not _same_metres(drawn, read_site(folder / SITE_COPY)):
        raise ConfigError(
            f"the calibration in {site} is not the one that {folder} was tracked with, whose metres would be exported; "
            "only epsg may differ: track the video again with this site, or leave --site out"
        )
    whole = WholeTracks(_of_size(drawn, summary))
    look = _FirstLook()
    edges = EDGE_COLUMNS if set(EDGE_COLUMNS) <= column_names(folder) else ()
    for table in whole_pictures(_batches(folder, (*_NEEDED[:6], "length_m", "length_sigma_m", *BOX, *edges)), folder):
        whole.add(table)
        look.add(table)
    if not look.positions:
        raise SourceError(
            f"{folder} has no positions in metres: no vehicle was found inside the points of the site's calibration"
        )
    vehicles = look.vehicles(whole)
    fps, size = summary.get("fps"), look.high - look.low
    return RoadRun(folder, drawn, fps, _every_s(summary), vehicles, look.low, size, look.rows, look.positions)


def _every_s(summary: dict[str, Any]) -> float:
    """Time from one picture with rows to the next [s]; 0 if there are rows of all."""
    settings, fps = summary.get("settings", {}), summary.get("fps") or 0.0
    every_s = settings.get("output", {}).get("every_s") or 0.0
    if not fps:
        return float(every_s)
    source = SourceSettings(max_fps=settings.get("source", {}).get("max_fps"))
    of_a_camera = "began" in summary
    looked_at = min(fps, source.max_fps or fps) if of_a_camera else source.looked_at_fps(fps)
    steps = max(1, ceil(every_s * looked_at - 1e-6))
    return float(steps / looked_at) if steps > 1 or looked_at < fps else 0.0


def _same_metres(one: Site, other: Site) -> bool:
    """Whether two sites have the same picture and calibration, so that points of the picture have the same metres."""

    def told(site: Site) -> tuple[object, ...]:
        calibration = site.calibration
        if calibration is None:
            return ()
        without = {"camera_height_m": None} | ({} if calibration.geographic else {"epsg": None})
        return site.camera.width, site.camera.height, calibration.model_copy(update=without)

    return told(one) == told(other)


class _FirstLook:
    """What must be known of a run before its first row is written; holds a few numbers a track."""

    def __init__(self) -> None:
        self.rows = self.positions = 0
        self.low, self.high = np.full(2, np.inf), np.full(2, -np.inf)
        self._parts: list[Ints] = []

    def add(self, table: pa.Table) -> None:
        """Take a batch."""
        self.rows += len(table)
        table = table.filter(pa.array(_known(table)))
        self.positions += len(table)
        if not len(table):
            return
        track, index = np.unique(table["track_id"].to_numpy(), return_inverse=True)
        xy = np.column_stack([table["x_m"].to_numpy(), table["y_m"].to_numpy()])
        self.low, self.high = np.minimum(self.low, xy.min(axis=0)), np.maximum(self.high, xy.max(axis=0))
        seen = table["status"].to_numpy(zero_copy_only=False) != "coasting"
        until = np.full(len(track), -1)
        np.maximum.at(until, index[seen], table["frame"].to_numpy()[seen])
        self._parts.append(np.column_stack([track, until]))

    def vehicles(self, whole: WholeTracks) -> Vehicles:
        """Those of all batches."""
        parts = np.concatenate(self._parts)
        track, index = np.unique(parts[:, 0], return_inverse=True)
        until = np.full(len(track), -1)
        np.maximum.at(until, index, parts[:, 1])
        named, likeliest = whole.named(track)
        kind = np.array([name or UNKNOWN for name in named.kind])
        return Vehicles(track, until, named.length, kind, np.array(likeliest))


def _known(table: pa.Table) -> Mask:
    """(N,) the rows that have a position."""
    return np.isfinite(table["x_m"].to_numpy() + table["y_m"].to_numpy())


def _batches(folder: Path, columns: tuple[str, ...] | None = None) -> Iterator[pa.Table]:
    path = folder / "tracks.parquet"
    try:
        with pq.ParquetFile(path) as file:
            for batch in file.iter_batches(_BATCH, columns=columns):
                yield pa.Table.from_batches([batch])
    except (pa.ArrowInvalid, OSError) as error:
        raise damaged(path, error) from None


def _summary(folder: Path) -> dict[str, Any]:
    path = folder / "summary.json"
    try:
        summary: dict[str, Any] = json.loads(path.read_text())
        if not isinstance(summary["settings"]["output"], dict):
            raise TypeError("settings.output is no table")
    except (FileNotFoundError, NotADirectoryError):
        raise FormatError(
            f"{folder} is not a run: it has no summary.json; of a live run give one of its parts"
        ) from None
    except (ValueError, KeyError, TypeError) as error:
        raise FormatError(f"{path} is damaged ({error}); vidtrack repair {folder} may help") from None
    return summary


def _check_columns(folder: Path) -> None:
    path = folder / "tracks.parquet"
    if not path.is_file():
        raise FormatError(f"{folder} has no tracks.parquet; vidtrack repair {folder} makes it from tracks.csv")
    names = column_names(folder)
    if not set(_NEEDED) <= names:
        what = "is a run of radar plots" if "scan" in names else "has no positions in metres"
        raise ConfigError(f"{folder} {what}; only runs of vidtrack track --site with a [calibration] can be exported")


def _of_size(site: Site, summary: dict[str, Any]) -> Site:
    """The site drawn for the run's pictures."""
    width, height = summary.get("width"), summary.get("height")
    return site.scaled(width, height) if width and height else site


def _site_of(summary: dict[str, Any], folder: Path) -> Path:
    """The site that the run was given: its copy, else its file. Raises ConfigError where neither is there any more."""
    copy = folder / SITE_COPY
    if copy.is_file():
        return copy
    named = summary["settings"]["output"].get("site")  # runs of earlier versions have no copy
    if named is None or not Path(named).is_file():
        raise ConfigError(
            f"the site of {folder}, {named}, is not there from this folder; give it with --site SITE.toml"
        )
    return Path(named)

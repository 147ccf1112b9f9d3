"""Reads a finished run as steps, so that any sink can show it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pyarrow as pa

from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.load import parse
from vidtrack.config.settings import Settings
from vidtrack.errors import FormatError
from vidtrack.output.parquet import read_parquet
from vidtrack.output.repair import read_tracks
from vidtrack.output.sink import Step
from vidtrack.scan import Scan
from vidtrack.tracks import Status, Tracks
from vidtrack.video.frame import Frame, Image

_NO_BLOBS = (np.empty((0, 2)), np.eye(2))


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """The contents of a run folder.

    source    name of the input
    shape     (H, W) of the pictures; None for a radar run
    table     tracks.csv, or tracks.parquet where that is the only one
    """

    folder: Path
    source: str
    shape: tuple[int, int] | None
    settings: Settings
    table: pa.Table


def read_run(folder: Path) -> FinishedRun:
    """Read a run folder. Raises FormatError if its tracks or summary.json are missing or damaged."""
    parquet = folder / "tracks.parquet"
    alone = parquet.is_file() and not (folder / "tracks.csv").exists()
    table = read_parquet(parquet) if alone else read_tracks(folder / "tracks.csv")
    path = folder / "summary.json"
    try:
        summary = json.loads(path.read_text())
        shape = None if "scan" in table.column_names else (int(summary["height"]), int(summary["width"]))
        return FinishedRun(folder, summary["source"], shape, parse(summary["settings"]), table)
    except FileNotFoundError:
        raise FormatError(f"{folder} is not a run: it has no summary.json") from None
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise FormatError(f"{path} is damaged ({error}); vidtrack repair {folder} may help") from None


def background(folder: Path, shape: tuple[int, int]) -> Image:
    """tracks.png at source size (H, W); plain grey if it is missing."""
    path = folder / "tracks.png"
    picture = cv2.imread(str(path)) if path.is_file() else None  # OpenCV prints a warning for a missing file
    if picture is None:
        return np.full((*shape, 3), 60, np.uint8)
    return np.asarray(cv2.resize(picture, shape[::-1], interpolation=cv2.INTER_AREA), np.uint8)


def steps(run: FinishedRun, frames: Iterable[Frame] | None = None) -> Iterator[Step]:
    """The steps of the run: for the source's frames, or without them for all frames of the table's span."""
    columns = {name: run.table[name].to_numpy() for name in run.table.column_names}
    statuses = {status.name.lower(): status for status in Status}
    columns["status"] = np.array([statuses[word] for word in columns["status"]], np.int8)
    number = columns.pop("scan" if run.shape is None else "frame")
    for index, time_s, frame in (
        _table_times(number, columns["time_s"]) if frames is None else ((f.index, f.time_s, f) for f in frames)
    ):
        first, last = np.searchsorted(number, index), np.searchsorted(number, index, side="right")
        tracks = _tracks(time_s, {name: values[first:last] for name, values in columns.items()})
        yield Step(index, time_s, Scan(time_s, *_NO_BLOBS), tracks, frame, None, {})


def _table_times(number: Ints, time_s: Floats) -> Iterator[tuple[int, float, None]]:
    """Number and time of each frame, at the usual distance; the time of a frame without tracks is interpolated."""
    frames, first = np.unique(number, return_index=True)
    if not len(frames):
        return
    usual = int(np.median(np.diff(frames))) if len(frames) > 1 else 1
    empty = [np.arange(a + usual, b - usual / 2, usual) for a, b in pairwise(frames)]
    every = np.sort(np.concatenate([frames, *empty])).astype(int)
    times = np.interp(every, frames, time_s[first])
    yield from ((index, time_s, None) for index, time_s in zip(every.tolist(), times.tolist(), strict=True))


def _tracks(t: float, rows: dict[str, np.ndarray]) -> Tracks:
    """Tracks of one frame; values missing in the table are NaN, and velocities have no covariance."""
    count = len(rows["track_id"])
    unknown = np.full(count, np.nan)
    unit = "m" if "vx_m_s" in rows else "px"
    axes = [axis for axis in "xyz" if f"{axis}_{unit}" in rows]
    states = [column for axis in axes for column in (rows[f"{axis}_{unit}"], rows[f"v{axis}_{unit}_s"])]
    sigma = np.column_stack([rows[f"sigma_{axis}_{unit}"] for axis in axes])
    position, velocity = tuple(range(0, len(states), 2)), tuple(range(1, len(states), 2))
    P = np.zeros((count, len(states), len(states)))
    P[:, position, position] = sigma**2
    P[:, 0, 2] = P[:, 2, 0] = rows["corr_xy"] * sigma[:, 0] * sigma[:, 1]
    boxes = [rows.get(name, unknown) for name in ("left_px", "top_px", "width_px", "height_px")]
    return Tracks(
        t=t,
        id=rows["track_id"],
        status=rows["status"],
        x=np.column_stack(states),
        P=P,
        box=np.column_stack(boxes),
        group=rows.get("group_id", np.full(count, -1)),
        group_since_s=unknown,
        age_s=unknown,
        travel=unknown,
        existence=unknown,
        measurement=np.full(count, -1),
        nis=rows["nis"],
        position=position,
        velocity=velocity,
    )

"""Track-to-track fusion: the tracks of several finished radar runs as one, by covariance intersection."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.tracks_of_runs import Histories, parallel, same_targets
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError, FormatError, SourceError
from vidtrack.estimate.intersection import intersection
from vidtrack.formats import damaged
from vidtrack.output.radar_plot import RadarPlot
from vidtrack.output.sink import Sink, Step
from vidtrack.output.summary import Summary
from vidtrack.output.tables import RADAR, TrackTable
from vidtrack.radar.plane import Plane, plane_of_run
from vidtrack.run.run import Pipeline, Run
from vidtrack.scan import Scan
from vidtrack.tracks import CONFIRMED, Tracks

_log = logging.getLogger(__name__)

STATE = ("x_m", "vx_m_s", "y_m", "vy_m_s")
SIGMA = ("sigma_x_m", "sigma_vx_m_s", "sigma_y_m", "sigma_vy_m_s")
CORRELATION = {"corr_x_vx": (0, 1), "corr_xy": (0, 2), "corr_x_vy": (0, 3),
               "corr_y_vx": (1, 2), "corr_vxy": (1, 3), "corr_y_vy": (2, 3)}  # fmt: skip
SAME_DEG = 1e-6
"""degrees; origins are the same within this, 0.1 m on the earth."""
COLUMNS = ("time_s", "track_id", *STATE, *SIGMA, *CORRELATION)


@dataclass(frozen=True, slots=True)
class RunTracks:
    """The tracks of a finished run: rows in order of track and time.

    track (N,), time_s (N,), x (N, 4) x, vx, y, vy, P (N, 4, 4)
    """

    track: Ints
    time_s: Floats
    x: Floats
    P: Floats


def run_fusion(folders: Sequence[Path], output: Path | None = None, *, force: bool = False) -> Run:
    """A run whose tracks are those of finished runs, fused. Raises the errors of Run."""
    return Run(_pipeline(folders), output, force=force)


@contextmanager
def _pipeline(folders: Sequence[Path]) -> Iterator[Pipeline]:
    runs = [read_tracks(folder) for folder in folders]
    plane = common_plane(folders)
    origin = {} if plane is None else {"origin": [plane.latitude, plane.longitude, plane.height]}
    times = np.unique(np.concatenate([run.time_s for run in runs]))

    def sinks(folder: Path) -> Iterator[Sink]:
        yield TrackTable(folder, RADAR)
        yield RadarPlot(folder / "tracks.png", [])

    def summary(folder: Path) -> Summary:
        source = ", ".join(map(str, folders))
        fused = {"runs": [str(folder) for folder in folders], "tracks_of_runs": [len(np.unique(r.track)) for r in runs]}
        return Summary(folder / "summary.json", source, Settings(), lambda: fused | origin, unit="scans")

    yield Pipeline(
        name="-".join(folder.resolve().name for folder in folders),
        place=folders[0],
        count=len(times),
        steps=fused_steps(runs, times),
        summary=summary,
        sinks=sinks,
    )


def common_plane(folders: Sequence[Path]) -> Plane | None:
    """The plane of the runs; None if none of them knows where its x = y = 0 is.

    Raises FormatError for a folder without a readable summary.json, ConfigError if the origins differ.
    """
    planes = [_plane(folder) for folder in folders]
    first = planes[0]
    for folder, plane in zip(folders[1:], planes[1:], strict=True):
        if not _same(first, plane):
            raise ConfigError(
                f"{folders[0]} has its origin at {_place(first)}, {folder} at {_place(plane)}; "
                "track both again with the same --radar-position or one file for --radars"
            )
    return first


def _plane(folder: Path) -> Plane | None:
    try:
        return plane_of_run(json.loads((folder / "summary.json").read_text()))
    except (OSError, ValueError) as error:
        raise FormatError(f"{folder} is not a finished run: {error}") from None


def _same(a: Plane | None, b: Plane | None) -> bool:
    if a is None or b is None:
        return a is b
    return max(abs(a.latitude - b.latitude), abs(a.longitude - b.longitude)) < SAME_DEG


def _place(plane: Plane | None) -> str:
    return "an unknown place" if plane is None else f"{plane.latitude:.6f},{plane.longitude:.6f}"


def read_tracks(folder: Path) -> RunTracks:
    """The tracks of a run of radar plots. Raises SourceError, FormatError."""
    path = folder / "tracks.parquet"
    if not path.is_file():
        raise SourceError(f"{folder} holds no tracks.parquet; give the folder of a finished radar run")
    try:
        table = pyarrow.parquet.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise damaged(path, error) from None
    missing = [name for name in COLUMNS if name not in table.column_names]
    if missing:
        raise FormatError(f"{path} has no column {missing[0]!r}; fuse takes the runs of vidtrack radar, in metres")
    if "z_m" in table.column_names:
        raise FormatError(f"{path} has tracks in space; fuse takes tracks in the plane")
    if not len(table):
        raise FormatError(f"{path} holds no tracks; there is nothing to fuse")
    values = {name: table[name].to_numpy().astype(float) for name in COLUMNS}
    order = np.lexsort((values["time_s"], values["track_id"]))
    correlation = np.tile(np.eye(4), (len(order), 1, 1))
    for name, (i, j) in CORRELATION.items():
        correlation[:, i, j] = correlation[:, j, i] = values[name]
    sigma = np.column_stack([values[name] for name in SIGMA])
    P = correlation * sigma[:, :, None] * sigma[:, None, :]
    x = np.column_stack([values[name] for name in STATE])
    return RunTracks(values["track_id"][order].astype(np.int64), values["time_s"][order], x[order], P[order])


def fused_steps(runs: Sequence[RunTracks], times: Floats) -> Iterator[Step]:
    """Yields a step for each time (K,) with the fused tracks, numbered from 1."""
    track_run, states, covs = _at(runs, times)
    there = ~np.isnan(states[:, :, 0])
    place = [0, 2]
    histories = Histories(track_run, there, states[:, :, place], covs[:, :, place][:, :, :, place])
    target = same_targets(histories)
    _warn_if_biased(histories, target)
    for k, t in enumerate(times.tolist()):
        rows = np.flatnonzero(there[:, k])
        ids, first = np.unique(target[rows], return_index=True)
        x, P = states[rows[first], k], covs[rows[first], k]
        for run in range(1, len(runs)):
            mine = rows[(track_run[rows] == run) & ~np.isin(rows, rows[first])]
            on = np.searchsorted(ids, target[mine])
            x[on], P[on] = intersection(x[on], P[on], states[mine, k], covs[mine, k])
        empty = Scan(t, np.empty((0, 2)), np.eye(2))
        yield Step(k, t, empty, _tracks(t, ids + 1, x, P), None, None, {})


def _warn_if_biased(histories: Histories, target: Ints) -> None:
    """A warning says so if more pairs of tracks only move alike than agree within their errors."""
    apart = parallel(histories, target)
    agreeing = len(target) - len(np.unique(target))
    if len(apart) > agreeing:
        _log.warning(
            "tracks of different runs move as one target does, but %.0f m apart, far beyond their errors (%d pairs; %d "
            "agree): a run may have a bias, or another clock, which fuse does not remove; track the plots together "
            "with --radars", np.median(apart), len(apart), agreeing,
        )  # fmt: skip


def _at(runs: Sequence[RunTracks], times: Floats) -> tuple[Ints, Floats, Floats]:
    """Run (T,), states (T, K, 4) and covariances (T, K, 4, 4) of all tracks at times (K,); NaN where one has none.

    Between two rows of a track its state is that of a cubic through both, and its covariance is interpolated.
    """
    number, states, covs = [], [], []
    for run, tracks in enumerate(runs):
        for track in np.unique(tracks.track):
            own = tracks.track == track
            x, P = _between(tracks.time_s[own], tracks.x[own], tracks.P[own], times)
            number.append(run)
            states.append(x)
            covs.append(P)
    return np.array(number), np.stack(states), np.stack(covs)


def _between(t: Floats, x: Floats, P: Floats, times: Floats) -> tuple[Floats, Floats]:
    """States (K, 4) and covariances (K, 4, 4) at times (K,) from rows at t (N,); NaN outside."""
    after = np.clip(np.searchsorted(t, times), 1, max(len(t) - 1, 1))
    before, after = after - 1, np.minimum(after, len(t) - 1)
    step = np.maximum(t[after] - t[before], 1e-9)[:, None]
    s = np.clip((times - t[before])[:, None] / step, 0, 1)
    p0, p1, v0, v1 = x[before][:, ::2], x[after][:, ::2], x[before][:, 1::2], x[after][:, 1::2]
    found = np.empty((len(times), 4))
    found[:, ::2] = (
        (1 + 2 * s) * (1 - s) ** 2 * p0 + s**2 * (3 - 2 * s) * p1 + step * s * (1 - s) * ((1 - s) * v0 - s * v1)
    )
    found[:, 1::2] = (1 - s) * v0 + s * v1
    cov = (1 - s[:, :, None]) * P[before] + s[:, :, None] * P[after]
    outside = (times < t[0] - 1e-9) | (times > t[-1] + 1e-9)
    found[outside], cov[outside] = np.nan, np.nan
    return found, cov


def _tracks(t: float, ids: Ints, x: Floats, P: Floats) -> Tracks:
    count = len(ids)
    unknown, none = np.full(count, np.nan), np.full(count, -1)
    return Tracks(
        t, ids, np.full(count, CONFIRMED, np.int8), x, P, np.full((count, 4), np.nan), none, unknown, unknown, unknown,
        np.ones(count), none, unknown, exchange=np.zeros(count),
    )  # fmt: skip

"""ASTERIX CAT 062, system tracks: EUROCONTROL SDPS track messages, part 9, edition 1.20."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import pyarrow as pa

from vidtrack.arrays.types import Floats, Ints
from vidtrack.output.export.radar_run import RadarRun
from vidtrack.output.folder import writing

_CATEGORY = 62
_LONGEST = 1400
"""Octets of a block, which fits a datagram on Ethernet."""
_DAY_S = 86400.0
_WITH_WGS84, _WITHOUT = bytes([0x9F, 0x0D, 0x01, 0x04]), bytes([0x97, 0x0D, 0x01, 0x04])
"""Field specifications: which items of the profile follow."""
_MONO, _COASTS, _FIRST, _LAST, _TENTATIVE, _MORE = 0x80, 0x80, 0x20, 0x40, 0x02, 0x01
_ACCURACIES = bytes([0xC4])
"""Subfields of I062/500: position, its covariance, velocity."""


def write(run: RadarRun, folder: Path) -> str:
    """Write tracks.ast: all rows of the run as records of CAT 062, in order of scan. Returns what to know about it."""
    first, last = _ends(run)
    path = folder / "tracks.ast"
    with writing(path), path.open("wb") as file:
        for table in run.tables():
            file.write(_blocks(_records(table, run, first, last), table["scan"].to_numpy()))
    where = "with positions in WGS84" if run.plane else "in metres only: --radar-position gives positions in WGS84"
    return f"{run.rows} records of CAT 062, {where}"


def _ends(run: RadarRun) -> tuple[dict[int, int], dict[int, int]]:
    """The first and the last scan of each track."""
    first: dict[int, int] = {}
    last: dict[int, int] = {}
    for table in run.tables():
        for track, scan in zip(table["track_id"].to_pylist(), table["scan"].to_pylist(), strict=True):
            first.setdefault(track, scan)
            last[track] = scan
    return first, last


def _records(table: pa.Table, run: RadarRun, first: dict[int, int], last: dict[int, int]) -> np.ndarray:
    """(N, octets) the records of the rows, all of one length."""
    value = {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}
    count, scan, track = len(table), value["scan"], value["track_id"]
    xy = np.column_stack([value["x_m"], value["y_m"]])
    parts = [_constant(_WITH_WGS84 if run.plane else _WITHOUT, count), _constant(bytes([run.sac, run.sic]), count)]
    parts.append(_octets(value["time_s"] % _DAY_S * 128 % (_DAY_S * 128), 3))
    if run.plane is not None:
        parts += [_octets(degrees * 2**25 / 180, 4) for degrees in run.plane.degrees(xy)]
    parts += [_octets(xy[:, axis] * 2, 3) for axis in (0, 1)]
    parts += [_octets(value[name] * 4, 2) for name in ("vx_m_s", "vy_m_s")]
    parts.append(_octets(track % 65536, 2))
    starts = np.array([first[one] for one in track.tolist()], dtype=np.int64) == scan
    ends = np.array([last[one] for one in track.tolist()], dtype=np.int64) == scan
    parts.append(_status(value["status"], starts, ends))
    parts.append(_accuracies(value))
    return np.concatenate(parts, axis=1)


def _status(status: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """I062/080 in four octets: mono-sensor, tentative; first and last message; nothing; coasting."""
    octets = np.zeros((len(status), 4), np.uint8)
    octets[:, 0] = _MONO | _MORE | np.where(status == "tentative", _TENTATIVE, 0)
    octets[:, 1] = _MORE | np.where(starts, _FIRST, 0) | np.where(ends, _LAST, 0)
    octets[:, 2] = _MORE
    octets[:, 3] = np.where(status == "coasting", _COASTS, 0)
    return octets


def _accuracies(value: dict[str, np.ndarray]) -> np.ndarray:
    """I062/500: standard deviations of the position [0.5 m] and of the velocity [0.25 m/s], and the covariance.

    The covariance is stated as the root of its magnitude, with its sign.
    """
    sigmas = [value["sigma_x_m"], value["sigma_y_m"]]
    covariance = value["corr_xy"] * sigmas[0] * sigmas[1]
    speeds = [value.get(f"sigma_v{axis}_m_s", np.zeros(len(covariance))) for axis in "xy"]
    return np.concatenate(
        [
            _constant(_ACCURACIES, len(covariance)),
            *(_octets(np.minimum(sigma * 2, 65535), 2) for sigma in sigmas),
            _octets(np.clip(np.sign(covariance) * np.sqrt(abs(covariance)) * 2, -32768, 32767), 2),
            *(_octets(np.minimum(speed * 4, 255), 1) for speed in speeds),
        ],
        axis=1,
    )


def _blocks(records: np.ndarray, scan: Ints) -> bytes:
    """Data blocks of the records of each scan."""
    found = []
    for rows in np.split(np.arange(len(scan)), np.flatnonzero(np.diff(scan)) + 1):
        waiting = iter(rows)
        while chunk := list(islice(waiting, _LONGEST // records.shape[1])):
            body = records[chunk].tobytes()
            found.append(bytes([_CATEGORY]) + (len(body) + 3).to_bytes(2, "big") + body)
    return b"".join(found)


def _octets(values: Floats, size: int) -> np.ndarray:
    """(N, size) rounded values as big-endian integers, negative ones as two's complements."""
    whole = np.round(values).astype(np.int64)
    return whole.astype(">i8").view(np.uint8).reshape(-1, 8)[:, 8 - size :]


def _constant(octets: bytes, count: int) -> np.ndarray:
    return np.tile(np.frombuffer(octets, np.uint8), (count, 1))

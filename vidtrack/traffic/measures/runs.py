"""When the site was watched: finished runs, one after the other, on one clock."""

from __future__ import annotations

import csv
import json
import logging
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from os import SEEK_END
from pathlib import Path
from typing import Any

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError, FormatError, SourceError
from vidtrack.traffic.metres import SITE_COPY
from vidtrack.traffic.site import read_site

_log = logging.getLogger(__name__)
_JOINED_S = 1.0
"""Parts of one live run with less between them are watched without a break."""
_CLOCK_S, _CLOCK_SHARE = 5.0, 1e-4
"""s, and share of the time since: by so much the clock that a live run tells its beginning by may have been set"""
_ROUNDING_S = 1e-3
_EARLY = {"interrupted": "was interrupted", "truncated": "is of a video that is cut short"}
"""Words for what summary.json says of a run that ended before its video should"""
_LONGEST_LINE = 1 << 16
"""Octets at the end of a table that hold its last line"""
_NO_RUN = "{} is not a finished run: it has no tracks.parquet and no tracks.csv"


@dataclass(frozen=True, slots=True)
class Recording:
    """A finished run.

    folder      with tracks.parquet, or tracks.csv
    size        (width, height) px of its pictures
    offset_s    what its `time_s` is behind the site's time
    begin_s, end_s   of what was watched, in the site's time
    session     recordings with the same number are parts of one live run: their tracks have the same numbers
    breaks      begin and end of each time between without a picture, in its `time_s`
    rim_px      by how much its boxes reach beyond vehicles on each side; 0: in runs of earlier versions, not known
    """

    folder: Path
    size: tuple[int, int]
    offset_s: float
    begin_s: float
    end_s: float
    session: int
    breaks: tuple[tuple[float, float], ...] = ()
    rim_px: float = 0.0

    @property
    def spans(self) -> list[list[float]]:
        """[begin, end] of what was watched without a break [s], in the site's time."""
        begins = [self.begin_s, *(self.offset_s + end for _, end in self.breaks)]
        ends = [*(self.offset_s + begin for begin, _ in self.breaks), self.end_s]
        return [[begin, end] for begin, end in zip(begins, ends, strict=True) if begin < end]


@dataclass(frozen=True, slots=True)
class Day:
    """All recordings of a site in order of time. `utc`: of the site's time 0; None: not known."""

    recordings: tuple[Recording, ...]
    utc: datetime | None

    @property
    def spans(self) -> Floats:
        """(S, 2) s; begin and end of what was watched without a break."""
        spans: list[list[float]] = []
        last = -1
        for one in self.recordings:
            for begin, end in one.spans:
                if spans and one.session == last and begin - spans[-1][1] < _JOINED_S:
                    spans[-1][1] = max(end, spans[-1][1])
                else:
                    spans.append([begin, end])
                last = one.session
        return np.array(spans).reshape(-1, 2)


@dataclass(frozen=True, slots=True)
class _Found:
    """A run as its folder and the user describe it, in its own time_s.

    zero   the time of time_s 0
    early  why it ended before its video did; "": it did not
    """

    folder: Path
    size: tuple[int, int]
    zero: datetime | None
    live: bool
    begin_s: float
    end_s: float
    breaks: tuple[tuple[float, float], ...]
    rim_px: float
    early: str


def open_day(runs: Sequence[str], start: datetime | None) -> Day:
    """The recordings in folders, each written as FOLDER or FOLDER@TIME.

    start  time of the first picture of the first run that does not tell it

    A live run tells its time (`began` in summary.json), TIME that of a run's `time_s` 0. A run without either begins
    where the one before it in the list ends. Raises ConfigError for runs of radar, one that is given twice, two at the
    same time, times that cannot be read and those that are not known, SourceError where there is no run.
    """
    found = [_found(run) for run in runs]
    _refuse_twice(found)
    _refuse_after_early(found)
    zeros = [one.zero for one in found]
    if zeros[0] is None:
        if start is None and any(zeros):
            raise ConfigError(
                f"{found[0].folder} does not tell its time, and others do; write {found[0].folder}@TIME, "
                "for example 2026-06-01T07:00:00+02:00"
            )
        zeros[0] = start
    sessions = _sessions(found)
    zeros = [zeros[session] for session in sessions]  # the clock of a live run goes on: one zero for all its parts
    utc = min((zero for zero in zeros if zero is not None), default=None)
    recordings: list[Recording] = []
    for one, zero, session in zip(found, zeros, sessions, strict=True):
        if zero is not None and utc is not None:
            offset = (zero - utc).total_seconds()
        else:
            offset = recordings[-1].end_s - one.begin_s if recordings else 0.0
        begin, end = offset + one.begin_s, offset + one.end_s
        recordings.append(Recording(one.folder, one.size, offset, begin, end, session, one.breaks, one.rim_px))
    recordings.sort(key=lambda one: one.end_s)
    return Day(tuple(_apart(recordings)), utc)


def folder_of(run: str) -> Path:
    """Of a run written as for `open_day`."""
    return _split(run)[0]


def has_tracks(folder: Path) -> bool:
    """Whether a run's table of tracks is in its folder."""
    return any((folder / name).is_file() for name in ("tracks.parquet", "tracks.csv"))


def measured_run(run: Mapping[str, Any]) -> Recording:
    """A recording as measures.json has it. Raises SourceError where the run is no longer in its folder."""
    folder = Path(run["folder"])
    if not (folder / "summary.json").is_file():
        raise SourceError(f"the tracks of the run {folder.name} are no longer where they were measured")
    alone = open_day([str(folder)], None).recordings[0]
    offset = run["end_s"] - alone.end_s + alone.offset_s
    return replace(alone, session=run["run"], offset_s=offset, begin_s=run["begin_s"], end_s=run["end_s"])


def parts_with_tracks(run: Path, parts: Sequence[Path]) -> list[Path]:
    """The parts of a live run that can be measured; the run may go on. Empty for any other run, which has no parts.

    Raises SourceError where a live run has no such part.
    """
    opened = []
    for part in parts:
        with suppress(SourceError):  # it has just begun, or only its counts are kept
            open_day([str(part)], None)
            opened.append(part)
    if parts and not opened:
        raise SourceError(
            f"no part of {run} has tracks: wait until the camera delivers; with output.level=tracks until the first "
            "part has ended; with output.level=counts there are none"
        )
    return opened


def site_of(runs: Sequence[str], given: Path | None = None) -> Path:
    """The site to measure runs at: the copy in their folders, each written as for `open_day`.

    given  the site for all of them, whatever they were tracked with

    Raises ConfigError where a run has none, or another one than the first, SourceError where there is no run.
    """
    if given is not None:
        _tell_of_places(runs)
        return given
    copies = [folder_of(run) / SITE_COPY for run in runs]
    for copy in copies:
        if not has_tracks(copy.parent):
            raise SourceError(_NO_RUN.format(copy.parent))
        if not copy.is_file() or not _had_site(copy.parent):
            raise ConfigError(f"{copy.parent} has no {SITE_COPY}: it was tracked without a site; give --site SITE.toml")
    for other in copies[1:]:
        if other.read_bytes() != copies[0].read_bytes():
            raise ConfigError(
                f"{copies[0]} and {other} are not the same site; give --site SITE.toml for all of them, "
                "or measure those of each site alone"
            )
    return copies[0]


def _tell_of_places(runs: Sequence[str]) -> None:
    """Warn of runs that were tracked at sites of several names."""
    copies: dict[bytes, Path] = {}
    for copy in (folder_of(run) / SITE_COPY for run in runs):
        if copy.is_file() and _had_site(copy.parent):
            copies.setdefault(copy.read_bytes(), copy)
    named: dict[str, Path] = {}
    for copy in copies.values():
        with suppress(ConfigError):  # of another version; it is not needed
            named.setdefault(read_site(copy).camera.name, copy.parent)
    if len(named) > 1:
        places = " and ".join(f"{folder} at {name}" for name, folder in named.items())
        _log.warning("the runs were tracked at sites of several names, %s; here they are taken for one place", places)


def _had_site(folder: Path) -> bool:
    """Whether the run was tracked with a site; a folder that is used again may hold that of another run."""
    try:
        output = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["settings"]["output"]
    except (OSError, KeyError, TypeError, ValueError):
        return True  # another check says what is wrong with the folder
    return output.get("site") is not None


def _refuse_twice(found: Sequence[_Found]) -> None:
    folders: set[Path] = set()
    for one in found:
        if one.folder.resolve() in folders:
            raise ConfigError(f"{one.folder} is given twice; its vehicles would be counted twice")
        folders.add(one.folder.resolve())


def _refuse_after_early(found: Sequence[_Found]) -> None:
    """Refuse a run without a time after one that ended early: nobody knows when that would have ended."""
    for before, one in pairwise(found):
        if before.early and one.zero is None:
            raise ConfigError(
                f"{before.folder} {before.early}, so nobody knows when {one.folder} begins; write {one.folder}@TIME, "
                "for example 2026-06-01T08:00:00+02:00"
            )


def _sessions(found: list[_Found]) -> list[int]:
    """Of each run the number of the first one in the list that it is a part of, or its own.

    Parts of a live run tell the same beginning, but for what the clock was set by meanwhile.
    """
    sessions: list[int] = []
    for one in found:
        same = (
            number
            for number, other in enumerate(found[: len(sessions)])
            if one.live and other.live and one.zero is not None and other.zero is not None
            if abs((one.zero - other.zero).total_seconds()) < _CLOCK_S + _CLOCK_SHARE * max(one.end_s, other.end_s)
        )
        sessions.append(next(same, len(sessions)))
    return sessions


def _found(run: str) -> _Found:
    folder, time = _split(run)
    if not has_tracks(folder):
        raise SourceError(_NO_RUN.format(folder))
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        frames, end, fps = float(summary["frames"]), float(summary["media_s"]), float(summary["fps"])
        size = int(summary["width"]), int(summary["height"])
        source = summary["settings"]["source"]
        spans = [(float(first), float(last)) for first, last in summary.get("watched", [])]  # earlier versions: none
        rim = float(summary.get("rim_px", 0.0))
        early = next((words for name, words in _EARLY.items() if summary.get(name)), "")
    except OSError:
        raise SourceError(f"{folder} has no summary.json, so nobody knows when it watched") from None
    except (KeyError, TypeError, ValueError):
        raise ConfigError(f"{folder} is not a run over video: its summary.json has no frames, size and times") from None
    if frames < 1 or fps <= 0 or min(size) < 1:
        raise SourceError(f"{folder} has no frames; there is nothing to measure")
    if ended(folder) and _cut_off(folder):
        raise FormatError(f"{folder / 'tracks.csv'} is cut off in its last line, though the run ended; copy it again")
    began = summary.get("began")
    zero = time or (datetime.fromisoformat(began) if began else None)
    begin = float(source.get("start_s") or 0.0)
    if began:  # a part of a live run begins somewhere in it
        begin = spans[0][0] if spans else end - (frames - 1) / fps
    breaks = tuple((before[1] + 1 / fps, after[0]) for before, after in pairwise(spans))
    return _Found(folder, size, zero, bool(began), min(begin, end), end + 1 / fps, breaks, rim, early)


def ended(folder: Path) -> bool:
    """Whether a run came to its end, so that nobody is writing its tables and each line is whole, or was cut off."""
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(summary, dict) and summary.get("interrupted") is False


def _cut_off(folder: Path) -> bool:
    """Whether the last line of a run's only table has no end, and fewer cells than the first one."""
    if (folder / "tracks.parquet").is_file():
        return False
    with (folder / "tracks.csv").open("rb") as file:
        first = file.readline()
        file.seek(max(0, file.seek(0, SEEK_END) - _LONGEST_LINE))
        last = file.read().rpartition(b"\n")[2]
    return bool(last) and _cells(last) < _cells(first)


def _cells(line: bytes) -> int:
    try:
        return len(next(csv.reader([line.decode("utf-8", errors="replace")])))
    except csv.Error:  # no line of a table
        return 0


def _split(run: str) -> tuple[Path, datetime | None]:
    """FOLDER@TIME; an @ that no time follows belongs to the folder."""
    folder, at, text = run.rpartition("@")
    if not at or Path(run).is_dir():
        return Path(run), None
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise ConfigError(f"{run}: {text!r} is no time; write FOLDER@2026-06-01T07:00:00+02:00") from None
    if time.tzinfo is None:
        raise ConfigError(f"{run}: the time has no zone; write for example {text}+02:00, or {text}Z for UTC")
    return Path(folder), time


def _apart(recordings: list[Recording]) -> list[Recording]:
    """The recordings, in order of their ends, when no two are of the same time.

    Where a part of a live run begins is known by its frames and its nominal rate, and not before the last one ended.
    """
    apart = recordings[:1]
    for second in recordings[1:]:
        first = apart[-1]
        early = first.end_s - second.begin_s
        if early > 0 and first.session == second.session:
            second = replace(second, begin_s=first.end_s)
        elif early > _ROUNDING_S:
            raise ConfigError(
                f"{second.folder} begins {early:.1f} s before {first.folder} ends; one site is watched once at a time"
            )
        apart.append(second)
    return apart

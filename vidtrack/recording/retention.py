"""Retention of a live run: the oldest tracks and recordings are deleted at their limits; counts have their own."""

from __future__ import annotations

import logging
import math
import os
import re
import shutil
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from stat import S_ISREG

from vidtrack.errors import ConfigError
from vidtrack.recording.source import part_order

log = logging.getLogger(__name__)

SHARE = 1 / 8  # of the byte limit: largest size of one part
_ROOM = 2  # least size of a part, in what it takes at least
_FULL = 1 - 2 * SHARE  # of the byte limit: between two checks a part of tracks and one of a recording grow
_TIME = "%Y-%m-%dT%H-%M-%S"
_PART = re.compile(r"\d{4}-\d\d-\d\dT\d\d-\d\d-\d\dZ(-\d+)?")
_COUNTS, _OF_COUNTS = "counts.csv", {"counts.csv", "summary.json"}


def new_part(root: Path) -> Path:
    """Make a folder in `root`, named by the UTC time, or by the last name and a number if that is not earlier.

    The names stay in order when the clock is set back. Raises OSError.
    """
    time_utc, number = datetime.now(UTC).strftime(_TIME), 1
    last_utc, last_number = max(map(part_order, parts_of(root)), default=("", 0))
    if last_utc >= time_utc:
        time_utc, number = last_utc, last_number + 1
    folder = root / (f"{time_utc}Z" if number == 1 else f"{time_utc}Z-{number}")
    folder.mkdir(parents=True)
    return folder


def parts_of(root: Path) -> list[Path]:
    """Folders of the parts in `root`, oldest first."""
    if not root.is_dir():
        return []
    return sorted((entry for entry in root.iterdir() if _PART.fullmatch(entry.name)), key=part_order)


def size_of(folder: Path) -> int:
    """Bytes of all files below a folder; files and folders deleted meanwhile count as 0."""
    return sum(_bytes_of(Path(root, name)) for root, _, names in os.walk(folder) for name in names)


@dataclass(frozen=True, slots=True)
class Limits:
    """Largest age of a part's newest content [s], and largest number of bytes of all parts; None: no limit."""

    seconds: float | None = None
    size: float | None = None

    def __bool__(self) -> bool:
        return self.seconds is not None or self.size is not None


class Retention:
    """Deletes closed parts that are too old or take too much space; the newest part of each root stays.

    both        limits of tracks and recordings together; an own age limit of a kind replaces this one's
    tracks      limits of the results, whose counts stay
    recordings  limits of the recordings
    counts_s    largest age of counts [s]; None: they stay

    results, recorded   roots of each kind
    """

    def __init__(
        self,
        both: Limits,
        tracks: Limits = Limits(),
        recordings: Limits = Limits(),
        counts_s: float | None = None,
    ) -> None:
        self.results: list[Path] = []
        self.recorded: list[Path] = []
        self._both, self._tracks, self._recordings = both, tracks, recordings
        self._counts_s = counts_s
        self._stripped: set[Path] = set()

    @property
    def tracks_part(self) -> float | None:
        """Bytes at which a part of results ends; None: no limit."""
        return _part_size(self._tracks, self._both)

    @property
    def recordings_part(self) -> float | None:
        """Bytes at which a part of a recording ends; None: no limit."""
        return _part_size(self._recordings, self._both)

    @property
    def has_sizes(self) -> bool:
        """Whether there is a limit in bytes."""
        return any(limits.size is not None for limits in (self._both, self._tracks, self._recordings))

    def refuse_small(self, results: float, recordings: float) -> None:
        """Raise ConfigError for limits that cannot be held, given the bytes that a part of each kind takes at least."""
        kinds = (
            ("keep_bytes", self._both, max(results, recordings)),
            ("keep_tracks_bytes", self._tracks, results),
            ("keep_recordings_bytes", self._recordings, recordings),
        )
        for name, limits, least in kinds:
            if limits.size is not None and SHARE * limits.size < _ROOM * least:
                raise ConfigError(
                    f"live.{name} = {limits.size / 1e6:g} MB cannot be held: one part of these pictures takes up to "
                    f"{least / 1e6:.2g} MB; give at least {math.ceil(_ROOM * least / SHARE / 1e6)}MB"
                )

    def prune(self) -> None:
        """Delete the oldest parts beyond the limits."""
        self._prune(self.results, Limits(_own(self._tracks, self._both), self._tracks.size))
        self._prune(self.recorded, Limits(_own(self._recordings, self._both), self._recordings.size))
        self._prune([*self.results, *self.recorded], Limits(None, self._both.size))
        if self._counts_s is not None:
            for root in self.results:
                for part in parts_of(root)[:-1]:
                    if (part / _COUNTS).exists() and _age_s(part / _COUNTS) > self._counts_s:
                        _delete(part)

    def _prune(self, roots: Sequence[Path], limits: Limits) -> None:
        if not limits:
            return
        closed = sorted((part for root in roots for part in self._full(root)[:-1]), key=part_order)
        taken = 0
        if limits.size is not None:
            taken = sum(_without_counts(part) for root in roots for part in self._full(root))
        for part in closed:
            old = limits.seconds is not None and _age_s(part) > limits.seconds
            large = limits.size is not None and taken > _FULL * limits.size
            if old or large:
                taken -= _without_counts(part)
                self._strip(part)

    def _full(self, root: Path) -> list[Path]:
        """The parts that hold more than counts, and the newest one."""
        parts = parts_of(root)
        for part in parts[:-1]:
            if part not in self._stripped and (part / _COUNTS).exists() and _names_of(part) <= _OF_COUNTS:
                self._stripped.add(part)
        return [part for part in parts if part not in self._stripped]

    def _strip(self, part: Path) -> None:
        """Delete a part, except its counts."""
        if not (part / _COUNTS).exists():
            _delete(part)
            return
        for path in part.iterdir():
            if path.name not in _OF_COUNTS:
                if path.is_dir():
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink(missing_ok=True)
        self._stripped.add(part)
        log.info("deleted %s except its counts", part)


def _names_of(part: Path) -> set[str]:
    with suppress(FileNotFoundError):
        return {path.name for path in part.iterdir()}
    return set()


def _part_size(*limits: Limits) -> float | None:
    return min((SHARE * limit.size for limit in limits if limit.size is not None), default=None)


def _own(limits: Limits, both: Limits) -> float | None:
    return both.seconds if limits.seconds is None else limits.seconds


def _without_counts(part: Path) -> int:
    """Bytes of a part that `_strip` deletes."""
    kept = sum(_bytes_of(part / name) for name in _OF_COUNTS) if (part / _COUNTS).exists() else 0
    return size_of(part) - kept


def _bytes_of(path: Path) -> int:
    with suppress(FileNotFoundError):
        status = path.stat()
        return status.st_size if S_ISREG(status.st_mode) else 0
    return 0


def _delete(part: Path) -> None:
    shutil.rmtree(part, ignore_errors=True)
    log.info("deleted %s", part)


def _age_s(path: Path) -> float:
    """Time since the newest content of a folder or file [s]; 0 if it has been deleted."""
    try:
        return time.time() - path.stat().st_mtime
    except FileNotFoundError:
        return 0.0

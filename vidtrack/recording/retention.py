"""Retention of a live run's parts: the oldest are deleted when they are too old or take too many bytes."""

from __future__ import annotations

import logging
import re
import shutil
import time
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from stat import S_ISREG

from vidtrack.recording.source import part_order

log = logging.getLogger(__name__)

SHARE = 1 / 8  # of the byte limit: largest size of one part
_FULL = 0.95  # of the byte limit: parts grow between two checks
_TIME = "%Y-%m-%dT%H-%M-%S"
_PART = re.compile(r"\d{4}-\d\d-\d\dT\d\d-\d\d-\d\dZ(-\d+)?")


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
    """Bytes of all files below a folder; files deleted meanwhile count as 0."""
    total = 0
    for path in folder.rglob("*"):
        with suppress(FileNotFoundError):
            status = path.stat()
            total += status.st_size if S_ISREG(status.st_mode) else 0
    return total


class Retention:
    """Deletes closed parts that are too old or take too much space.

    roots    folders whose parts count
    seconds  largest age of a part's newest content; None: no limit
    size     largest number of bytes in all roots together; None: no limit
    """

    def __init__(self, seconds: float | None, size: float | None) -> None:
        self.roots: list[Path] = []
        self._seconds = seconds
        self._size = size
        self.part_size = None if size is None else size * SHARE

    def prune(self) -> None:
        """Delete the oldest parts beyond the limits; the newest part of each root stays."""
        if self._seconds is None and self._size is None:
            return
        closed = sorted((part for root in self.roots for part in parts_of(root)[:-1]), key=part_order)
        taken = sum(size_of(root) for root in self.roots) if self._size is not None else 0
        for part in closed:
            size = size_of(part)
            old = self._seconds is not None and time.time() - _changed_s(part) > self._seconds
            large = self._size is not None and taken > _FULL * self._size
            if not (old or large):
                break
            shutil.rmtree(part, ignore_errors=True)
            taken -= size
            log.info("deleted %s", part)


def _changed_s(part: Path) -> float:
    """Unix time of a part's newest content; the present time if it has been deleted."""
    try:
        return part.stat().st_mtime
    except FileNotFoundError:
        return time.time()

"""Text files that stay readable after a crash or kill: they are written in whole lines, about once a second."""

from __future__ import annotations

import os
import time
from pathlib import Path

from vidtrack.output.folder import append, replacing, writing


class Every:
    """Returns True at most once per `seconds` of the monotonic clock."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._next = time.monotonic() + seconds

    def __call__(self) -> bool:
        now = time.monotonic()
        if now < self._next:
            return False
        self._next = now + self._seconds
        return True


class LineFile:
    """A growing text file. On a write error it is cut back to its last whole line and raises StoppedEarly."""

    def __init__(self, path: Path, header: str = "") -> None:
        self.path = path
        self._due = Every(1.0)
        self._waiting: list[str] = []
        replace_text(path, header)  # atomically with its header
        with writing(path):
            # Unbuffered: a buffer left by a failed write would fail again on closing.
            self._file = open(path, "ab", buffering=0)  # noqa: SIM115

    def add(self, lines: str) -> None:
        """Append whole lines; call it for every scan, also without lines, so that earlier ones are written in time."""
        self._waiting.append(lines)
        if self._due():
            self.flush()

    def flush(self) -> None:
        """Pass all lines to the operating system."""
        block = "".join(self._waiting).encode()
        self._waiting.clear()
        with writing(self.path):
            append(self._file, block)

    def sync(self) -> None:
        """Wait until all flushed lines are on the disk."""
        with writing(self.path):
            os.fdatasync(self._file.fileno())

    def close(self) -> None:
        """Write the rest and close the file."""
        try:
            self.flush()
        finally:
            self._file.close()


def drop_partial_line(path: Path) -> None:
    """Remove an incomplete last line, left by a killed process."""
    with writing(path), open(path, "r+b") as file:
        content = file.read()
        file.truncate(content.rfind(b"\n") + 1)


def sort_rows(path: Path, columns: int, header: bool) -> None:
    """Sort a table of numbers by its first `columns` columns; equal rows keep their order."""
    with writing(path):
        lines = path.read_text().splitlines(keepends=True)
        first = lines[:1] if header else []
        rows = lines[len(first) :]
        rows.sort(key=lambda row: [float(cell) for cell in row.split(",", columns)[:columns]])
        replace_text(path, "".join(first + rows))


def replace_text(path: Path, text: str) -> None:
    """Write a whole file atomically."""
    with replacing(path) as new:
        new.write_text(text)

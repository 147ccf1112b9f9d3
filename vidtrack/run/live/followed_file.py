"""A file that a run follows: it may be written anew while the run goes on."""

from __future__ import annotations

from pathlib import Path

from vidtrack.output.linefile import Every

LOOK_S = 1.0  # between two looks at the file

_Mark = tuple[int, int, int]


class FollowedFile:
    """Looks whether a file has changed since this object was made.

    A new content counts when two looks have found it: a program that writes in pieces is not met halfway.
    """

    def __init__(self, path: Path, look_s: float = LOOK_S) -> None:
        self.path = path
        self._due = Every(look_s)
        self._read = self._seen = _mark(path)

    def changed(self) -> bool:
        """Whether there is a content that no call before has told of."""
        if not self._due():
            return False
        mark = _mark(self.path)
        settled, self._seen = mark == self._seen, mark
        if not settled or mark == self._read:
            return False
        self._read = mark
        return True


def _mark(path: Path) -> _Mark | None:
    """What changes when a file is written or replaced; None without the file."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino

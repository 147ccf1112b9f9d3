"""The site of a live run, which may be drawn anew while the run goes on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from vidtrack.output.linefile import Every
from vidtrack.traffic.metres import used_site

_LOOK_S = 1.0  # between two looks at the file

_Mark = tuple[int, int, int]


class FollowedSite:
    """Looks whether the file of a site has changed.

    used  the site as it was read last; it stays where the file is no site for these pictures

    A new content is read when two looks have found it: a program that writes in pieces is not met halfway.
    The constructor raises ConfigError.

    tell  called with what is wrong with the file, once for each content
    """

    def __init__(self, path: Path, width: int, height: int, tell: Callable[[str], None]) -> None:
        self._path, self._size, self._tell = path, (width, height), tell
        self._due = Every(_LOOK_S)
        self._read = self._seen = _mark(path)  # before the file is read: what is written meanwhile is seen later
        self.used = used_site(path, width, height)

    def changed(self) -> bool:
        """Whether `used` is another site than at the call before."""
        if not self._due():
            return False
        mark = _mark(self._path)
        settled, self._seen = mark == self._seen, mark
        if not settled or mark == self._read:
            return False
        self._read = mark
        try:
            found = used_site(self._path, *self._size)
        except Exception as error:  # whatever is in the file, the results go on
            self._tell(f"{_first_line(error)}; the run goes on with the site that it has")
            return False
        same = found.text == self.used.text
        if not same:
            self.used = found
        return not same


def _mark(path: Path) -> _Mark | None:
    """What changes when a file is written or replaced; None without the file."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0]

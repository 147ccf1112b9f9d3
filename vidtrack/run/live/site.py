"""The site of a live run, which may be drawn anew while the run goes on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from vidtrack.run.live.followed_file import LOOK_S, FollowedFile
from vidtrack.traffic.metres import used_site

_LOOK_S = LOOK_S


class FollowedSite:
    """Looks whether the file of a site has changed.

    used  the site as it was read last; it stays where the file is no site for these pictures

    The constructor raises ConfigError.

    tell  called with what is wrong with the file, once for each content
    """

    def __init__(self, path: Path, width: int, height: int, tell: Callable[[str], None]) -> None:
        self._path, self._size, self._tell = path, (width, height), tell
        self._file = FollowedFile(path, _LOOK_S)  # before the file is read: what is written meanwhile is seen later
        self.used = used_site(path, width, height)

    def changed(self) -> bool:
        """Whether `used` is another site than at the call before."""
        if not self._file.changed():
            return False
        try:
            found = used_site(self._path, *self._size)
        except Exception as error:  # whatever is in the file, the results go on
            self._tell(f"{_first_line(error)}; the run goes on with the site that it has")
            return False
        same = found.text == self.used.text
        if not same:
            self.used = found
        return not same


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0]

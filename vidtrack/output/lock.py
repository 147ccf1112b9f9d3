"""One run at a time in a place."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vidtrack.errors import OutputError

if sys.platform != "win32":
    import fcntl


@contextmanager
def exclusive(path: Path) -> Iterator[None]:
    """Keep other runs out of a folder that exists, or off a file; the system opens it again even after a kill.

    A file's lock is on FILE.lock beside it, for the file itself is replaced when it is written. Where locks are
    unknown, as on Windows and some network disks, nobody is kept out.
    Raises OutputError while another run is there, or if the lock file cannot be made.
    """
    if sys.platform == "win32":
        yield
        return
    is_folder = path.is_dir()
    place = path if is_folder else lock_file(path)
    try:
        handle = os.open(place, os.O_RDONLY if is_folder else os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise OutputError(f"cannot use {place}: {error.strerror}; choose another place") from None
    try:
        if not _locked(handle):
            raise OutputError(f"{path} is in use by another run; end that one first, or choose another place")
        yield
    finally:
        os.close(handle)  # the file stays: who waits for it may have opened it already


def lock_file(path: Path) -> Path:
    """The file whose lock stands for that of `path`."""
    return path.with_name(path.name + ".lock")


def _locked(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # no locks on this disk
        return True
    return True

"""Exclusive locks on folders and files: one run, or one change, at a time."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from vidtrack.errors import OutputError

if sys.platform != "win32":
    import fcntl


@contextmanager
def exclusive(path: Path) -> Iterator[None]:
    """Lock an existing folder or a file against other runs; the system releases the lock even after a kill.

    A file is locked by FILE.lock beside it, because the file itself is replaced when written. Without locks, as on
    Windows and some network disks, nothing is locked.
    Raises OutputError if another run holds the lock, or if the lock file cannot be made.
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
        os.close(handle)  # the lock file stays: another process may have opened it


@contextmanager
def by_turns(path: Path) -> Iterator[None]:
    """Wait until no other process changes a file, there or not yet, and let none until the `with` block ends.

    The lock file is gone afterwards. Without locks nothing is locked. Raises OSError if the lock file cannot be made.
    """
    if sys.platform == "win32":
        yield
        return
    place = lock_file(path)
    while True:
        handle = os.open(place, os.O_RDWR | os.O_CREAT, 0o644)
        with suppress(OSError):  # the file system has no locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(handle), place.stat()):
                break
        os.close(handle)  # the one before has removed it
    try:
        yield
    finally:
        place.unlink(missing_ok=True)
        os.close(handle)


def lock_file(path: Path) -> Path:
    """The lock file of `path`."""
    return path.with_name(path.name + ".lock")


def _locked(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # the file system has no locks
        return True
    return True

"""The folder of one run, checked before the computation, and safe writing of its files."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from itertools import count
from pathlib import Path

from vidtrack.errors import OutputError, StoppedEarly

LINE_FILES = ("tracks.csv", "mot.txt", "counts.csv", "decisions.csv", "registration.csv", "groups.csv")
"""The files of a run's folder that are written line by line; `vidtrack repair` cuts a half-written last line."""

RESULTS = (
    *LINE_FILES,
    "tracks.parquet",
    "tracks.parquet.parts",
    "summary.json",
    "tracks.png",
    "scene.jpg",
    "radar.html",
)
"""All files of a run's folder; `--force` replaces these and keeps other files."""


def open_folder(path: Path | None, name: str, force: bool) -> Path:
    """A writable folder, made if necessary.

    path    the requested folder; None: `runs/<name>`, then `runs/<name>-2`, ...
    force   `path` may contain other files

    Raises OutputError if the folder cannot be made or written, or if `path` is not empty and `force` is False.
    """
    return usable(_next_free(name) if path is None else _asked_for(path, force))


def open_run(path: Path | None, source_name: str, force: bool) -> Path:
    """A folder for a run's results, see `open_folder`; `force` deletes the results of an earlier run in it."""
    folder = open_folder(path, source_name, force)
    if force:
        try:
            _remove_results(folder)
        except OSError as error:
            raise OutputError(f"cannot replace the results in {folder}: {error}; choose another folder") from None
    return folder


@contextmanager
def begun(path: Path | None, source_name: str, force: bool) -> Iterator[Path]:
    """A folder for a run's results; if the `with` block, the run's start, fails, the results are deleted.

    Raises OutputError as `open_run`.
    """
    folder = open_run(path, source_name, force)
    try:
        yield folder
    except BaseException:
        withdraw(folder)
        raise


def withdraw(folder: Path) -> None:
    """Delete a run's results, and the folder if it is then empty."""
    with suppress(OSError):
        _remove_results(folder)
        folder.rmdir()


def refuse_overwriting(read: Path, *written: Path | None) -> None:
    """Raise OutputError if an output path is the input path."""
    for path in written:
        if path is not None and path.resolve() == read.resolve():
            raise OutputError(f"{path} is what is to be read; choose another place for the results")


def usable(folder: Path) -> Path:
    """The folder, made if necessary. Raises OutputError if no file can be written into it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror}; choose another folder") from None


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn a write error of this file into StoppedEarly: disk full, unplugged, file deleted."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise StoppedEarly(
            f"cannot write {path}: {reason}; what was written before is valid, and vidtrack repair makes it whole"
        ) from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path that replaces `path` atomically when the block ends: readers see the old or the new content."""
    new = path.with_name(path.name + ".new")
    with writing(path):
        try:
            yield new
            os.replace(new, path)
        finally:
            with suppress(OSError):
                new.unlink(missing_ok=True)


def append(file: FileIO, block: bytes) -> None:
    """Append `block` to an unbuffered file; on a write error remove the partial block and raise OSError."""
    start = file.tell()
    rest = memoryview(block)
    try:
        while rest:
            rest = rest[file.write(rest) :]
    except OSError:
        with suppress(OSError):  # the disk may be gone; report the first error
            file.truncate(start)
            file.seek(start)
        raise


def _next_free(source_name: str) -> Path:
    name = re.sub(r"[^\w.-]+", "_", source_name).strip("._") or "run"
    for n in count(1):
        folder = Path("runs", name if n == 1 else f"{name}-{n}")
        try:
            folder.mkdir(parents=True)
            return folder
        except FileExistsError:
            if not folder.parent.is_dir():
                raise OutputError("cannot make a folder in runs: it is a file; choose a folder with -o") from None
        except OSError as error:
            raise OutputError(f"cannot make {folder}: {error.strerror}; choose another folder with -o") from None
    raise AssertionError("count() never ends")


def _asked_for(folder: Path, force: bool) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not force and any(folder.iterdir()):
            raise OutputError(f"{folder} is not empty; choose another folder with -o, or add --force to replace it")
    except OSError as error:
        raise OutputError(f"cannot use {folder} for results: {error.strerror}; choose another with -o") from None
    return folder


def _remove_results(folder: Path) -> None:
    for name in RESULTS:
        old = folder / name
        if old.is_dir():
            shutil.rmtree(old)
        else:
            old.unlink(missing_ok=True)

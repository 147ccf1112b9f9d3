"""Files by fsspec address, such as s3://BUCKET/KEY."""

from __future__ import annotations

import glob
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any

from vidtrack.errors import ConfigError, SourceError
from vidtrack.video.live.address import redact

_FILE = "file://"
_CHUNK = 1 << 22  # bytes copied between two beats
_STAMPS = ("ETag", "etag", "LastModified", "mtime", "updated", "last_modified", "created")


def is_remote(text: str) -> bool:
    """Whether this is an address, not a path on this machine."""
    return "://" in text and not text.startswith(_FILE)


def local_path(text: str) -> str:
    """A path on this machine, also where it is written as file://PATH."""
    return text.removeprefix(_FILE)


def without_secrets(address: str) -> str:
    """The address without user name, password or keys."""
    return redact(address) if is_remote(address) else address


def store(address: str) -> tuple[Any, str]:
    """The file system of an address, and the path in it. Raises ConfigError without the library for it."""
    try:
        import fsspec
    except ImportError:
        raise ConfigError(
            f"{without_secrets(address)} needs fsspec: pip install 'vidtrack[s3]', or the package of that store"
        ) from None
    try:
        return fsspec.core.url_to_fs(address)
    except (ImportError, ValueError) as error:
        raise ConfigError(f"cannot use {without_secrets(address)}: {error}") from None


@contextmanager
def reading(address: str) -> Iterator[None]:
    """Turn what a store raises into SourceError, without secrets."""
    try:
        yield
    except (SourceError, ConfigError):
        raise
    except FileNotFoundError:
        raise SourceError(f"cannot open {without_secrets(address)}: no such file") from None
    except Exception as error:  # each store has errors of its own
        what = f"{type(error).__name__}: {error}".replace(address, without_secrets(address)).splitlines()[0]
        raise OSError(f"cannot read {without_secrets(address)}: {what}") from None


def pieces(text: str) -> Iterator[bytes]:
    """The content of a file, by path or address, piece by piece. Raises SourceError or OSError."""
    if is_remote(text):
        yield from _pieces(*store(text), text)
    else:
        with open(local_path(text), "rb") as file:
            yield from iter(partial(file.read, _CHUNK), b"")


def _pieces(files: Any, path: str, address: str) -> Iterator[bytes]:
    """The content of a file in a store; what the caller does with a piece raises its own errors."""
    with reading(address), files.open(path, "rb") as file:
        yield from iter(partial(file.read, _CHUNK), b"")


def remote_files(text: str, endings: frozenset[str]) -> Iterator[tuple[str, int, str]]:
    """(address, bytes, stamp) of a file, of all files that match, or of those below a folder with these endings.

    Raises SourceError if there is none.
    """
    files, path = store(text)
    with reading(text):
        if glob.has_magic(path):
            found = files.glob(path, detail=True)
        elif files.isdir(path):
            found = {
                k: v for k, v in files.find(path, detail=True).items() if PurePosixPath(k).suffix.lower() in endings
            }
        else:
            found = {path: files.info(path)}
    found = {name: info for name, info in found.items() if info.get("type") != "directory"}
    if not found:
        raise SourceError(f"there is no video at {without_secrets(text)}")
    root = text.partition("://")[0]
    for name, info in sorted(found.items()):
        address = text if name == path else files.unstrip_protocol(name)
        assert address.startswith(root)
        stamp = next((str(info[key]) for key in _STAMPS if info.get(key)), "")
        yield address, int(info.get("size") or 0), stamp


@contextmanager
def local_copy(address: str, beat: Callable[[], None]) -> Iterator[str]:
    """The path of a source on this machine; a copy, for as long as the block lasts, if it is remote.

    beat  called after each piece of the copy
    """
    if not is_remote(address):
        yield address
        return
    with TemporaryDirectory(prefix="vidtrack-") as folder:
        path = Path(folder, PurePosixPath(address).name)
        _save(pieces(address), path, beat)
        yield str(path)


def _save(content: Iterable[bytes], path: Path, beat: Callable[[], None]) -> None:
    with path.open("wb") as copy:
        for piece in content:
            copy.write(piece)
            beat()


def upload(folder: Path, address: str, last: str, beat: Callable[[], None]) -> None:
    """Copy a folder to a store; its file `last` comes last, so that whoever sees it sees the whole.

    beat  called after each piece
    """
    files, path = store(address)
    names = [str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file()]
    with reading(address):
        for old in (f"{path}/{last}", path):  # while an older copy is deleted, it is not taken for a whole one
            with suppress(FileNotFoundError):
                files.rm(old, recursive=True)
        for name in sorted(names, key=last.__eq__):
            with files.open(f"{path}/{name}", "wb") as copy:
                for piece in pieces(str(folder / name)):
                    copy.write(piece)
                    beat()
            beat()  # a store takes the last piece, and an empty file, when it is closed


def download(address: str, folder: Path, only: str | None, beat: Callable[[], None]) -> None:
    """Copy all files below an address, or `only` one of them, to a folder.

    beat  called after each piece
    """
    files, path = store(address)
    if only is None:
        with reading(address):
            names = files.find(path)
    else:
        names = [f"{path}/{only}"]
    for name in names:
        target = folder / PurePosixPath(name).relative_to(PurePosixPath(path))
        target.parent.mkdir(parents=True, exist_ok=True)
        _save(_pieces(files, name, address), target, beat)

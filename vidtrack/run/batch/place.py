"""Where a batch keeps its results: a folder, or an address of a store."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol
from uuid import uuid4

from vidtrack.errors import OutputError
from vidtrack.output.folder import replacing, usable, writing
from vidtrack.output.lock import exclusive
from vidtrack.run.batch.index import INDEX
from vidtrack.run.batch.remote import download, is_remote, local_path, reading, store, upload, without_secrets

PARTIAL, SLICES = "partial", "slices"
"""Folders of what is not complete, and of slices that wait to be stitched."""


def _nothing() -> None:
    """Nobody waits for a beat."""


class Place(Protocol):
    """Named folders and files of a batch. A folder appears in it when it is complete."""

    shown: str

    def held(self) -> AbstractContextManager[None]:
        """Keep other batches out, where the place can."""

    def names(self, under: str) -> set[str]:
        """What is in a folder; nothing if there is none."""

    def read(self, name: str) -> bytes | None:
        """The content of a file; None if there is none."""

    def write(self, name: str, content: bytes) -> None:
        """Replace a file as a whole."""

    def workspace(self) -> AbstractContextManager[Path]:
        """An empty folder on this machine, deleted at the end of the block."""

    def put(self, folder: Path, name: str, last: str, beat: Callable[[], None]) -> None:
        """Move a complete folder of a workspace into place; its file `last` tells that it is complete.

        beat  called after each piece of a copy
        """

    def local(
        self, name: str, beat: Callable[[], None] = _nothing, only: str | None = None
    ) -> AbstractContextManager[Path]:
        """A folder of the place as one on this machine, to read; at least the file `only` of it."""

    def remove(self, name: str) -> None:
        """Delete a folder."""


def place_of(text: str) -> Place:
    """The place at a path or an fsspec address."""
    return RemotePlace(text.rstrip("/")) if is_remote(text) else FolderPlace(Path(local_path(text)).absolute())


class FolderPlace:
    """A folder of this machine, or one that all machines share."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.shown = str(root)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Lock the folder, made if necessary, and delete what a killed batch left. Raises OutputError.

        Without an index, folders of these names are not those of a batch, and stay.
        """
        with exclusive(usable(self.root)):
            own = (self.root / INDEX).is_file() or not any((self.root / name).exists() for name in (PARTIAL, SLICES))
            try:
                if own:
                    self.remove(PARTIAL)
                yield
            finally:
                if own:
                    self.remove(PARTIAL)
                    with suppress(OSError):  # there is none, or slices in it
                        (self.root / SLICES).rmdir()

    def names(self, under: str) -> set[str]:
        """What is in a folder; nothing if there is none."""
        with suppress(FileNotFoundError):
            return {entry.name for entry in (self.root / under).iterdir()}
        return set()

    def read(self, name: str) -> bytes | None:
        """The content of a file; None if there is none."""
        with suppress(FileNotFoundError):
            return (self.root / name).read_bytes()
        return None

    def write(self, name: str, content: bytes) -> None:
        """Replace a file as a whole. Raises StoppedEarly."""
        with replacing(self.root / name) as new:
            new.write_bytes(content)

    @contextmanager
    def workspace(self) -> Iterator[Path]:
        """An empty folder in the place itself, so that moving out of it is one step."""
        folder = self.root / PARTIAL / uuid4().hex
        with writing(folder):
            folder.mkdir(parents=True)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def put(self, folder: Path, name: str, last: str, beat: Callable[[], None]) -> None:
        """Move a complete folder into place; an older one of this name goes."""
        target = self.root / name
        with writing(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            if target.exists():
                target.rename(folder.parent / f"{folder.name}-old")
            folder.rename(target)

    def local(
        self, name: str, beat: Callable[[], None] = _nothing, only: str | None = None
    ) -> AbstractContextManager[Path]:
        """The folder itself."""
        return nullcontext(self.root / name)

    def remove(self, name: str) -> None:
        """Delete a folder."""
        shutil.rmtree(self.root / name, ignore_errors=True)


class RemotePlace:
    """An fsspec address. A file cannot be locked there: who runs two batches into one address does the work twice."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.shown = without_secrets(address)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Check that the address can be written. Raises OutputError."""
        name = f"writable-{uuid4().hex}"
        try:
            self.write(name, b"")
            self.remove(name)
        except OSError as error:
            raise OutputError(f"cannot write to {self.shown}: {error}") from None
        yield

    def names(self, under: str) -> set[str]:
        """What is in a folder; nothing if there is none."""
        files, path = store(f"{self.address}/{under}")
        with reading(self.address):
            files.invalidate_cache()
            return (
                {name.rstrip("/").rpartition("/")[2] for name in files.ls(path, detail=False)}
                if files.isdir(path)
                else set()
            )

    def read(self, name: str) -> bytes | None:
        """The content of a file; None if there is none."""
        files, path = store(f"{self.address}/{name}")
        with reading(self.address):
            try:
                content: bytes = files.cat_file(path)
            except FileNotFoundError:
                return None
            return content

    def write(self, name: str, content: bytes) -> None:
        """Replace a file as a whole."""
        files, path = store(f"{self.address}/{name}")
        with reading(self.address):
            files.pipe_file(path, content)

    @contextmanager
    def workspace(self) -> Iterator[Path]:
        """An empty folder for temporary files of this machine."""
        with TemporaryDirectory(prefix="vidtrack-") as folder:
            yield Path(folder)

    def put(self, folder: Path, name: str, last: str, beat: Callable[[], None]) -> None:
        """Copy a complete folder; its file `last` comes last."""
        upload(folder, f"{self.address}/{name}", last, beat)

    @contextmanager
    def local(self, name: str, beat: Callable[[], None] = _nothing, only: str | None = None) -> Iterator[Path]:
        """A copy, or one of its file `only`, for as long as the block lasts."""
        with TemporaryDirectory(prefix="vidtrack-") as folder:
            download(f"{self.address}/{name}", Path(folder), only, beat)
            yield Path(folder)

    def remove(self, name: str) -> None:
        """Delete a folder."""
        files, path = store(f"{self.address}/{name}")
        with reading(self.address), suppress(FileNotFoundError):
            files.rm(path, recursive=True)

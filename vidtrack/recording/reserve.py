"""The end of a disk, which is kept for what matters more: counts may take all of it, tracks and recordings may not."""

from __future__ import annotations

import shutil
from pathlib import Path

from vidtrack.errors import StoppedEarly
from vidtrack.output.folder import writing

_SHARE, _MOST_BYTES = 0.05, 1e9
_OF_TRACKS = 1 / 5


class Reserve:
    """Free space that is not written to.

    size  bytes that recordings leave free, and of which tracks leave a fifth; None: 5 % of the disk, at most 1 GB
    """

    def __init__(self, size: float | None) -> None:
        self._size = size

    def check_recordings(self, folder: Path) -> None:
        """Raise StoppedEarly if no more may be recorded on the disk of this folder."""
        self._check(folder, 1.0, "results")

    def check_tracks(self, folder: Path) -> None:
        """Raise StoppedEarly if no more tracks may be written on the disk of this folder."""
        self._check(folder, _OF_TRACKS, "counts")

    def _check(self, folder: Path, share: float, kept_for: str) -> None:
        with writing(folder):
            disk = shutil.disk_usage(folder)
        kept = share * (min(_SHARE * disk.total, _MOST_BYTES) if self._size is None else self._size)
        if disk.free < kept:
            raise StoppedEarly(
                f"cannot write {folder}: the disk is full, its last {kept / 1e6:.3g} MB are kept for {kept_for}"
            )

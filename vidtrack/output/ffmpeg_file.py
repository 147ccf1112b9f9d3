"""An output file for FFmpeg that reports write errors."""

from __future__ import annotations

from pathlib import Path

from vidtrack.output.folder import append


class FFmpegFile:
    """A file object for PyAV that keeps the first write error in `error`: FFmpeg crashes if a header cannot be written.

    It has no `seek`, so FFmpeg never changes bytes already written. Raises OSError if it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.error: OSError | None = None
        self.size = 0
        self._file = open(path, "wb", buffering=0)  # noqa: SIM115

    def write(self, block: bytes) -> int:
        """Append the block; after an error, discard it."""
        if self.error is None:
            try:
                append(self._file, block)
                self.size += len(block)
            except OSError as error:
                self.error = error
        return len(block)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

"""A file for FFmpeg to write to."""

from __future__ import annotations

from pathlib import Path

from vidtrack.output.folder import append


class FFmpegFile:
    """A file object for PyAV. It keeps an error for later: FFmpeg crashes on a header that it could not write.

    Nothing can be sought in it, so that what is written never has to be changed. Raises OSError when it cannot
    be opened.
    """

    def __init__(self, path: Path) -> None:
        self.error: OSError | None = None
        self.size = 0
        self._file = open(path, "wb", buffering=0)  # noqa: SIM115

    def write(self, block: bytes) -> int:
        """Append the block, or nothing at all after the first error."""
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

"""What went wrong while reading a source, for the summary and the user."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field

log = logging.getLogger(__name__)


@dataclass(slots=True)
class SourceStats:
    """Counts that grow while a source is read.

    frames_read     frames handed on
    frames_dropped  frames a live source had to leave out; files never drop one
    decode_errors   pictures that could not be read, or only with damage
    truncated       the file is shorter than its container says, or its end cannot be decoded
    header_fps      rate that the source states; None if it states none
    fps_assumed     nothing tells the rate
    warnings        what the user was told, in order
    """

    frames_read: int = 0
    frames_dropped: int = 0
    decode_errors: int = 0
    truncated: bool = False
    header_fps: float | None = None
    fps_assumed: bool = False
    warnings: list[str] = field(default_factory=list)

    def warn(self, message: str) -> None:
        """Log a warning and keep it."""
        self.warnings.append(message)
        log.warning(message)

    def count_error(self, what: str) -> None:
        """Count a damaged picture; only the first one is told, a bad disk would fill the screen."""
        self.decode_errors += 1
        if self.decode_errors == 1:
            self.warn(f"{what}; reading goes on, further damage is only counted")

    def mark_truncated(self, why: str) -> None:
        """Note that the end of the source is missing."""
        if not self.truncated:
            self.truncated = True
            self.warn(why)

"""Counts and warnings of a source, for the summary and the user."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field

log = logging.getLogger(__name__)


@dataclass(slots=True)
class SourceStats:
    """Counts that grow while a source is read.

    frames_read     frames delivered
    frames_dropped  frames that a live source dropped; 0 for files
    decode_errors   unreadable or damaged pictures
    truncated       the file is shorter than its container states, or its end cannot be decoded
    header_fps      rate that the source states; None without one
    fps_assumed     whether the rate is assumed
    warnings        warnings in order
    told            the user knows the warnings from another reading of the source
    """

    frames_read: int = 0
    frames_dropped: int = 0
    decode_errors: int = 0
    truncated: bool = False
    header_fps: float | None = None
    fps_assumed: bool = False
    warnings: list[str] = field(default_factory=list)
    told: bool = False

    def warn(self, message: str) -> None:
        """Keep a warning, and log it unless the user knows it."""
        self.warnings.append(message)
        if not self.told:
            log.warning(message)

    def count_error(self, what: str) -> None:
        """Count a damaged picture; only the first one gives a warning."""
        self.decode_errors += 1
        if self.decode_errors == 1:
            self.warn(f"{what}; reading goes on, further damage is only counted")

    def mark_truncated(self, why: str) -> None:
        """Note that the end of the source is missing."""
        if not self.truncated:
            self.truncated = True
            self.warn(why)

"""What a live run shows of itself to the page, also while its camera has not delivered yet."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from vidtrack.output.status import StatusBoard
from vidtrack.video.live.stats import LiveStats


class View:
    """Status and pictures of a run. Safe in any thread.

    source  address without credentials
    stats   of the camera; give it to the run
    board   of the run, once its camera delivers
    counts  folder of its counts by interval; None before, and without counting lines
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.stats = LiveStats()
        self.board: StatusBoard | None = None
        self.counts: Path | None = None

    def status(self) -> dict[str, Any]:
        """The fields of `LiveStatus`; before the first picture only those of `waiting_for`."""
        if self.board is None:
            return waiting_for(self.source, self.stats.state, list(self.stats.problems))
        now = self.board.now()
        return {field.name: getattr(now, field.name) for field in fields(now)}

    def picture(self) -> bytes | None:
        """The newest annotated picture as JPEG; None before the first one."""
        return None if self.board is None else self.board.picture()

    def ended(self, error: str | None = None) -> dict[str, Any]:
        """The final status, with the error that ended the run."""
        status = self.status() | {"state": "ended"}
        if error is not None:
            status["problems"] = [*status["problems"], (time.time(), error)]
        return status


def waiting_for(source: str, state: str, problems: list[tuple[float, str]]) -> dict[str, Any]:
    """The status of a camera that has not delivered a picture."""
    reading: Mapping[str, Any] = {}
    return {"source": source, "state": state, "reading": reading, "problems": problems}

"""What the page asks of a camera, and how often."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from time import monotonic
from typing import Any, Generic, TypeVar

from vidtrack.output.status import StatusBoard

Status = Mapping[str, Any]
Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera as the page knows it; both functions are called in threads of the page, never by the tracker.

    status   gives the fields of `vidtrack.output.status.LiveStatus` as plain data. Only `source`, `state` and
             `problems` must be there; what is not known yet is left out
    picture  gives the newest annotated picture as JPEG; None before the first one
    stale_s  a camera whose last frame is older than this does not deliver
    """

    status: Callable[[], Status]
    picture: Callable[[], bytes | None]
    stale_s: float = 10.0

    @classmethod
    def of(cls, board: StatusBoard, stale_s: float) -> Camera:
        """A camera of this process."""

        def status() -> Status:
            now = board.now()
            return {field.name: getattr(now, field.name) for field in fields(now)}

        return cls(status, board.picture, stale_s)

    def delivers(self, status: Status) -> bool:
        """Whether the camera runs and its frames are tracked."""
        age_s = status.get("frame_age_s")
        return status["state"] == "running" and age_s is not None and age_s <= self.stale_s


class Shared(Generic[Value]):
    """A value that is made in a thread, at most every `least_s` seconds and once for all who ask."""

    def __init__(self, make: Callable[[], Value], least_s: float) -> None:
        self._make = make
        self._least_s = least_s
        self._lock = asyncio.Lock()
        self._made: tuple[float, Value] | None = None

    async def get(self) -> Value:
        """The newest value; made now if it is too old."""
        async with self._lock:
            if self._made is None or monotonic() - self._made[0] >= self._least_s:
                value = await asyncio.to_thread(self._make)
                self._made = monotonic(), value
            return self._made[1]

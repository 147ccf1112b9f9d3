"""The page's access to a camera, at a limited rate."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, Generic, TypeVar

from vidtrack.output.status import trouble_of

Status = Mapping[str, Any]
Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera of the page. The page calls both functions in its own threads.

    status   returns the fields of `vidtrack.output.status.LiveStatus` as plain data; only `source`, `state` and
             `problems` are required
    picture  returns the newest annotated picture as JPEG; None before the first one
    counts   returns the folder of its counts by interval; None without counting lines
    stale_s  a camera whose last frame is older than this does not deliver [s]
    """

    status: Callable[[], Status]
    picture: Callable[[], bytes | None]
    counts: Callable[[], Path | None] = lambda: None
    stale_s: float = 10.0

    def trouble(self, status: Status) -> str | None:
        """Why the camera does not deliver, see `trouble_of`."""
        return trouble_of(status, self.stale_s)

    def words(self) -> str:
        """The camera's trouble now, or that there is none."""
        return self.trouble(self.status()) or "delivers"


class Shared(Generic[Value]):
    """A value computed in a thread, at most every `least_s` seconds, and shared by all requests."""

    def __init__(self, make: Callable[[], Value], least_s: float) -> None:
        self._make = make
        self._least_s = least_s
        self._lock = asyncio.Lock()
        self._made: tuple[float, Value] | None = None

    async def get(self) -> Value:
        """The current value, computed anew if it is older than `least_s`."""
        async with self._lock:
            if self._made is None or monotonic() - self._made[0] >= self._least_s:
                value = await asyncio.to_thread(self._make)
                self._made = monotonic(), value
            return self._made[1]

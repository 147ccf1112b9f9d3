"""Ctrl-C and SIGTERM between two frames, so that every result ends with a whole one."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, TypeVar

Item = TypeVar("Item")
_WATCHED = (signal.SIGINT, signal.SIGTERM)


class Terminated(BaseException):
    """SIGTERM, raised where the main thread stands."""


def terminate(number: int, frame: FrameType | None) -> None:
    """Signal handler that ends the program by an exception, so that files are closed."""
    raise Terminated


def stoppable(items: Iterable[Item]) -> Iterator[Item]:
    """The items; a signal that comes while one is made or used is raised after it, a second one at once."""
    caught: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        if caught:
            raise KeyboardInterrupt
        caught.append(number)

    before: dict[int, Any] = {}
    try:
        for item in items:
            if not before:  # until the first item nothing is at stake, and opening may take long
                before = {number: signal.signal(number, note) for number in _WATCHED}
            yield item
            if caught:
                raise KeyboardInterrupt if caught[0] == signal.SIGINT else Terminated
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def stopping(stop: Callable[[], None]) -> Iterator[None]:
    """The first signal calls `stop`, a second one ends the program at once."""
    stopped = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal stopped
        if stopped:
            raise KeyboardInterrupt
        stopped = True
        stop()

    before = {number: signal.signal(number, note) for number in _WATCHED}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

"""Ctrl-C and SIGTERM between two frames, so that every result ends with a whole one."""

from __future__ import annotations

import signal
from _thread import interrupt_main
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from types import FrameType
from typing import Any, TypeVar

Item = TypeVar("Item")
_WATCHED = (signal.SIGINT, signal.SIGTERM)
_PATIENCE_S = 0.8  # that a frame may take to end by itself: the first one waits for the compiler


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
    """The first signal calls `stop`; a second one, or waiting in vain, is raised where the program stands."""
    stopped, over = Event(), Event()

    def note(number: int, frame: FrameType | None) -> None:
        if stopped.is_set():
            raise KeyboardInterrupt
        stopped.set()
        stop()
        Thread(target=interrupt, name="patience", daemon=True).start()

    def interrupt() -> None:
        if not over.wait(_PATIENCE_S):
            interrupt_main()

    before = {number: signal.signal(number, note) for number in _WATCHED}
    try:
        yield
    finally:
        over.set()
        for number, handler in before.items():
            signal.signal(number, handler)

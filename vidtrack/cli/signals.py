"""Handles Ctrl-C and SIGTERM between two frames, so that all results end with a whole frame."""

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
_PATIENCE_S = 0.8  # for the current frame to end; the first one may wait for the compiler


class Terminated(BaseException):
    """SIGTERM, raised in the main thread."""


def terminate(number: int, frame: FrameType | None) -> None:
    """Signal handler that raises an exception, so that files are closed."""
    raise Terminated


def stoppable(items: Iterable[Item]) -> Iterator[Item]:
    """Yields the items; the first signal is raised after the current item, a second one at once."""
    caught: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        if caught:
            raise KeyboardInterrupt
        caught.append(number)

    before: dict[int, Any] = {}
    try:
        for item in items:
            if not before:  # before the first item, which may take long, signals act at once
                before = {number: signal.signal(number, note) for number in _WATCHED}
            yield item
            if caught:
                raise KeyboardInterrupt if caught[0] == signal.SIGINT else Terminated
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def stopping(stop: Callable[[], None]) -> Iterator[None]:
    """The first signal calls `stop`; a second signal, or a time-out after the first, interrupts the main thread."""
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

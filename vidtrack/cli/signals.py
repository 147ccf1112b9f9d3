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


@contextmanager
def _out_of_kernels() -> Iterator[None]:
    """A compiled call makes a SystemError of what a signal's handler raises within it: here it is itself again."""
    try:
        yield
    except SystemError as error:
        if isinstance(error.__cause__, KeyboardInterrupt | Terminated):
            raise error.__cause__ from None
        raise


def stoppable(items: Iterable[Item]) -> Iterator[Item]:
    """Yields the items; the first signal is raised after the current item, a second one at once."""
    caught: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        if caught:
            raise KeyboardInterrupt
        caught.append(number)

    before: dict[int, Any] = {}
    try:
        with _out_of_kernels():
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
def stopping(stop: Callable[[], None], late: Callable[[], object] = interrupt_main) -> Iterator[None]:
    """The first signal calls `stop`; a second one interrupts the main thread.

    late  is called by another thread if the block has not ended soon after a first Ctrl-C; by default it interrupts
          the main thread, as SIGTERM always does: who sends it does not wait long
    """
    stopped, over = Event(), Event()

    def note(number: int, frame: FrameType | None) -> None:
        if stopped.is_set():
            raise KeyboardInterrupt
        stopped.set()
        stop()
        Thread(target=wait, args=(number,), name="patience", daemon=True).start()

    def wait(number: int) -> None:
        if not over.wait(_PATIENCE_S):
            (late if number == signal.SIGINT else interrupt_main)()

    before = {number: signal.signal(number, note) for number in _WATCHED}
    try:
        with _out_of_kernels():
            yield
    finally:
        over.set()
        for number, handler in before.items():
            signal.signal(number, handler)

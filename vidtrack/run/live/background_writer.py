"""Writes results in a thread of its own, so that a slow or full disk neither delays nor stops the tracker."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from threading import Condition, Event, Thread
from time import monotonic

from vidtrack.errors import Error
from vidtrack.output.sink import Sink, Step

log = logging.getLogger(__name__)

_DEPTH = 8  # queued steps, with their pictures
_WARN_S = 60.0  # between two warnings of a continuing loss


class BackgroundWriter:
    """Sink that queues steps and writes them in batches in its own thread.

    name     of the output, for messages
    write    writes a batch; after it raises an Error it is called again with the next batch
    finish   called after the last batch
    every_s  time between two batches [s]; 0: no pause
    depth    largest number of queued steps
    tell     called with what goes wrong

    lost     number of steps not written, because `write` failed or was too slow
    failing  why nothing can be written now; None: it can
    """

    def __init__(
        self,
        name: str,
        write: Callable[[list[Step]], None],
        finish: Callable[[], None],
        every_s: float = 0.0,
        depth: int = _DEPTH,
        tell: Callable[[str], None] = log.warning,
    ) -> None:
        self.name = name
        self.lost = 0
        self.failing: str | None = None
        self._tell = tell
        self._write = write
        self._finish = finish
        self._every_s = every_s
        self._depth = depth
        self._waiting: deque[Step] = deque()
        self._changed = Condition()
        self._ending = Event()
        self._warned_s = -_WARN_S
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @classmethod
    def of(cls, name: str, sink: Sink, tell: Callable[[str], None] = log.warning) -> BackgroundWriter:
        """A background writer for any sink."""

        def write(steps: list[Step]) -> None:
            for step in steps:
                sink.step(step)

        return cls(name, write, sink.close, tell=tell)

    def step(self, step: Step) -> None:
        """Queue a step; count it as lost if the queue is full."""
        with self._changed:
            if len(self._waiting) >= self._depth:
                self._lose(1, f"{self.name}: writing is too slow")
            else:
                self._waiting.append(step)
                self._changed.notify()

    def end(self) -> None:
        """Start the end: the thread writes the queued steps and finishes. Does not wait."""
        self._ending.set()
        with self._changed:
            self._changed.notify()

    def join(self, timeout_s: float) -> None:
        """Wait for the thread to end; after the time-out it is abandoned."""
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            self._tell(f"{self.name} could not be finished in {timeout_s:g} s; what is written is valid")

    def close(self) -> None:
        """Same as `end`."""
        self.end()

    def _run(self) -> None:
        while not self._ending.is_set():
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._ending.is_set())
            self._ending.wait(self._every_s)
            self._write_waiting()
        self._write_waiting()  # steps queued during the last write
        try:
            self._finish()
        except (Error, OSError) as error:
            self._tell(f"{self.name} could not be finished: {error}")

    def _write_waiting(self) -> None:
        with self._changed:
            steps = list(self._waiting)
            self._waiting.clear()
        try:
            self._write(steps)
        except (Error, OSError) as error:
            self.failing = str(error)
            self._lose(len(steps), self.failing)
        else:
            if self.failing is not None:
                self.failing = None
                self._tell(f"{self.name} is written again; the results of {self.lost} frames are lost")

    def _lose(self, steps: int, why: str) -> None:
        self.lost += steps
        if monotonic() - self._warned_s > _WARN_S:
            self._warned_s = monotonic()
            self._tell(f"{why}; tracking goes on")

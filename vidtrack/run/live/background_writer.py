"""Writes results beside the tracker: a slow or full disk can neither make it wait nor stop it."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from threading import Condition, Event, Thread
from time import monotonic

from vidtrack.errors import Error, StoppedEarly
from vidtrack.output.sink import Sink, Step

log = logging.getLogger(__name__)

_DEPTH = 8  # steps that may wait with their pictures
_WARN_S = 60.0  # a loss that lasts is told so often


class BackgroundWriter:
    """Sink in a thread of its own that hands its steps on in batches.

    name     of the output, for messages
    write    takes a batch; raises StoppedEarly if it cannot be written, and is given the next one all the same
    finish   is called after the last batch
    every_s  time between two batches; 0: as they come
    depth    steps that may wait

    lost     steps that were not written: `write` failed, or was too slow
    """

    def __init__(
        self,
        name: str,
        write: Callable[[list[Step]], None],
        finish: Callable[[], None],
        every_s: float = 0.0,
        depth: int = _DEPTH,
    ) -> None:
        self.name = name
        self.lost = 0
        self._write = write
        self._finish = finish
        self._every_s = every_s
        self._depth = depth
        self._waiting: deque[Step] = deque()
        self._changed = Condition()
        self._ending = Event()
        self._failing = False
        self._warned_s = -_WARN_S
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @classmethod
    def of(cls, name: str, sink: Sink) -> BackgroundWriter:
        """Any sink; once it failed, it may fail for ever."""

        def write(steps: list[Step]) -> None:
            for step in steps:
                sink.step(step)

        return cls(name, write, sink.close)

    def step(self, step: Step) -> None:
        """Queue a step, or count it as lost."""
        with self._changed:
            if len(self._waiting) >= self._depth:
                self._lose(1, f"{self.name}: writing is too slow")
            else:
                self._waiting.append(step)
                self._changed.notify()

    def end(self) -> None:
        """Let the thread write what waits, and finish."""
        self._ending.set()
        with self._changed:
            self._changed.notify()

    def join(self, timeout_s: float) -> None:
        """Wait for the end; after the time-out the thread is left behind."""
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            log.warning("%s could not be finished in %g s; what is written is valid", self.name, timeout_s)

    def close(self) -> None:
        """As `end`."""
        self.end()

    def _run(self) -> None:
        while not self._ending.is_set():
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._ending.is_set())
            self._ending.wait(self._every_s)
            self._write_waiting()
        self._write_waiting()  # what came during the last write
        try:
            self._finish()
        except (Error, OSError) as error:
            log.warning("%s could not be finished: %s", self.name, error)

    def _write_waiting(self) -> None:
        with self._changed:
            steps = list(self._waiting)
            self._waiting.clear()
        try:
            self._write(steps)
        except (StoppedEarly, OSError) as error:
            self._failing = True
            self._lose(len(steps), str(error))
        else:
            if self._failing:
                self._failing = False
                log.warning("%s is written again; the results of %d frames are lost", self.name, self.lost)

    def _lose(self, steps: int, why: str) -> None:
        self.lost += steps
        if monotonic() - self._warned_s > _WARN_S:
            self._warned_s = monotonic()
            log.warning("%s; tracking goes on", why)

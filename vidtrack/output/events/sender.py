"""Sends the events of an outbox to one receiver, in a thread of its own that nothing waits for."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from random import Random
from threading import Event as Flag
from threading import Thread
from time import monotonic
from typing import Protocol

from vidtrack.errors import Error
from vidtrack.output.events.outbox import Outbox
from vidtrack.video.live.backoff import Backoff

log = logging.getLogger(__name__)

_BATCH = 50
_LOOK_S = 1.0  # between two looks at the state of the camera, if nothing happens
_BACKOFF_S, _LONGEST_S = 1.0, 60.0


class Unreachable(Error):  # noqa: N818
    """The receiver did not take an event, and may do so later. The message contains no password."""


class Receiver(Protocol):
    """Where events are sent. All methods raise Unreachable; they are called from one thread."""

    name: str
    shown: str

    def open(self) -> None:
        """Connect."""

    def send(self, lines: Sequence[str]) -> int:
        """Send events in order; returns how many of the first ones the receiver has."""

    def tell(self) -> None:
        """Tell the receiver of the camera's state if it is another than before."""

    def close(self) -> None:
        """Disconnect; raises nothing."""


class Sender:
    """The thread that empties an outbox.

    tell   called with what goes wrong, once until it goes well again

    sent   number of events that the receiver has taken in this run
    """

    def __init__(self, receiver: Receiver, outbox: Outbox, tell: Callable[[str], None] = log.warning) -> None:
        self.name = receiver.name
        self.sent = 0
        self._receiver = receiver
        self._outbox = outbox
        self._tell = tell
        self._backoff = Backoff(_BACKOFF_S, _LONGEST_S, Random())
        self._down: str | None = None  # why the receiver cannot be reached
        self._lost = outbox.dropped  # when it was reached last
        self._ending = Flag()
        self._thread = Thread(target=self._run, name=f"{receiver.name}-events", daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """Number of events that were never sent, of all runs."""
        return self._outbox.dropped

    @property
    def waiting(self) -> int:
        """Number of events that wait."""
        return self._outbox.waiting

    @property
    def failing(self) -> str | None:
        """Why events are being lost now; None while they are sent, or wait in a queue with room."""
        if self._outbox.failing is not None:
            return self._outbox.failing
        if self._down is None or self._outbox.dropped == self._lost:
            return None
        return f"{self._down}; {self.waiting} events wait, {self._outbox.dropped - self._lost} were dropped"

    def end(self) -> None:
        """Start the end: what waits is tried once more. Does not wait."""
        self._ending.set()
        self._outbox.wake()

    def join(self, until_s: float) -> None:
        """Wait for the thread until a monotonic time; then it is abandoned, and the next run sends what is left."""
        self._thread.join(max(0.0, until_s - monotonic()))

    def _run(self) -> None:
        while True:
            last = self._ending.is_set()
            try:
                self._receiver.open()
                while True:
                    self._receiver.tell()
                    while self._pass_on():
                        pass
                    if last:
                        break
                    self._outbox.wait(_LOOK_S)
                    last = self._ending.is_set()
            except Exception as error:  # whatever happens, the events wait and are tried again
                self._failed(error)
            finally:
                self._receiver.close()
            if last:
                return
            self._ending.wait(self._backoff.next_s())

    def _pass_on(self) -> bool:
        """Send the oldest events; False if there are none."""
        lines = self._outbox.oldest(_BATCH)
        if not lines:
            return False
        taken = self._receiver.send(lines)
        self.sent += taken
        self._outbox.sent(lines[:taken])
        self._went_well()
        return True

    def _went_well(self) -> None:
        self._lost = self._outbox.dropped
        self._backoff.reset()
        if self._down is not None:
            self._down = None
            log.warning("%s takes events again", self._receiver.shown)

    def _failed(self, error: Exception) -> None:
        if self._down is None:
            self._tell(f"{error}; events wait on the disk")
        self._down = str(error)

"""The queue between reader and tracker: a few items, the newest."""

from __future__ import annotations

from collections import deque
from threading import Condition
from time import monotonic
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Mailbox(Generic[Item]):
    """A bounded queue between two threads.

    depth   capacity in items
    waits   whether `put` waits if the queue is full; else the oldest item is dropped
    """

    def __init__(self, depth: int, waits: bool) -> None:
        self._items: deque[Item] = deque()
        self._depth = depth
        self._waits = waits
        self._changed = Condition()
        self._open = True
        self._error: Exception | None = None

    def put(self, item: Item) -> int:
        """Add an item; returns the number of dropped items. No effect after `close`."""
        with self._changed:
            if self._waits:
                self._changed.wait_for(lambda: len(self._items) < self._depth or not self._open)
            if not self._open:
                return 0
            dropped = len(self._items) >= self._depth
            if dropped:
                self._items.popleft()
            self._items.append(item)
            self._changed.notify_all()
            return int(dropped)

    def get(self, timeout_s: float) -> Item | None:
        """The oldest item; None after the time-out. Once closed and empty: raises the error, or StopIteration."""
        deadline = monotonic() + timeout_s
        with self._changed:
            while not self._items:
                if self._error is not None:
                    raise self._error
                if not self._open:
                    raise StopIteration
                if not self._changed.wait(max(0.0, deadline - monotonic())):
                    return None
            item = self._items.popleft()
            self._changed.notify_all()
            return item

    def close(self, error: Exception | None = None) -> None:
        """Refuse new items; `get` returns the remaining ones, then raises `error` or StopIteration."""
        with self._changed:
            self._open = False
            self._error = error
            self._changed.notify_all()

"""An iterator that works ahead in its own thread."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

T = TypeVar("T")


class ReadAhead(Generic[T]):
    """Iterates over `items` in its own thread, at most `depth` items ahead of the consumer.

    An error in the thread is raised in place of its item. `close` may be called at any time; it returns when the item
    in work is done and the thread has ended.
    """

    def __init__(self, items: Iterable[T], depth: int) -> None:
        self._items = iter(items)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="read-ahead")
        self._ahead: deque[Future[T | None]] = deque()
        for _ in range(depth):
            self._ask()

    def __iter__(self) -> ReadAhead[T]:
        return self

    def __next__(self) -> T:
        if not self._ahead:
            raise StopIteration
        item = self._ahead.popleft().result()
        if item is None:
            self.close()
            raise StopIteration
        self._ask()
        return item

    def _ask(self) -> None:
        self._ahead.append(self._thread.submit(next, self._items, None))

    def close(self) -> None:
        """Stop the thread and discard the items read ahead."""
        self._thread.shutdown(cancel_futures=True)
        self._ahead.clear()

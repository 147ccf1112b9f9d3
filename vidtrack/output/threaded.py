"""Runs slow sinks in threads, so that a second core encodes while the first one tracks."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack

from vidtrack.output.sink import Sink, Step


class Threaded:
    """Sink that passes each step to `sink` in a thread, at most `depth` steps behind.

    An exception of the sink is raised by a later `step`, at the latest by `close`.
    """

    def __init__(self, sink: Sink, depth: int = 8) -> None:
        self._sink = sink
        self._depth = depth
        self._pool = ThreadPoolExecutor(1, thread_name_prefix=type(sink).__name__)
        self._pending: deque[Future[None]] = deque()

    def step(self, step: Step) -> None:
        """Queue a step; wait while `depth` steps are queued."""
        if len(self._pending) >= self._depth:
            self._pending.popleft().result()
        self._pending.append(self._pool.submit(self._sink.step, step))

    def close(self) -> None:
        """Finish all steps, then close the sink."""
        try:
            while self._pending:
                self._pending.popleft().result()
        finally:
            self._pool.shutdown(cancel_futures=True)
            self._sink.close()


def close_together(*sinks: Sink) -> None:
    """Close the sinks in parallel, because closing is mostly encoding. All are closed even if one raises.

    The last is closed in the calling thread: OpenCV loads its font anew in each thread.
    """
    *others, last = sinks
    with ExitStack() as closed, ThreadPoolExecutor() as pool:
        for sink in others:
            closed.callback(pool.submit(sink.close).result)
        last.close()

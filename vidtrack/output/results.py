"""Where the steps of a run go: all sinks in order, each one ended whatever happens."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from types import TracebackType

from vidtrack.output.sink import Sink, Step
from vidtrack.output.summary import Summary


class Results:
    """Open results of a run; use it with `with`.

    Leaving the `with` block, whatever the reason, closes all sinks, the summary last: it then says whether the run
    was interrupted.
    """

    def __init__(self, summary: Summary) -> None:
        self._summary = summary
        self._sinks: list[Sink] = []
        self._open = ExitStack()
        self._open.push(self._end)  # last of all: it reports what the others did

    def add(self, sink: Sink) -> None:
        """One more sink for all steps."""
        self._sinks.append(sink)
        self._open.callback(sink.close)

    def record(self, steps: Iterable[Step]) -> Iterator[Step]:
        """The steps, each once all sinks have seen it."""
        for step in steps:
            for sink in (*self._sinks, self._summary):
                sink.step(step)
            yield step

    def __enter__(self) -> Results:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.__exit__(kind, error, trace)

    def _end(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """The error is that of the run, or of a sink that could not be closed."""
        self._summary.interrupted = kind is not None
        self._summary.close()

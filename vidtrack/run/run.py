"""A run: a source becomes steps, the steps go to sinks, the sinks write a folder.

`video.py`, `boxes.py` and `radar.py` each make the pipeline of one kind of input: its source, its steps and its list of
sinks. `live/` runs a source without an end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType

from vidtrack.errors import SourceError
from vidtrack.output.folder import begun, refuse_overwriting, withdraw
from vidtrack.output.sink import Sink, Step
from vidtrack.output.summary import Summary


@dataclass(frozen=True, slots=True)
class Extras:
    """Optional outputs of a run.

    rerun      FILE.rrd, "spawn" or "serve"
    video      file of the annotated video
    masks      folder of masks
    decisions  whether to write decisions.csv, the reason of each assignment
    source     name of the source in summary.json; None: its path
    """

    rerun: str | None = None
    video: Path | None = None
    masks: Path | None = None
    decisions: bool = False
    source: str | None = field(default=None, kw_only=True)

    @property
    def explain(self) -> bool:
        """Whether the tracker must keep each scan's choices."""
        return self.decisions or self.rerun is not None

    @property
    def shows(self) -> bool:
        """Whether an output shows the pictures."""
        return self.video is not None or self.rerun is not None


@dataclass(frozen=True, slots=True)
class Pipeline:
    """An open source with its steps and sinks.

    name     of the source; names the folder
    place    path of the source, which must not be overwritten
    count    number of steps; None: unknown
    steps    each frame or scan with its tracks, computed lazily
    summary  opens summary.json in a folder
    sinks    opens the other outputs in a folder, one after the other
    """

    name: str
    place: Path
    count: int | None
    steps: Iterable[Step]
    summary: Callable[[Path], Summary]
    sinks: Callable[[Path], Iterable[Sink]]


class Run:
    """Context manager that iterates over the steps of a pipeline and passes them to its sinks.

    output  folder of the results; None: runs/NAME
    force   replace the results of an earlier run in `output`

    folder        of the results
    name, count   of the pipeline

    When the `with` block ends, even by an exception, all results are complete up to the last whole step;
    `summary.json` states whether the run was interrupted.
    Raises SourceError, FormatError, ConfigError or OutputError at the start, StoppedEarly on a write error.
    """

    def __init__(
        self, pipeline: AbstractContextManager[Pipeline], output: Path | None = None, *, force: bool = False
    ) -> None:
        self._begun = False
        with ExitStack() as stack:  # on an error below, everything already open is closed
            opened = stack.enter_context(pipeline)
            refuse_overwriting(opened.place, output)
            self.name, self.count, self._steps = opened.name, opened.count, opened.steps
            with begun(output, opened.name, force) as self.folder, ExitStack() as written:
                self._summary = opened.summary(self.folder)
                written.push(self._end)  # closed last: it reports on the other sinks
                self._sinks: list[Sink] = []
                for sink in opened.sinks(self.folder):
                    self._sinks.append(sink)
                    written.callback(sink.close)
                stack.push(written.pop_all())
            self._open = stack.pop_all()

    def __iter__(self) -> Iterator[Step]:
        for step in recorded(self._steps, (*self._sinks, self._summary)):
            self._begun = True
            yield step

    def __enter__(self) -> Run:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.__exit__(kind, error, trace)
        if isinstance(error, SourceError) and not self._begun:
            withdraw(self.folder)  # so that the corrected command can use it

    def _end(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Close the summary. The error is from the run or from closing a sink."""
        self._summary.interrupted = kind is not None
        self._summary.close()


def recorded(steps: Iterable[Step], sinks: Sequence[Sink]) -> Iterator[Step]:
    """Yields each step after all sinks have received it."""
    for step in steps:
        for sink in sinks:
            sink.step(step)
        yield step

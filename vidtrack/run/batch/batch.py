"""A batch: what is to be done is handed to an engine, and what came of it is entered into the index."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import CancelledError, Future
from dataclasses import asdict, dataclass, field, replace
from queue import Empty, Queue
from typing import Any

from vidtrack.errors import OutputError, StoppedEarly
from vidtrack.output.linefile import Every
from vidtrack.run.batch.child import attempt
from vidtrack.run.batch.engines import Engine
from vidtrack.run.batch.index import DONE, INDEX, SET_ASIDE, WAITING, Row, index_bytes, rows_of
from vidtrack.run.batch.place import Place
from vidtrack.run.batch.task import RESULTS, VERSION, Outcome, Task
from vidtrack.run.batch.work import ABOUT
from vidtrack.run.slices.cuts import Cut
from vidtrack.run.slices.kept import ABOUT as ABOUT_SLICE

ATTEMPTS = 3
"""A task is begun so often where another attempt may help: a process that died or hung, a full disk, a network."""
_INDEX_S = 5.0
_LOOK_S = 1.0  # how long an engine that says nothing is waited for before it is looked at


@dataclass(slots=True)
class Progress:
    """How far a batch is; counts and seconds of this call alone, but for `before`.

    total, before, done, aside   sources: all, done by earlier calls, done now, set aside now
    media_s                      video done now [s]
    bytes_done, bytes_total      of the sources to do now
    """

    total: int = 0
    before: int = 0
    done: int = 0
    aside: int = 0
    media_s: float = 0.0
    bytes_done: int = 0
    bytes_total: int = 0


@dataclass(slots=True)
class _Cutting:
    """A long file in work: its slices that are not done yet."""

    task: Task
    left: set[int] = field(default_factory=set)


class Batch:
    """The sources of a batch in one place.

    tasks  of all sources, one each
    again  do all of them, also those that are done

    rows       by source
    progress   of this call
    unreadable   number of sources set aside because nothing could be read of them

    Raises OutputError if the place holds something else, or the results of other sources only.
    """

    def __init__(self, place: Place, tasks: Iterable[Task], *, again: bool = False) -> None:
        self.place = place
        self.unreadable = 0
        self._tasks = {task.about["source"]: task for task in tasks}
        known = rows_of(place.read(INDEX), place.shown)
        self._refuse_others(known)
        self._folders = place.names(RESULTS)
        self.rows = known | {source: self._row(task, known.get(source), again) for source, task in self._tasks.items()}
        todo = [task for source, task in self._tasks.items() if self.rows[source].state != DONE]
        self.progress = Progress(
            total=len(self._tasks),
            before=len(self._tasks) - len(todo),
            bytes_total=sum(task.about["bytes"] for task in todo),
        )
        self._waiting = deque(todo)
        self._running: dict[Future[Outcome], Task] = {}
        self._ended: Queue[Future[Outcome]] = Queue()
        self._cutting: dict[str, _Cutting] = {}
        self._begun: dict[tuple[str, str, int], int] = {}
        self._due = Every(_INDEX_S)
        self._save()

    def run(self, engine: Engine, tell: Callable[[Progress], None]) -> None:
        """Do what is to be done; `tell` is called after each change, and at least once a second.

        Raises StoppedEarly if the engine is gone. However it ends, the index says what is done, and no process works
        for this place any more.
        """
        try:
            while self._waiting or self._running:
                self._hand_over(engine)
                self._take(engine)
                tell(self.progress)
            engine.end(self._out)
        except BaseException:
            for future in self._running:
                future.cancel()
            engine.end(self._out)
            raise
        finally:
            self._save()

    @property
    def _out(self) -> str:
        return next(iter(self._tasks.values())).out

    def _hand_over(self, engine: Engine) -> None:
        if not self._waiting:
            return
        for _ in range(engine.width() - len(self._running)):
            if not self._waiting:
                return
            task = self._waiting.popleft()
            key = task.name, task.kind, task.number
            self._begun[key] = self._begun.get(key, 0) + 1
            self.rows[task.about["source"]].attempts = max(self.rows[task.about["source"]].attempts, self._begun[key])
            future = engine.executor.submit(attempt, task.as_dict())
            self._running[future] = task
            future.add_done_callback(self._ended.put)

    def _take(self, engine: Engine) -> None:
        """Enter what has ended, or see after a while whether the engine is still there."""
        try:
            future = self._ended.get(timeout=_LOOK_S)
        except Empty:
            engine.check()
            return
        task = self._running.pop(future)
        self._enter(task, _outcome(future, engine))
        if self._due():
            self._save()

    def _enter(self, task: Task, outcome: Outcome) -> None:
        row = self.rows[task.about["source"]]
        row.seconds = round(row.seconds + outcome.get("seconds", 0.0), 3)
        if "done" in outcome:
            self._done(task, row, outcome["done"])
        elif "cuts" in outcome:
            self._cut(replace(task, cuts=tuple(Cut(**cut) for cut in outcome["cuts"])))
        elif "sliced" in outcome:
            self._sliced(task.name, outcome["sliced"])
        elif row.state == WAITING:  # another slice may have failed before
            self._failed(task, row, outcome)

    def _done(self, task: Task, row: Row, found: Mapping[str, Any]) -> None:
        self._enter_run(row, found)
        self._cutting.pop(task.name, None)
        self.progress.done += 1
        self.progress.media_s += found["media_s"]
        self.progress.bytes_done += row.bytes

    def _cut(self, task: Task) -> None:
        """Do the slices of a long file that are not there yet, before all else."""
        left = {cut.number for cut in task.cuts if not self._is_kept(task.slice_folder(cut.number))}
        self._cutting[task.name] = _Cutting(task, left)
        if left and task.warm_s is not None:
            self._waiting.extendleft(task.slice(number) for number in sorted(left, reverse=True))
        else:
            self._next(self._cutting[task.name])

    def _is_kept(self, slice_folder: str) -> bool:
        """Whether a slice is there as a whole; a copy to a store that was killed leaves a part of it."""
        return self.place.read(f"{slice_folder}/{ABOUT_SLICE}") is not None

    def _sliced(self, name: str, number: int) -> None:
        cutting = self._cutting.get(name)
        if cutting is None:  # set aside meanwhile
            return
        cutting.left.discard(number)
        if not cutting.left or cutting.task.warm_s is None:
            self._next(cutting)

    def _next(self, cutting: _Cutting) -> None:
        """Do the next slice of a file whose slices go on from each other; stitch them if all are there."""
        task = cutting.task
        self._waiting.appendleft(task.slice(min(cutting.left)) if cutting.left else replace(task, kind="stitch"))

    def _failed(self, task: Task, row: Row, outcome: Outcome) -> None:
        """Try again at the end where that may help, else set the source aside."""
        if outcome["again"] and self._begun[task.name, task.kind, task.number] < ATTEMPTS:
            self._waiting.append(task)
            return
        row.state, row.error = SET_ASIDE, outcome["error"]
        self._cutting.pop(task.name, None)
        self._waiting = deque(one for one in self._waiting if one.name != task.name)
        self.progress.aside += 1
        self.progress.bytes_done += row.bytes
        self.unreadable += bool(outcome["unreadable"])

    def _row(self, task: Task, known: Row | None, again: bool) -> Row:
        """The row of a source at the start: done if its results are there and nothing has changed."""
        row = Row(**task.about, key=task.key, version=VERSION)
        if again:
            return row
        if known is not None and known.state == DONE and known.key == task.key and known.folder in self._folders:
            return replace(known, start=row.start, site=row.site)
        if task.name in self._folders:  # done by a batch that was killed before it could say so
            about = json.loads(self.place.read(f"{task.result}/{ABOUT}") or "{}")
            if about.get("key") == task.key:
                self._enter_run(row, {name: about[name] for name in _OF_RUN})
        return row

    @staticmethod
    def _enter_run(row: Row, found: Mapping[str, Any]) -> None:
        row.state, row.error = DONE, None
        for name in _OF_RUN:
            setattr(row, name, found[name])

    def _refuse_others(self, known: Mapping[str, Row]) -> None:
        shown = self.place.shown
        if known and not known.keys() & self._tasks.keys():
            raise OutputError(
                f"{shown} belongs to another batch: none of its {len(known)} sources is among these; "
                "choose another -o, or name its sources too"
            )
        others = sorted(self.place.names("") - {f"{INDEX}.new"})
        if not known and others:
            raise OutputError(f"{shown} is no batch's: it holds {others[0]} and no {INDEX}; choose another -o")

    def _save(self) -> None:
        """Write the index. A disk that is full now may have room later."""
        try:
            self.place.write(INDEX, index_bytes(self.rows.values()))
        except (OSError, StoppedEarly):
            if not self._running and not self._waiting:
                raise


_OF_RUN = ("frames", "media_s", "coverage", "tracks", "truncated")
"""Columns of the index that a finished run fills."""


def _outcome(future: Future[Outcome], engine: Engine) -> Outcome:
    """What came of a task; an engine that lost it is asked whether it is still there."""
    try:
        return future.result()
    except (Exception, CancelledError) as error:
        engine.check()
        reason = " ".join(str(error).split())[:300]
        return {
            "error": f"the engine lost it: {type(error).__name__} {reason}".strip(),
            "again": True,
            "unreadable": False,
        }


def about(row: Row) -> dict[str, Any]:
    """What a task knows of its source: columns of the index that are there before it is done."""
    return {name: value for name, value in asdict(row).items() if name in _BEFORE}


_BEFORE = ("source", "folder", "site", "start", "bytes", "stamp")

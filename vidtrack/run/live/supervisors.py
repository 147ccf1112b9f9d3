"""Tracks several cameras at once, each in its own process and sub-folder, so that a crash stays with one camera."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from dataclasses import replace
from multiprocessing.connection import wait
from pathlib import Path
from threading import Event
from time import monotonic
from types import TracebackType
from typing import Any

from vidtrack.errors import Error, StoppedEarly
from vidtrack.output.intervals.book import totals
from vidtrack.output.linefile import replace_text
from vidtrack.output.lock import exclusive
from vidtrack.run.live.supervisor import END_S, Supervisor, counts_of
from vidtrack.run.live.worker import Job

log = logging.getLogger(__name__)

_END_S = END_S
_COUNTED = ("frames", "frames_dropped", "decode_errors", "reconnects", "stalls", "tracks")


class Supervisors:
    """Context manager that tracks several cameras at once. Leaving it ends all processes within two seconds.

    by_camera  each camera's supervisor, by its name

    Raises OutputError if another run uses the folder.
    """

    def __init__(self, jobs: Iterable[Job], folder: Path) -> None:
        self.folder = folder
        self._stopping = Event()
        self._until_s: float | None = None  # monotonic time of the end; None: not stopped
        self._final: dict[str, Any] | None = None
        self._lock = ExitStack()
        self._lock.enter_context(exclusive(folder))
        self.by_camera = {job.name: Supervisor(job) for job in jobs}
        self._removed: dict[str, Supervisor] = {}

    def use(self, jobs: Iterable[Job]) -> list[str]:
        """Track these cameras from now on; returns what is changed, in words.

        Only processes of other jobs than before are stopped and started. Call it from the thread of `running`.
        """
        wanted = {job.name: job for job in jobs}
        known = self.by_camera | self._removed
        changes = []
        for name, supervisor in self.by_camera.items():
            if name not in wanted:
                supervisor.leave()
                changes.append(f"{name} is removed")
        for name, job in wanted.items():
            if name not in known:
                changes.append(f"{name} is added")
                known[name] = Supervisor(job)
            elif name in self._removed or replace(known[name].asked, force=False) != job:
                changes.append(f"{name} is {'added' if name in self._removed else 'changed'}")
                known[name].change(job)
        self._removed = {name: supervisor for name, supervisor in known.items() if name not in wanted}
        self.by_camera = {name: known[name] for name in wanted}
        return changes

    def running(self, timeout_s: float) -> bool:
        """Wait up to `timeout_s`, restarting crashed processes; False when all have ended or `stop` was called.

        Returns early when a process ends.
        """
        if not self._stopping.is_set():
            wait([supervisor.sentinel for supervisor in _alive(self._all)], timeout_s)
            for supervisor in self._all:
                supervisor.restart_if_due()
        return not self._stopping.is_set() and not all(supervisor.ended for supervisor in self.by_camera.values())

    def stop(self) -> None:
        """Stop all processes; `running` then returns False. Safe in any thread and in signal handlers."""
        self._until_s = self._until_s or monotonic() + _END_S  # the time counts from the signal
        self._stopping.set()
        for supervisor in self._all:
            supervisor.stop()

    def statuses(self) -> list[dict[str, Any]]:
        """Name and status of each camera."""
        return [{"name": name, **supervisor.status()} for name, supervisor in self.by_camera.items()]

    def summary(self) -> dict[str, Any]:
        """The summaries of all cameras, with the sums of their counts; `error` for a camera that failed."""
        if self._final is not None:
            return self._final
        cameras = {name: _summary(supervisor) for name, supervisor in self.by_camera.items()}
        cameras |= {name: _summary(supervisor) | {"removed": True} for name, supervisor in self._removed.items()}
        totals = {key: sum(camera.get(key, 0) for camera in cameras.values()) for key in (*_COUNTED, "restarts")}
        return {**totals, "cameras": cameras}

    @property
    def _all(self) -> list[Supervisor]:
        return [*self.by_camera.values(), *self._removed.values()]

    def __enter__(self) -> Supervisors:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        until_s = self._until_s or 0.0
        while (alive := _alive(self._all)) and monotonic() < until_s:
            wait([supervisor.sentinel for supervisor in alive], max(0.0, until_s - monotonic()))
        for supervisor in alive:
            supervisor.kill()
        try:
            self._final = self.summary()
            replace_text(self.folder / "summary.json", json.dumps(self._final, indent=2) + "\n")
        except StoppedEarly as failure:
            log.warning("%s", failure)
        self._lock.close()


def _alive(supervisors: Iterable[Supervisor]) -> list[Supervisor]:
    return [supervisor for supervisor in supervisors if supervisor.exit_code is None]


def _summary(supervisor: Supervisor) -> dict[str, Any]:
    """Summary of one camera: figures added over its processes, all its counts, and the error of the last one."""
    now = supervisor.summary()
    runs = [*supervisor.summaries, now]
    content = now | {key: sum(run.get(key, 0) for run in runs) for key in _COUNTED if any(key in run for run in runs)}
    with suppress(Error, OSError):  # what cannot be read is told by the next run
        content["counts"] = totals(counts_of(supervisor.job)) or now.get("counts", {})
    content["restarts"] = supervisor.restarts
    return content if supervisor.error is None else content | {"error": supervisor.error}

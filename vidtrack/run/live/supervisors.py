"""Tracks several cameras at once, each in its own process and sub-folder, so that a crash stays with one camera."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from contextlib import ExitStack, suppress
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
from vidtrack.run.live.supervisor import Supervisor, counts_of
from vidtrack.run.live.worker import Job

log = logging.getLogger(__name__)

_END_S = 1.8  # then processes still running are killed; their files stay valid
_COUNTED = ("frames", "frames_dropped", "decode_errors", "reconnects", "stalls", "tracks")


class Supervisors:
    """Context manager that tracks several cameras at once. Leaving it ends all processes within two seconds.

    by_camera  each camera's supervisor, by its name

    Raises OutputError if another run uses the folder.
    """

    def __init__(self, jobs: Iterable[Job], folder: Path) -> None:
        self.folder = folder
        self._stopping = Event()
        self._lock = ExitStack()
        self._lock.enter_context(exclusive(folder))
        self.by_camera = {job.name: Supervisor(job) for job in jobs}

    def running(self, timeout_s: float) -> bool:
        """Wait up to `timeout_s`, restarting crashed processes; False when all have ended or `stop` was called.

        Returns early when a process ends.
        """
        if not self._stopping.is_set():
            wait([supervisor.sentinel for supervisor in _alive(self.by_camera.values())], timeout_s)
            for supervisor in self.by_camera.values():
                supervisor.restart_if_due()
        return not self._stopping.is_set() and not all(supervisor.ended for supervisor in self.by_camera.values())

    def stop(self) -> None:
        """Stop all processes; `running` then returns False. Safe in any thread and in signal handlers."""
        self._stopping.set()
        for supervisor in self.by_camera.values():
            supervisor.stop()

    def statuses(self) -> list[dict[str, Any]]:
        """Name and status of each camera."""
        return [{"name": name, **supervisor.status()} for name, supervisor in self.by_camera.items()]

    def summary(self) -> dict[str, Any]:
        """The summaries of all cameras, with the sums of their counts; `error` for a camera that failed."""
        cameras = {name: _summary(supervisor) for name, supervisor in self.by_camera.items()}
        totals = {key: sum(camera.get(key, 0) for camera in cameras.values()) for key in (*_COUNTED, "restarts")}
        return {**totals, "cameras": cameras}

    def __enter__(self) -> Supervisors:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        until_s = monotonic() + _END_S
        while (alive := _alive(self.by_camera.values())) and monotonic() < until_s:
            wait([supervisor.sentinel for supervisor in alive], until_s - monotonic())
        for supervisor in alive:
            supervisor.kill()
        try:
            replace_text(self.folder / "summary.json", json.dumps(self.summary(), indent=2) + "\n")
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

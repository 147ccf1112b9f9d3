"""Several cameras at once: a process and a sub-folder each, so that none can harm another."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Iterable, Mapping
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path
from threading import Event, Lock
from time import monotonic
from types import TracebackType
from typing import Any

from vidtrack.live.worker import END, PICTURE, STATUS, Job, unknown, work
from vidtrack.output.linefile import replace_text
from vidtrack.video.live.address import redact

_ANSWER_S = 1.0
_END_S = 1.8  # until what does not end is killed; its files are valid all the same
_COUNTED = ("frames", "frames_dropped", "decode_errors", "reconnects", "stalls", "tracks")
_SPAWN = multiprocessing.get_context("spawn")  # a fork would copy locks that threads hold


class Worker:
    """A camera's process, seen from outside. All methods may be called from any thread.

    sentinel  becomes ready when it ends
    """

    def __init__(self, job: Job) -> None:
        self.job = job
        self._asking = Lock()
        self._number = 0
        self._told = False
        self._last: dict[str, Any] = unknown(redact(job.address))
        self._channel, theirs = _SPAWN.Pipe()
        self._process = _SPAWN.Process(target=work, args=(job, theirs), name=job.name, daemon=True)
        self._process.start()
        theirs.close()
        self.sentinel = self._process.sentinel

    @property
    def exit_code(self) -> int | None:
        """None while it runs; negative if a signal ended it."""
        return self._process.exitcode

    def status(self) -> Mapping[str, Any]:
        """As `LiveStatus` has it, plain; what is not known yet is left out. The last one, once it has ended."""
        answer = self._ask(STATUS)
        if answer is not None:
            self._last = json.loads(answer)
        elif self.exit_code is not None:
            self._last = {**self._last, "state": "ended"}
        return self._last

    def picture(self) -> bytes | None:
        """The newest annotated picture as JPEG; None without one."""
        return self._ask(PICTURE) or None

    @property
    def error(self) -> str | None:
        """Why it ended, if it was not told to and did not reach its end."""
        code = self.exit_code
        if not code or (self._told and code < 0):
            return None
        problems = self.status()["problems"]
        return str(problems[-1][1]) if problems and code > 0 else f"its process ended with code {code}"

    def stop(self) -> None:
        """Tell it to end; without waiting."""
        if self.exit_code is None:
            self._told = True
            self._process.terminate()

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()

    def _ask(self, what: bytes) -> bytes | None:
        """The answer; None if there is none in time, or never will be."""
        with self._asking:
            self._number += 1
            number = b"%d" % self._number
            try:
                if self.exit_code is None:
                    self._channel.send_bytes(number + b" " + what)
                until_s = monotonic() + _ANSWER_S
                while self._channel.poll(max(0.0, until_s - monotonic())):
                    tag, _, content = self._channel.recv_bytes().partition(b" ")
                    if tag == END:
                        self._last = json.loads(content)
                    elif tag == number:  # others came too late for those who asked
                        return content
            except (EOFError, OSError):
                self._channel.close()
            return None


class Many:
    """Cameras that are tracked at the same time; use it with `with`. Leaving it ends all within two seconds.

    workers  by name
    """

    def __init__(self, jobs: Iterable[Job], folder: Path) -> None:
        self.folder = folder
        self._stopping = Event()
        self.workers = {job.name: Worker(job) for job in jobs}

    def running(self, timeout_s: float) -> bool:
        """Wait so long, or until something ends; whether any camera is still tracked and nobody said stop."""
        alive = [worker.sentinel for worker in self.workers.values() if worker.exit_code is None]
        if alive and not self._stopping.is_set():
            wait(alive, timeout_s)
        return bool(alive) and not self._stopping.is_set()

    def stop(self) -> None:
        """Let `running` say no; from any thread, or a signal handler."""
        self._stopping.set()

    def statuses(self) -> list[dict[str, Any]]:
        """All cameras: name and status."""
        return [{"name": name, **worker.status()} for name, worker in self.workers.items()]

    def summary(self) -> dict[str, Any]:
        """All cameras' summaries in one, with the sums of their counts; `error` where one ended by itself."""
        cameras = {name: _summary(worker) for name, worker in self.workers.items()}
        totals = {key: sum(camera.get(key, 0) for camera in cameras.values()) for key in _COUNTED}
        return {**totals, "cameras": cameras}

    def __enter__(self) -> Many:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for worker in self.workers.values():
            worker.stop()
        until_s = monotonic() + _END_S
        while (alive := _alive(self.workers.values())) and monotonic() < until_s:
            wait([worker.sentinel for worker in alive], until_s - monotonic())
        for worker in alive:
            worker.kill()
        replace_text(self.folder / "summary.json", json.dumps(self.summary(), indent=2) + "\n")


def _alive(workers: Iterable[Worker]) -> list[Worker]:
    return [worker for worker in workers if worker.exit_code is None]


def _summary(worker: Worker) -> dict[str, Any]:
    """What the camera's own run wrote, and how its process ended."""
    status = worker.status()
    content: dict[str, Any] = {"source": status["source"]}
    if "frame" in status:  # otherwise it never began, and what lies there is of another run
        with suppress(OSError, ValueError):
            content = json.loads((worker.job.folder / "summary.json").read_text(encoding="utf-8"))
    return content if worker.error is None else content | {"error": worker.error}

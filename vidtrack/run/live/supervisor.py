"""Supervises a camera's process from the parent: requests its status, stops it, restarts it after a crash."""

from __future__ import annotations

import json
import logging
import multiprocessing
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from random import Random
from threading import Lock
from time import monotonic
from typing import Any

from vidtrack.errors import StoppedEarly
from vidtrack.output.status import is_stuck
from vidtrack.recording.retention import parts_of
from vidtrack.run.live.counting import COUNTS
from vidtrack.run.live.view import waiting_for
from vidtrack.run.live.worker import BEGUN, END, PICTURE, STATUS, Job, work
from vidtrack.video.live.address import redact
from vidtrack.video.live.backoff import Backoff

log = logging.getLogger(__name__)

END_S = 1.6
"""s; a process that was stopped and still runs then is killed; its files stay valid"""

_ANSWER_S = 1.0
_SPAWN = multiprocessing.get_context("spawn")  # fork would copy locks held by threads


class Supervisor:
    """Supervises a camera's process, and restarts it, after growing pauses, when it ends without a final status.

    It is restarted too where it could not begin on a full disk: there may be room later.

    All methods but `restart_if_due` and `change` may be called from any thread.

    job        of the current or last process
    asked      the job as it was given last
    restarts   number of restarts
    summaries  of the earlier processes
    """

    def __init__(self, job: Job) -> None:
        live = job.settings.live
        self.restarts = 0
        self.summaries: list[dict[str, Any]] = []
        self.asked = job
        self._processes = 0
        self._next: Job | None = None  # to follow when the process has ended
        self._kill_s: float | None = None  # monotonic time at which a process that was stopped is killed
        self._shown = redact(job.address)
        self._backoff = Backoff(live.backoff_s, live.backoff_longest_s, Random())
        self._requesting = Lock()
        self._number = 0
        self._stopped = False
        self._crashes: list[tuple[float, str]] = []
        self._restart_s: float | None = None  # monotonic time of the next start
        self._start(job)

    @property
    def exit_code(self) -> int | None:
        """None while the process runs; negative if a signal ended it."""
        return self._process.exitcode

    @property
    def sentinel(self) -> int:
        """A handle that becomes ready when the process ends; see multiprocessing.connection.wait."""
        return self._process.sentinel

    @property
    def ended(self) -> bool:
        """Whether the process has ended and will not be restarted."""
        return self.exit_code is not None and self._restart_s is None and self._next is None

    def restart_if_due(self) -> None:
        """Restart the process if it crashed and the pause is over, or another job is to follow it."""
        code = self.exit_code
        if code is None and self._kill_s is not None and monotonic() > self._kill_s:
            self.kill()
        if code is not None and self._next is not None:
            self._follow(self._next)
            return
        if code is None or self._stopped:
            return
        if self._restart_s is not None:
            if monotonic() >= self._restart_s:
                self._restart()
        elif code != 0 and (self.restarts or code == StoppedEarly.exit_code or not self._has_final_status()):
            pause_s = self._pause_s()
            self._restart_s = monotonic() + pause_s
            self._crashes = [*self._crashes, (time.time(), f"{self._why()}; it is started again")][-5:]
            log.warning("%s: %s; it is started again in %.1f s", self.asked.name, self._why(), pause_s)

    def change(self, job: Job) -> None:
        """Stop the process, and go on with another job when it has ended; see `restart_if_due`."""
        self.leave()
        self.asked = self._next = job

    def leave(self) -> None:
        """Stop the process, and kill it if it has not ended soon. Does not wait."""
        self.stop()
        self._kill_s = monotonic() + END_S

    def status(self) -> Mapping[str, Any]:
        """The fields of `LiveStatus` known so far, and `restarts`; the last known ones when the process is gone."""
        answer = self._request(STATUS)
        if answer is not None:
            self._last = json.loads(answer)
        state = self._last["state"] if self.exit_code is None else "ended" if self.ended else "waiting"
        problems = sorted([*self._crashes, *map(tuple, self._last["problems"])])
        return {**self._last, "state": state, "problems": problems, "restarts": self.restarts}

    def picture(self) -> bytes | None:
        """The newest annotated picture as JPEG; None without one."""
        return self._request(PICTURE) or None

    def counts(self) -> Path | None:
        """The folder of its counts by interval; None without counting lines and site."""
        output = self.job.settings.output
        return counts_of(self.job) if output.lines or output.site else None

    @property
    def error(self) -> str | None:
        """Why the process failed; None if it runs, was stopped or succeeded."""
        code = self.exit_code
        if not self.ended or not code or (self._stopped and code < 0):
            return None
        return self._why()

    def works(self) -> bool:
        """Whether a restart of the whole run would mend nothing: the process answers, and tracks what comes.

        One that is gone is restarted alone; one that starts has not answered yet.
        """
        if self.exit_code is not None or not self._answered:
            return True
        answer = self._request(STATUS)
        return answer is not None and not is_stuck(json.loads(answer), 2 * self.asked.settings.live.timeout_s)

    def stop(self) -> None:
        """Stop the process. Does not wait."""
        self._restart_s = self._next = None
        if self.exit_code is None:
            self._stopped = True
            self._process.terminate()

    def kill(self) -> None:
        """Kill the process."""
        self._process.kill()

    def summary(self) -> dict[str, Any]:
        """summary.json of the current or last process."""
        content: dict[str, Any] = {"source": self._shown}
        self._request(STATUS)
        if self._begun:  # otherwise the file belongs to another run
            with suppress(OSError, ValueError):
                content = json.loads((self.job.folder / "summary.json").read_text(encoding="utf-8"))
        return content

    def _start(self, job: Job) -> None:
        self.job = job
        self._last = waiting_for(self._shown, "connecting", [])
        self._begun = self._final_status_came = self._answered = False
        self._started_s = monotonic()
        self._stopped, self._kill_s = False, None
        self._processes += 1
        self._channel, theirs = _SPAWN.Pipe()
        self._process = _SPAWN.Process(target=work, args=(job, theirs), name=job.name, daemon=True)
        self._process.start()
        theirs.close()

    def _restart(self) -> None:
        self._restart_s = None
        self.restarts += 1
        self._go_on(replace(self.asked, after=self._why()))

    def _follow(self, job: Job) -> None:
        """Start the process of a job that takes the place of another one."""
        self._next = None
        self._shown = redact(job.address)
        self._backoff.reset()
        self._go_on(job)

    def _go_on(self, job: Job) -> None:
        self.summaries.append(self.summary())
        with self._requesting:
            self._channel.close()
            self._start(_continued(job, self._processes + 1))

    def _pause_s(self) -> float:
        if monotonic() - self._started_s > self.asked.settings.live.backoff_longest_s:
            self._backoff.reset()
        return self._backoff.next_s()

    def _has_final_status(self) -> bool:
        """Whether the process sent a final status."""
        self._request(STATUS)
        return self._final_status_came

    def _why(self) -> str:
        if self._has_final_status() and self._last["problems"]:
            return str(self._last["problems"][-1][1])
        return f"its process ended with code {self.exit_code}"

    def _request(self, what: bytes) -> bytes | None:
        """The answer of the process; None if none comes within the time-out."""
        with self._requesting:
            self._number += 1
            number = b"%d" % self._number
            with suppress(OSError):  # if the process has just ended, its earlier messages can still be read
                self._channel.send_bytes(number + b" " + what)
            try:
                until_s = monotonic() + _ANSWER_S
                while self._channel.poll(max(0.0, until_s - monotonic())):
                    tag, _, content = self._channel.recv_bytes().partition(b" ")
                    self._begun |= tag == BEGUN
                    if tag == END:
                        self._last = json.loads(content)
                        self._final_status_came = True
                    elif tag == number:  # other numbers answer requests that timed out
                        self._answered = True
                        return content
            except (EOFError, OSError):
                self._channel.close()
            return None


def _continued(job: Job, start: int) -> Job:
    """The job for process number `start`: parts and recordings continue, other outputs get new names."""
    extras = job.extras
    return replace(
        job,
        force=False,
        folder=job.folder if parts_of(job.folder) else _free(job.folder),
        extras=replace(
            extras,
            video=extras.video and _numbered(extras.video, start),
            rerun=extras.rerun and str(_numbered(Path(extras.rerun), start)),
            masks=extras.masks and _numbered(extras.masks, start),
            lasting=job.extras.lasting or job.folder,
        ),
    )


def counts_of(job: Job) -> Path:
    """The folder of the counts by interval, which all processes of a camera share."""
    return (job.extras.lasting or job.folder) / COUNTS


def _free(folder: Path) -> Path:
    names = (folder if number == 1 else _numbered(folder, number) for number in count(1))
    return next(name for name in names if not name.exists() or not any(name.iterdir()))


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}-{number}{path.suffix}")

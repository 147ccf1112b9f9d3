"""The process of one of several cameras: its live run, and its answers to the parent."""

from __future__ import annotations

import json
import logging
import os
import signal
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Lock, Thread
from types import FrameType
from typing import NoReturn

from vidtrack.config.settings import Settings
from vidtrack.errors import Error
from vidtrack.run.live.leave import run_and_leave
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun
from vidtrack.run.live.view import View
from vidtrack.video.live.address import redact

log = logging.getLogger(__name__)

STATUS, PICTURE, BEGUN, END = b"status", b"picture", b"begun", b"end"
_SEND_S = 0.5  # to send the final status, while another answer may block


@dataclass(frozen=True, slots=True)
class Job:
    """Arguments of a camera's process, which first calls `prepare` with the camera's name.

    after  why the process before this one ended; None: there was none
    """

    name: str
    address: str
    settings: Settings
    folder: Path
    extras: LiveExtras
    force: bool
    prepare: Callable[[str], None]
    after: str | None = None


class _Terminated(BaseException):
    """SIGTERM before the run exists."""


def work(job: Job, channel: Connection) -> NoReturn:
    """Track a camera until SIGTERM or the end of the parent; the exit code is that of a single live run."""
    run_and_leave(partial(_work, job, channel))


def _work(job: Job, channel: Connection) -> int:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the parent sends SIGTERM
    signal.signal(signal.SIGTERM, _terminate)
    job.prepare(job.name)
    view = View(redact(job.address))
    answers = _Answers(view, channel)
    try:
        with LiveRun(
            job.address, job.settings, job.folder, job.extras, force=job.force, stats=view.stats, after=job.after
        ) as run:
            signal.signal(signal.SIGTERM, lambda *_: run.stop())
            view.board = run.board
            answers.begin()
            for _ in run:
                pass
    except _Terminated:
        answers.end()
    except Error as error:
        log.error("%s", error)
        answers.end(str(error))
        return error.exit_code
    else:
        answers.end()
    return 0


def _terminate(number: int, frame: FrameType | None) -> None:
    raise _Terminated


class _Answers:
    """Thread that answers the parent's requests: `NUMBER status` or `NUMBER picture` with `NUMBER content`."""

    def __init__(self, view: View, channel: Connection) -> None:
        self._view = view
        self._channel = channel
        self._sending = Lock()
        Thread(target=self._run, name="answers", daemon=True).start()

    def begin(self) -> None:
        """Report that the run has begun and owns its folder."""
        self._send(BEGUN, b"")

    def end(self, error: str | None = None) -> None:
        """Send the final status, with the error if there was one."""
        self._send(END, json.dumps(self._view.ended(error)).encode())

    def _run(self) -> None:
        try:
            while True:
                number, _, what = self._channel.recv_bytes().partition(b" ")
                picture = what == PICTURE
                self._send(number, self._view.picture() or b"" if picture else json.dumps(self._view.status()).encode())
        except (EOFError, OSError):  # the parent is gone
            os.kill(os.getpid(), signal.SIGTERM)

    def _send(self, tag: bytes, content: bytes) -> None:
        if self._sending.acquire(timeout=_SEND_S):
            try:
                self._channel.send_bytes(tag + b" " + content)
            finally:
                self._sending.release()

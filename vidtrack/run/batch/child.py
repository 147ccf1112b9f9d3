"""Keeps a process that does tasks: one that dies or hangs costs its task, not the batch."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import threading
from contextlib import suppress
from selectors import EVENT_READ, DefaultSelector
from typing import Any

from vidtrack.beside import python
from vidtrack.run.batch.task import VERSION, Outcome
from vidtrack.video.resources import CORES

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENCV_FOR_THREADS_NUM", CORES)
"""Variables of the environment by which libraries choose how many threads they start."""
_of_thread = threading.local()
_alive: set[Child] = set()
_START_S = 120.0  # a cold start on a busy disk, and the compilation before the first frame


def attempt(told: dict[str, Any]) -> Outcome:
    """Do a task in the process of this thread, on one core. Raises nothing.

    told  Task.as_dict()
    """
    if told["version"] != VERSION:
        return _failed(
            f"this worker has vidtrack {VERSION}, the batch {told['version']}; install the same version", False
        )
    child = getattr(_of_thread, "child", None)
    if child is None or child.process.poll() is not None:
        child = _of_thread.child = Child(told["out"])
    child.out = told["out"]  # a worker's process may have done tasks of another batch
    return child.do(told, float(told["patience_s"]))


def end_children(out: str) -> None:
    """End all processes of this one that work for a place; their threads return a failure."""
    for child in list(_alive):
        if child.out == out:
            child.end()


class Child:
    """A process of `worker.py` with one core.

    out  place that it works for
    """

    def __init__(self, out: str) -> None:
        self.out = out
        self.process = subprocess.Popen(
            python("from vidtrack.run.batch.worker import main; main()"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | dict.fromkeys(_THREADS, "1"),
            start_new_session=True,  # Ctrl-C is for the batch, which then ends its processes
        )
        self._fresh = True
        _alive.add(self)

    def do(self, told: dict[str, Any], patience_s: float) -> Outcome:
        """Do a task; a failure if the process ends, or gives no sign for `patience_s` and is killed."""
        process = self.process
        assert process.stdin is not None
        assert process.stdout is not None
        patience_s, self._fresh = (max(patience_s, _START_S) if self._fresh else patience_s), False
        buffer = b""
        with suppress(BrokenPipeError), DefaultSelector() as waiting:
            process.stdin.write(json.dumps(told).encode() + b"\n")
            process.stdin.flush()
            waiting.register(process.stdout, EVENT_READ)
            while waiting.select(patience_s):
                piece = os.read(process.stdout.fileno(), 1 << 16)
                if not piece:
                    break
                *lines, buffer = (buffer + piece).split(b"\n")
                for answer in map(json.loads, lines):
                    if answer:  # not a beat
                        return dict(answer)
            else:
                self.end()
                return _failed(f"it gave no frame for {patience_s:g} s and was killed", True)
        self.end()
        return _failed(f"the process that tracked it was ended by {_reason(process.wait())}", True)

    def end(self) -> None:
        """Kill the process."""
        _alive.discard(self)
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


def _failed(why: str, again: bool) -> Outcome:
    return {"error": why, "again": again, "unreadable": False}


def _reason(code: int) -> str:
    """What a process ended by, in words."""
    if code >= 0:
        return f"itself with code {code}"
    with suppress(ValueError):
        return f"signal {-code} ({signal.Signals(-code).name})"
    return f"signal {-code}"

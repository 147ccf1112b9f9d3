"""The end of a process, at once and with its own exit code."""

from __future__ import annotations

import atexit
import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn


def run_and_leave(command: Callable[[], int | None]) -> NoReturn:
    """Run a command, and end the process with its exit code, that of a SystemExit, or 1 after an unexpected error."""
    try:
        code = command() or 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        if isinstance(end.code, str):
            sys.stderr.write(f"{end.code}\n")
    except BaseException:
        sys.excepthook(*sys.exc_info())
        code = 1
    leave(code)


def leave(code: int) -> NoReturn:
    """End the process with this exit code.

    Python's own end takes libraries apart, which a run that has to end soon has no time for, and ends abandoned threads
    where they ask for its lock. Within a function of OpenCV or Arrow that aborts the process, "terminate called without
    an active exception": C++ lets nothing unwind through a destructor.
    """
    threading._shutdown()  # type: ignore[attr-defined]  # joins threads; those of pools wait until they are told to end
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # its reader is gone, or it is closed
            stream.flush()
    os._exit(code)

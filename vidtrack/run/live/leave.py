"""The end of a process, at once and with its own exit code."""

from __future__ import annotations

import atexit
import os
import sys
import threading
from contextlib import suppress
from typing import NoReturn


def leave(code: int) -> NoReturn:
    """End the process with this exit code.

    Python's own end takes libraries apart, which a run that has to end soon has no time for, and ends abandoned threads
    where they ask for its lock; in compiled code that aborts the process.
    """
    threading._shutdown()  # type: ignore[attr-defined]  # joins threads; those of pools wait until they are told to end
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # its reader is gone, or it is closed
            stream.flush()
    os._exit(code)

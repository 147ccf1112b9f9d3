"""Hides secrets in the command line that `ps` shows."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from pathlib import Path

_ARG_START, _ARG_END = 48, 49  # fields of /proc/PID/stat, counted from 1 (proc(5))


def hide_arguments(secrets: Iterable[str]) -> None:
    """Overwrite each secret in this process's argument list with stars. Linux only; no effect elsewhere."""
    stat = Path("/proc/self/stat")
    if not stat.exists():
        return
    fields = stat.read_text().rpartition(")")[2].split()  # the name before it may contain spaces
    start, end = (int(fields[number - 3]) for number in (_ARG_START, _ARG_END))
    shown = ctypes.string_at(start, end - start)
    for secret in secrets:
        text = secret.encode()
        shown = shown.replace(text, b"*" * len(text))
    ctypes.memmove(start, shown, len(shown))

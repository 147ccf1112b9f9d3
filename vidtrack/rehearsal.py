"""Compiles kernels beside a first run, from the last to the first, while the run needs them from the first on.

Which ones it needs its first scans show, tracked with each kernel as the Python function that it is made from.
"""

from __future__ import annotations

import json
import subprocess
from atexit import register
from collections.abc import Callable
from contextlib import suppress
from os import cpu_count
from typing import Any

import numpy as np
from numba import typeof
from numba.core.registry import CPUDispatcher

from vidtrack.beside import python
from vidtrack.compiled import first_run


def rehearse_beside(play: Callable[..., object], *told: str) -> None:
    """`rehearse` in a process of its own, which ends with ours, for the first run on a machine with a second core.

    What it is told goes through a pipe: others may read the words of a command, and settings may hold passwords.
    """
    if first_run() and (cpu_count() or 1) > 1:
        name = play.__name__
        said = f"import json; from {play.__module__} import {name}; from {__name__} import rehearse; "
        helper = subprocess.Popen(
            python(f"{said}rehearse({name}, *json.load(sys.stdin))"),
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        register(helper.kill)
        assert helper.stdin is not None
        with suppress(BrokenPipeError), helper.stdin:
            json.dump(told, helper.stdin)


def rehearse(play: Callable[..., object], *told: str) -> None:
    """Call a function without compiled code, then compile the kernels that it called, the last one first.

    By then the run has compiled the first ones; half-way the two meet.
    """
    called: dict[tuple[Any, tuple[Any, ...]], None] = {}

    def played(kernel: Any, *arguments: Any) -> Any:
        if kernel.targetoptions.get("inline") != "always":  # else it is compiled within others
            called.setdefault((kernel, tuple(map(typeof, arguments))))
        return kernel.py_func(*arguments)

    kernels: Any = CPUDispatcher  # the class of all of them
    kernels.__call__ = played
    try:
        with np.errstate(all="ignore"):
            play(*told)
    finally:
        del kernels.__call__
    for kernel, types in reversed(called):
        kernel.compile(types)

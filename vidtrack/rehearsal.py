"""Compiles kernels beside a first run, from the last to the first, while the run needs them from the first on.

Which ones it needs its first scans show, tracked with each kernel as the Python function that it is made from.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import typeof
from numba.core.registry import CPUDispatcher
from pydantic import BaseModel

from vidtrack.beside import help_beside
from vidtrack.compiled import first_run


def rehearse_beside(play: Callable[..., object], *told: str | BaseModel) -> None:
    """`rehearse` in a process of its own, for a first run on a machine with a second core.

    play  a function of a module, which gets what is told; of a model, as settings are, the values that are not defaults
    """
    if first_run():
        name = play.__name__
        said = f"import json; from {play.__module__} import {name}; from {__name__} import rehearse; "
        values = [
            each if isinstance(each, str) else each.model_dump(mode="json", exclude_defaults=True) for each in told
        ]
        help_beside(f"{said}rehearse({name}, *json.load(sys.stdin))", values)


def rehearse(play: Callable[..., object], *told: Any) -> None:
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

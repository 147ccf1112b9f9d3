"""Rows of a bank shared out among the processors."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def in_parts(rows: int, size: int, work: Callable[[slice], None]) -> None:
    """Call work for parts of `size` rows that cover all, in threads if there are several; kernels free the interpreter.

    The parts do not depend on the number of threads, and neither must what the work does.
    """
    parts = [slice(first, min(first + size, rows)) for first in range(0, rows, size)]
    if len(parts) < 2:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for _ in pool.map(work, parts):
            pass  # raises what the work raised

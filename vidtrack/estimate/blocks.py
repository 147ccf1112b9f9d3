"""Parallel work on blocks of rows."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def in_blocks(rows: int, size: int, work: Callable[[slice], None]) -> None:
    """Call work on slices of `size` rows that cover all rows; several slices run in threads.

    Kernels release the interpreter's lock. Slices, and so results, do not depend on the number of threads.
    """
    blocks = [slice(first, min(first + size, rows)) for first in range(0, rows, size)]
    if len(blocks) < 2:
        for block in blocks:
            work(block)
        return
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for _ in pool.map(work, blocks):
            pass  # raises the work's exception

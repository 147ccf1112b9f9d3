"""Rows of a bank in blocks, processed in parallel."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def in_blocks(rows: int, size: int, work: Callable[[slice], None]) -> None:
    """Call work on slices of `size` rows that cover all rows, in threads if there are several slices.

    Kernels release the interpreter's lock. The slices do not depend on the number of threads; results must not either.
    """
    blocks = [slice(first, min(first + size, rows)) for first in range(0, rows, size)]
    if len(blocks) < 2:
        for block in blocks:
            work(block)
        return
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for _ in pool.map(work, blocks):
            pass  # raises what the work raised

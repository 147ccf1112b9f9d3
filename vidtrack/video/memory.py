"""Memory that is freed and taken again with every frame."""

from __future__ import annotations

import numpy as np

_LARGEST = 31 << 20  # bytes; glibc learns from no block of 32 MB or more


def keep_freed_memory() -> None:
    """Let the C library keep freed pictures for the next ones, not give them back to the system each time.

    glibc takes blocks above a threshold from the system and returns them at once; the threshold rises to the
    largest such block that was freed. Without this each frame's pages are mapped and zeroed anew, which costs
    up to a tenth of a run.
    """
    np.empty(_LARGEST, np.uint8)  # freed at once, never touched

"""What work on one frame after the other asks of the process: memory that stays, and no idle threads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import numpy as np

_LARGEST = 31 << 20  # bytes; glibc learns nothing from a block of 32 MB or more


def keep_freed_memory() -> None:
    """Let the C library keep freed pictures for the next ones instead of giving them back to the system.

    glibc takes blocks above a threshold from the system and returns them at once; the threshold rises to the
    largest such block that was freed. Otherwise the pages of each frame's arrays are mapped and zeroed anew.
    """
    np.empty(_LARGEST, np.uint8)  # freed at once and never touched


@contextmanager
def opencv_single_threaded() -> Iterator[None]:
    """Keep OpenCV to the calling thread: for short operations its threads wait actively and take the decoder's core."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)

"""Process-wide settings for work frame by frame: freed memory is kept, and OpenCV's threads do not compete."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import cv2
import numpy as np

OPENCV = ("mog2", "knn")
"""Kinds of detectors that are OpenCV's own."""

_LARGEST = 31 << 20  # bytes; glibc learns nothing from a block of 32 MB or more


def keep_freed_memory() -> None:
    """Let the C library keep freed pictures for the next ones instead of giving them back to the system.

    glibc takes blocks above a threshold from the system and returns them at once; the threshold rises to the
    largest such block that was freed. Otherwise the pages of each frame's arrays are mapped and zeroed anew.
    """
    np.empty(_LARGEST, np.uint8)  # freed at once and never touched


@contextmanager
def frame_by_frame(detector: str) -> Iterator[None]:
    """Settings under which frames are detected one after the other, by a detector of this kind.

    OpenCV keeps its threads for its own detectors: their operations are long enough to gain from them.
    """
    keep_freed_memory()
    with nullcontext() if detector in OPENCV else opencv_single_threaded():
        yield


@contextmanager
def opencv_single_threaded() -> Iterator[None]:
    """Keep OpenCV to the calling thread: for short operations its threads wait actively and take the decoder's core."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)

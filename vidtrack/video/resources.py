"""Process-wide settings for frame-by-frame work: memory reuse and OpenCV's threads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import cv2
import numpy as np

OPENCV = ("mog2", "knn")
"""Kinds of detectors that are OpenCV's own."""

_LARGEST = 31 << 20  # bytes; glibc learns nothing from a block of 32 MB or more


def keep_freed_memory() -> None:
    """Let the C library reuse the memory of freed pictures and not return it to the system.

    glibc takes blocks above a threshold from the system and returns them at once; the threshold rises to the
    largest such block that was freed. Otherwise the pages of each frame's arrays are mapped and zeroed again.
    """
    np.empty(_LARGEST, np.uint8)  # freed at once and never touched


@contextmanager
def frame_by_frame(detector: str) -> Iterator[None]:
    """Context with the settings for frame-by-frame detection by a detector of this kind.

    OpenCV's threads stay on for its own detectors, whose operations are long enough to gain from them.
    """
    keep_freed_memory()
    with nullcontext() if detector in OPENCV else opencv_single_threaded():
        yield


@contextmanager
def opencv_single_threaded() -> Iterator[None]:
    """Context in which OpenCV uses one thread: in short operations its threads spin and take the decoder's core."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)

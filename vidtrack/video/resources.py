"""Process-wide settings for frame-by-frame work: memory reuse, and the threads of the decoder and of OpenCV."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import cv2
import numpy as np

OPENCV = ("mog2", "knn")
"""Kinds of detectors that are OpenCV's own."""

CORES = "VIDTRACK_CORES"
"""Variable of the environment: number of cores that this process may use; without it, all."""

_DECODERS = 4  # at least: pictures take unlike times, and with three of them on two cores one is idle more often
_SMALL = 640 * 480  # pixels
_LARGEST = 31 << 20  # bytes; glibc learns nothing from a block of 32 MB or more


def decoders(pixels: int) -> int:
    """Number of the decoder's threads: the cores that this process was given, or enough for all of the machine.

    One for small pictures: they are decoded faster than they are tracked, and threads would take time of their own.
    """
    given = os.environ.get(CORES)
    if given:
        return int(given)
    return 1 if pixels <= _SMALL else max(_DECODERS, os.cpu_count() or 1)


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

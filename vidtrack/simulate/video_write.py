"""A clip as files: `video.avi` and its truth `gt.txt`."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from vidtrack.simulate.clip import Clip
from vidtrack.simulate.truth import Truth

QUANTISER = 3  # of MPEG-4, 1 to 31: fine detail and part of the noise are lost, as in a recorder's file


def write(clip: Clip, folder: Path, frames: Iterable[NDArray[np.uint8]] | None = None) -> None:
    """Write `video.avi` and `gt.txt` into a folder that exists; `frames` stands in for the clip (a progress bar)."""
    write_video(folder / "video.avi", clip if frames is None else frames, clip.size, clip.fps)
    write_truth(folder / "gt.txt", clip.truth)


def write_video(path: Path, frames: Iterable[NDArray[np.uint8]], size: tuple[int, int], fps: float) -> None:
    """Write frames (H, W, 3) BGR as MPEG-4 (XVID) in an AVI."""
    with av.open(str(path), "w", format="avi") as container:
        stream = container.add_stream("mpeg4", rate=_rate(fps))
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        stream.codec_context.codec_tag = "XVID"
        stream.codec_context.qmin = stream.codec_context.qmax = QUANTISER
        for image in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="bgr24")))
        container.mux(stream.encode())


def write_truth(path: Path, truth: Truth) -> None:
    """Write MOTChallenge text: frame (from 1), id, left, top, width, height, 1, 1, visibility."""
    ones = np.ones(len(truth))
    rows = np.column_stack([truth.frame + 1, truth.id, truth.box, ones, ones, truth.visibility])
    np.savetxt(path, rows, fmt="%d,%d,%.3f,%.3f,%.3f,%.3f,%d,%d,%.3f")


def _rate(fps: float) -> Fraction:
    """The rate as a fraction that MPEG-4 can store: its clock has at most 65535 ticks a second."""
    return Fraction(fps).limit_denominator(min(1001, int(65535 / fps)))

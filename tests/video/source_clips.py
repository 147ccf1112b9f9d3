"""Small videos whose frames can be told apart: frame i is grey with level `level(i)`."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

SIZE = (64, 48)


def level(index: int) -> int:
    return 30 + 3 * (index % 70)


def picture(index: int, size: tuple[int, int] = SIZE) -> np.ndarray:
    """(H, W, 3) blue-green-red: flat, with a little texture so that the coders have something to code."""
    width, height = size
    texture = np.random.default_rng(index).integers(-8, 9, (height, width, 1))
    return np.clip(level(index) + np.repeat(texture, 3, axis=2), 0, 255).astype(np.uint8)


def write_clip(
    path: Path,
    frames: int = 20,
    codec: str = "mpeg4",
    pixels: str = "yuv420p",
    size: tuple[int, int] = SIZE,
    rate: float | Fraction = 25,
    stamps_ms: Iterable[int] | None = None,
    options: dict[str, str] | None = None,
    spare: int = 0,
    coder: dict[str, str] | None = None,
    ahead: dict[int, int] | None = None,
) -> Path:
    """Encode `frames` frames, at `rate` or at explicit timestamps; of H.264, no other refers to `spare` in a row.

    coder  options of x264
    ahead  what is added to the stamps of packets, by their numbers
    """
    packets: list[av.Packet] = []
    with av.open(str(path), "w", options=options or {}) as container:
        stream = container.add_stream(codec, rate=Fraction(rate).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = *size, pixels
        stream.bit_rate = 2_000_000
        if codec == "libx264":
            stream.options = {"preset": "ultrafast", "g": "10", "bf": str(spare), **(coder or {})}
        stamps = None if stamps_ms is None else list(stamps_ms)
        if stamps is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        for index in range(frames if stamps is None else len(stamps)):
            frame = av.VideoFrame.from_ndarray(picture(index, size), format="bgr24").reformat(format=pixels)
            if stamps is not None:
                frame.pts, frame.time_base = stamps[index], Fraction(1, 1000)
            packets += stream.encode(frame)
        packets += stream.encode()
        for number, by in (ahead or {}).items():
            packets[number].pts += by
        container.mux(packets)
    return path

"""Luminance and half-size chroma planes of decoded pictures, without a copy if the decoder's layout allows."""

from __future__ import annotations

from dataclasses import replace

import av
import cv2
import numpy as np
from av.video.plane import VideoPlane

from vidtrack.video.frame import Frame, Image

_FULL, _LIMITED = 2, 1  # AVCOL_RANGE_JPEG and AVCOL_RANGE_MPEG
_YUV = frozenset(f"yuv{letter}{ratio}p" for letter in ("", "j") for ratio in (420, 422, 440, 444))


def to_frame(index: int, time_s: float, picture: av.VideoFrame) -> Frame:
    """The planes of a decoded picture.

    Planar 8-bit YUV and grey are read-only views of the decoder's memory whose rows may be padded; finer
    chroma is thinned to half size by stride. Everything else (RGB, palettes, more than 8 bits, packed
    layouts) is converted: RGB to full-range BT.601, which `Frame.bgr` undoes; YUV keeps its range.
    A picture with rotation metadata, as from a phone, is turned upright.
    """
    quarter_turns = round(picture.rotation / 90) if abs(picture.rotation) <= 180 else 0  # beyond: no rotation at all
    picture = planar(picture)
    y, *chroma = map(_view, picture.planes)
    if not chroma:
        return Frame(index, time_s, _turned(y, quarter_turns), full_range=picture.color_range != _LIMITED)
    height, width = (picture.height + 1) // 2, (picture.width + 1) // 2
    chroma = [_thinned(plane, height, width) for plane in chroma]
    y, u, v = (_turned(plane, quarter_turns) for plane in (y, *chroma))
    full_range = picture.color_range == _FULL or picture.format.name.startswith("yuvj")
    return Frame(index, time_s, y, u, v, full_range)


def planar(picture: av.VideoFrame) -> av.VideoFrame:
    """The picture in planes of 8 bits, converted if necessary."""
    if picture.format.name in _YUV and all(plane.line_size > 0 for plane in picture.planes):
        return picture
    if _is_grey(picture):
        return picture if picture.format.name == "gray" else picture.reformat(format="gray")
    return _converted(picture)


def _is_grey(picture: av.VideoFrame) -> bool:
    kind = picture.format
    return not kind.has_palette and sum(not part.is_alpha for part in kind.components) == 1


def _converted(picture: av.VideoFrame) -> av.VideoFrame:
    if picture.format.is_rgb or picture.format.has_palette:
        return picture.reformat(format="yuv420p", dst_colorspace="ITU601", dst_color_range="JPEG")
    return picture.reformat(format="yuv420p")


def _view(plane: VideoPlane) -> Image:
    """(h, w) view of one plane; it keeps the decoder's memory alive."""
    rows = np.ndarray((plane.height, plane.width), np.uint8, memoryview(plane), strides=(plane.line_size, 1))
    rows.flags.writeable = False  # the decoder predicts later pictures from this memory
    return rows


def _thinned(plane: Image, height: int, width: int) -> Image:
    """Every second row or column where the plane has more than (height, width)."""
    return plane[:: 2 if plane.shape[0] > height else 1, :: 2 if plane.shape[1] > width else 1]


def _turned(plane: Image, quarter_turns: int) -> Image:
    """The plane rotated counterclockwise; a copy only if it is rotated."""
    return np.ascontiguousarray(np.rot90(plane, quarter_turns)) if quarter_turns else plane


def matched(frame: Frame, first: Frame) -> Frame:
    """The frame converted to the first one's size, with chroma if the first has it: cameras turn grey at night."""
    if frame.shape == first.shape and (frame.u is None) == (first.u is None):
        return frame
    y = _scaled(frame.y, first.y)
    if first.u is None or first.v is None:
        return replace(frame, y=y, u=None, v=None)
    if frame.u is None or frame.v is None:
        neutral = np.full(first.u.shape, 128, np.uint8)
        return replace(frame, y=y, u=neutral, v=neutral)
    return replace(frame, y=y, u=_scaled(frame.u, first.u), v=_scaled(frame.v, first.v))


def _scaled(plane: Image, like: Image) -> Image:
    height, width = like.shape
    return np.asarray(cv2.resize(plane, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)

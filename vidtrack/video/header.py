"""Container headers beyond FFmpeg's interface: the length that the file should have, and AVI's frame period."""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import BinaryIO

_BOXES = frozenset(b"ftyp styp pdin moov moof mfra mdat free skip wide sidx ssix prft emsg meta uuid".split())
_HEADERS = 1 << 16  # bytes of an AVI file in which its headers are looked for
_EBML, _SEGMENT = b"\x1a\x45\xdf\xa3", b"\x18\x53\x80\x67"


def missing_bytes(path: Path) -> int:
    """Bytes by which an AVI, MP4 or Matroska file is shorter than its outermost chunks state; 0 if whole or unknown.

    These sizes are reliable, because readers depend on them; frame counts are often wrong.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        magic = file.read(8)
        if magic[:4] == b"RIFF":
            end = _riff_end(file, size)
        elif magic[4:] == b"ftyp":
            end = _boxes_end(file, size)
        elif magic[:4] == _EBML:
            end = _segment_end(file)
        else:
            end = 0
    return max(0, end - size)


def avi_period_s(path: Path) -> float | None:
    """Seconds per frame in the main header of an AVI file (dwMicroSecPerFrame of avih); None if there is none."""
    with path.open("rb") as file:
        head = file.read(36)
    if len(head) < 36 or head[:4] != b"RIFF" or head[24:28] != b"avih":
        return None
    return struct.unpack("<I", head[32:])[0] * 1e-6 or None


def avi_states_rate(path: Path) -> bool:
    """Whether an AVI file states a rate; FFmpeg silently assumes one if neither header does."""
    with path.open("rb") as file:
        stream = re.search(rb"strh.{4}vids.{16}(.{4})(.{4})", file.read(_HEADERS), re.DOTALL)
    return avi_period_s(path) is not None or stream is None or all(map(any, stream.groups()))


def _riff_end(file: BinaryIO, size: int) -> int:
    """End of the last RIFF chunk; large AVI files (OpenDML) have several."""
    end = start = 0
    while start < size:
        file.seek(start)
        head = file.read(8)
        if len(head) < 8 or head[:4] != b"RIFF":
            break
        length = struct.unpack("<I", head[4:])[0]
        if length in (0, 0xFFFFFFFF):  # never filled in by the recorder
            break
        end = start + length  # without the 8 bytes of its head: some writers count them in
        start += 8 + length + length % 2
    return end


def _boxes_end(file: BinaryIO, size: int) -> int:
    """End of the last top-level box of an MP4 file (ISO/IEC 14496-12, 4.2); unknown boxes are padding or debris."""
    end = 0
    while end < size:
        file.seek(end)
        head = file.read(16)
        if head[4:8] not in _BOXES:
            break
        length = int.from_bytes(head[:4], "big")
        if length == 1:
            length = int.from_bytes(head[8:], "big")
        if length < 8:  # 0: up to the end of the file
            break
        end += length
    return end


def _segment_end(file: BinaryIO) -> int:
    """End of the segment of a Matroska file (RFC 8794: an EBML head, then the segment); 0 if its size is not stated."""
    end = 0
    for identifier in (_EBML, _SEGMENT):
        file.seek(end)
        if file.read(4) != identifier:
            return 0
        length = _vint(file)
        if length is None:
            return 0
        end = file.tell() + length
    return end


def _vint(file: BinaryIO) -> int | None:
    """A variable-size integer of EBML: as many leading zeros as bytes follow; all ones is "unknown"."""
    first = file.read(1)
    if not first or not first[0]:
        return None
    width = 9 - first[0].bit_length()
    value = int.from_bytes(first + file.read(width - 1), "big") & ((1 << 7 * width) - 1)
    return None if value == (1 << 7 * width) - 1 else value

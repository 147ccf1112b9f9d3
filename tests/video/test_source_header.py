"""How long a container says it is."""

from __future__ import annotations

import struct

import pytest

from vidtrack.video.header import avi_period_s, missing_bytes


def riff(kind: bytes, body: bytes) -> bytes:
    return b"RIFF" + struct.pack("<I", 4 + len(body)) + kind + body


def box(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", 8 + len(body)) + kind + body


def large_box(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", 1) + kind + struct.pack(">Q", 16 + len(body)) + body


EBML = b"\x1a\x45\xdf\xa3\x84abcd"
SEGMENT = b"\x18\x53\x80\x67"
WHOLE = {
    "avi": riff(b"AVI ", bytes(100)),
    "opendml": riff(b"AVI ", bytes(100)) + riff(b"AVIX", bytes(200)),
    "mp4": box(b"ftyp", bytes(8)) + box(b"moov", bytes(50)) + box(b"mdat", bytes(500)),
    "mp4 over 4 GB": box(b"ftyp", bytes(8)) + large_box(b"mdat", bytes(500)),
    "mkv": EBML + SEGMENT + b"\x40\xc8" + bytes(200),
}


@pytest.mark.parametrize("name", WHOLE)
def test_whole_and_cut(tmp_path, name):
    path = tmp_path / "file"
    path.write_bytes(WHOLE[name])
    assert missing_bytes(path) == 0
    path.write_bytes(WHOLE[name] + b"more")
    assert missing_bytes(path) == 0
    path.write_bytes(WHOLE[name][:-60])
    assert 50 <= missing_bytes(path) <= 60


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"RIFF",
        b"RIFF" + bytes(4) + b"AVI " + bytes(50),
        b"RIFF" + b"\xff" * 4 + b"AVI " + bytes(50),
        EBML + SEGMENT + b"\x01" + b"\xff" * 7 + bytes(50),
        EBML + SEGMENT,
        box(b"ftyp", bytes(8)) + bytes(4) + b"mdat" + bytes(50),
        b"GIF89a" + bytes(50),
    ],
)
def test_unstated_length_is_not_missed(tmp_path, data):
    path = tmp_path / "file"
    path.write_bytes(data)
    assert missing_bytes(path) == 0
    assert avi_period_s(path) is None

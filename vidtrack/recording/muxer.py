"""Writes one file of a recording: the packets as received, or the pictures of a raw camera, losslessly coded."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av

from vidtrack.output.ffmpeg_file import FFmpegFile
from vidtrack.video.live.connection import Connection

_CLOCK = Fraction(1, 1000)
_OPTIONS = {"cluster_time_limit": "1000", "flush_packets": "1"}  # a kill loses at most one cluster


class Muxer:
    """Writes the packets of one connection to a Matroska file, in their order and with their times of arrival.

    packets  number of packets written

    The constructor raises OSError or av.FFmpegError. A later write error is kept in `error`.
    """

    def __init__(self, path: Path, connection: Connection) -> None:
        self.packets = 0
        self._file = FFmpegFile(path)
        self._container = av.open(self._file, "w", format="matroska", options=_OPTIONS)
        self._is_raw = connection.is_raw
        self._stream: av.VideoStream | None = None
        if not self._is_raw:
            self._stream = self._container.add_stream_from_template(connection.stream)
        self._began_s: float | None = None
        self._last_ms = -1

    @property
    def error(self) -> OSError | None:
        """The first write error; nothing is written after it."""
        return self._file.error

    @property
    def size(self) -> int:
        """Bytes written."""
        return self._file.size

    def take(self, packet: av.Packet, pictures: list[av.VideoFrame], arrived_s: float) -> None:
        """Append a packet, of a raw camera its pictures; `arrived_s` is a monotonic time [s]."""
        if self._began_s is None:
            self._began_s = arrived_s
        self._last_ms = max(self._last_ms + 1, round((arrived_s - self._began_s) / _CLOCK))
        if self._is_raw:
            for picture in pictures:
                self._encode(picture)
        else:
            ahead = 0  # the coding order may differ from the display order
            if packet.pts is not None and packet.dts is not None and packet.time_base:
                ahead = round((packet.pts - packet.dts) * packet.time_base / _CLOCK)
            packet.stream = self._stream
            packet.time_base = _CLOCK
            packet.dts, packet.pts = self._last_ms, self._last_ms + ahead
            self._container.mux(packet)
        self.packets += 1

    def close(self) -> None:
        """Finish the file."""
        try:
            self._container.close()
        finally:
            self._file.close()

    def _encode(self, picture: av.VideoFrame) -> None:
        stream = self._stream = self._stream or self._lossless(picture)
        picture.pts, picture.time_base = self._last_ms, _CLOCK
        self._container.mux(stream.encode(picture))

    def _lossless(self, picture: av.VideoFrame) -> av.VideoStream:
        stream = self._container.add_stream("ffv1", rate=25)
        stream.width, stream.height, stream.pix_fmt = picture.width, picture.height, picture.format.name
        stream.codec_context.color_range = picture.color_range
        stream.time_base = stream.codec_context.time_base = _CLOCK
        stream.thread_count = 1  # more threads would delay packets
        return stream

"""One connection to a live source: open, read and decode until an error."""

from __future__ import annotations

import ctypes
import errno
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from time import monotonic
from urllib.parse import urlsplit

import av
import av._core
import av.format

from vidtrack.config.names import Decoder
from vidtrack.config.settings import Settings
from vidtrack.errors import SourceError
from vidtrack.video.decoder import accelerator
from vidtrack.video.live.address import Address
from vidtrack.video.planes import planar

_RAW = "rawvideo"
_PROBE_S = 2.0  # FFmpeg's default is up to 5 s; 2 s suffice here
_LARGEST = 1 << 27  # bytes of one allocation of FFmpeg: a plane of 11,000 x 11,000 pixels, or a coded picture


class Refused(SourceError):  # noqa: N818
    """The source refuses permanently: authentication, permission, no video stream."""


class Stalled(SourceError):  # noqa: N818
    """The connection is open and delivers no data."""


class Connection:
    """An open stream.

    fps    nominal frames/s, None if the stream does not state it
    codec  FFmpeg's name of the codec
    is_raw whether packets are uncompressed pictures; the pictures are then planar
    is_intra whether packets are whole compressed pictures, so that any may be left out

    options  NAME=VALUE for FFmpeg; they override those of the address
    decoder  hardware that decodes

    Raises Refused, Stalled or another SourceError if it cannot be opened; messages contain no password.
    """

    def __init__(
        self, address: Address, timeout_s: float, options: Sequence[str] = (), decoder: Decoder = "software"
    ) -> None:
        self._address = address
        self._timeout_s = timeout_s
        self._container = _open(address, timeout_s, options, decoder)
        self.stream = _video_stream(self._container, address)
        self._coder = self.stream.codec_context
        self._coder.thread_type = "SLICE"  # frame threads hold back a picture each
        self._coder.copy_opaque = True
        self.fps = float(self.stream.average_rate or 0) or None
        self.codec = self._coder.name
        self.is_raw = self.codec == _RAW
        self.is_intra = self._coder.codec.intra_only and not self.is_raw
        # Formats without time stamps get invented ones.
        flags = self._container.format.flags
        self._has_stamps = not flags & av.format.Flags.no_timestamps.value  # type: ignore[operator]

    def packets(self) -> Iterator[av.Packet]:
        """Packets of the video. Always ends with an error: Stalled after the time-out, or another SourceError."""
        began = heard = monotonic()
        reason = "the stream ended"
        try:
            for packet in self._container.demux():
                quiet = monotonic() - heard > 0.9 * self._timeout_s
                if quiet:  # these packets come from FFmpeg's buffer
                    break
                if packet.stream is self.stream and packet.size:
                    heard = monotonic()
                    yield packet
        except av.FFmpegError as error:
            reason = _TOO_LARGE if error.errno == errno.ENOMEM else error.strerror or str(error.errno)
        if monotonic() - heard > 0.9 * self._timeout_s:
            raise Stalled(f"{self._address.shown} is connected, but nothing came for {self._timeout_s:g} s")
        raise SourceError(f"lost {self._address.shown} after {monotonic() - began:.1f} s: {reason}")

    def decode(self, packet: av.Packet | None) -> list[av.VideoFrame]:
        """The pictures that a packet completes; None flushes the decoder. Raises av.FFmpegError."""
        pictures = self._coder.decode(packet)
        return [planar(picture) for picture in pictures] if self.is_raw else pictures

    def stamp_s(self, picture: av.VideoFrame) -> float | None:
        """The picture's timestamp, on the camera's clock."""
        return picture.time if self._has_stamps else None

    def start_decoder_anew(self) -> list[av.VideoFrame]:
        """Restart the decoder before the next packet; returns the pictures that it held back."""
        pictures = self.decode(None)
        self._coder.flush_buffers()
        return pictures

    def close(self) -> None:
        """Close the connection."""
        self._container.close()


def connection_to(address: Address, settings: Settings) -> Callable[[], Connection]:
    """Opens a connection as the settings say."""
    live = settings.live
    return partial(Connection, address, live.timeout_s, live.ffmpeg, settings.source.decoder)


_TOO_LARGE = f"a picture larger than {_LARGEST >> 20} MB came; is it a video stream?"


def bound_pictures() -> None:
    """Bound what FFmpeg allocates at once: a picture without an end would take all memory.

    FFmpeg has no option for it. Where its function cannot be called (Windows), nothing is bounded.
    """
    with suppress(OSError, AttributeError):
        ctypes.CDLL(av._core.__file__).av_max_alloc(ctypes.c_size_t(_LARGEST))


def _open(address: Address, timeout_s: float, options: Sequence[str], decoder: Decoder) -> av.container.InputContainer:
    bound_pictures()
    began = monotonic()
    own = dict(option.split("=", 1) for option in options)
    chosen = {"analyzeduration": str(round(_PROBE_S * 1e6)), **address.options, **own}
    try:
        return av.open(
            address.url, format=address.format, options=chosen, timeout=timeout_s, metadata_errors="ignore",
            hwaccel=accelerator(decoder),
        )  # fmt: skip
    except av.FFmpegError as error:
        raise _complaint(address, error, timed_out=monotonic() - began > 0.9 * timeout_s, timeout_s=timeout_s) from None


def _video_stream(container: av.container.InputContainer, address: Address) -> av.VideoStream:
    streams = container.streams.video
    if container.duration and not address.is_device and not container.format.name.startswith("rtsp"):
        container.close()
        raise Refused(f"{address.shown} is a recording, not live; download it and use vidtrack track")
    if not streams or streams[0].codec_context is None:
        container.close()
        raise Refused(f"{address.shown} holds no video that FFmpeg can decode")
    return streams[0]


def _complaint(address: Address, error: av.FFmpegError, timed_out: bool, timeout_s: float) -> SourceError:
    """The error with a helpful message; FFmpeg's message would show the password."""
    start = f"cannot open {address.shown}:"
    if isinstance(error, (av.error.HTTPUnauthorizedError, av.error.HTTPForbiddenError)):
        code = "401" if isinstance(error, av.error.HTTPUnauthorizedError) else "403"
        return Refused(
            f"{start} the camera refuses the user or the password ({code}); "
            "write them as rtsp://USER:PASSWORD@HOST/..., a % in them as %25"
        )
    if isinstance(error, av.error.HTTPNotFoundError):
        return SourceError(f"{start} the camera knows no such path (404)")
    if isinstance(error, PermissionError) and address.is_device:  # a server that is silent may give it as well
        return Refused(f"{start} permission denied; add your user to the group of the device, mostly video")
    if address.is_device:
        return _complaint_of_device(start, error)
    if error.errno == errno.ENOMEM:
        return SourceError(f"{start} {_TOO_LARGE}")
    if timed_out:
        return Stalled(f"{start} no answer in {timeout_s:g} s")
    if isinstance(error, ConnectionRefusedError):
        return SourceError(f"{start} connection refused; is the camera on, and the port right?")
    if isinstance(error, av.error.EOFError):
        return SourceError(f"{start} the camera ends the connection without a picture")
    if error.errno == errno.EIO and not _resolves(address.url):
        return SourceError(f"{start} the host name is unknown")
    if error.errno == errno.EIO or isinstance(error, av.error.InvalidDataError):
        return SourceError(f"{start} what comes is not a video stream")
    return SourceError(f"{start} {error.strerror}")


def _complaint_of_device(start: str, error: av.FFmpegError) -> SourceError:
    """What a camera of this machine says; where another attempt may help, it is not refused."""
    if error.errno == errno.EBUSY:
        return SourceError(f"{start} another program uses it; end that one")
    if error.errno in (errno.ENODEV, errno.ENOENT, errno.ENXIO):
        return SourceError(f"{start} it is not plugged in")
    if error.errno in (errno.EIO, errno.EPROTO, errno.ETIMEDOUT, errno.ENOSPC, errno.EAGAIN):
        return SourceError(f"{start} it fails ({error.strerror}); are its cable and its USB port good enough?")
    if error.errno == errno.EINVAL:
        return Refused(f"{start} it has no such size, rate or format; see live.ffmpeg, and v4l2-ctl --list-formats-ext")
    return Refused(f"{start} it is no camera ({error.strerror})")


def _resolves(url: str) -> bool:
    try:
        return bool(socket.getaddrinfo(urlsplit(url).hostname, None))
    except (OSError, ValueError):
        return False

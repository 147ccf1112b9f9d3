"""Video files through FFmpeg: every picture that can be decoded, with a reliable time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property
from itertools import chain
from math import inf
from pathlib import Path

import av
from av.codec.hwaccel import HWAccel

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import SourceError
from vidtrack.video.clock import FALLBACK_FPS, increasing_times, is_plausible, nominal_rate, stamp_rate
from vidtrack.video.decoder import accelerator
from vidtrack.video.header import avi_period_s, avi_states_rate, missing_bytes
from vidtrack.video.left_out import LeftOut
from vidtrack.video.max_rate import MaxRate
from vidtrack.video.resources import decoders
from vidtrack.video.span import ROUNDING_S
from vidtrack.video.stats import SourceStats

Stamped = tuple[int | None, av.VideoFrame | None]
"""The stamp of a picture, None without one, and the picture, None if it was left out"""
_TEXT_CODECS = frozenset({"ansi", "bintext", "xbin", "idf"})  # FFmpeg draws any .txt file as a terminal would
_RATE_PACKETS, _RATE_BYTES = 64, 32_000_000  # looked at for the rate; raw 4K video reaches the second bound first


class VideoFile:
    """The pictures of a video file in order of presentation; iterate once.

    from_s  s; begin with the key picture before this time, and number the pictures from there

    name, place, fps, frames as for Source. No more than `max_fps` a second come, with the numbers and times that they
    have among all. Damage is counted in `stats`, and reading continues with the next picture that can be decoded.
    Raises SourceError for a file that is not a readable video.
    """

    def __init__(self, path: Path, settings: SourceSettings, stats: SourceStats, from_s: float = 0.0) -> None:
        self._path = self.place = path
        self._settings = settings
        self._stats = stats
        self._from_s = from_s
        self._container = _open(path, accelerator(settings.decoder))
        self._stream = _video_stream(self._container, path)
        self._stream.thread_type = "AUTO"
        self._stream.codec_context.thread_count = decoders(self._stream.width * self._stream.height)
        # AVI stores no presentation times, only the order of decoding: FFmpeg's guess at them jumps to and fro.
        self._is_avi = self._container.format.name == "avi"
        self._packets = self._demuxed()
        self._opening = self._first_packets()
        self._stretch = 1.0
        self.name = path.stem
        self.fps, self._ticks_per_s = self._rate(settings)
        self.frames = self._stream.frames or self._frames_by_duration()
        self._left_out = LeftOut(
            self._stream.codec_context, self._max_rate(), self._ticks_per_s, in_order=not self._is_avi
        )
        if (missing := missing_bytes(path)) > 0:
            stats.mark_truncated(f"{path} is cut short: {missing} bytes are missing at its end")

    def __iter__(self) -> Iterator[tuple[int, float, av.VideoFrame]]:
        begin, pictures = self._from_key() if self._from_s > 0 else (0, self._decoded())
        stamped = ((stamp, (stamp, picture)) for stamp, picture in pictures)
        times = increasing_times(stamped, self._ticks_per_s / self.fps)
        rate = self._max_rate()
        for index, (ticks, (stamp, picture)) in enumerate(times):
            self._left_out.take(stamp, begin + ticks, picture)
            time_s = (begin + ticks) / self._ticks_per_s
            if picture is not None and rate.chooses(time_s):
                yield index, time_s, picture

    def _from_key(self) -> tuple[int, Iterator[Stamped]]:
        """The ticks of the key picture before `from_s`, and the pictures from it on.

        Of no more than `max_fps` it is that before one interval more: those from `from_s` on are then the right ones.
        The whole file where no such place is found: then pictures have no stamps, or there is no index.
        """
        wanted = self._origin + int(max(0.0, self._from_s - self._interval_s) * self._ticks_per_s)
        for place in (wanted, self._origin):
            with suppress(av.FFmpegError):  # no index: reading goes on where it was
                self._container.seek(place, stream=self._stream)
            self._opening, self._packets = [], self._demuxed()
            pictures = self._decoded()
            stamp, picture = next(pictures, (None, None))
            if stamp is not None and stamp <= wanted:
                return stamp - self._origin, chain([(stamp, picture)], pictures)
        raise SourceError(f"no key picture of {self._path} before {self._from_s:g} s is found; it cannot be cut")

    def between(self, begin_s: float, end_s: float, every_s: float = 0.0) -> Iterator[tuple[float, av.VideoFrame]]:
        """(time, picture) of a span of time, decoded from the key frame before it; spans in any order.

        Only pictures that lie `every_s` apart are needed, or those of `max_fps`; those between them are left out where
        that saves decoding. Where pictures have no stamps, or the place in the file is not found, the file is read from
        its beginning. Iterate over the whole file or over spans, not both.
        """
        from_s = max(0.0, begin_s - self._interval_s)
        latest_s = begin_s + 1 / self.fps if self._settings.max_fps is None else from_s + ROUNDING_S
        near = self._after_key_frame(from_s, end_s, every_s)
        first = next(near, None)
        if first is None or first[0] > latest_s:
            again = VideoFile(self._path, self._settings, SourceStats(told=True))
            near = ((time_s, picture) for _, time_s, picture in again)
        else:
            near = chain([first], near)
        rate = self._max_rate()
        for time_s, picture in near:
            if time_s > end_s + ROUNDING_S:
                break
            if rate.chooses(time_s) and time_s >= begin_s - ROUNDING_S:
                yield time_s, picture

    def _after_key_frame(self, begin_s: float, end_s: float, every_s: float) -> Iterator[tuple[float, av.VideoFrame]]:
        """Pictures from the key frame before a time on; it ends at one without a stamp."""
        try:
            self._container.seek(int(self._origin + begin_s * self._ticks_per_s), stream=self._stream)
            packets = self._container.demux(self._stream)
            if every_s and not self._is_avi and self._settings.max_fps is None:
                packets = self._needed(packets, begin_s, end_s, every_s)
            self._left_out.begin(self._origin)
            for packet in packets:
                if self._left_out.skips(packet, self._stamp(packet)):
                    continue
                for picture in self._stream.codec_context.decode(packet):
                    stamp = self._stamp(picture)
                    if stamp is None:
                        return
                    self._left_out.take(stamp, stamp - self._origin, picture)
                    yield self._time_s(stamp), picture
        except av.FFmpegError:  # damaged here, or without an index
            return

    def _needed(
        self, packets: Iterator[av.Packet], begin_s: float, end_s: float, every_s: float
    ) -> Iterator[av.Packet]:
        """The packets; of a span, the decoder drops pictures less than `every_s` apart that no other refers to."""
        span: list[av.Packet] = []
        for packet in packets:
            span.append(packet)
            if packet.pts is None:
                break
            if self._time_s(packet.pts if packet.dts is None else packet.dts) > end_s + ROUNDING_S:
                break
        wanted: set[int] = set()
        next_s = begin_s
        for stamp in sorted(packet.pts for packet in span if packet.pts is not None):
            if self._time_s(stamp) > next_s - ROUNDING_S:
                wanted.add(stamp)
                next_s = self._time_s(stamp) + every_s
        try:
            for packet in span:
                spare = packet.pts is not None and packet.pts not in wanted
                self._stream.codec_context.skip_frame = "NONREF" if spare else "DEFAULT"
                yield packet
        finally:
            self._stream.codec_context.skip_frame = "DEFAULT"
        yield from packets

    def _time_s(self, stamp: int) -> float:
        return (stamp - self._origin) / self._ticks_per_s

    @cached_property
    def _origin(self) -> int:
        """The stamp of time 0."""
        return next((stamp for stamp, _ in self._decoded()), None) or 0

    def _max_rate(self) -> MaxRate:
        return MaxRate(self._settings.looked_at_fps(self.fps), self.fps, since_s=0.0)

    @property
    def _interval_s(self) -> float:
        """Time in which one picture is looked at; 0 if all are."""
        return 0.0 if self._settings.max_fps is None else 1 / self._settings.looked_at_fps(self.fps)

    def close(self) -> None:
        """Close the file; not while another thread iterates."""
        self._container.close()

    def _demuxed(self) -> Iterator[av.Packet | None]:
        """Packets; unreadable parts are skipped. None at the end, to flush the decoder."""
        stuck = False
        while True:
            try:
                for packet in self._container.demux(self._stream):
                    if packet.size:
                        stuck = False
                        yield packet
                break
            except av.FFmpegError as error:
                self._stats.count_error(f"{self._path} is damaged: {error.strerror}")
                if stuck:
                    self._stats.mark_truncated(f"{self._path} cannot be read to its end: {error.strerror}")
                    break
                stuck = True
        yield None

    def _decoded(self) -> Iterator[Stamped]:
        """The pictures, including damaged ones that the decoder concealed, and the places of those that it left out."""
        damaged = partial = False
        for packet in chain(self._opening, self._packets):
            if packet is not None:
                partial = packet.is_corrupt
                if self._left_out.skips(packet, self._stamp(packet)):
                    continue
            try:
                pictures = self._stream.codec_context.decode(packet)
            except av.FFmpegError as error:
                pictures, damaged = [], True
                self._stats.count_error(f"a picture of {self._path} cannot be decoded: {error.strerror}")
            for picture in pictures:
                damaged = picture.is_corrupt
                if damaged:
                    self._stats.count_error(f"a picture of {self._path} is damaged")
                stamp = self._stamp(picture)
                if stamp is not None:
                    yield from self._left_out_before(stamp)
                yield stamp, picture
        yield from self._left_out_before(inf)
        if damaged or partial:
            self._stats.mark_truncated(f"the end of {self._path} cannot be decoded")

    def _left_out_before(self, stamp: float) -> Iterator[Stamped]:
        return ((left_out, None) for left_out in self._left_out.before(stamp))

    @property
    def duration_s(self) -> float | None:
        """Length that the file states, in the times of its pictures [s]."""
        return self._stretch * self._container.duration / av.time_base if self._container.duration else None

    def _first_packets(self) -> list[av.Packet | None]:
        """Enough packets to measure the rate; they are decoded later."""
        packets: list[av.Packet | None] = []
        size = 0
        for packet in self._packets:
            packets.append(packet)
            size += packet.size if packet else 0
            if len(packets) == _RATE_PACKETS or size > _RATE_BYTES:
                break
        return packets

    def _rate(self, settings: SourceSettings) -> tuple[float, float]:
        """Nominal frames/s, and the timestamps' ticks per second.

        If the user states the rate, or the stamps' rate is implausible, the ticks are rescaled to the nominal rate;
        gaps remain.
        """
        ticks_per_s = float(1 / self._stream.time_base) if self._stream.time_base else 1.0
        stamps = [self._stamp(packet) for packet in self._opening if packet is not None]
        rate = stamp_rate([stamp for stamp in stamps if stamp is not None])
        measured = None if rate is None else rate * ticks_per_s
        is_stated = not self._is_avi or avi_states_rate(self._path)
        header = float(self._stream.average_rate or 0) if is_stated else 0.0
        self._stats.header_fps = header or None
        fps = settings.fps or (nominal_rate(header, measured) if is_stated else None) or self._rate_by_main_header()
        if measured is not None and (settings.fps is not None or not is_plausible(measured)):
            self._stretch = measured / fps
            ticks_per_s /= self._stretch
        return fps, ticks_per_s

    def _rate_by_main_header(self) -> float:
        """The rate in the main header of an AVI file, which states its rate twice; else assumed with a warning."""
        period_s = avi_period_s(self._path)
        if period_s is not None and is_plausible(1 / period_s):
            return 1 / period_s
        self._stats.fps_assumed = True
        self._stats.warn(
            f"{self._path} states no rate a camera can have; {FALLBACK_FPS:g} frames/s assumed, "
            "state the true rate with --fps"
        )
        return FALLBACK_FPS

    def _stamp(self, coded: av.Packet | av.VideoFrame) -> int | None:
        return coded.dts if self._is_avi else coded.pts

    def _frames_by_duration(self) -> int | None:
        return round(self.duration_s * self.fps) if self.duration_s else None


def _open(path: Path, hardware: HWAccel | None) -> av.container.InputContainer:
    if not path.is_file():
        raise SourceError(f"cannot open {path}: it is neither a file nor a folder")
    if path.stat().st_size == 0:
        raise SourceError(f"cannot open {path}: the file is empty (0 bytes)")
    try:
        # "file:" keeps a colon in the name from being taken for a protocol; old recorders write names in any encoding
        return av.open(f"file:{path}", metadata_errors="ignore", hwaccel=hardware)
    except av.FFmpegError as error:
        missing = missing_bytes(path)
        cut = f"; it is cut short, {missing} bytes are missing at its end" if missing else ""
        raise SourceError(f"cannot open {path} as a video: {error.strerror}{cut}") from None


def _video_stream(container: av.container.InputContainer, path: Path) -> av.VideoStream:
    """The first video stream; the cover picture of an audio file does not count."""
    streams = [s for s in container.streams.video if not s.disposition & av.stream.Disposition.attached_pic]
    if not streams:
        kinds = ", ".join(sorted({stream.type for stream in container.streams} - {"video"})) or "still pictures"
        raise SourceError(f"no video in {path}: it holds only {kinds}")
    if streams[0].codec_context is None:
        raise SourceError(f"cannot decode {path}: its codec is unknown to FFmpeg {streams[0]}; convert it to H.264")
    if streams[0].codec_context.name in _TEXT_CODECS:
        raise SourceError(f"cannot open {path}: it is a text file, not a video")
    return streams[0]

"""Pictures of a video file that are not even decoded, since more come in a second than the user wants."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from heapq import heappop, heappush
from math import inf

import av

from vidtrack.video.max_rate import MaxRate

_ALONE = frozenset({"mjpeg", "jpeg2000", "prores"})  # codecs whose pictures refer to no other one
_REORDERED = 16  # H.264 moves pictures by at most so many
_START = b"\0\0\1"  # of each unit of an H.264 stream, where its length is not written before it


class LeftOut:
    """Decides which pictures are not decoded, and knows their places among those that are.

    A picture is spare if another one comes before it in the same interval of the `rate`. Where pictures stand alone, as
    in MJPEG, all spare ones are left out, and of H.264 those to which no other one refers. Nothing is left out while
    the stamp of time 0 is not known, and from where stamps go back, times are not those of the stamps, or pictures come
    in fields.

    ticks_per_s  of the stamps
    in_order     whether stamps are times of presentation, not of decoding
    """

    def __init__(self, context: av.VideoCodecContext, rate: MaxRate, ticks_per_s: float, *, in_order: bool) -> None:
        self._rate, self._ticks_per_s = rate, ticks_per_s
        self._alone = context.name in _ALONE
        self._size_bytes = _size_bytes(context.extradata)
        self._may = not rate.chooses_all and (self._alone or (in_order and context.name == "h264"))
        self._zero: float | None = None  # stamp of time 0
        self._seen: deque[tuple[int, int]] = deque(maxlen=_REORDERED + 1)  # (stamp, interval) of the last packets
        self._stamps: list[int] = []  # of pictures that are left out; a heap
        self._last = -inf  # stamp of the last picture that was decoded

    def begin(self, zero: float) -> None:
        """Reading begins somewhere; `zero` is the stamp of time 0."""
        self._zero, self._last = zero, -inf
        self._seen.clear()
        self._stamps.clear()

    def take(self, stamp: int | None, ticks: float, picture: av.VideoFrame | None) -> None:
        """A picture with this stamp got this time [ticks]; None: it was left out."""
        zero = None if stamp is None else stamp - ticks
        if self._zero is None and zero is not None:
            self.begin(zero)
        elif zero != self._zero or (picture is not None and picture.interlaced_frame):
            self._may = False

    def skips(self, packet: av.Packet, stamp: int | None) -> bool:
        """Whether the packet is not decoded."""
        if not self._may or self._zero is None or stamp is None or packet.is_corrupt or packet.is_discard:
            return False
        if len(self._seen) == self._seen.maxlen and stamp <= min(self._seen)[0]:
            self._may = False
            return False
        if not self._is_spare(stamp, self._zero) or not (self._alone or _is_disposable(packet, self._size_bytes)):
            return False
        heappush(self._stamps, stamp)
        return True

    def before(self, stamp: float) -> Iterator[int]:
        """The stamps of the pictures that were left out before the one of this stamp, which was decoded."""
        bound = inf if stamp < self._last and not self._may else stamp  # inf: a part of a joined file is over
        self._last = stamp
        while self._stamps and self._stamps[0] < bound:
            yield heappop(self._stamps)

    def _is_spare(self, stamp: int, zero: float) -> bool:
        interval = self._rate.interval((stamp - zero) / self._ticks_per_s)
        spare = any(seen < stamp and of == interval for seen, of in self._seen)
        self._seen.append((stamp, interval))
        return spare


def _size_bytes(extradata: bytes | None) -> int:
    """In how many bytes the length of a unit of H.264 is written before it; 0: it begins after a start code."""
    return (extradata[4] & 3) + 1 if extradata and extradata[0] == 1 else 0


def _is_disposable(packet: av.Packet, size_bytes: int) -> bool:
    """Whether no other picture of H.264 refers to this one: nal_ref_idc of its slices is 0 (ITU-T H.264, 7.4.1)."""
    for head in _heads(bytes(packet), size_bytes):
        if 1 <= head & 0x1F <= 5:  # a slice
            return not head & 0x60
    return False


def _heads(data: bytes, size_bytes: int) -> Iterator[int]:
    """The first byte of each unit of H.264."""
    end = 0
    while end < len(data):
        if size_bytes:
            begin = end + size_bytes
            end = begin + int.from_bytes(data[end:begin], "big")
        else:
            found = data.find(_START, end)
            begin = end = len(data) if found < 0 else found + len(_START)
        yield from data[begin : begin + 1]

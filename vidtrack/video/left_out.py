"""Pictures of a video file that are not even decoded, since more come in a second than the user wants."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from heapq import heappop, heappush

import av

from vidtrack.video.max_rate import MaxRate

_REORDERED = 16  # H.264 moves pictures by at most so many


class LeftOut:
    """Decides which pictures the decoder leaves out, and knows their places among those that it decodes.

    A picture is spare if another one comes before it in the same interval of the `rate`. Where all pictures stand alone
    no spare one is decoded; of H.264 those are to which others refer. Nothing is left out while the stamp of time 0 is
    not known, where times are not those of the stamps, of pictures in fields, and by hardware.

    ticks_per_s  of the stamps
    in_order     whether stamps are times of presentation, not of decoding
    """

    def __init__(self, context: av.VideoCodecContext, rate: MaxRate, ticks_per_s: float, *, in_order: bool) -> None:
        self._context, self._rate, self._ticks_per_s = context, rate, ticks_per_s
        self._alone = context.codec.intra_only
        skippable = in_order and context.name == "h264" and not context.is_hwaccel
        self._may = (self._alone or skippable) and not rate.chooses_all
        self._zero: float | None = None  # stamp of time 0
        self._seen: deque[tuple[int, int]] = deque(maxlen=_REORDERED + 1)  # (stamp, interval) of the last packets
        self._stamps: list[int] = []  # of pictures that are left out; a heap

    def begin(self, zero: float) -> None:
        """Reading begins somewhere; `zero` is the stamp of time 0."""
        self._zero = zero
        self._seen.clear()
        self._stamps.clear()

    def take(self, stamp: int | None, ticks: float, picture: av.VideoFrame | None) -> None:
        """A picture with this stamp got this time [ticks]; None: it was left out."""
        zero = None if stamp is None else stamp - ticks
        if self._zero is None and zero is not None:
            self.begin(zero)
        elif zero != self._zero or (picture is not None and picture.interlaced_frame):
            self._stop()

    def skips(self, packet: av.Packet, stamp: int | None) -> bool:
        """Whether the packet is not decoded; if it is, the decoder knows whether it may skip its picture."""
        if not self._may or self._zero is None:
            return False
        spare = stamp is not None and not packet.is_corrupt and self._is_spare(stamp, self._zero)
        if stamp is not None and spare:
            heappush(self._stamps, stamp)
        if not self._alone:
            self._context.skip_frame = "NONREF" if spare else "DEFAULT"
        return spare and self._alone

    def before(self, stamp: float) -> Iterator[int]:
        """The stamps of the pictures that were left out before the one of this stamp, which was decoded."""
        while self._stamps and self._stamps[0] <= stamp:
            left_out = heappop(self._stamps)
            if left_out < stamp:
                yield left_out

    def _is_spare(self, stamp: int, zero: float) -> bool:
        interval = self._rate.interval((stamp - zero) / self._ticks_per_s)
        spare = any(seen < stamp and of == interval for seen, of in self._seen)
        self._seen.append((stamp, interval))
        return spare

    def _stop(self) -> None:
        """Decode all from now on."""
        if self._may and not self._alone:
            self._context.skip_frame = "DEFAULT"
        self._may = False

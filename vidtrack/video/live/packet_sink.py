"""The interface of a recorder for a reader's packets, and the null recorder."""

from __future__ import annotations

from typing import Protocol

import av

from vidtrack.video.live.connection import Connection

Place = tuple[int, int]
"""Index of a part of a recording, and of a packet in it."""


class PacketSink(Protocol):
    """Records received packets, in parts that can be decoded separately."""

    def cut(self, connection: Connection, packet: av.Packet) -> bool:
        """Begin a new part with this packet if it is due; returns whether, because the decoder must then restart."""

    def place(self) -> Place:
        """The place of the next packet."""

    def take(self, packet: av.Packet, pictures: list[av.VideoFrame], arrived_s: float) -> None:
        """Record a packet, or the pictures of an uncompressed camera."""

    def end_part(self) -> None:
        """End the part after a lost connection; the next packet begins a new one."""


class NoPacketSink:
    """Records nothing."""

    def cut(self, connection: Connection, packet: av.Packet) -> bool:
        """Never."""
        return False

    def place(self) -> Place:
        """Nowhere."""
        return 0, 0

    def take(self, packet: av.Packet, pictures: list[av.VideoFrame], arrived_s: float) -> None:
        """Discard the packet."""

    def end_part(self) -> None:
        """Do nothing."""

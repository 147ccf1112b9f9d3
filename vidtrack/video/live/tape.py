"""What a reader offers its packets to: a recording, or nothing."""

from __future__ import annotations

from typing import Protocol

import av

from vidtrack.video.live.connection import Connection

Place = tuple[int, int]
"""Number of a recording's part, and of a packet in it."""


class Tape(Protocol):
    """Takes packets as they are received, in parts that can be decoded by themselves."""

    def cut(self, connection: Connection, packet: av.Packet) -> bool:
        """Begin a new part with this packet if it is time; then the decoder has to start anew as well."""

    def place(self) -> Place:
        """Where the next packet goes."""

    def take(self, packet: av.Packet, pictures: list[av.VideoFrame], arrived_s: float) -> None:
        """Keep a packet, or of a raw camera its pictures."""

    def hang_up(self) -> None:
        """The connection is gone; the next packet begins a new part."""


class NoTape:
    """Keeps nothing."""

    def cut(self, connection: Connection, packet: av.Packet) -> bool:
        """Never."""
        return False

    def place(self) -> Place:
        """Nowhere."""
        return 0, 0

    def take(self, packet: av.Packet, pictures: list[av.VideoFrame], arrived_s: float) -> None:
        """Forget it."""

    def hang_up(self) -> None:
        """There is nothing to end."""

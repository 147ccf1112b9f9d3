"""Datagrams from the network, unicast or multicast."""

from __future__ import annotations

import select
import socket
import struct
from ipaddress import AddressValueError, IPv4Address
from types import TracebackType
from urllib.parse import parse_qs, urlsplit

from vidtrack.errors import ConfigError, SourceError

_BUFFER = 1 << 22
"""Octets that the system keeps while scans are tracked."""
_LONGEST = 65536
_AT_ONCE = 10_000
"""Datagrams taken in one go."""


def is_address(source: str) -> bool:
    """Whether a source is the address of a feed on the network."""
    return source.startswith("udp://")


class UdpFeed:
    """Receives datagrams at udp://ADDRESS:PORT; a group is joined, at the interface of ?interface=ADDRESS if given.

    Raises ConfigError for a wrong address, SourceError if it cannot listen there.
    """

    def __init__(self, address: str) -> None:
        host, port, interface = _parsed(address)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
            self._socket.bind((str(host), port))
            if host.is_multicast:
                group = struct.pack("4s4s", host.packed, interface.packed)
                self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
        except OSError as error:
            self._socket.close()
            raise SourceError(f"cannot listen at {address}: {error.strerror or error}") from None
        self._socket.setblocking(False)

    def poll(self, wait_s: float) -> list[bytes]:
        """The datagrams that have come; waits up to wait_s for the first."""
        found: list[bytes] = []
        if select.select([self._socket], [], [], wait_s)[0]:
            try:
                while len(found) < _AT_ONCE:
                    found.append(self._socket.recv(_LONGEST))
            except BlockingIOError:
                pass
        return found

    def __enter__(self) -> UdpFeed:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()


def _parsed(address: str) -> tuple[IPv4Address, int, IPv4Address]:
    """Host, port and interface. Raises ConfigError."""
    try:
        parts = urlsplit(address)
        options = parse_qs(parts.query, strict_parsing=bool(parts.query))
        interface = IPv4Address(options.pop("interface", ["0.0.0.0"])[0])
        if parts.port is None or parts.port == 0 or parts.path or options:
            raise ValueError
        return IPv4Address(parts.hostname or "0.0.0.0"), parts.port, interface
    except (ValueError, AddressValueError):
        raise ConfigError(
            f"{address} is not udp://ADDRESS:PORT with an IPv4 address, such as udp://239.1.2.3:8600, "
            "or udp://239.1.2.3:8600?interface=192.168.1.5"
        ) from None

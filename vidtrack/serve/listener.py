"""The listening socket of the page."""

from __future__ import annotations

import os
import re
import socket
from ipaddress import ip_address

from vidtrack.errors import ConfigError

LOOPBACK = "127.0.0.1"
_GONE_S = 20.0  # the system disconnects a client that receives nothing for this time
_PLACE = re.compile(r"(?:(?P<host>[^\[\]:]+|\[[^\[\]]+\]):)?(?P<port>\d{1,5})")


def listen(place: str, token: str | None, option: str = "--http") -> socket.socket:
    """A listening socket at "[HOST:]PORT", on loopback without a host; port 0 is any free port.

    option  of the command that gave the place, for messages
    Raises ConfigError if the place is malformed, is open to other machines without a token, or is not free.
    """
    host, port = _host_and_port(place, option)
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE | socket.AI_ADDRCONFIG
        )[0]
        if not token and not ip_address(str(address[0]).partition("%")[0]).is_loopback:
            raise ConfigError(
                f"{option} {place}: other machines could see this page; protect it by --http-token or VIDTRACK_TOKEN"
            )
        listener = socket.create_server(address, family=family)
    except OSError as error:
        raise ConfigError(f"{option} {place}: {_why(error)}; give another host or port") from None
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if hasattr(socket, "TCP_USER_TIMEOUT"):  # Linux; accepted sockets inherit both options
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, round(1000 * _GONE_S))
    return listener


def url_of(listener: socket.socket) -> str:
    """The page's address; with the name of this machine if it listens on all its addresses."""
    host, port = listener.getsockname()[:2]
    if ip_address(host.partition("%")[0]).is_unspecified:
        host = socket.gethostname()
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def _host_and_port(place: str, option: str) -> tuple[str, int]:
    match = _PLACE.fullmatch(place)
    if match is None or int(match["port"]) > 65535:
        raise ConfigError(f"{option} {place!r}: write it as PORT or HOST:PORT, for example 8080 or 0.0.0.0:8080")
    return (match["host"] or LOOPBACK).strip("[]"), int(match["port"])


def _why(error: OSError) -> str:
    if isinstance(error, socket.gaierror):
        return "the host name is unknown"
    return os.strerror(error.errno or 0).lower()

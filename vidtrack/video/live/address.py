"""Addresses of live sources: parsing for FFmpeg, and redaction of credentials."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote, urlsplit

from vidtrack.errors import SourceError

HIDDEN = "***"
_SCHEMES = ("rtsp", "rtsps", "http", "https")
_MAY_STAY = "%:@!$&'()*+,;=~"  # in user and password
_USER = re.compile(r"://([^/?#]*@|[^/?#@:]*:(?!\d*(?:[/?#]|$)).*@)")
_SECRET_FIELD = re.compile(r"([?&;](?:pass\w*|pwd|user\w*|usr|auth\w*|token|\w*key|secret|sig\w*)=)[^&;#\s]*", re.I)


@dataclass(frozen=True, slots=True)
class Address:
    """The address of a live source.

    url      for FFmpeg; it may contain a password and is left out of the repr
    shown    the address without credentials, for logs, errors, results
    name     default name of the run
    format   FFmpeg's input format; None: FFmpeg decides by the address
    options  FFmpeg's options for opening it
    """

    url: str = field(repr=False)
    shown: str
    name: str
    format: str | None = None
    options: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_device(self) -> bool:
        """Whether this is a camera of this machine."""
        return self.format == "v4l2"


def parse_address(source: str, timeout_s: float) -> Address:
    """A camera index, a V4L2 device, or an rtsp://, rtsps://, http://, https:// address.

    timeout_s  of FFmpeg's sockets, in addition to the reader's

    Raises SourceError for anything else.
    """
    if source.isdecimal():
        source = f"/dev/video{int(source)}"
    shown = redact(source)
    scheme, separator, _ = source.partition("://")
    if not separator:
        return _device(Path(source))
    if scheme not in _SCHEMES:
        raise SourceError(f"cannot read {shown}: {scheme}:// is not supported; use {', '.join(_SCHEMES)}, or a camera")
    microseconds = str(round(timeout_s * 1e6))
    options = {"rw_timeout": microseconds}
    if scheme.startswith("rtsp"):
        # TCP: lost UDP packets become grey smears that look like vehicles.
        options = {"rtsp_transport": "tcp", "timeout": microseconds, "allowed_media_types": "video"}
    url = _escaped(source)
    return Address(url, shown, _host(url, shown), None, options)


def redact(address: str) -> str:
    """The address without user name, password or secret query fields.

    A password may contain unescaped "@", "/" or "?", so in doubt more is hidden.
    """
    if _USER.search(address):
        address = re.sub("://.*@", f"://{HIDDEN}@", address)
    return _SECRET_FIELD.sub(rf"\1{HIDDEN}", address)


def _host(url: str, shown: str) -> str:
    """Host and port. Raises SourceError if they are missing or invalid."""
    try:
        parts, visible = urlsplit(url), urlsplit(shown)
        named = parts.hostname and parts.port != 0
    except ValueError:  # the port is no number below 65536, or a bracket is missing
        named = False
    if not named:
        raise SourceError(f"cannot read {shown}: it names no host, or no such port; write it as rtsp://HOST:PORT/PATH")
    return visible.netloc.rpartition("@")[2] or visible.scheme


def _escaped(address: str) -> str:
    """The address with "/", "?" and "#" in the password escaped for FFmpeg."""
    return _USER.sub(lambda found: "://" + quote(found[1], safe=_MAY_STAY), address, count=1)


def secrets(address: str) -> list[str]:
    """The parts of the address that `redact` hides."""
    return [text for text in _between(address, redact(address)) if text]


def _between(whole: str, shown: str) -> list[str]:
    pattern = "(.*)".join(re.escape(part) for part in shown.split(HIDDEN))
    match = re.fullmatch(pattern, whole)
    return list(match.groups()) if match else []


def _device(path: Path) -> Address:
    if path.is_file() or path.is_dir():
        raise SourceError(f"{path} is no camera; if it holds pictures, read it with vidtrack track")
    if not path.exists():
        raise SourceError(
            f"no such device {path}; give a camera index, a device such as /dev/video0, or an rtsp:// or http:// stream"
        )
    return Address(str(path), str(path), path.name, "v4l2")

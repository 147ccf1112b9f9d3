"""Addresses of receivers of events: a broker of MQTT, a server that takes webhooks."""

from __future__ import annotations

from dataclasses import dataclass, field
from urllib.parse import SplitResult, quote, unquote, urlsplit

from vidtrack.errors import ConfigError
from vidtrack.video.live.address import HIDDEN, redact, secrets

_MQTT = {"mqtt": 1883, "mqtts": 8883}
_WEB = {"http": 80, "https": 443}
_PREFIX = "vidtrack"


@dataclass(frozen=True, slots=True)
class Broker:
    """A broker of MQTT.

    shown     the address without user and password
    prefix    first part of all topics
    tls       whether the connection is encrypted
    """

    shown: str
    host: str
    port: int
    tls: bool
    prefix: str
    user: str | None = field(default=None, repr=False)
    password: str | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True)
class Hook:
    """A server that takes webhooks.

    shown   the address without anything after the host, since what follows often is a secret
    path    with the query
    """

    shown: str
    host: str
    port: int
    tls: bool
    path: str = field(repr=False)
    user: str | None = field(default=None, repr=False)
    password: str | None = field(default=None, repr=False)


def parse_broker(address: str) -> Broker:
    """The broker of mqtt[s]://[USER:PASSWORD@]HOST[:PORT][/PREFIX]. Raises ConfigError.

    A password may contain any characters; % is written as %25.
    """
    shown = redact(address) if "://" in address else HIDDEN
    scheme, mark, rest = address.partition("://")
    login, at, place = rest.rpartition("@")
    user, colon, password = login.partition(":")
    whole = f"{scheme}{mark}{quote(user, safe='%')}{colon}{quote(password, safe='%')}{at}{place}"
    parts = _split(whole, shown, _MQTT, "mqtt://USER:PASSWORD@HOST/PREFIX or mqtts://...")
    prefix = unquote(parts.path).strip("/") or _PREFIX
    if parts.query or parts.fragment or set(prefix) & set("+#\0"):
        raise ConfigError(f"--mqtt {shown}: the path is the first part of the topics and may not contain ? # +")
    return Broker(
        shown, parts.hostname or "", parts.port or _MQTT[parts.scheme], parts.scheme == "mqtts", prefix, *_login(parts)
    )


def parse_hook(address: str) -> Hook:
    """The server of http[s]://[USER:PASSWORD@]HOST[:PORT]/PATH. Raises ConfigError."""
    parts = _split(address, f"{address.partition('://')[0]}://{HIDDEN}", _WEB, "https://HOST/PATH")
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    tls = parts.scheme == "https"
    place = parts.netloc.rpartition("@")[2]
    shown = f"{parts.scheme}://{place}/{HIDDEN}"
    return Hook(shown, parts.hostname or "", parts.port or _WEB[parts.scheme], tls, path, *_login(parts))


def secret_parts(mqtt: str | None, webhook: str | None) -> list[str]:
    """The parts of both addresses that nobody may see."""
    found = [] if mqtt is None else secrets(mqtt)
    if webhook is not None:
        login, _, place = webhook.partition("://")[2].rpartition("@")
        found += [login, place.partition("/")[2]]
    return [text for text in found if text]


def _split(address: str, shown: str, ports: dict[str, int], example: str) -> SplitResult:
    option = "--mqtt" if ports is _MQTT else "--webhook"
    try:
        parts = urlsplit(address)
        good = parts.scheme in ports and parts.hostname and parts.port != 0
    except ValueError:  # the port is no number below 65536, or a bracket is missing
        good = False
    if not good:
        raise ConfigError(f"{option} {shown}: write it as {example}")
    return parts


def _login(parts: SplitResult) -> tuple[str | None, str | None]:
    return parts.username and unquote(parts.username), parts.password and unquote(parts.password)

"""NMEA 0183 sentences become messages: the targets of a ship's radar (TTM, TLL) and AIS positions (VDM, VDO).

TTM is read by range and bearing from the own ship, TLL and AIS by latitude and longitude. AIS is decoded by pyais.
IEC 61162-1; ITU-R M.1371.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from functools import cache, reduce
from typing import Any

from vidtrack.errors import ConfigError
from vidtrack.radar.feeds.asterix import NAUTICAL_MILE
from vidtrack.radar.feeds.clock import DAY_S
from vidtrack.radar.feeds.messages import NAN, Kind, Losses, Message

_SENTENCE = re.compile(rb"[$!][A-Z]{2}[A-Z0-9]{3},[^\r\n]{0,1000}")
_PROPRIETARY = re.compile(rb"[$!]P[A-Z0-9]+,")
_TORN = re.compile(rb"[$!]|\*[0-9A-Fa-f]{2}\s*$|[^\t\x20-\x7e]")
"""What makes a line without a sentence a damaged one: a begin, a checksum, or what is not text."""
_STAMP = re.compile(rb"\\[^\\\r\n]*?\bc:(\d{9,13})[^\\\r\n]*\\")
_METRES = {b"K": 1000.0, b"N": NAUTICAL_MILE, b"S": 1609.344}
_FARTHEST_LATITUDE, _FARTHEST_LONGITUDE = 90.0, 180.0
_POSITIONS = (1, 2, 3, 9, 18)
"""Types of AIS messages with a position, all of one sentence."""
_MILLISECONDS = 1e11
"""Time stamps from here on are in milliseconds."""
_LONGEST = 160
"""Octets of a line: a sentence has at most 80 characters, and the block of tags before it as many."""


def looks_like(content: bytes) -> bool:
    """Whether most of it, by octets, is lines with a sentence whose checksum is not wrong, or a proprietary one.

    NULs, with which recorders fill their files, do not count, nor do the octets of a line beyond the longest.
    """
    sound = total = 0
    for line in content.splitlines():
        octets = min(len(line) - line.count(b"\0"), _LONGEST)
        found = _SENTENCE.search(line)
        total += octets
        sound += octets if (found and _is_sound(found.group())) or _PROPRIETARY.search(line) else 0
    return 2 * sound > total


def _is_sound(sentence: bytes) -> bool:
    """Whether the checksum is right, if there is one."""
    body, star, checksum = sentence[1:].partition(b"*")
    return not star or checksum[:2].upper() == b"%02X" % reduce(lambda sum_, octet: sum_ ^ octet, body, 0)


def _is_damaged(line: bytes) -> bool:
    """Whether a line without a sentence was one; a comment or what a recorder wrote between them was not."""
    return not line.startswith(b"#") and bool(_TORN.search(line)) and not _PROPRIETARY.search(line)


class Decoder:
    """Turns text into messages, and counts lines that are damaged in `losses`.

    It remembers the own ship's clock and heading for sentences that need them.
    """

    def __init__(self, losses: Losses) -> None:
        self.losses = losses
        self._clock_s = NAN
        self._heading = NAN
        self._readers: dict[bytes, Callable[[list[bytes]], Message | None]] = {b"TTM": self._ttm, b"TLL": self._tll}

    def messages(self, payload: bytes) -> Iterator[Message]:
        """The messages of whole lines."""
        for line in payload.splitlines():
            found = _SENTENCE.search(line)
            if found is None:
                self.losses.damaged += _is_damaged(line)
                continue
            stamp = _STAMP.search(line)
            try:
                message = self._message(found.group(), stamp and int(stamp.group(1)))
            except (ValueError, IndexError, KeyError):
                self.losses.damaged += 1
                continue
            if message is not None:
                yield message

    def _message(self, sentence: bytes, stamp: int | None) -> Message | None:
        """The message of a sentence; None for one of another kind. Raises ValueError for a damaged one."""
        if not _is_sound(sentence):
            raise ValueError
        if stamp is not None:
            self._clock_s = (stamp / 1000 if stamp >= _MILLISECONDS else stamp) % DAY_S
        fields = sentence[1:].partition(b"*")[0].split(b",")
        kind = fields[0][2:]
        if kind in (b"VDM", b"VDO"):
            return self._ais(sentence, fields, stamped=stamp is not None)
        if kind in (b"RMC", b"GGA", b"ZDA"):
            self._clock_s = _time_of_day(fields[1]) if fields[1] else self._clock_s
        elif kind == b"HDT":
            self._heading = math.radians(_number(fields[1]))
        reader = self._readers.get(kind)
        return reader(fields) if reader else None

    def _ttm(self, fields: list[bytes]) -> Message | None:
        """A tracked target; None for one that is lost."""
        if fields[12] == b"L":
            return None
        azimuth = math.radians(_number(fields[3]))
        if fields[4] == b"R":
            azimuth += self._heading
        if not math.isfinite(azimuth):
            raise ValueError
        distance = _number(fields[2]) * _METRES[fields[10] or b"N"]
        clock_s = _time_of_day(fields[14]) if len(fields) > 14 and fields[14] else self._clock_s
        return Message(Kind.POLAR, 0, 0, clock_s, distance, azimuth, target=_number(fields[1]))

    def _tll(self, fields: list[bytes]) -> Message | None:
        if len(fields) > 8 and fields[8] == b"L":
            return None
        latitude = _degrees(fields[2], 2) * {b"N": 1, b"S": -1}[fields[3]]
        longitude = _degrees(fields[4], 3) * {b"E": 1, b"W": -1}[fields[5]]
        clock_s = _time_of_day(fields[7]) if fields[7] else self._clock_s
        return _position(clock_s, latitude, longitude, _number(fields[1]))

    def _ais(self, sentence: bytes, fields: list[bytes], *, stamped: bool) -> Message | None:
        """A ship's position; None for another message. Without a time stamp only the second of the minute is known."""
        if fields[1] != b"1":
            return None
        found = ais_library().decode(sentence)
        if found.msg_type not in _POSITIONS:
            return None
        if not stamped and found.second < 60:
            now = 0.0 if math.isnan(self._clock_s) else self._clock_s
            since = found.second - now
            self._clock_s = (now + since - 60 * round(since / 60)) % DAY_S
        if abs(found.lat) > _FARTHEST_LATITUDE or abs(found.lon) > _FARTHEST_LONGITUDE:
            return None  # not available
        return _position(self._clock_s, float(found.lat), float(found.lon), float(found.mmsi))


@cache
def ais_library() -> Any:
    """The module pyais, whose errors are values that are wrong. Raises ConfigError if it is not installed."""
    try:
        import pyais
        import pyais.exceptions
    except ImportError:
        raise ConfigError("AIS needs the package pyais: pip install 'vidtrack[ais]'") from None
    return _Ais(pyais.decode, pyais.exceptions.AISBaseException)


class _Ais:
    """pyais, with ValueError for what it cannot decode."""

    def __init__(self, decode: Callable[[bytes], Any], refused: type[Exception]) -> None:
        self._decode, self._refused = decode, refused

    def decode(self, sentence: bytes) -> Any:
        """The message of a sentence. Raises ValueError."""
        try:
            return self._decode(sentence)
        except self._refused as error:
            raise ValueError(str(error)) from None


def _position(clock_s: float, latitude: float, longitude: float, target: float) -> Message:
    if abs(latitude) > _FARTHEST_LATITUDE or abs(longitude) > _FARTHEST_LONGITUDE:
        raise ValueError
    return Message(Kind.GEODETIC, 0, 0, clock_s, latitude, longitude, target=target)


def _number(text: bytes) -> float:
    """A finite number of at most 1e9. Raises ValueError."""
    value = float(text)
    if not abs(value) < 1e9:
        raise ValueError
    return value


def _time_of_day(text: bytes) -> float:
    """hhmmss.ss in seconds."""
    hours, minutes, seconds = int(text[:2]), int(text[2:4]), _number(text[4:])
    if not (0 <= hours < 24 and 0 <= minutes < 60 and 0 <= seconds < 61):
        raise ValueError
    return 3600 * hours + 60 * minutes + seconds


def _degrees(text: bytes, digits: int) -> float:
    """ddmm.mm or dddmm.mm in degrees."""
    return int(text[:digits]) + _number(text[digits:]) / 60

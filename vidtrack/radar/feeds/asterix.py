"""ASTERIX records of radars, trackers and ADS-B become messages.

Read are CAT 001 and 048 (target reports), 002 and 034 (service messages of the antenna), 021 (ADS-B) and 062 (system
tracks), each by the newest edition, whose items in use are those of the older ones. EUROCONTROL, "Surveillance Data
Exchange", parts 2a, 2b, 4, 9, 12.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import pi

from vidtrack.radar.feeds.layout import Damaged, Layout, Truncated, layouts
from vidtrack.radar.feeds.messages import NAN, Kind, Losses, Message

NAUTICAL_MILE = 1852.0
FEET = 0.3048
READ = (1, 2, 21, 34, 48, 62)
BESIDE = (8, 10, 11, 19, 20, 23, 63, 65)
"""Categories that come with those that are read, and are passed over."""
_HEAD = 3
_ENOUGH = 4
"""Blocks in a row that are looked at."""
_FOLLOWED = 16
"""Blocks after one of unknown content that are followed to tell whether its length is right."""
_SMALL = 64
"""Octets of a block in which no others are looked for: little is lost."""
_CHECKED = 512
"""Octets of a block in which records are looked at to tell whether it is one."""
_SEEN, _NO_LENGTH = 1024, 1 << 16
"""Octets of a record that are looked at, and more than any block has."""

Place = dict[str, int]


def looks_like(content: bytes) -> bool:
    """Whether it begins with data blocks: one that ends with the content, or at least two in a row."""
    blocks, at = 0, _timed(content)
    while blocks < _ENOUGH and _is_block(content, at):
        blocks += 1
        at = _following(content, at)
    return blocks > 1 or (blocks == 1 and at == len(content))


def first_block(content: bytes, farthest: int, begin: int = 0, enough: int = _ENOUGH) -> int | None:
    """Where sound blocks begin, from `begin` on, no farther than so many octets; None: nowhere.

    At least `enough` of them follow each other, or the only one ends with the content, and those that are read have no
    damage in their first octets. Blocks from different places may overlap: each record is decoded once.
    """
    decoder, records = Decoder(Losses()), dict[tuple[int, int], int]()
    known: dict[int, tuple[int, bool]] = {}  # of places walked: sound blocks from there on, whether up to the end
    for first in range(begin, min(begin + farthest, len(content))):
        walked: list[tuple[int, int]] = []
        read, at = 0, _timed(content, first)
        while read < enough and at not in known and _is_block(content, at):
            after = _following(content, at)
            if content[at] in READ and not _is_sound(content, at, decoder, records):
                known[at] = 0, False
                break
            walked.append((at, read))
            read += content[at] in READ
            at = after
        more, whole = known.get(at, (0, at == len(content)))
        if read + more >= enough or (whole and read + more):
            return first
        known.update((place, (read + more - before, whole)) for place, before in walked)
    return None


def _is_passable(content: bytes, at: int) -> bool:
    """Whether the length of a block that is damaged, or not read, is right: others follow it, and it holds none."""
    after = _following(content, at)
    if after == len(content):
        return True
    return _leads_on(content, after) and (after - at < _SMALL or first_block(content, after - at - 1, at + 1) is None)


def _leads_on(content: bytes, at: int) -> bool:
    """Whether blocks of any category lead from `at` to a sound one of those that are read, or to the end, or go on."""
    for _ in range(_FOLLOWED):
        if at == len(content):
            return True
        if not _is_whole(content, at):
            return False
        if content[at] in READ:
            return _is_sound(content, at, Decoder(Losses()), {})
        at = _following(content, at)
    return True


def _next_sound(content: bytes, begin: int) -> int:
    """The place, from `begin` on, of the next of two sound blocks in a row, or of one at the end; else the end."""
    for place in range(begin, len(content), _NO_LENGTH):
        found = first_block(content, _NO_LENGTH, place, enough=2)
        if found is not None:
            return _timed(content, found)
    return len(content)


def _is_sound(content: bytes, at: int, decoder: Decoder, known: dict[tuple[int, int], int]) -> bool:
    """Whether the records that begin in the first octets of a block are undamaged and end in it, as far as is seen.

    known  the places after records, or after what is seen of them, by category and place
    """
    category, end = content[at], at + _size(content, at)
    place = at + _HEAD
    while place < min(end, at + _CHECKED):
        if (category, place) not in known:
            known[category, place] = place + decoder.length(category, content[place : place + _SEEN])
        place = known[category, place]
    return place <= end


def _is_block(content: bytes, at: int) -> bool:
    """Whether a whole data block of a known category may be at `at`."""
    return at < len(content) and content[at] in (*READ, *BESIDE) and _is_whole(content, at)


def _is_whole(content: bytes, at: int) -> bool:
    """Whether a block at `at` would have content, and end in what there is."""
    return _HEAD < _size(content, at) <= len(content) - at


def _following(content: bytes, at: int) -> int:
    """The place after the data block at `at`."""
    return _timed(content, at + _size(content, at))


def _size(content: bytes, at: int) -> int:
    """Octets of the data block at `at`."""
    return int.from_bytes(content[at + 1 : at + _HEAD], "big")


class Decoder:
    """Turns payloads into messages, and counts what is damaged in `losses`.

    After a damaged record the rest of its block is left out. Where no block follows another, as octets are missing, it
    goes on at the next sound ones.
    It remembers each sender's time, because CAT 001 says it only modulo 512 s.
    """

    def __init__(self, losses: Losses) -> None:
        self.losses = losses
        self._layouts = layouts()
        self._clock_s: dict[int, float] = {}

    def messages(self, payload: bytes) -> Iterator[Message]:
        """The messages of a payload of whole blocks."""
        at, last = _timed(payload), -1  # the places of this block and of the last one that was read or found
        while at < len(payload):
            whole, damaged = _is_whole(payload, at), self.losses.damaged
            sound = whole and payload[at] in self._layouts
            if sound:
                yield from self._block(payload[at], payload[at + _HEAD : at + _size(payload, at)])
                last, sound = at, self.losses.damaged == damaged
            if sound or (whole and _is_passable(payload, at)):
                at = _following(payload, at)
            else:
                self.losses.damaged = damaged + 1
                at = last = _next_sound(payload, last + 1)

    def length(self, category: int, body: bytes) -> int:
        """Octets of the first record: one more than given if it goes on, more than any block has if it is damaged."""
        try:
            place, after = _layout(category, self._layouts[category], body, 0).places(body, 0)
            _READERS[category](body, place, NAN)
        except (Truncated, IndexError):
            return len(body) + 1
        except Damaged:
            return _NO_LENGTH
        return after

    def _block(self, category: int, body: bytes) -> Iterator[Message]:
        kinds, read, source = self._layouts[category], _READERS[category], 0
        at = 0
        while at < len(body):
            try:
                place, at = _layout(category, kinds, body, at).places(body, at)
                source = _whole(body, place["010"], 2) if "010" in place else source
                message = read(body, place, self._clock_s.get(source, NAN))
            except (Damaged, IndexError):
                self.losses.damaged += 1
                return
            if message is not None:
                if message.clock_s == message.clock_s:
                    self._clock_s[source] = message.clock_s
                yield message._replace(source=source, category=category)


def _timed(payload: bytes, at: int = 0) -> int:
    """The place of the next block: some recorders put a length below 256 and a time before each, six octets."""
    framed = payload[at : at + 1] == b"\0" and int.from_bytes(payload[at : at + 2], "big") > 6 + _HEAD
    return at + 6 if framed else at


def _layout(category: int, kinds: dict[str, Layout] | object, body: bytes, at: int) -> Layout:
    """The layout of the record at `at`; that of CAT 001 depends on the first bit of I001/020."""
    assert isinstance(kinds, dict)
    if category != 1:
        return kinds[""]
    flags = body[at]
    first = at
    while body[at] & 1:
        at += 1
    descriptor = at + 1 + (2 if flags & 0x80 else 0)
    if not body[first] & 0x40:
        return kinds["plot"]
    return kinds["track" if body[descriptor] & 0x80 else "plot"]


def _report_048(body: bytes, place: Place, _now: float) -> Message | None:
    """A target report; None for one without a detection: a track that coasts."""
    if "040" not in place or ("020" in place and not body[place["020"]] >> 5):
        return None
    at = place["040"]
    return Message(
        Kind.POLAR, 0, 48, _clock(body, place, "140"),
        _whole(body, at, 2) / 256 * NAUTICAL_MILE,
        _whole(body, at + 2, 2) * 2 * pi / 65536,
        height_m=_height_048(body, place),
        doppler_m_s=_doppler(body, place),
    )  # fmt: skip


def _height_048(body: bytes, place: Place) -> float:
    """Metres, as a 3-D radar measured it, or else of the flight level."""
    if "110" in place:
        return _signed(_whole(body, place["110"], 2), 14) * 25 * FEET
    return _signed(_whole(body, place["090"], 2), 14) * 25 * FEET if "090" in place else NAN


def _doppler(body: bytes, place: Place) -> float:
    """m/s; the calculated Doppler speed of I048/120, positive for a receding target, NaN if absent or doubtful."""
    if "120" not in place or not body[place["120"]] & 0x80:
        return NAN
    value = _whole(body, place["120"] + 1, 2)
    return NAN if value & 0x8000 else float(_signed(value, 10))


def _report_001(body: bytes, place: Place, now: float) -> Message | None:
    if "040" not in place or ("020" in place and not body[place["020"]] & 0x30):
        return None
    at = place["040"]
    clock_s = NAN
    if "141" in place:
        clock_s = _whole(body, place["141"], 2) / 128
        if now == now:
            clock_s += 512 * round((now - clock_s) / 512)
    return Message(
        Kind.POLAR, 0, 1, clock_s,
        _whole(body, at, 2) / 128 * NAUTICAL_MILE,
        _whole(body, at + 2, 2) * 2 * pi / 65536,
        height_m=_signed(_whole(body, place["090"], 2), 14) * 25 * FEET if "090" in place else NAN,
    )  # fmt: skip


_NORTH, _SECTOR, _SOUTH = 1, 2, 3


def _service(body: bytes, place: Place, _now: float) -> Message | None:
    """A mark of the antenna in CAT 002 or 034; None for another service message."""
    kind = body[place["000"]] if "000" in place else 0
    turn_s = _whole(body, place["041"], 2) / 128 if "041" in place else NAN
    if kind == _SECTOR and "020" in place:
        azimuth = body[place["020"]] * 2 * pi / 256
    elif kind in (_NORTH, _SOUTH):
        azimuth = 0.0 if kind == _NORTH else pi
    else:
        return None
    return Message(Kind.MARK, 0, 0, _clock(body, place, "030"), turn_s or NAN, azimuth)


def _antenna_034(body: bytes, place: Place, now: float) -> Message | None:
    """As CAT 002, where 3 is the south mark; in CAT 034 it is something else."""
    return None if "000" in place and body[place["000"]] == _SOUTH else _service(body, place, now)


def _track_062(body: bytes, place: Place, _now: float) -> Message | None:
    """A system track: its position in WGS84, or else in the tracker's plane."""
    clock_s, target = _clock(body, place, "070"), _whole(body, place["040"], 2) if "040" in place else -1
    height = _signed(_whole(body, place["130"], 2), 16) * 6.25 * FEET if "130" in place else NAN
    if "105" in place:
        lat, lon = _degrees(body, place["105"], 4, 25)
        return Message(Kind.GEODETIC, 0, 62, clock_s, lat, lon, height, target=target)
    if "100" in place:
        x, y = (_signed(_whole(body, place["100"] + k, 3), 24) * 0.5 for k in (0, 3))
        return Message(Kind.CARTESIAN, 0, 62, clock_s, x, y, height, target=target)
    return None


def _adsb_021(body: bytes, place: Place, _now: float) -> Message | None:
    name = next((name for name in ("073", "071", "077") if name in place), "073")
    if "131" in place:
        lat, lon = _degrees(body, place["131"], 4, 30)
    elif "130" in place:
        lat, lon = _degrees(body, place["130"], 3, 23)
    else:
        return None
    height = _signed(_whole(body, place["140"], 2), 16) * 6.25 * FEET if "140" in place else NAN
    target = _whole(body, place["080"], 3) if "080" in place else -1
    return Message(Kind.GEODETIC, 0, 21, _clock(body, place, name), lat, lon, height, target=target)


_READERS: dict[int, Callable[[bytes, Place, float], Message | None]] = {
    1: _report_001,
    2: _service,
    21: _adsb_021,
    34: _antenna_034,
    48: _report_048,
    62: _track_062,
}


def _clock(body: bytes, place: Place, name: str) -> float:
    """Time of day, NaN if the item is absent. Raises Damaged for one beyond a day."""
    if name not in place:
        return NAN
    clock_s = _whole(body, place[name], 3) / 128
    if clock_s > 86400:
        raise Damaged
    return clock_s


def _degrees(body: bytes, at: int, size: int, power: int) -> tuple[float, float]:
    """Latitude and longitude, of so many octets each, in units of 180 / 2^power. Raises Damaged off the earth."""
    latitude, longitude = (_signed(_whole(body, at + k, size), 8 * size) * 180 / 2**power for k in (0, size))
    if abs(latitude) > 90 or abs(longitude) > 180:
        raise Damaged
    return latitude, longitude


def _whole(body: bytes, at: int, size: int) -> int:
    return int.from_bytes(body[at : at + size], "big")


def _signed(value: int, bits: int) -> int:
    """The lowest bits as a two's complement."""
    value &= (1 << bits) - 1
    return value - (1 << bits) if value >> (bits - 1) else value

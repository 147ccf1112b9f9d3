"""Payloads of a recording: pcap and pcapng captures, FINAL recordings, or the bare bytes.

pcap and pcapng: the Internet drafts draft-ietf-opsawg-pcap and draft-ietf-opsawg-pcapng. FINAL: a header of 8 octets
(length of the whole, 6 octets of board, line and time), the data, and four octets A5.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from vidtrack.arrays.types import Ints, Mask
from vidtrack.radar.feeds.messages import Losses

_PCAP = {b"\xd4\xc3\xb2\xa1": "<", b"\x4d\x3c\xb2\xa1": "<", b"\xa1\xb2\xc3\xd4": ">", b"\xa1\xb2\x3c\x4d": ">"}
_PCAPNG = b"\x0a\x0d\x0d\x0a"
_FINAL_HEAD, _FINAL_END = 8, b"\xa5\xa5\xa5\xa5"
_LINK_HEADS = {0: 4, 1: 14, 12: 0, 101: 0, 113: 16, 228: 0, 229: 0, 276: 20}
"""Octets before the IP packet by link type: loopback, Ethernet, raw IP, Linux cooked 1, IPv4, IPv6, Linux cooked 2."""
_PCAP_HEAD, _LONGEST = 16, 1 << 18
"""Octets of the header of a packet, and of the longest packet that capture programs write."""
_PARTS = 10**9
"""A header's fraction of a second is less, in nanoseconds."""
_SEARCHED = 1 << 16
"""Octets that are searched at once for the next sound header."""
_KINDS = (0x0A0D0D0A, 1, 3, 6)
"""Types of pcapng blocks that matter: section, interface, simple and enhanced packet."""
_VLAN = (b"\x81\x00", b"\x88\xa8")
_UDP = 17


def payloads(content: bytes, losses: Losses) -> Iterator[bytes]:
    """The payloads of all UDP datagrams of a capture, of all blocks of a FINAL recording, or else the whole content.

    What a capture holds beside UDP is passed over, and so are fragments of datagrams. A packet that the end cuts off is
    left out. After a damaged header it goes on with the next sound one; `losses` counts each such place, and the cut.
    """
    if is_capture(content):
        for link, frame in _frames(content, losses):
            payload = _datagram(link, frame)
            if payload:
                yield payload
    elif _is_final(content):
        yield from _final(content, losses)
    else:
        yield content


def is_capture(content: bytes) -> bool:
    """Whether it begins as pcap and pcapng do."""
    return content[:4] in _PCAP or content[:4] == _PCAPNG


def explain_lack(content: bytes) -> str:
    """What a capture has instead of payloads of a known format."""
    count, links = 0, set()
    for link, frame in _frames(content, Losses()):
        count += bool(_datagram(link, frame))
        links.add(link)
    if count:
        return f"none, or only one, of the {count} UDP datagrams in this capture is ASTERIX or NMEA"
    if links and links.isdisjoint(_LINK_HEADS):
        own, read = (", ".join(map(str, sorted(each))) for each in (links, _LINK_HEADS))
        return f"the packets of this capture have link type {own}; those that are read are {read} (1: Ethernet)"
    return f"this capture has no {'whole UDP datagram' if links else 'packet'}"


def _frames(content: bytes, losses: Losses) -> Iterator[tuple[int, bytes]]:
    """Link type and frame of each packet of a capture."""
    order = _PCAP.get(content[:4])
    return _pcapng(content, losses) if order is None else _pcap(content, order, losses)


def _pcap(content: bytes, order: str, losses: Losses) -> Iterator[tuple[int, bytes]]:
    """Link type and frame of each packet."""
    if len(content) < 24:
        return
    link = struct.unpack_from(f"{order}I", content, 20)[0] & 0xFFFF
    head = struct.Struct(f"{order}4I")
    places = _Places(partial(_packets, content, order), len(content))
    at = 24
    while at + _PCAP_HEAD <= len(content):
        _, fraction, size, whole = head.unpack_from(content, at)
        sound = fraction < _PARTS and max(size, whole) <= _LONGEST
        if sound and at + _PCAP_HEAD + size <= len(content):
            yield link, content[at + _PCAP_HEAD : at + _PCAP_HEAD + size]
            at += _PCAP_HEAD + size
            continue
        at = places.after(at + 1)
        if sound and at == len(content):
            losses.truncated = 1
        else:
            losses.damaged += 1
    if at < len(content):
        losses.truncated = 1


class _Places:
    """Where sound headers are. Each part of the content is searched once, however often it goes on after damage.

    sound  gives the places (N,), ascending, from one octet to before another
    end    place that is said when there is no more
    """

    def __init__(self, sound: Callable[[int, int], Ints], end: int) -> None:
        self._sound = sound
        self._end = end
        self._part = -1
        self._found = np.empty(0, np.int64)

    def after(self, at: int) -> int:
        """The first place from `at` on."""
        while at < self._end:
            part = at // _SEARCHED
            if part != self._part:
                self._part = part
                self._found = self._sound(part * _SEARCHED, min((part + 1) * _SEARCHED, self._end))
            later = self._found[np.searchsorted(self._found, at) :]
            if len(later):
                return int(later[0])
            at = (part + 1) * _SEARCHED
        return self._end


def _packets(content: bytes, order: str, first: int, last: int) -> Ints:
    """Places of packets after which there is another, or the end."""
    octets = np.frombuffer(content, np.uint8)
    head = _heads(octets, order, np.arange(first, min(last, len(content) - _PCAP_HEAD + 1)))
    place = first + np.flatnonzero(_fits(head) & (head[:, 2] > 0))
    after = place + _PCAP_HEAD + head[place - first, 2].astype(np.int64)
    sound = after == len(content)
    whole = np.flatnonzero(after + _PCAP_HEAD <= len(content))
    sound[whole] = _fits(_heads(octets, order, after[whole]))
    return place[sound]


def _heads(octets: np.ndarray, order: str, place: Ints) -> np.ndarray:
    """(N, 4) the words of packet headers at these places (N,)."""
    words: np.ndarray = octets[place[:, None] + np.arange(_PCAP_HEAD)].view(f"{order}u4")
    return words


def _fits(head: np.ndarray) -> Mask:
    """(N,) whether headers (N, 4) are sound."""
    return (head[:, 1] < _PARTS) & (head[:, 2] <= head[:, 3]) & (head[:, 3] <= _LONGEST)


def _pcapng(content: bytes, losses: Losses) -> Iterator[tuple[int, bytes]]:
    """Link type and frame of each packet in enhanced and simple packet blocks."""
    order, at = "<", 0
    places = {each: _Places(partial(_blocks, content, each), len(content)) for each in "<>"}
    links: list[int] = []
    while at + 12 <= len(content):
        if content[at : at + 4] == _PCAPNG:
            order = "<" if content[at + 8 : at + 12] == b"\x4d\x3c\x2b\x1a" else ">"
            links = []
        if not _is_block(content, order, at):
            losses.damaged += 1
            at = places[order].after(at + 4)
            continue
        kind, size = struct.unpack_from(f"{order}II", content, at)
        if at + size > len(content):
            break
        body = content[at + 8 : at + size - 4]
        if kind == 1 and len(body) >= 2:
            links.append(struct.unpack_from(f"{order}H", body)[0])
        elif kind == 6 and len(body) >= 20:
            interface, _, _, kept = struct.unpack_from(f"{order}4I", body)
            if interface < len(links):
                yield links[interface], body[20 : 20 + kept]
        elif kind == 3 and links:
            yield links[0], body[4:]
        at += size
    if at < len(content):
        losses.truncated = 1


def _is_block(content: bytes, order: str, at: int) -> bool:
    """Whether a block is there: its length is said at both ends, if the end is not cut off."""
    size = struct.unpack_from(f"{order}I", content, at + 4)[0]
    if size < 12 or size % 4:
        return False
    if at + size > len(content):
        return bool(size <= _LONGEST)
    return bool(struct.unpack_from(f"{order}I", content, at + size - 4)[0] == size)


def _blocks(content: bytes, order: str, first: int, last: int) -> Ints:
    """Places of whole blocks that matter. All lengths of blocks are multiples of four, and so are the places."""
    word = np.frombuffer(content, f"{order}u4", len(content) // 4)
    place = np.arange(first // 4, min(last // 4, len(word) - 2))
    place = place[np.isin(word[place], _KINDS)]
    size = word[place + 1].astype(np.int64)
    whole = (size >= 12) & (size % 4 == 0) & (4 * place + size <= len(content))
    place, size = place[whole], size[whole]
    return 4 * place[word[place + size // 4 - 1] == size]


def _datagram(link: int, frame: bytes) -> bytes:
    """The payload of a whole UDP datagram; empty for everything else."""
    at = _LINK_HEADS.get(link)
    if at is None:
        return b""
    if link == 1:
        while frame[at - 2 : at] in _VLAN:
            at += 4
    packet = frame[at:]
    version = packet[0] >> 4 if packet else 0
    if version == 4 and len(packet) >= 20 and packet[9] == _UDP:
        fragment = int.from_bytes(packet[6:8], "big") & 0x3FFF  # the flag "more fragments" and the offset
        packet = b"" if fragment else packet[4 * (packet[0] & 15) :]
    elif version == 6 and len(packet) >= 40 and packet[6] == _UDP:
        packet = packet[40:]
    else:
        return b""
    return packet[8 : int.from_bytes(packet[4:6], "big")]


def _is_final(content: bytes) -> bool:
    size = int.from_bytes(content[:2], "big")
    return size > _FINAL_HEAD + 4 and content[size - 4 : size] == _FINAL_END


def _final(content: bytes, losses: Losses) -> Iterator[bytes]:
    """The data of each block; after a damaged one, from the next end mark on."""
    at = 0
    while at < len(content):
        size = int.from_bytes(content[at : at + 2], "big")
        if size > _FINAL_HEAD + 4 and content[at + size - 4 : at + size] == _FINAL_END:
            yield content[at + _FINAL_HEAD : at + size - 4]
            at += size
        else:
            losses.damaged += 1
            mark = content.find(_FINAL_END, at)
            at = len(content) if mark < 0 else mark + len(_FINAL_END)

"""Payloads of a recording: pcap and pcapng captures, FINAL recordings, or the bare bytes.

pcap and pcapng: the Internet drafts draft-ietf-opsawg-pcap and draft-ietf-opsawg-pcapng. FINAL: a header of 8 octets
(length of the whole, 6 octets of board, line and time), the data, and four octets A5.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

_PCAP = {b"\xd4\xc3\xb2\xa1": "<", b"\x4d\x3c\xb2\xa1": "<", b"\xa1\xb2\xc3\xd4": ">", b"\xa1\xb2\x3c\x4d": ">"}
_PCAPNG = b"\x0a\x0d\x0d\x0a"
_FINAL_HEAD, _FINAL_END = 8, b"\xa5\xa5\xa5\xa5"
_LINK_HEADS = {0: 4, 1: 14, 12: 0, 101: 0, 113: 16, 228: 0, 229: 0, 276: 20}
"""Octets before the IP packet by link type: loopback, Ethernet, raw IP, Linux cooked 1, IPv4, IPv6, Linux cooked 2."""
_VLAN = (b"\x81\x00", b"\x88\xa8")
_UDP = 17


def payloads(content: bytes) -> Iterator[bytes]:
    """The payloads of all UDP datagrams of a capture, of all blocks of a FINAL recording, or else the whole content.

    What a capture holds beside UDP is passed over, and so are fragments of datagrams. A cut end is left out.
    """
    if content[:4] in _PCAP:
        frames = _pcap(content, _PCAP[content[:4]])
    elif content[:4] == _PCAPNG:
        frames = _pcapng(content)
    elif _is_final(content):
        yield from _final(content)
        return
    else:
        yield content
        return
    for link, frame in frames:
        payload = _datagram(link, frame)
        if payload:
            yield payload


def _pcap(content: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Link type and frame of each packet."""
    if len(content) < 24:
        return
    link = struct.unpack_from(f"{order}I", content, 20)[0] & 0xFFFF
    at = 24
    while at + 16 <= len(content):
        size = struct.unpack_from(f"{order}I", content, at + 8)[0]
        yield link, content[at + 16 : at + 16 + size]
        at += 16 + size


def _pcapng(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Link type and frame of each packet in enhanced and simple packet blocks."""
    order, at = "<", 0
    links: list[int] = []
    while at + 12 <= len(content):
        if content[at : at + 4] == _PCAPNG:
            order = "<" if content[at + 8 : at + 12] == b"\x4d\x3c\x2b\x1a" else ">"
            links = []
        kind, size = struct.unpack_from(f"{order}II", content, at)
        body = content[at + 8 : at + size - 4]
        if kind == 1 and len(body) >= 2:
            links.append(struct.unpack_from(f"{order}H", body)[0])
        elif kind == 6 and len(body) >= 20:
            interface, _, _, kept = struct.unpack_from(f"{order}4I", body)
            if interface < len(links):
                yield links[interface], body[20 : 20 + kept]
        elif kind == 3 and links:
            yield links[0], body[4:]
        at += max(12, size)


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


def _final(content: bytes) -> Iterator[bytes]:
    """The data of each block; after a damaged one, from the next end mark on."""
    at = 0
    while at < len(content):
        size = int.from_bytes(content[at : at + 2], "big")
        if size > _FINAL_HEAD + 4 and content[at + size - 4 : at + size] == _FINAL_END:
            yield content[at + _FINAL_HEAD : at + size - 4]
            at += size
        else:
            mark = content.find(_FINAL_END, at)
            at = len(content) if mark < 0 else mark + len(_FINAL_END)

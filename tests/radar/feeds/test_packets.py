"""Payloads of captures and recordings."""

import struct

import numpy as np
import pytest
from asterix_records import block, plot

from vidtrack.errors import PlotFormatError
from vidtrack.radar.feeds import asterix, packets
from vidtrack.radar.feeds.messages import Losses
from vidtrack.radar.feeds.recording import read_messages

PAYLOADS = [b"first payload", b"2", b"the third one"]
ETHERNET = bytes(12) + b"\x08\x00"


def payloads(content):
    return packets.payloads(content, Losses())


def udp(payload):
    return struct.pack(">HHHH", 1000, 8600, 8 + len(payload), 0) + payload


def ipv4(payload, fragment=0, protocol=17):
    content = udp(payload)
    head = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(content), 1, fragment, 9, protocol, 0, bytes(4), bytes(4))
    return head + content


def ipv6(payload):
    content = udp(payload)
    return struct.pack(">IHBB", 6 << 28, len(content), 17, 9) + bytes(32) + content


def pcap(frames, link=1, order="<", magic=0xA1B2C3D4):
    head = struct.pack(f"{order}IHHIIII", magic, 2, 4, 0, 0, 65535, link)
    return head + b"".join(struct.pack(f"{order}IIII", 0, 0, len(f), len(f)) + f for f in frames)


def pcapng(frames, order="<"):
    def block(kind, body):
        body += bytes(-len(body) % 4)
        size = struct.pack(f"{order}I", 12 + len(body))
        return struct.pack(f"{order}I", kind) + size + body + size

    section = block(0x0A0D0D0A, struct.pack(f"{order}IHHq", 0x1A2B3C4D, 1, 0, -1))
    interface = block(1, struct.pack(f"{order}HHI", 1, 0, 0))
    return (
        section
        + interface
        + b"".join(block(6, struct.pack(f"{order}IIIII", 0, 0, 0, len(f), len(f)) + f) for f in frames)
    )


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("magic", [0xA1B2C3D4, 0xA1B23C4D])
def test_a_capture_is_read_whatever_machine_made_it(order, magic):
    frames = [ETHERNET + ipv4(payload) + b"padding" for payload in PAYLOADS]
    assert list(payloads(pcap(frames, order=order, magic=magic))) == PAYLOADS


@pytest.mark.parametrize("order", ["<", ">"])
def test_the_newer_format_of_captures_is_read(order):
    assert list(payloads(pcapng([ETHERNET + ipv4(payload) for payload in PAYLOADS], order))) == PAYLOADS


@pytest.mark.parametrize(
    ("link", "head"),
    [(101, b""), (113, bytes(16)), (276, bytes(20)), (0, b"\2\0\0\0"), (1, bytes(12) + b"\x81\x00\0\5\x08\x00")],
)
def test_other_links_are_read(link, head):
    assert list(payloads(pcap([head + ipv4(payload) for payload in PAYLOADS], link))) == PAYLOADS


def test_the_newer_internet_protocol_is_read():
    assert list(payloads(pcap([bytes(12) + b"\x86\xdd" + ipv6(payload) for payload in PAYLOADS]))) == PAYLOADS


def test_what_is_no_whole_datagram_is_passed_over():
    frames = [ipv4(b"fragment", fragment=0x2000), ipv4(b"of TCP", protocol=6), b"", b"E", ipv4(b"whole")]
    assert list(payloads(pcap(frames, 101))) == [b"whole"]


def test_every_truncation_of_a_capture_is_read_without_a_crash():
    for whole in (pcap([ETHERNET + ipv4(p) for p in PAYLOADS]), pcapng([ETHERNET + ipv4(p) for p in PAYLOADS])):
        for end in range(4, len(whole)):
            assert len(list(payloads(whole[:end]))) <= len(PAYLOADS)


@pytest.mark.parametrize("capture", [pcap, pcapng])
def test_an_end_within_a_packet_is_told(capture):
    frames = [ETHERNET + ipv4(payload) for payload in PAYLOADS]
    whole, shorter = capture(frames), len(capture(frames[:2]))
    for end in range(shorter, len(whole) + 1):
        losses = Losses()
        assert list(packets.payloads(whole[:end], losses)) == PAYLOADS[: 2 + (end == len(whole))]
        assert (losses.truncated, losses.damaged) == (int(shorter < end < len(whole)), 0)


def test_a_size_that_goes_beyond_the_end_does_not_hide_the_packets_after_it():
    whole, losses = pcap([ETHERNET + ipv4(payload) for payload in PAYLOADS]), Losses()
    wrong = whole[:24] + struct.pack("<IIII", 0, 0, 5000, 5000) + whole[40:]
    assert list(packets.payloads(wrong, losses)) == PAYLOADS[1:]
    assert (losses.truncated, losses.damaged) == (0, 1)


FRAMES = [ETHERNET + ipv4(f"payload number {k}".encode()) for k in range(6)]


@pytest.mark.parametrize("capture", [pcap, lambda frames: pcap(frames, order=">"), pcapng])
@pytest.mark.parametrize(
    "damage", [b"\xff" * 16, bytes(12) + b"\xff" * 4, b"trash " * 500], ids=["head", "size", "trash"]
)
def test_a_capture_is_read_past_a_damaged_header(capture, damage):
    whole, losses = capture(FRAMES), Losses()
    at = whole.index(FRAMES[2]) - 28 * (capture is pcapng) - 16 * (capture is not pcapng)
    found = list(packets.payloads(whole[:at] + damage + whole[at + len(damage[:16]) :], losses))
    expected = [f"payload number {k}".encode() for k in range(6)]
    assert found[:2] == expected[:2]
    assert found[-3:] == expected[-3:]
    assert len(found) <= 6
    assert losses.damaged >= 1


def test_a_capture_with_damage_anywhere_is_read_without_a_crash():
    rng = np.random.default_rng(0)
    for whole in (pcap(FRAMES), pcapng(FRAMES)):
        for _ in range(300):
            damaged = bytearray(whole)
            for at in rng.integers(4, len(whole), 3):
                damaged[at] = rng.integers(256)
            assert len(list(payloads(bytes(damaged)))) <= 2 * len(FRAMES)


def test_a_final_recording_is_read_past_a_damaged_block():
    blocks = [struct.pack(">H6x", 12 + len(payload)) + payload + b"\xa5" * 4 for payload in PAYLOADS]
    assert list(payloads(b"".join(blocks))) == PAYLOADS
    damaged = b"\xff" + blocks[1][1:]
    assert list(payloads(blocks[0] + damaged + blocks[2])) == [PAYLOADS[0], PAYLOADS[2]]


def test_bare_bytes_are_one_payload():
    assert list(payloads(b"\x30\x00\x04\x01")) == [b"\x30\x00\x04\x01"]


@pytest.mark.parametrize("kind", ["pcap", "pcapng"])
def test_with_damage_everywhere_each_octet_is_searched_once(monkeypatch, kind):
    if kind == "pcap":
        head = struct.pack("<4I", 0, 0, 1, 1)
        content = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1) + (2 * (head + b"x") + b"\xff" * 8) * 24_000
    else:
        block = struct.pack("<4I", 6, 16, 0, 16) + b"\xff" * 4
        content = struct.pack("<IIIHHqI", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1, 28) + block * 50_000
    name = {"pcap": "_packets", "pcapng": "_blocks"}[kind]
    search, searched, losses = getattr(packets, name), np.zeros(len(content), int), Losses()

    def counted(content, order, first, last):
        searched[first:last] += 1
        return search(content, order, first, last)

    monkeypatch.setattr(packets, name, counted)
    assert not list(packets.payloads(content, losses))
    assert (searched == 1).all()
    assert losses.damaged > 20_000


def test_a_capture_that_begins_with_other_traffic_is_read(tmp_path):
    blocks = [block(plot(float(k), 30000, 10 * k)) for k in range(4)]
    other = [b"\x12\x34" + b"query" * 6] * 60
    (tmp_path / "capture").write_bytes(pcap([ETHERNET + ipv4(payload) for payload in [*other, *blocks]]))
    assert read_messages(tmp_path / "capture", Losses()).time_s.tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("content", "named"),
    [
        (pcap([]), "no packet"),
        (pcap([bytes(80)], link=105), "link type 105; those that are read are 0, 1,"),
        (pcap([ETHERNET + ipv4(b"over TCP", protocol=6)]), "no whole UDP datagram"),
        (pcapng([ETHERNET + ipv4(payload) for payload in PAYLOADS]), "none, or only one, of the 3 UDP datagrams"),
    ],
)
def test_a_capture_without_plots_is_told_by_what_it_has(tmp_path, content, named):
    (tmp_path / "capture").write_bytes(content)
    with pytest.raises(PlotFormatError, match=named):
        read_messages(tmp_path / "capture", Losses())


def test_one_datagram_among_other_traffic_makes_no_recording(tmp_path):
    stray = ETHERNET + ipv4(block(plot(0.0, 30_000.0, 40.0)))
    (tmp_path / "capture").write_bytes(pcap([*[ETHERNET + ipv4(payload) for payload in PAYLOADS], stray]))
    with pytest.raises(PlotFormatError, match="only one, of the 4 UDP datagrams"):
        read_messages(tmp_path / "capture", Losses())


def test_no_plots_are_looked_for_within_other_traffic(tmp_path):
    """Four blocks within a datagram that does not begin with one are none: noise would have some, too."""
    sound = [block(plot(float(k), 30_000.0, 40.0)) for k in range(6)]
    frames = [ETHERNET + ipv4(payload) for payload in (*sound[:2], b"\xff" * 40 + b"".join(sound[2:]))]
    (tmp_path / "capture").write_bytes(pcap(frames))
    losses = Losses()
    assert len(read_messages(tmp_path / "capture", losses)) == 2
    assert losses.damaged == 1


def test_only_datagrams_of_its_own_format_inform_a_decoder(tmp_path, monkeypatch):
    """Text among blocks is not read for a time of day."""
    sound = [block(plot(float(k), 30_000.0, 40.0)) for k in range(3)]
    sentence = b"$RATTM,01,2.00,90.0,T,0,0,T,0,0,N,,T,,120000,A\r\n"
    (tmp_path / "capture").write_bytes(pcap([ETHERNET + ipv4(payload) for payload in (sentence, *sound)]))
    read, decode = [], asterix.Decoder.messages
    monkeypatch.setattr(
        asterix.Decoder, "messages", lambda self, payload: read.append(payload) or decode(self, payload)
    )
    read_messages(tmp_path / "capture", Losses())
    assert sentence not in read
    assert len(read) == 2 * len(sound)

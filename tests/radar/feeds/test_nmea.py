"""Sentences of NMEA 0183 and AIS."""

import sys
from functools import reduce

import numpy as np
import pyais
import pytest

from vidtrack.config.radar import RadarSettings
from vidtrack.errors import ConfigError
from vidtrack.radar.feeds import nmea
from vidtrack.radar.feeds.messages import Kind, Losses
from vidtrack.radar.feeds.recording import is_feed
from vidtrack.radar.reading import read


def sentence(body):
    return f"${body}*{reduce(lambda total, octet: total ^ octet, body.encode(), 0):02X}\r\n"


def messages(*lines):
    losses = Losses()
    return list(nmea.Decoder(losses).messages("".join(lines).encode())), losses


def ais(second=0, **position):
    return pyais.encode_dict({"type": 1, "mmsi": 211000001, "second": second, **position})[0] + "\r\n"


def test_a_tracked_target_has_range_and_bearing():
    ((message,), losses) = messages(sentence("RATTM,03,2.50,270.0,T,10.0,90.0,T,0.1,5.0,N,ABC,T,,123519.50,A"))
    assert message[:4] == (Kind.POLAR, 0, 0, 12 * 3600 + 35 * 60 + 19.5)
    assert message.u == pytest.approx(4630)
    assert np.degrees(message.v) == pytest.approx(270)
    assert message.target == 3
    assert not losses.damaged


def test_a_relative_bearing_needs_the_heading():
    relative = sentence("RATTM,03,1.0,350.0,R,10.0,90.0,T,0.1,5.0,K,,T,,000010.00,A")
    assert messages(relative)[1].damaged == 1
    ((message,), _) = messages(sentence("HEHDT,30.0,T"), relative)
    assert np.degrees(message.v) % 360 == pytest.approx(20)
    assert message.u == pytest.approx(1000)


def test_a_target_with_latitude_and_longitude():
    ((message,), _) = messages(sentence("RATLL,07,4212.500,N,00830.000,W,,101530.00,T,"))
    assert message.kind == Kind.GEODETIC
    assert (message.u, message.v) == (pytest.approx(42 + 12.5 / 60), pytest.approx(-8.5))


def test_a_lost_target_is_none():
    found, losses = messages(sentence("RATTM,03,2.5,270.0,T,,,T,,,N,,L,,,A"), sentence("RATLL,07,,N,,W,,,L,"))
    assert not found
    assert not losses.damaged


def test_a_ship_has_its_position_and_number():
    ((message,), _) = messages("\\s:rx,c:1700000000*00\\" + ais(lat=53.5, lon=8.1))
    assert (message.u, message.v) == (pytest.approx(53.5), pytest.approx(8.1))
    assert message.target == 211000001
    assert message.clock_s == 1700000000 % 86400


def test_without_a_time_stamp_the_seconds_go_on():
    found, _ = messages(sentence("GPGGA,235958.00,,,,,0,,,,,,,,"), ais(59, lat=1, lon=1), ais(2, lat=1, lon=1))
    assert [message.clock_s for message in found] == [86399, 2]


def test_a_wrong_checksum_is_damage():
    found, losses = messages(
        sentence("RATTM,03,2.50,270.0,T,10.0,90.0,T,0.1,5.0,N,ABC,T,,123519.50,A").replace("2.50", "2.51")
    )
    assert not found
    assert losses.damaged == 1


@pytest.mark.parametrize(
    "trash",
    [b"\0\0\0\r\n", b"\xff\xfe\0garbage\r\n", b"$RATTM,01,4.0\r\n", b"$H@HDT,090.0,T*26\r\n", b"@HEHDT,1,T*00\n"],
)
@pytest.mark.parametrize("before", [0, 1, 20])
def test_a_damaged_line_is_counted_and_the_others_are_read(tmp_path, trash, before):
    lines = [
        sentence(f"RATTM,01,{4 + k / 100:.2f},30.0,T,10.0,90.0,T,0.0,0.0,N,T1,T,,12{k // 20:02}{k % 20 * 3:02}.00,A")
        for k in range(40)
    ]
    path = tmp_path / "ship.nmea"
    path.write_bytes(b"".join([*(line.encode() for line in lines[:before]), trash, *map(str.encode, lines[before:])]))
    assert is_feed(path)
    plots = read(path, RadarSettings())
    assert (len(plots), plots.losses["damaged"]) == (40, 1)


def test_a_file_with_many_damaged_lines_is_what_most_of_it_says(tmp_path):
    line = sentence("RATTM,01,4.00,30.0,T,10.0,90.0,T,0.0,0.0,N,T1,T,,120000.00,A").encode()
    path = tmp_path / "ship.nmea"
    path.write_bytes((line + b"\0\x0e\0\x01" + line[:30] + b"\r\n") * 100)
    assert is_feed(path)
    path.write_bytes(line + b"a table,of numbers\r\n" * 100)
    assert not is_feed(path)


FILL = b"\0" * 100_000


@pytest.mark.parametrize("before", [b"", FILL, b"x" * 70_000 + b"\r\n"])
@pytest.mark.parametrize("between", [b"", FILL])
@pytest.mark.parametrize("after", [b"", FILL])
def test_what_fills_a_file_does_not_tell_what_it_is(tmp_path, before, between, after):
    lines = [
        sentence(f"RATTM,01,{4 + k / 100:.2f},30.0,T,10.0,90.0,T,0.0,0.0,N,T1,T,,1200{k * 3:02}.00,A").encode()
        for k in range(16)
    ]
    path = tmp_path / "ship.nmea"
    path.write_bytes(b"".join([before, *lines[:8], between, *lines[8:], after]))
    assert is_feed(path)
    assert len(read(path, RadarSettings())) == 16


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_text_of_two_octets_a_character_is_no_recording(tmp_path, encoding):
    path = tmp_path / "ship.nmea"
    path.write_bytes(sentence("HEHDT,090.0,T").encode(encoding) * 100)
    assert not is_feed(path)


def test_what_stands_between_the_sentences_is_no_damage():
    _, losses = messages("# a comment: $5*00\r\n", "2026-01-01 12:00:00\r\n", "\r\n", "$PSRF103,00,01,00,01*25\r\n")
    assert not losses.damaged


def test_what_is_tracked_of_several_kinds_is_told_by_kind(tmp_path, caplog):
    lines = []
    for second in range(40):
        lines.append(sentence(f"RATTM,01,2.00,90.0,T,0,0,T,0,0,N,A,T,,1200{second:02}.00,A"))
        lines.append(sentence(f"RATLL,02,4712.34,N,01234.56,E,B,1200{second:02}.00,T,"))
    (tmp_path / "a.nmea").write_text("".join(lines))
    read(tmp_path / "a.nmea", RadarSettings())
    assert "tracked are 40 plots of NMEA; not 40 positions of NMEA" in caplog.text


def test_hostile_text_never_crashes():
    rng = np.random.default_rng(0)
    good = (sentence("RATTM,03,2.5,270.0,T,10.0,90.0,T,0.1,5.0,N,A,T,,123519.5,A") + ais(5, lat=1, lon=1)).encode()
    decoder = nmea.Decoder(losses := Losses())
    for _ in range(1000):
        line = bytearray(good)
        for at in rng.integers(0, len(line), 3):
            line[at] = rng.integers(1, 256)
        for message in decoder.messages(bytes(line)):
            assert np.isfinite([message.u, message.v]).all()
    assert losses.damaged > 500


def test_ships_are_tracked_once_a_round(tmp_path):
    lines = [f"\\c:{1700000000 + 10 * k}*00\\" + ais(lat=53.5 + 0.0005 * k, lon=8.1) for k in range(12)]
    path = tmp_path / "ships.nmea"
    path.write_text("".join(lines))
    plots = read(path, RadarSettings(geodetic=(53.5, 8.1, 0.0)))
    assert plots.scan.tolist() == list(range(12))
    np.testing.assert_allclose(plots.z[:, 1], 55.65 * np.arange(12), atol=0.5)


def test_a_jump_of_the_clock_holds_no_rounds(tmp_path, caplog):
    times = [1700000000 + 10 * k + 20000 * (k > 6) for k in range(14)]
    path = tmp_path / "ships.nmea"
    path.write_text("".join(f"\\c:{t}*00\\" + ais(lat=53.5, lon=8.1) for t in times))
    plots = read(path, RadarSettings(geodetic=(53.5, 8.1, 0.0)))
    assert plots.scan.tolist() == list(range(12))  # the first two after the jump are not believed
    assert "the time jumps from" in caplog.text


def test_without_the_library_the_message_says_what_to_install(monkeypatch):
    one = ais(lat=1, lon=1)
    monkeypatch.setitem(sys.modules, "pyais", None)
    nmea.ais_library.cache_clear()
    with pytest.raises(ConfigError, match=r"pip install 'vidtrack\[ais\]'"):
        messages(one)
    nmea.ais_library.cache_clear()

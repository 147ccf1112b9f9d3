"""Scans from payloads as they come, and from the network."""

import csv
import json
import signal
import socket
import threading
import time

import numpy as np
import pytest
from asterix_records import RADAR, block, mark, plot, sweeps, two_feeds

from vidtrack.cli.tracking import finish_feed
from vidtrack.config.radar import RadarSettings
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError, PlotFormatError, SourceError
from vidtrack.radar.feeds import stream as stream_module
from vidtrack.radar.feeds.stream import KEPT_S, MOST_EMPTY, ScanStream
from vidtrack.radar.feeds.udp import UdpFeed
from vidtrack.radar.reading import read
from vidtrack.radar.scans import measurements
from vidtrack.run import radar_live
from vidtrack.run.radar_live import run_feed

SETTINGS = RadarSettings()


@pytest.fixture(scope="module")
def blocks():
    """Fourteen turns with five targets that fly, as blocks."""
    rng = np.random.default_rng(7)
    scan = np.repeat(np.arange(14), 5)
    azimuth_deg = np.tile(np.arange(5) * 70.0 + 3, 14) + 0.2 * scan
    table = {"scan": scan, "range_m": 30000 + 700 * scan + rng.normal(0, 20, len(scan)), "azimuth_deg": azimuth_deg}
    return sweeps(table, begin_s=500.0)


def given_out(payloads, settings=SETTINGS):
    stream, scans = ScanStream(settings, "feed"), []
    for payload in payloads:
        stream.hear(payload)
        scans += stream.over()
    return stream, scans


def test_scans_are_those_of_the_recording(tmp_path, blocks):
    path = tmp_path / "radar.ast"
    path.write_bytes(b"".join(blocks))
    stream, scans = given_out(blocks)
    recorded = list(measurements(read(path, SETTINGS), SETTINGS))
    assert [number for number, _ in scans] == list(range(13))  # the last one is not over
    for (number, scan), (same, expected) in zip(scans, recorded, strict=False):
        assert number == same
        assert scan.t == pytest.approx(expected.t)
        np.testing.assert_allclose(scan.z, expected.z)
    assert stream.plots == 65


def test_other_traffic_at_the_address_is_counted_and_changes_nothing(blocks):
    foreign = [
        b"GET / HTTP/1.1\r\n\r\n" + block(plot(502.0, 12000, 123)),
        b"$GPZDA,000500.00,01,01,2026,,\r\n",
        b"$GPZDA,000500.00,01,01,2026,,\r\n" * 3 + block(plot(502.0, 12000, 123)),
        bytes(60),
    ]
    stream, scans = given_out([payload for own in blocks for payload in (own, *foreign)])
    _, expected = given_out(blocks)
    assert stream.losses.damaged == 4 * len(blocks)
    assert len(scans) == len(expected)
    for (_, scan), (_, same) in zip(scans, expected, strict=True):
        np.testing.assert_array_equal(scan.z, same.z)


@pytest.mark.parametrize("stray", [b"$PMTK010,001*2E\r\n", b"$GPZDA,000500.00,01,01,2026,,\r\n"])
def test_what_tells_nothing_does_not_settle_the_format(stray, blocks):
    stream, scans = given_out([stray, *blocks])
    assert len(scans) == len(given_out(blocks)[1])
    assert not stream.losses.damaged


def test_proprietary_sentences_and_empty_lines_are_no_damage():
    stream = ScanStream(SETTINGS, "feed")
    for payload in (
        b"\r\n",
        b"$PMTK010,001*2E\r\n",
        b"$PGRME,3.1,M,4.2,M,5.2,M*2D\r\n",
        b"$RATTM,01,3.5,45.0,T,,,,,,N,,T,,000500.00,A\r\n",
    ):
        stream.hear(payload)
    assert not stream.losses.damaged


def test_what_comes_late_is_counted(blocks):
    late = block(plot(530.5, 31000, 225))
    stream, _ = given_out([*blocks[:53], late, *blocks[53:]])
    assert (stream.losses.late, stream.losses.strayed) == (1, 0)


def twelve_a_turn(seed, turns=20):
    """Blocks of turns of 4 s with twelve plots each."""
    scan = np.repeat(np.arange(turns), 12)
    range_m = np.random.default_rng(seed).uniform(20e3, 40e3, len(scan))
    table = {"scan": scan, "range_m": range_m, "azimuth_deg": np.tile(np.arange(12) * 30.0, turns)}
    return sweeps(table, begin_s=500.0)


def test_a_clock_that_is_set_back_by_some_turns_goes_on():
    stream, scans = given_out([*twelve_a_turn(7)[:130], *twelve_a_turn(8)[65:]])
    assert (stream.losses.resets, stream.losses.late) == (1, 0)
    assert [number for number, _ in scans] == list(range(24))
    assert (np.diff([scan.t for _, scan in scans]) > 0).all()


def test_a_recording_that_is_sent_in_a_loop_is_no_late_copy():
    turns = twelve_a_turn(7)
    stream, scans = given_out([*turns, *turns, *turns])
    assert (stream.losses.resets, stream.losses.duplicates) == (2, 0)
    assert stream.plots > 0.95 * 3 * 240 - 12
    assert (np.diff([scan.t for _, scan in scans]) > 0).all()


@pytest.mark.parametrize("behind", [20, 60, 90])
def test_late_copies_of_a_second_feed_are_left_out_as_in_a_recording(tmp_path, behind):
    both = two_feeds(twelve_a_turn(7, turns=30), behind)
    stream, scans = given_out(both)
    scans += stream.over(silent=True)
    path = tmp_path / "both.ast"
    path.write_bytes(b"".join(both))
    recorded = read(path, SETTINGS)
    assert stream.losses.resets == 0
    assert stream.losses.as_dict() == recorded.losses
    assert stream.losses.duplicates > 200
    assert [len(scan.z) for _, scan in scans] == np.bincount(recorded.scan).tolist()


def test_a_silence_ends_the_scan_that_is_open(blocks):
    stream, scans = given_out(blocks)
    scans += stream.over(silent=True)
    assert [number for number, _ in scans] == list(range(14))


def test_marks_without_plots_are_empty_scans(blocks):
    empty = [mark(500.0 + 4 * turn, turn_s=4.0) for turn in range(14, 20)]
    _, scans = given_out([*blocks, *empty])
    assert [len(scan.z) for _, scan in scans[13:]] == [5, 0, 0, 0, 0]
    np.testing.assert_allclose(np.diff([scan.t for _, scan in scans[13:]]), 4, atol=0.1)


def test_after_a_long_pause_the_empty_scans_are_few(blocks):
    pause = [block(plot(500 + 4 * 900 + 4 * k, 30000 + k, 10)) for k in range(6)]
    _, scans = given_out([*blocks, *pause])
    assert MOST_EMPTY <= sum(not len(scan.z) for _, scan in scans) <= MOST_EMPTY + 2


def test_several_radars_are_refused(blocks):
    other = sweeps({"scan": np.arange(5), "range_m": np.full(5, 2e4), "azimuth_deg": np.full(5, 9.0)}, begin_s=500)
    renamed = [one.replace(bytes([25, 201]), bytes([25, 9])) for one in other]
    with pytest.raises(PlotFormatError, match="2 radars"):
        given_out([part for pair in zip(blocks, renamed, strict=False) for part in pair])
    assert RADAR[1] == ("SIC", 201)


def test_what_is_not_wanted_is_forgotten_after_a_minute(blocks, monkeypatch, caplog):
    now = 0.0
    monkeypatch.setattr(stream_module, "monotonic", lambda: now)
    stream = ScanStream(RadarSettings(sac=25, sic=9), "feed")
    other = block(plot(500.0, 30000, 10))
    for _ in range(300):
        now += 1.0
        stream.hear(other)
        assert not list(stream.over())
        assert len(stream._heard) <= KEPT_S + 1
    assert [one for one in caplog.messages if "for 60 s" in one] == [
        "feed: for 60 s there were no plots of the radar with this sac and sic; it has 62 plots of CAT 048 from 25/201"
    ]
    scans = []
    for payload in blocks:
        stream.hear(payload.replace(bytes([25, 201]), bytes([25, 9])))
        scans += stream.over()
    assert [number for number, _ in scans] == list(range(13))


def test_marks_alone_are_named(monkeypatch, caplog):
    now = 0.0
    monkeypatch.setattr(stream_module, "monotonic", lambda: now)
    stream = ScanStream(SETTINGS, "feed")
    for turn in range(30):
        now += 4.0
        stream.hear(mark(500.0 + 4 * turn, turn_s=4.0))
        assert not list(stream.over())
    assert "feed: for 60 s there were no plots; it has marks of the antenna only" in caplog.messages


@pytest.mark.parametrize("address", ["udp://239.1.2.3", "udp://radar:8600", "udp://1.2.3.4:x", "udp://1.2.3.4:1?to=2"])
def test_a_wrong_address_is_refused(address):
    with pytest.raises(ConfigError, match="is not udp://ADDRESS:PORT"):
        UdpFeed(address)


def test_an_address_of_another_machine_is_refused():
    with pytest.raises(SourceError, match="cannot listen at"):
        UdpFeed("udp://192.0.2.1:8600")


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.mark.parametrize("group", ["127.0.0.1", "239.1.2.3"])
def test_a_feed_is_tracked_until_it_is_stopped(tmp_path, blocks, group):
    port, seen = free_port(), threading.Event()
    address = f"udp://{group}:{port}" + ("?interface=127.0.0.1" if group.startswith("239") else "")

    def send():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
            one.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            for payload in [b"not a radar", *blocks]:
                one.sendto(payload, (group, port))

    with run_feed(address, Settings(), seen.is_set, tmp_path / "run") as run:
        sender = threading.Thread(target=send)
        sender.start()
        for step in run:
            if step.index == 12:
                sender.join()
                seen.set()
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["scans"], summary["plots"], summary["damaged"], summary["tracks"]) == (14, 70, 1, 5)
    assert not summary["interrupted"]
    assert run.name == f"{group}-{port}"


def interrupted_feed(folder, blocks, monkeypatch, times):
    """A feed whose first scan takes long, as one does that waits for the compiler, while Ctrl-C is pressed."""
    received, stop = iter([blocks]), threading.Event()
    monkeypatch.setattr(UdpFeed, "poll", lambda self, wait_s: next(received, []))
    monkeypatch.setattr("vidtrack.cli.signals._PATIENCE_S", 0.01)
    build = radar_live.build_radar_tracker

    def slow(*of, **named):
        for _ in range(times):
            signal.raise_signal(signal.SIGINT)
            time.sleep(0.1)
        return build(*of, **named)

    monkeypatch.setattr(radar_live, "build_radar_tracker", slow)
    finish_feed(run_feed(f"udp://127.0.0.1:{free_port()}", Settings(), stop.is_set, folder), stop.set, quiet=False)


def test_ctrl_c_while_the_first_scan_is_compiled_leaves_all_results(tmp_path, blocks, monkeypatch, capsys):
    interrupted_feed(tmp_path / "run", blocks, monkeypatch, times=1)
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["scans"], summary["plots"], summary["interrupted"]) == (14, 70, False)
    assert {row["scan"] for row in csv.DictReader((tmp_path / "run" / "tracks.csv").open())} >= {"12", "13"}
    assert "Ctrl-C again ends it at once" in capsys.readouterr().err


def test_a_second_ctrl_c_ends_a_feed_at_once(tmp_path, blocks, monkeypatch, capsys):
    with pytest.raises(KeyboardInterrupt):
        interrupted_feed(tmp_path / "run", blocks, monkeypatch, times=2)
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["interrupted"]
    assert f"the results up to here are in {tmp_path / 'run'}" in capsys.readouterr().err


def test_a_feed_of_another_radar_is_said_to_be_one(tmp_path, blocks, monkeypatch):
    received = iter([blocks])
    monkeypatch.setattr(UdpFeed, "poll", lambda self, wait_s: next(received, []))
    settings = Settings().model_copy(update={"radar": RadarSettings(sac=1, sic=1)})
    asked = iter([False, True])
    with (
        pytest.raises(
            SourceError, match="there were no plots of the radar with this sac and sic; it has 70 plots of CAT 048"
        ),
        run_feed(f"udp://127.0.0.1:{free_port()}", settings, lambda: next(asked), tmp_path / "run") as run,
    ):
        list(run)


def test_a_feed_without_a_datagram_leaves_nothing(tmp_path):
    with (
        pytest.raises(SourceError, match="no datagram was received"),
        run_feed(f"udp://127.0.0.1:{free_port()}", Settings(), lambda: True, tmp_path / "run") as run,
    ):
        list(run)
    assert not (tmp_path / "run").exists()

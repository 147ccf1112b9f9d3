"""ASTERIX recordings become plots; what is damaged is left out and counted."""

import csv
import logging
import sys

import numpy as np
import pytest
from asterix_records import RADAR, block, mark, plot, sweeps, track, two_feeds

from vidtrack.config.radar import RadarSettings
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError, PlotFormatError
from vidtrack.radar.feeds import asterix, layout
from vidtrack.radar.feeds.asterix import Decoder
from vidtrack.radar.feeds.layout import Layout
from vidtrack.radar.feeds.messages import Kind, Losses
from vidtrack.radar.feeds.recording import is_feed, read_messages, senders
from vidtrack.radar.reading import read
from vidtrack.run.radar import track_plots
from vidtrack.simulate.radar_scenarios import simulate_radar
from vidtrack.simulate.radar_write import write_radar

NAUTICAL_MILE = 1852.0
OTHER = (("SAC", 25), ("SIC", 202))


def recorded(tmp_path, *blocks, name="radar.ast"):
    path = tmp_path / name
    path.write_bytes(b"".join(blocks))
    return path


def seconds(path, **settings):
    return read(path, RadarSettings(**settings))


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A simulated scene seen by a turning antenna from 23:59 on: its recording, and a table of the same plots."""
    folder = tmp_path_factory.mktemp("scene")
    seen = simulate_radar("radar-tws", 3)
    write_radar(seen, folder)
    with (folder / "plots.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if int(row["scan"]) < 30]
    table = {name: np.array([float(row[name]) for row in rows]) for name in ("scan", "range_m", "azimuth_deg")}
    begin_s = 86400 - 60
    (folder / "radar.ast").write_bytes(b"".join(sweeps(table, begin_s=begin_s)))
    azimuth_deg = table["azimuth_deg"] % 360
    table["time_s"] = begin_s + 4 * (table["scan"] + azimuth_deg / 360)
    order = np.lexsort((azimuth_deg, table["scan"]))
    table = {name: column[order] for name, column in table.items()}
    with (folder / "same.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*table, "sigma_range_m", "sigma_azimuth_deg"])
        writer.writerows([*row, 50, 0.3] for row in zip(*table.values(), strict=True))
    return folder, table


def test_a_simulated_scene_is_read_to_within_half_the_last_bit(scene):
    folder, table = scene
    plots = read(folder / "radar.ast", RadarSettings())
    assert (plots.scan == table["scan"]).all()
    np.testing.assert_allclose(plots.time_s, table["time_s"], atol=0.5 / 128 + 1e-9)
    np.testing.assert_allclose(plots.z[:, 0], table["range_m"], atol=NAUTICAL_MILE / 512)
    azimuth_deg = np.degrees(plots.z[:, 1]) - table["azimuth_deg"]
    np.testing.assert_allclose(azimuth_deg - 360 * np.round(azimuth_deg / 360), 0, atol=360 / 131072 + 1e-9)
    assert not any(plots.losses.values())


def test_a_simulated_scene_gives_the_tracks_of_its_table(scene):
    folder, _ = scene
    settings = Settings()
    for (scan, found), (number, expected) in zip(
        track_plots(folder / "radar.ast", settings), track_plots(folder / "same.csv", settings), strict=True
    ):
        assert scan == number
        assert (found.id == expected.id).all()
        np.testing.assert_allclose(found.xy, expected.xy, atol=60)


def test_two_feeds_give_each_plot_once(tmp_path):
    one = [mark(0.0, turn_s=4.0), *(block(plot(t, 20000 + t, 10.0)) for t in (0.1, 4.1, 8.1))]
    twice = [part for part in one for _ in range(2)]
    plots = seconds(recorded(tmp_path, *twice))
    assert len(plots) == 3
    assert plots.losses["duplicates"] == 3
    assert plots.scan.tolist() == [0, 1, 2]


def test_time_goes_on_after_midnight(tmp_path):
    blocks = [block(plot(86390 + 4 * k, 20000, 0.5)) for k in range(6)]
    plots = seconds(recorded(tmp_path, mark(86390 - 0.01, turn_s=4.0), *blocks))
    np.testing.assert_allclose(plots.time_s, 86390 + 4 * np.arange(6))
    assert plots.scan.tolist() == list(range(6))


def test_a_stray_time_is_left_out(tmp_path):
    times = [100, 104, 108, 50000, 112, 116]
    plots = seconds(recorded(tmp_path, mark(100, turn_s=4.0), *(block(plot(t, 20000 + t, 1.0)) for t in times)))
    assert plots.time_s.tolist() == [100, 104, 108, 112, 116]
    assert plots.losses["strayed"] == 1


def test_a_clock_that_is_set_back_goes_on(tmp_path):
    times = [1000 + 4 * k for k in range(10)] + [400 + 4 * k for k in range(10)]
    plots = seconds(recorded(tmp_path, mark(1000, turn_s=4.0), *(block(plot(t, 20000 + t, 1.0)) for t in times)))
    assert plots.losses["resets"] == 1
    assert (np.diff(plots.time_s) >= 0).all()
    assert plots.time_s[-1] < 1100


def turning(*begins_s):
    """Blocks of ten turns of 4 s with twelve plots each, from each of these times on."""
    return [
        part
        for number, begin_s in enumerate(begins_s)
        for turn in range(10)
        for north_s in [begin_s + 4 * turn]
        for part in (
            mark(north_s, turn_s=4.0),
            *(block(plot(north_s + (k + 0.5) / 3, 20000 + 5 * north_s + 500 * number, 30 * k + 15)) for k in range(12)),
        )
    ]


@pytest.mark.parametrize("back_s", [12, 20, 29, 60])
def test_an_antenna_that_is_turned_back_in_time_has_had_its_clock_set(tmp_path, back_s):
    plots = seconds(recorded(tmp_path, *turning(1000, 1040.25 - back_s)))
    assert plots.losses["resets"] == 1
    assert (np.diff(plots.time_s) >= 0).all()
    assert np.bincount(plots.scan).tolist() == [12] * 10 + [11] + [12] * 9


@pytest.mark.parametrize(("silent_s", "empty"), [(60, 15), (7200, 0), (36000, 0)])
def test_a_silence_holds_empty_scans_and_a_jump_of_the_clock_none(tmp_path, caplog, silent_s, empty):
    plots = seconds(recorded(tmp_path, *turning(1000, 1040 + silent_s)))
    assert np.unique(plots.scan).tolist() == [*range(10), *range(10 + empty, 20 + empty)]
    assert plots.time_s[-1] == pytest.approx(1080 + silent_s, abs=1)
    assert ("the time jumps from" in caplog.text) == (not empty)


def test_hours_in_which_the_antenna_turns_and_sees_nothing_are_scans(tmp_path, caplog):
    idle = [mark(1040.0 + 4 * turn, turn_s=4.0) for turn in range(1000)]
    plots = seconds(recorded(tmp_path, *turning(1000), *idle, *turning(5040)))
    assert plots.scan[-1] == 1019
    assert "the time jumps from" not in caplog.text


def test_plots_that_come_late_by_part_of_a_turn_are_in_their_scan(tmp_path):
    blocks = turning(1000)
    turns = [blocks[k : k + 13] for k in range(0, len(blocks), 13)]
    late = [part for mark_, *plots in turns for part in (*plots[1:], mark_, plots[0])]
    plots = seconds(recorded(tmp_path, *late))
    assert len(plots) == 120
    assert not any(plots.losses.values())


@pytest.mark.parametrize("behind", [20, 60])
def test_a_second_feed_that_is_late_is_no_clock_that_was_set_back(tmp_path, behind):
    blocks = turning(1000)
    plots = seconds(recorded(tmp_path, *two_feeds(blocks, behind)))
    assert plots.losses["resets"] == 0
    assert plots.losses["duplicates"] > 50
    assert np.unique(plots.time_s).tolist() == plots.time_s.tolist()
    assert plots.time_s[-1] == pytest.approx(seconds(recorded(tmp_path, *blocks)).time_s[-1])


@pytest.mark.parametrize(("turn_s", "told"), [(60.0, False), (300.0, True)])
def test_turns_that_nothing_tells_are_asked_for(tmp_path, caplog, turn_s, told):
    rng = np.random.default_rng(0)
    turns = np.sort(rng.uniform(0, 12, 240))
    places = zip(turns, rng.uniform(2e3, 6e4, 240), strict=True)
    plots = [block(plot(20000 + turn_s * t, range_m, 360 * t % 360)) for t, range_m in places]
    path = recorded(tmp_path, *plots)
    assert (len(np.unique(read(path, RadarSettings()).scan)) == 12) is not told
    assert ("set radar.scan_s" in caplog.text) is told
    caplog.clear()
    assert len(np.unique(read(path, RadarSettings(scan_s=turn_s)).scan)) == 12
    assert "set radar.scan_s" not in caplog.text


def test_several_radars_are_refused_until_one_is_chosen(tmp_path):
    blocks = [
        block(plot(4 * k, 20000 + 1000 * n, 1.0, radar)) for k in range(4) for n, radar in enumerate([RADAR, OTHER])
    ]
    path = recorded(tmp_path, mark(0.0, turn_s=4.0), *blocks)
    with pytest.raises(PlotFormatError, match=r"2 radars \(SAC/SIC\): 25/201 \(4 plots\), 25/202 \(4 plots\); choose"):
        seconds(path)
    assert set(seconds(path, sic=202).z[:, 0].round(-3)) == {21000}
    with pytest.raises(PlotFormatError, match="no plots of the radar with this sac and sic"):
        seconds(path, sic=7)


def test_a_damaged_code_of_a_sender_is_no_other_radar(tmp_path, caplog):
    stray = block(plot(1039.9, 20000, 300, OTHER))
    path = recorded(tmp_path, *turning(1000), stray, *turning(1040))
    plots = seconds(path)
    assert (len(plots), plots.losses["damaged"]) == (240, 1)
    assert f"{path}: left out: 1 damaged" in caplog.messages
    assert senders(path) == [(25, 201)]
    assert senders(path, [(25, 202)]) == [(25, 201), (25, 202)]
    assert seconds(path, sic=201).losses["damaged"] == 1
    assert (len(seconds(path, sic=202)), seconds(path, sic=202).losses["damaged"]) == (1, 0)
    with pytest.raises(PlotFormatError, match="2 radars"):
        seconds(recorded(tmp_path, *turning(1000), *[stray] * 4))


def test_reports_without_a_detection_are_no_plots(tmp_path):
    coasting = plot(1.0, 30000, 5.0).set_item("020", ((0, 0, 0, 0, 0, None),))
    plots = seconds(recorded(tmp_path, mark(0.0, turn_s=4.0), block(plot(0.5, 20000, 1.0), coasting)))
    assert plots.z[:, 0].round(-3).tolist() == [20000]


def test_doppler_is_read_where_every_plot_has_one(tmp_path):
    def moving(time_s, speed):
        return block(plot(time_s, 20000 + time_s, 1.0, **{"120": {"CAL": (0, 0, ("CAL", (speed, "m/s")))}}))

    blocks = [mark(0.0, turn_s=4.0), moving(0.5, 35), moving(4.5, -12)]
    assert seconds(recorded(tmp_path, *blocks)).z[:, 2].tolist() == [35, -12]
    assert seconds(recorded(tmp_path, *blocks, block(plot(8.5, 20000, 1.0)))).z.shape == (3, 2)


def test_system_tracks_are_in_the_plane_of_the_radar(tmp_path):
    blocks = [track(4.0 * k, 52.0 + 0.001 * k, 13.0, number=7) for k in range(4)]
    plots = seconds(recorded(tmp_path, *blocks), geodetic=(52.0, 13.0, 0.0))
    assert plots.scan.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(plots.z[:, 0], 0, atol=0.5)
    np.testing.assert_allclose(plots.z[:, 1], 111.27 * np.arange(4), atol=0.7)


@pytest.mark.parametrize("part", [0, 4], ids=["latitude", "longitude"])
def test_a_position_that_is_not_on_the_earth_is_damage(tmp_path, part):
    blocks = [track(4.0 * k, 52.0, 13.0, number=7) for k in range(4)]
    at = blocks[0].index(round(52 / 180 * 2**25).to_bytes(4, "big")) + part
    blocks[0] = blocks[0][:at] + b"\x40" + blocks[0][at + 1 :]  # over 5000 degrees
    plots = seconds(recorded(tmp_path, *blocks))
    assert len(plots) == 3
    assert plots.losses["damaged"] == 1


def test_damage_is_counted_in_one_line_and_the_rest_is_read(tmp_path, caplog):
    good = [block(plot(4.0 * k, 20000 + k, 1.0)) for k in range(8)]
    torn = bytearray(b"".join(good))
    torn[len(good[0]) + 3 : len(good[0]) + 6] = b"\xff\xff\xff"  # the field specification of the second one
    path = recorded(tmp_path, mark(0.0, turn_s=4.0), bytes(torn), b"\x30\x00")
    with caplog.at_level(logging.WARNING, "vidtrack"):
        plots = seconds(path)
    assert len(plots) == 7
    assert [line for line in caplog.messages if "left out" in line] == [f"{path}: left out: 2 damaged"]


def test_a_recording_goes_on_after_bytes_that_are_no_block(tmp_path):
    blocks = [block(plot(4.0 * k, 20000 + k, 1.0)) for k in range(8)]
    path = recorded(tmp_path, *blocks[:4], bytes(range(200, 230)), *blocks[4:])
    assert len(seconds(path)) == 8


@pytest.mark.parametrize("damage", ["cut", "cut far", "inserted", "changed"])
def test_octets_that_are_missing_or_wrong_cost_no_more_than_their_neighbours(scene, damage):
    """Lengths of blocks are then read from other octets, and may reach far into the recording."""
    sound = (scene[0] / "radar.ast").read_bytes()
    rng = np.random.default_rng(4)
    whole = sum(1 for _ in Decoder(Losses()).messages(sound))
    lost = []
    for at in rng.integers(500, len(sound) - 500, 60):
        losses = Losses()
        damaged = {
            "cut": sound[:at] + sound[at + 1 :],
            "cut far": sound[:at] + sound[at + 50 :],
            "inserted": sound[:at] + rng.bytes(20) + sound[at:],
            "changed": sound[:at] + rng.bytes(1) + sound[at + 1 :],
        }[damage]
        lost.append(whole - sum(1 for _ in Decoder(losses).messages(damaged)))
        assert losses.damaged or lost[-1] <= 5
    assert max(lost) <= 10


@pytest.mark.parametrize("category", [63, 247])
def test_blocks_that_are_not_read_are_no_damage_however_many_stand_between(category):
    other = bytes([category, 0, 9, 1, 2, 3, 4, 5, 6])
    losses = Losses()
    recording = b"".join(block(plot(k, 9000, 3 * k)) + k % 7 * other for k in range(60))
    assert sum(1 for _ in Decoder(losses).messages(recording + 20_000 * other)) == 60
    assert not losses.damaged


@pytest.mark.parametrize(
    "trash", [b"HTTP/1.1 200 OK\r\n\r\n", b"\x30\xff\xff" * 9, bytes(1000), b"\x30\0\5ab" * 3 + b"\7"]
)
def test_what_is_before_the_first_block_is_left_out_and_told(scene, tmp_path, caplog, trash):
    clean = (scene[0] / "radar.ast").read_bytes()
    path = recorded(tmp_path, trash, clean)
    assert is_feed(path)
    losses = Losses()
    assert len(read_messages(path, losses)) == len(read_messages(scene[0] / "radar.ast", Losses()))
    assert losses.damaged >= 1


@pytest.mark.parametrize("ways_in", [b"\xff\x00", bytes([8, 0x40, 0]) * 5000], ids=["one chain", "many ways into it"])
def test_a_long_chain_of_blocks_that_are_passed_over_is_walked_once(monkeypatch, ways_in):
    content, walked = ways_in + bytes([8, 0, 4, 0]) * ((65536 - len(ways_in)) // 4), []
    following = asterix._following
    monkeypatch.setattr(asterix, "_following", lambda *where: walked.append(where[1]) or following(*where))
    assert asterix.first_block(content, 1 << 16) is None
    assert len(walked) == len(set(walked)) > 10_000
    assert asterix.first_block(content + mark(0.0), 1 << 16) in (0, 2)


@pytest.mark.parametrize("sound", [2, 3, 4])
def test_blocks_from_different_starts_onto_one_chain_are_counted_together(sound):
    good = mark(0.0)
    content = bytes([8, 0, 3 + len(good)]) + good * sound + b"\xff"  # the first block hides a sound one
    assert asterix.first_block(content, len(content)) == (3 if sound == 4 else None)


@pytest.mark.parametrize("count", [4, 5])
def test_blocks_of_records_longer_than_what_is_looked_at_are_found(count):
    long = block(plot(0.0, 20000, 10.0, **{"250": [0] * 200}))
    content = b"HTTP/1.1 200 OK\r\n" + long * count
    assert len(long) > 1500
    assert asterix.first_block(content, 1 << 16) == 17
    assert asterix.first_block(content[:17] + long[:-1], 1 << 16) is None  # ends in its record


@pytest.mark.parametrize("octet", [0x30, 0x3E, 0x15])
def test_records_of_blocks_that_overlap_are_decoded_once(monkeypatch, octet):
    """Each octet begins a block of 5 to 16 thousand octets, and a record of a few or of all that follow."""
    content, octets, places = bytes([octet]) * (4 * 257 * octet - 40) + b"\xff\xff\xff", [], Layout.places
    monkeypatch.setattr(Layout, "places", lambda self, body, at: octets.append(len(body)) or places(self, body, at))
    assert asterix.first_block(content, 1 << 16) != 0
    assert 1000 < len(octets) <= len(content)
    assert max(octets) <= 1024


def test_other_binary_files_are_no_recordings(tmp_path):
    rng = np.random.default_rng(0)
    for k in range(5):
        assert not is_feed(recorded(tmp_path, rng.bytes(200_000), name=f"{k}.bin"))


def test_truncated_records_never_crash(scene):
    folder, _ = scene
    content = (folder / "radar.ast").read_bytes()[:120]
    for end in range(len(content)):
        for message in Decoder(Losses()).messages(content[:end]):
            assert message.kind in Kind


def test_hostile_records_never_crash(scene):
    folder, _ = scene
    rng = np.random.default_rng(0)
    content = np.frombuffer((folder / "radar.ast").read_bytes(), np.uint8)
    losses, found, records = Losses(), 0, 0
    decoder = Decoder(losses)
    while records < 10_000:
        begin = rng.integers(0, len(content) - 400)
        piece = content[begin : begin + 400].copy()
        at = rng.integers(0, len(piece), 20)
        piece[at] = rng.integers(0, 256, len(at))
        found += len(list(decoder.messages(piece.tobytes())))
        records += 20
    assert losses.damaged > 1000
    assert found > 1000


@pytest.mark.parametrize("category", [1, 2, 21, 34, 48, 62])
def test_records_end_where_the_library_says(category):
    from asterix.base import Bits, ParsingMode
    from asterix.generated import manifest

    rng = np.random.default_rng(category)
    uap = manifest["CATS"][category][-1].cv_uap
    records = getattr(uap, "cv_uaps", None) or {"": uap.cv_record}
    accepted = 0
    for name, record in records.items():
        for _ in range(150):
            body = rng.integers(0, 256, 60, dtype=np.uint8).tobytes()
            body = bytes([body[0] & 0xFE]) + body[1:] if rng.random() < 0.7 else body
            parsed = record.parse(ParsingMode.StrictParsing, Bits.from_bytes(body))
            if isinstance(parsed, ValueError) and "Last FX bit" in str(parsed):
                continue  # a longer item of a later edition, which is walked over
            try:
                _, end = layout.layouts()[category][name].places(body, 0)
            except layout.Damaged:
                end = None
            ends = None if isinstance(parsed, ValueError) or parsed[0].is_empty() else 60 - len(parsed[1]) // 8
            if name in ("plot", "track") and ends is not None and parsed[0].items_rfs:
                continue  # items in any order, which no radar of this age sends
            assert end == ends
            accepted += end is not None
    assert accepted > 15


def test_without_the_library_the_message_says_what_to_install(tmp_path, monkeypatch):
    path = recorded(tmp_path, mark(0.0), mark(4.0))
    monkeypatch.setitem(sys.modules, "asterix.generated", None)
    layout.layouts.cache_clear()
    with pytest.raises(ConfigError, match=r"pip install 'vidtrack\[asterix\]'"):
        seconds(path)


def test_a_recording_without_plots_is_refused(tmp_path):
    with pytest.raises(PlotFormatError, match="holds no plots; it has marks of the antenna only"):
        seconds(recorded(tmp_path, mark(0.0), mark(4.0)))


def test_tables_are_no_recordings(tmp_path, scene):
    folder, _ = scene
    assert is_feed(folder / "radar.ast")
    assert not is_feed(folder / "same.csv")
    assert not is_feed(tmp_path / "absent.ast")


def test_a_hundred_messages_of_a_kind_are_kept_in_order(scene):
    folder, _ = scene
    messages = read_messages(folder / "radar.ast", Losses())
    assert messages.marks.sum() == 30
    assert set(messages.source.tolist()) == {25 * 256 + 201}

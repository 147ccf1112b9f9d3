"""Capture: the newest frames with true times, whatever the connection does."""

import logging
import time
from itertools import islice

import av
import numpy as np
import pytest
from cameras import HANG_S, Picture, Script, coming, grey, script_of, wait_for, within

from vidtrack.config.live import LiveSettings
from vidtrack.errors import SourceError
from vidtrack.video.live.address import Address, parse_address
from vidtrack.video.live.connection import Connection, Refused, Stalled
from vidtrack.video.live.source import LiveSource

ADDRESS = Address("rtsp://user:secret@cam/x", "rtsp://***@cam/x", "cam")
FAST = LiveSettings(timeout_s=HANG_S, backoff_s=0.01, backoff_longest_s=0.05)
EVERY = FAST.model_copy(update={"every_frame": True})
LIVE = 0.005  # after which a picture has certainly been waited for
SILENT = 2 * HANG_S


@pytest.fixture(autouse=True)
def unhurried(monkeypatch):
    """Nobody waits for threads that sleep in a script."""
    monkeypatch.setattr("vidtrack.video.live.source._END_S", 0.01)


def pictures(levels, every_s=0.02):
    """Acts of a camera: one picture after the other."""
    return [act for level in levels for act in (every_s, Picture(grey(level)))]


def levels(frames):
    return [int(frame.y[0, 0]) for frame in frames]


def take(source, number):
    """The next frames."""
    return list(islice(coming(source), number))


def open_script(*connections, settings=FAST, **options):
    return LiveSource(ADDRESS, settings, connect=script_of(*connections), **options)


def test_frames_come_numbered_with_times_from_zero():
    with open_script(Script(*pictures([10, 20, 30]), SILENT)) as source:
        frames = take(source, 3)
        assert (source.width, source.height, source.fps) == (64, 48, 25.0)
    assert levels(frames) == [10, 20, 30]
    assert [frame.index for frame in frames] == [0, 1, 2]
    assert frames[0].time_s == 0.0
    assert np.all(np.diff([frame.time_s for frame in frames]) > 0.01)
    assert source.stats.received == source.stats.frames_read == 3


def test_a_slow_tracker_gets_the_newest_frames_and_is_never_late():
    with open_script(Script(*pictures(range(100), LIVE), SILENT)) as source:
        stats = source.stats
        while stats.received < 100:
            before = stats.received
            wait_for(lambda before=before: stats.received >= min(before + 10, 100))  # slower than the camera
            there = stats.received
            (frame,) = take(source, 1)
            assert there - levels([frame])[0] <= 3 or frame.index == 0  # two wait, and one may be coming
        while levels(take(source, 1)) != [99]:
            pass
    assert stats.frames_read + stats.frames_dropped == 100
    assert stats.frames_dropped > 50


def test_a_camera_of_just_the_largest_rate_loses_hardly_any_by_jitter():
    """By intervals of time alone it would lose one in ten."""
    waits = np.random.default_rng(0).uniform(0.012, 0.028, 200)
    acts = [act for wait in waits for act in (wait, Picture(grey(30)))]
    with open_script(Script(*acts, SILENT), settings=EVERY, max_fps=50.0) as source:
        assert len(take(source, 190)) == 190


def test_a_damaged_camera_stalls_also_where_few_pictures_are_decoded(monkeypatch):
    script = Script(*pictures(range(10, 250), 0.01), SILENT)

    def damaged_later(packet):
        if packet.image[0, 0] > 40:
            raise av.error.InvalidDataError(1, "damaged")
        return Script.decode(script, packet)

    monkeypatch.setattr(script, "is_intra", True, raising=False)
    monkeypatch.setattr(script, "decode", damaged_later)
    impatient = EVERY.model_copy(update={"timeout_s": 0.3})
    with open_script(script, settings=impatient, max_fps=20.0) as source:
        wait_for(lambda: source.stats.stalls == 1)


@pytest.mark.parametrize("is_intra", [False, True])
def test_pictures_beyond_the_rate_do_not_come_and_are_not_dropped(monkeypatch, is_intra):
    """Whole compressed pictures are not even decoded."""
    script, decoded = Script(*pictures(range(10, 70)), SILENT), []
    monkeypatch.setattr(script, "is_intra", is_intra, raising=False)
    monkeypatch.setattr(script, "decode", lambda packet: decoded.append(packet) or Script.decode(script, packet))
    with open_script(script, settings=EVERY, max_fps=12.5) as source:
        wait_for(lambda: source.stats.received == 60)
        seen = take(source, 10)
    assert np.all(np.diff([frame.time_s for frame in seen]) > 0.04)
    assert [frame.index for frame in seen] == list(range(10))
    assert source.stats.frames_dropped == 0
    assert len(decoded) < 40 if is_intra else len(decoded) == 60


def test_every_frame_waits_instead_and_drops_none():
    with open_script(Script(*pictures(range(10, 60), 0.004), SILENT), settings=EVERY) as source:
        seen = []
        for frame in islice(coming(source), 50):
            time.sleep(0.006)
            seen += levels([frame])
    assert seen == list(range(10, 60))
    assert source.stats.frames_dropped == 0


def test_every_frame_tells_when_it_falls_behind(caplog, monkeypatch):
    monkeypatch.setattr("vidtrack.video.live.source._LATE_S", 0.1)
    acts = [act for k in range(30) for act in (LIVE, Picture(grey(k), stamp_s=k * LIVE))]
    with open_script(Script(*acts, SILENT), settings=EVERY) as source:
        for _ in islice(coming(source), 30):
            time.sleep(0.01)
    assert caplog.text.count("behind; use a smaller --scale") == 1


def test_what_was_gathered_while_connecting_is_not_live(monkeypatch):
    clock = Clock()
    for module in ("reader", "source"):
        monkeypatch.setattr(f"vidtrack.video.live.{module}.monotonic", clock)

    class Timed(Script):
        wait = clock.wait

    gathered = [Picture(grey(level)) for level in (1, 2, 3)]
    with open_script(Timed(*gathered, *pictures([10, 20]), 0.0), settings=EVERY) as source:
        assert levels(take(source, 2)) == [10, 20]


class Clock:
    """Goes on when somebody waits, and hardly otherwise: what is quick is quick on any machine."""

    now_s = 1000.0

    def __call__(self):
        self.wait(1e-7)
        return self.now_s

    def wait(self, seconds):
        self.now_s += seconds


def test_it_reconnects_and_the_gap_is_true(caplog):
    lost, back = SourceError("lost it"), Script(*pictures([20], 0.2), SILENT)
    with open_script(Script(*pictures([10]), lost), SourceError("off"), lost, back) as source:
        frames = take(source, 2)
        assert frames[1].time_s > 0.2
        assert source.latency_s(frames[1].time_s) > 0
        assert source.stats.reconnects == 1
        assert source.stats.state == "running"
        assert len(source.stats.problems) == 3
    assert "trying again for as long as it takes" in caplog.text
    assert caplog.text.count("trying again") == 1  # the rest is only noted
    assert "pictures come again" in caplog.text


def test_an_outage_takes_few_lines_of_the_last_problems_however_long_it_is():
    quick = LiveSettings(backoff_s=1e-4, backoff_longest_s=1e-3, every_frame=True)
    refused = [SourceError("connection refused")] * 50
    story = (SourceError("lost"), *refused, SourceError("404"), *refused, Script(*pictures([20]), SILENT))
    with open_script(Script(*pictures([10], LIVE), story[0]), *story[1:], settings=quick) as source:
        take(source, 2)
        told = [what for _, what in source.stats.problems]
    assert told[1:] == ["connection refused", "404", "connection refused"]


def test_a_silent_connection_is_a_stall():
    with open_script(Script(*pictures([10])), Script(*pictures([20]), SILENT)) as source:
        take(source, 2)
        assert (source.stats.stalls, source.stats.reconnects) == (1, 1)


def test_packets_without_any_picture_are_a_stall_too(monkeypatch):
    monkeypatch.setattr("vidtrack.video.live.source._STUCK", 1000)  # on a slow machine this is one more
    brief = LiveSettings(timeout_s=0.1, backoff_s=0.01)

    class Deaf(Script):
        def decode(self, packet):
            return []

    deaf = Deaf(*pictures([1] * 40))
    with open_script(
        Script(*pictures([10]), SourceError("lost")), deaf, Script(*pictures([20]), SILENT), settings=brief
    ) as source:
        assert levels(take(source, 2)) == [10, 20]
        assert source.stats.stalls == 1


def test_a_hundred_reconnects_end_nothing():
    once = [Script(*pictures([k + 1], LIVE), SourceError("lost")) for k in range(100)]
    quick = LiveSettings(backoff_s=1e-4, backoff_longest_s=1e-3, every_frame=True)
    with open_script(*once, Script(*pictures([200]), SILENT), settings=quick) as source:
        frames = take(source, 101)
        assert source.stats.reconnects == 100
        assert len(source.stats.problems) == 20
    assert np.all(np.diff([frame.time_s for frame in frames]) > 0)
    assert levels(frames)[-1] == 200


def test_another_size_and_colour_are_brought_to_the_first():
    with open_script(
        Script(*pictures([10]), SourceError("lost")),
        Script(LIVE, Picture(grey(20, (96, 128))), SILENT),
    ) as source:
        frames = take(source, 2)
        assert [frame.shape for frame in frames] == [(48, 64), (48, 64)]
        assert "128x96 now" in source.stats.problems[-1][1]


def test_three_failures_at_the_start_are_the_end():
    with within(), pytest.raises(SourceError, match="nobody answers"):
        open_script()


def test_a_refusal_at_the_start_is_the_end_at_once():
    with pytest.raises(Refused, match="no"):
        open_script(Refused("no"), Script(*pictures([10]), SILENT))


def test_no_permission_for_the_device_says_what_to_do(monkeypatch):
    def denied(*_, **__):
        raise av.error.PermissionError(13, "Permission denied", "/dev/null")

    monkeypatch.setattr(av, "open", denied)
    with pytest.raises(Refused, match="/dev/null: permission denied; add your user to the group"):
        Connection(parse_address("/dev/null", 1.0), 1.0)


def test_a_refusal_later_is_not():
    with open_script(
        Script(*pictures([10]), SourceError("lost")), Refused("no"), Script(*pictures([20]), SILENT)
    ) as source:
        assert levels(take(source, 2)) == [10, 20]


def test_two_failures_at_the_start_are_forgiven():
    with open_script(SourceError("a"), Stalled("b"), Script(*pictures([10]), SILENT)) as source:
        assert levels(take(source, 1)) == [10]
        assert source.stats.stalls == 1


def test_numbers_and_times_go_on_after_another_run():
    origin_s = time.monotonic() - 100.0
    with open_script(Script(*pictures([10, 20]), SILENT), first=77, origin_s=origin_s) as source:
        frames = take(source, 2)
        assert source.latency_s(frames[1].time_s) > 0
    assert [frame.index for frame in frames] == [77, 78]
    assert frames[0].time_s > 100.0


def test_it_stops_at_once():
    with within():
        source = open_script(Script(*pictures([10]), SILENT))
        source.stop()
        assert list(source) == []
        source.close()


def test_a_reader_that_hangs_in_a_driver_is_replaced(caplog):
    brief = LiveSettings(timeout_s=0.1, backoff_s=0.01)
    others = [Script(*pictures([20]), SILENT) for _ in range(1000)]  # on a slow machine these seem to hang as well
    with open_script(Script(*pictures([10]), SILENT), *others, settings=brief) as source:
        assert levels(take(source, 2)) == [10, 20]
    assert "hangs" in caplog.text


def test_a_decoder_that_is_too_slow_goes_on_with_key_pictures(monkeypatch):
    monkeypatch.setattr("vidtrack.video.live.reader._BEHIND_S", 0.2)

    class Slow(Script):
        def decode(self, packet):
            time.sleep(0.05)
            return super().decode(packet)

    sent = [Picture(grey(k % 200), is_keyframe=k % 20 == 0) for k in range(4000)]  # none has to be waited for
    with open_script(Slow(*sent), settings=LiveSettings(timeout_s=HANG_S)) as source:
        got = []
        for frame in coming(source):
            got += levels([frame])
            if len(got) >= 4 and not any(level % 20 for level in got[-4:]):
                break
    assert source.stats.frames_dropped >= 3 * 19


def test_nothing_is_said_with_a_password(caplog):
    caplog.set_level(logging.DEBUG)
    with open_script(Script(*pictures([10]), SourceError("lost")), Script(*pictures([20]), SILENT)) as source:
        take(source, 2)
    assert "secret" not in caplog.text + repr(source.stats)

"""Recording pauses when the disk refuses, and goes on when there is room, whenever that happens."""

from threading import Event, Thread

import pytest
from cameras import Picture, Script, grey

from vidtrack.config.settings import Settings
from vidtrack.recording import recorder
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Limits, Retention, parts_of
from vidtrack.video.frame import Frame


class Muxer:
    """A muxer on a disk that may be full."""

    full = False

    def __init__(self, path, connection):
        self.path, self.packets, self.error, self.size = path, 0, None, 0
        path.touch()

    def take(self, packet, pictures, arrived_s):
        if Muxer.full:
            self.error = OSError(28, "No space left on device")
        else:
            self.packets += 1

    def close(self):
        pass


@pytest.fixture
def tape(tmp_path, monkeypatch):
    monkeypatch.setattr(recorder, "Muxer", Muxer)
    monkeypatch.setattr(recorder, "_RETRY_S", 0.0)
    return recorder.Recorder(tmp_path / "tape", Settings(), None, Retention(Limits()), Reserve(0))


def receive(tape, full=False):
    """A packet comes; returns where its frame is."""
    Muxer.full = full
    packet = Picture(grey(100))
    tape.cut(Script(), packet)
    place = tape.place()
    tape.take(packet, [], 0.0)
    return place


def track(tape, index, place):
    beginning = recorder.Beginning({"frame": index}, f"site {index}") if tape.begins(place) else None
    tape.log_frame(Frame.blank((48, 64), coloured=False), place, beginning)


def test_a_part_that_ends_before_its_first_frame_is_tracked_ends_no_other(tape, tmp_path, caplog):
    places = [receive(tape, full=True) for _ in range(3)]
    assert parts_of(tmp_path / "tape") == []
    for index, place in enumerate(places):
        track(tape, index, place)
    for index in range(3, 6):
        track(tape, index, receive(tape))
    tape.close()
    (part,) = parts_of(tmp_path / "tape")
    assert tape.lost == 3
    assert caplog.text.count("recording pauses") == 1  # not once for each try
    assert len((part / "frames.csv").read_text().splitlines()) == 1 + 3


@pytest.mark.parametrize("in_time", [True, False])
def test_a_file_is_never_closed_while_a_packet_is_written(tape, monkeypatch, caplog, in_time):
    entered, answer, did = Event(), Event(), []

    def take(*_):
        entered.set()
        answer.wait()
        did.append("take")

    receive(tape)
    monkeypatch.setattr(tape._muxer, "take", take)
    monkeypatch.setattr(tape._muxer, "close", lambda: did.append("close"))
    monkeypatch.setattr(recorder, "_END_S", 60.0 if in_time else 0.0)
    reader = Thread(target=receive, args=(tape,))
    reader.start()
    entered.wait()
    ending = Thread(target=tape.close)
    ending.start()
    if not in_time:
        ending.join()
    answer.set()
    reader.join()
    ending.join()
    assert did == (["take", "close"] if in_time else ["take"])
    assert ("the disk does not answer" in caplog.text) is not in_time


def test_a_packet_that_comes_after_the_end_begins_no_part(tape, tmp_path):
    track(tape, 0, receive(tape))
    tape.close()
    receive(tape)
    assert len(parts_of(tmp_path / "tape")) == 1


def test_a_recording_leaves_the_end_of_the_disk_to_results(tape, tmp_path, monkeypatch):
    for index in range(2):
        track(tape, index, receive(tape))
    monkeypatch.setattr(tape, "_reserve", Reserve(1e18))
    track(tape, 2, receive(tape))
    assert (tape.lost, "kept for results" in tape.failing) == (1, True)
    monkeypatch.setattr(tape, "_reserve", Reserve(0))
    track(tape, 3, receive(tape))
    tape.close()
    assert tape.failing is None
    assert len(parts_of(tmp_path / "tape")) == 2

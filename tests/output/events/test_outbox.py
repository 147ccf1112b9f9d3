"""The queue on the disk: nothing is lost by a kill, nothing grows without end, and what is dropped is counted."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.errors import FormatError
from vidtrack.output.events.outbox import Outbox


@pytest.fixture(autouse=True, scope="module")
def unsynchronised():
    """No test cuts the power."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("os.fdatasync", lambda _: None)
        yield


def line(number, length=0):
    return json.dumps({"n": number, "pad": "x" * length}) + "\n"


def taken(box, count=1000):
    """All that is waiting, sent."""
    found = []
    while lines := box.oldest(count):
        box.sent(lines)
        found += lines
    return found


def test_events_come_out_in_order_and_once(tmp_path):
    box = Outbox(tmp_path, 1e6)
    lines = [line(number) for number in range(100)]
    box.add(lines[:60])
    assert box.waiting == 60
    box.sent(box.oldest(50)[:40])
    box.add(lines[60:])
    assert taken(box, 7) == lines[40:]
    assert (box.waiting, box.dropped) == (0, 0)


def test_the_next_run_sends_what_this_one_did_not(tmp_path):
    """Whether it ended or was killed: nothing is kept in memory, and half a line is no event."""
    box = Outbox(tmp_path, 1e6)
    box.add([line(1), line(2), line(3)])
    box.sent(box.oldest(1))
    with open(next(tmp_path.glob("*.jsonl")), "a") as file:
        file.write('{"n": 4, "ha')
    again = Outbox(tmp_path, 1e6)
    again.add([line(5)])
    assert taken(again) == [line(2), line(3), line(5)]
    assert taken(Outbox(tmp_path, 1e6)) == []


def test_when_it_is_full_the_oldest_are_dropped_and_counted(tmp_path):
    box = Outbox(tmp_path, 10_000)
    for first in range(0, 1000, 8):
        box.add(line(number, 80) for number in range(first, first + 8))
        assert sum(path.stat().st_size for path in tmp_path.glob("*.jsonl")) <= 12_500
    again = Outbox(tmp_path, 10_000)
    left = [json.loads(text)["n"] for text in taken(again)]
    assert left == list(range(1000 - len(left), 1000))
    assert len(left) > 60
    assert again.dropped == box.dropped == 1000 - len(left)


def test_what_is_dropped_while_it_is_being_sent_is_not_counted_as_sent_too(tmp_path):
    box = Outbox(tmp_path, 10_000)
    box.add(line(number, 80) for number in range(80))
    sending = box.oldest(5)
    for first in range(80, 200, 8):
        box.add(line(number, 80) for number in range(first, first + 8))
    box.sent(sending)
    waiting = box.waiting
    assert waiting == len(taken(box))
    assert waiting + box.dropped == 200


def test_a_full_disk_delays_events_and_drops_none(tmp_path, monkeypatch):
    box = Outbox(tmp_path, 1e6)
    with monkeypatch.context() as full:
        full.setattr("vidtrack.output.events.outbox.append", lambda *_: (_ for _ in ()).throw(OSError(28, "No space")))
        box.add([line(1)])
        box.add([line(2)])
        assert "No space" in box.failing
        assert (box.waiting, box.oldest(5)) == (2, [])
    box.add([])
    assert box.failing is None
    assert taken(box) == [line(1), line(2)]


def test_a_queue_as_the_first_version_wrote_it_is_continued(tmp_path):
    """An update keeps what waits: these files are written by hand."""
    (tmp_path / "00000003.jsonl").write_text('{"n": 1}\n{"n": 2}\n')
    (tmp_path / "00000004.jsonl").write_text('{"n": 3}\n')
    (tmp_path / "sent.json").write_text('{"version": 1, "file": 3, "offset": 9, "dropped": 7}\n')
    box = Outbox(tmp_path, 1e6)
    assert (box.waiting, box.dropped) == (2, 7)
    assert taken(box) == ['{"n": 2}\n', '{"n": 3}\n']


def test_a_queue_of_a_later_version_is_not_touched(tmp_path):
    Outbox(tmp_path, 1e6).add([line(1)])
    (tmp_path / "sent.json").write_text('{"version": 2, "file": 1, "offset": 0, "dropped": 0}')
    with pytest.raises(FormatError, match="version 2"):
        Outbox(tmp_path, 1e6)


@settings(max_examples=15, deadline=None)
@given(acts=st.lists(st.tuples(st.sampled_from(["add", "send", "restart"]), st.integers(1, 12)), max_size=40))
def test_every_event_is_sent_in_order_or_counted(tmp_path_factory, acts):
    folder = tmp_path_factory.mktemp("box")
    box, added, sent = Outbox(folder, 4000), 0, []
    for act, count in acts:
        if act == "add":
            box.add(line(number, 60) for number in range(added, added + count))
            added += count
        elif act == "send":
            lines = box.oldest(count)
            box.sent(lines)
            sent += [json.loads(text)["n"] for text in lines]
        else:
            box = Outbox(folder, 4000)
    sent += [json.loads(text)["n"] for text in taken(box)]
    assert sent == sorted(set(sent))
    assert len(sent) + box.dropped == added

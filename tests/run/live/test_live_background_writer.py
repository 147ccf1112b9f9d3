"""Writing beside the tracker: nothing it does reaches the tracker."""

from threading import Event, Timer

import pytest
from cameras import HANG_S, wait_for, within
from synthetic_steps import make_step

from vidtrack.errors import StoppedEarly
from vidtrack.run.live.background_writer import BackgroundWriter
from vidtrack.video.live.mailbox import Mailbox

STEPS = [make_step(k, [(1, "c", 10.0, 10.0)]) for k in range(30)]


class Sink:
    """Notes steps; fails or blocks when told to."""

    def __init__(self):
        self.seen, self.closed = [], False
        self.failing = False
        self.free = Event()
        self.free.set()

    def step(self, step):
        self.free.wait(2 * HANG_S)
        if self.failing:
            raise StoppedEarly("no space")
        self.seen.append(step.index)

    def close(self):
        self.closed = True


def test_all_steps_arrive_in_order():
    sink = Sink()
    writer = BackgroundWriter(
        "x", lambda steps: [sink.step(step) for step in steps], sink.close, every_s=0.01, depth=100
    )
    for step in STEPS:
        writer.step(step)
    writer.end()
    writer.join(HANG_S)
    assert sink.seen == [step.index for step in STEPS]
    assert sink.closed
    assert writer.lost == 0


def test_a_sink_that_hangs_costs_steps_and_no_time(caplog):
    sink = Sink()
    sink.free.clear()
    writer = BackgroundWriter.of("x", sink)
    with within():
        for step in STEPS:
            writer.step(step)
        writer.end()
        writer.join(0.1)
    assert writer.lost >= 14
    assert "too slow" in caplog.text
    assert "could not be finished" in caplog.text
    sink.free.set()


def test_a_sink_that_fails_is_asked_again(caplog):
    sink = Sink()
    writer = BackgroundWriter.of("x", sink)
    sink.failing = True
    writer.step(STEPS[0])
    wait_for(lambda: writer.lost == 1)
    sink.failing = False
    writer.step(STEPS[1])
    wait_for(lambda: sink.seen == [1])
    writer.end()
    writer.join(HANG_S)
    assert "no space; tracking goes on" in caplog.text
    assert "x is written again" in caplog.text


def test_the_box_holds_the_newest():
    box = Mailbox(2, waits=False)
    assert [box.put(k) for k in range(5)] == [0, 0, 1, 1, 1]
    assert [box.get(0.0), box.get(0.0), box.get(0.0)] == [3, 4, None]


def test_a_closed_box_gives_what_it_has_and_then_why():
    box = Mailbox(2, waits=False)
    box.put(1)
    box.close(StoppedEarly("why"))
    assert box.put(2) == 0
    assert box.get(0.0) == 1
    with pytest.raises(StoppedEarly, match="why"):
        box.get(0.0)


def test_closing_frees_a_writer_that_waits():
    box = Mailbox(1, waits=True)
    box.put(1)
    Timer(0.05, box.close).start()
    with within():
        assert box.put(2) == 0
    assert box.get(0.0) == 1
    with pytest.raises(StopIteration):
        box.get(0.0)

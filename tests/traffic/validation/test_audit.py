"""What verdicts about crossings say about the counts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.traffic.validation.audit import (
    COUNTED_WELL,
    FALSE,
    MISSED,
    RIGHT,
    UNSURE,
    VERDICTS,
    WRONG,
    WRONG_WAY,
    Correction,
    audited,
    figures_of,
    sample_of,
)
from vidtrack.traffic.validation.audit_events import Event, doubtful_order, random_order

WAYS = [(gate, way) for gate in ("a", "b") for way in ("left", "right")]


def crossings(count, **more):
    return [Event(float(k), *WAYS[k % len(WAYS)], run=0, track_id=k, **more) for k in range(count)]


def about(event, verdict, late_s=0.0):
    return Correction(verdict, event.time_s + late_s, event.gate, event.direction, event.run, event.track_id)


def test_the_doubtful_come_first():
    plain = Event(0.0, "a", "up", 0, 1, confidence=1.0, reason="seen")
    events = [
        plain,
        Event(1.0, "a", "up", 0, 2, confidence=0.97, reason="seen"),
        Event(2.0, "a", "up", 0, 3, confidence=0.75, reason="merged"),
        Event(3.0, "a", "up", 0, 4, confidence=1.0, reason="seen", headway_s=0.2),
        Event(4.0, "a", "up", 0, 5, confidence=0.55, reason="joined"),
        Event(5.0, "a", "up", 0, 6, confidence=0.79, reason="coasted"),
        Event(6.0, "a", "up", 0, 7),
    ]
    assert doubtful_order(events).tolist() == [4, 2, 5, 3, 1, 0, 6]


def test_the_random_order_is_always_the_same_and_of_no_other_column():
    events = crossings(200)
    order = random_order(events).tolist()
    assert sorted(order) == list(range(200))
    assert (
        order
        == random_order(
            [Event(e.time_s + 0.3, e.gate, e.direction, 0, e.track_id, confidence=0.1) for e in events]
        ).tolist()
    )
    assert abs(np.corrcoef(order, np.arange(200))[0, 1]) < 0.25


@given(st.data())
def test_what_was_counted_is_what_is_corrected_and_what_is_not(data):
    events = crossings(data.draw(st.integers(1, 40)))
    verdicts = {k: data.draw(st.sampled_from(VERDICTS)) for k in range(len(events)) if data.draw(st.booleans())}
    missed = [Correction(MISSED, 1.0, *data.draw(st.sampled_from(WAYS))) for _ in range(data.draw(st.integers(0, 5)))]
    audit = audited(events, [*missed, *(about(events[k], verdict) for k, verdict in verdicts.items())])
    assert audit.verdicts == verdicts
    sample = sample_of(random_order(events).tolist(), audit)
    everything = figures_of(events, audit, sample)
    false = sum(verdict in FALSE for verdict in verdicts.values())
    turned = sum(verdict == WRONG_WAY for verdict in verdicts.values())
    assert everything.corrected == len(events) - (false - turned) + len(missed)
    for part in ([figures_of(events, audit, sample, gate) for gate in "ab"],
                 [figures_of(events, audit, sample, *way) for way in WAYS]):  # fmt: skip
        for name in ("counted", "looked_at", "false", "missed", "corrected", "sample", "right"):
            assert sum(getattr(one, name) for one in part) == getattr(everything, name)


def test_a_wrong_direction_moves_to_the_other_one():
    events = crossings(4)
    audit = audited(events, [about(events[0], WRONG_WAY)])
    assert [figures_of(events, audit, [], *way).corrected for way in WAYS] == [0, 2, 1, 1]


def test_only_what_was_looked_at_in_random_order_is_a_sample():
    """Doubtful crossings are looked at first, and half of them are wrong; of the others none is."""
    random = np.random.default_rng(3)
    doubtful = random.random(2000) < 0.1
    events = [Event(float(k), "a", "up", 0, k, confidence=0.6 if doubtful[k] else 1.0) for k in range(2000)]
    truth = [WRONG if doubtful[k] and random.random() < 0.5 else RIGHT for k in range(2000)]
    share = truth.count(RIGHT) / 2000
    order = random_order(events).tolist()

    def precision(looked_at):
        audit = audited(events, [about(events[k], truth[k]) for k in looked_at])
        return figures_of(events, audit, sample_of(order, audit))

    biased = precision(doubtful_order(events)[:150].tolist())
    assert biased.looked_at == 150
    assert biased.sample < 5
    fair = precision({*doubtful_order(events)[:150].tolist(), *order[:400]})
    assert fair.sample >= 400
    assert fair.precision.low < share < fair.precision.high
    assert fair.precision.value == pytest.approx(share, abs=0.025)
    whole = precision(range(2000))
    assert (whole.sample, whole.precision.value) == (2000, share)


def test_what_nobody_can_tell_is_in_no_precision():
    events = crossings(4)
    order = random_order(events).tolist()
    verdicts = dict(zip(order, [RIGHT, UNSURE, "wrong class", WRONG], strict=True))
    assert set(COUNTED_WELL) == {RIGHT, "wrong class"}
    audit = audited(events, [about(events[k], verdict) for k, verdict in verdicts.items()])
    figures = figures_of(events, audit, sample_of(order, audit))
    assert (figures.sample, figures.right, figures.looked_at) == (3, 2, 4)
    assert figures_of(events, audit, []).precision is None


def test_corrections_find_their_event_again_when_it_was_measured_anew():
    events = [Event(10.0, "a", "up", 0, 7), Event(14.0, "a", "up", 0, 7), Event(20.0, "b", "up", 0, 7)]
    late = [Correction(RIGHT, 10.4, "a", "up", 0, 7), Correction(WRONG, 13.5, "a", "up", 0, 7)]
    gone = [Correction(WRONG, 12.0, "a", "up", 0, 7), Correction(RIGHT, 20.0, "c", "up", 0, 7)]
    audit = audited(events, [*late, *gone])
    assert audit.verdicts == {0: RIGHT, 1: WRONG}
    assert audit.homeless == tuple(gone)

"""Pauses between attempts grow, are bounded, and differ between cameras."""

from random import Random

from vidtrack.video.live.backoff import Backoff


def test_pauses_double_up_to_the_longest():
    backoff = Backoff(1.0, 30.0, Random(0))
    for nominal in (1, 2, 4, 8, 16, 30, 30, 30):
        assert 0.8 * nominal <= backoff.next_s() <= 1.2 * nominal
    backoff.reset()
    assert backoff.next_s() <= 1.2
    assert len({Backoff(1.0, 30.0, Random(seed)).next_s() for seed in range(10)}) == 10


def test_ten_thousand_failures_are_no_overflow():
    backoff = Backoff(1.0, 30.0, Random(0))
    assert all(backoff.next_s() <= 36 for _ in range(10_000))
